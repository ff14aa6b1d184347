//! Writing a file whole or not at all: beside the target first, synced, then renamed.
//!
//! The old file is there, with every byte, until the new one is whole on the disk and takes its name. The new one gets the old
//! one's permissions, owner, group, access lists and extended attributes as far as the system lets; links are followed. Other
//! names of the same file (hard links) keep the old content: they may be somebody's backup.
//!
//! A run that is killed leaves its part behind, `.normend-XXXXXX.part`. Parts are locked while they are written, so the next run
//! that writes into the same folder knows those that nobody writes any more, and removes them.

use std::ffi::OsStr;
use std::fs::{self, File, Metadata, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use tempfile::NamedTempFile;

use crate::error::WriteError;

/// Most symbolic links followed from one name, as the kernel does.
const MOST_LINKS: usize = 40;
/// What the names of parts begin and end with. They are short whatever the target's name is, which may be as long as a name can be.
const PART_PREFIX: &str = ".normend-";
const PART_SUFFIX: &str = ".part";
/// Where the system has no locks, a part that nothing was written to for so long is nobody's.
const STALE: Duration = Duration::from_secs(24 * 3600);
/// How often a part is made anew because another run took it for one that was left behind, which is a matter of microseconds.
const MOST_PARTS: usize = 8;

/// Puts what `fill` writes in the place of `path`. A file that is there stays as it is when anything goes wrong.
pub(crate) fn replace(path: &Path, fill: impl FnOnce(&mut File) -> Result<(), WriteError>) -> Result<(), WriteError> {
    place(path, fill).map(drop)
}

/// As [`replace`]; gives the file that was written, which can be read, too.
pub(crate) fn place(path: &Path, fill: impl FnOnce(&mut File) -> Result<(), WriteError>) -> Result<File, WriteError> {
    let Target { path: target, former } = Target::find(path)?;
    let folder = folder_of(&target);
    remove_left_behind(folder);
    let mut part = new_part(folder).map_err(|error| match error.kind() {
        io::ErrorKind::PermissionDenied => refused(
            path,
            "lies in a folder that you may not add files to, and a file is only ever replaced by a whole new one: get the \
             permission to write into the folder, or choose another",
        ),
        _ => WriteError::io(path)(error),
    })?;
    let written = fill_part(&mut part, path, former.as_ref(), fill);
    if let Err(error) = written {
        return Err(with_room(error, part.as_file()));
    }
    // What another program wrote meanwhile is nobody's to throw away.
    let now = stamp(&target);
    if now.is_some() && now != former.as_ref().map(Stamp::of) {
        return Err(refused(
            path,
            "was changed by another program while it was to be replaced: look at it, then write again or choose another name",
        ));
    }
    let file = part.persist(&target).map_err(|error| match error.error.kind() {
        io::ErrorKind::NotFound => refused(
            path,
            "cannot be written: its folder vanished meanwhile: connect the drive again, or make the folder, and write once more",
        ),
        _ => WriteError::io(path)(error.error),
    })?;
    sync_folder(folder);
    Ok(file)
}

/// Fills the part, gives it what the former file has, and brings it to the disk.
fn fill_part(
    part: &mut NamedTempFile,
    path: &Path,
    former: Option<&Metadata>,
    fill: impl FnOnce(&mut File) -> Result<(), WriteError>,
) -> Result<(), WriteError> {
    let io = WriteError::io(path);
    fill(part.as_file_mut())?;
    if let Some(former) = former {
        keep_attributes(part.as_file(), path, former).map_err(&io)?;
    }
    part.as_file().sync_all().map_err(&io)
}

/// What a name leads to, found fit to be replaced.
struct Target {
    path: PathBuf,
    /// The file that is there.
    former: Option<Metadata>,
}

impl Target {
    fn find(path: &Path) -> Result<Self, WriteError> {
        let io = WriteError::io(path);
        let refuse = |reason| Err(refused(path, reason));
        let is_folder_name = path.as_os_str().as_encoded_bytes().last();
        if is_folder_name.is_some_and(|&last| std::path::is_separator(char::from(last))) {
            return refuse("is a folder: name a file");
        }
        let target = follow_links(path).map_err(&io)?;
        let former = match fs::metadata(&target) {
            Ok(metadata) if metadata.is_dir() => return refuse("is a folder: name a file"),
            Ok(metadata) if !metadata.is_file() => return refuse("is a device, not a file: name a file"),
            Ok(metadata) => Some(metadata),
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(io(error)),
        };
        if let Some(former) = &former {
            // The folder alone decides whether a file can be replaced; who may not write into the file should not do it that way.
            // The superuser may do all, but was warned by the permissions.
            let is_protected = former.permissions().readonly();
            match OpenOptions::new().write(true).open(&target) {
                Ok(_) if !is_protected => {}
                Err(error) if error.kind() != io::ErrorKind::PermissionDenied => return Err(io(error)),
                _ => return refuse("is write-protected: change its permissions or choose another name"),
            }
        }
        if target.file_name().is_none() {
            return refuse("is not the name of a file: name one");
        }
        if !folder_of(&target).is_dir() {
            return refuse("lies in a folder that does not exist: create the folder first");
        }
        Ok(Self { path: target, former })
    }
}

fn refused(path: &Path, reason: &'static str) -> WriteError {
    WriteError::Target {
        path: path.to_owned(),
        reason,
    }
}

fn folder_of(target: &Path) -> &Path {
    match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Says for how much of the file there was room, where there was none for all.
fn with_room(error: WriteError, part: &File) -> WriteError {
    match error {
        WriteError::Io { path, source }
            if matches!(source.kind(), io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded) =>
        {
            let n_bytes = part.metadata().map_or(0, |metadata| metadata.len());
            WriteError::Full { path, n_bytes }
        }
        error => error,
    }
}

/// A locked file in `folder` that is removed unless it gets a name.
fn new_part(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(PART_PREFIX).suffix(PART_SUFFIX);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // What any new file gets, less the user's umask; not the private mode of temporary files.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    for _ in 0..MOST_PARTS {
        let part = builder.tempfile_in(folder)?;
        match part.as_file().try_lock() {
            // Before it was locked, another run may have removed it.
            Ok(()) if part.path().exists() => return Ok(part),
            // A file system without locks.
            Err(TryLockError::Error(_)) => return Ok(part),
            Ok(()) | Err(TryLockError::WouldBlock) => {}
        }
    }
    Err(io::Error::other(
        "other programs remove its temporary files: write again",
    ))
}

/// Removes the parts in `folder` that nobody writes any more. One that stays does no harm.
fn remove_left_behind(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        if !is_part_name(&entry.file_name()) || !entry.file_type().is_ok_and(|kind| kind.is_file()) {
            continue;
        }
        let path = entry.path();
        let Ok(part) = OpenOptions::new().read(true).write(true).open(&path) else {
            continue;
        };
        let is_left = match part.try_lock() {
            Ok(()) => true,
            Err(TryLockError::WouldBlock) => false,
            Err(TryLockError::Error(_)) => {
                let modified = part.metadata().and_then(|metadata| metadata.modified());
                let age = modified.ok().and_then(|modified| modified.elapsed().ok());
                age.is_some_and(|age| age > STALE)
            }
        };
        if is_left {
            // Then the next time.
            let _ = fs::remove_file(&path);
        }
    }
}

/// Whether a file has a name that [`new_part`] gives.
fn is_part_name(name: &OsStr) -> bool {
    let name = name.to_str().unwrap_or_default();
    let middle = name
        .strip_prefix(PART_PREFIX)
        .and_then(|name| name.strip_suffix(PART_SUFFIX));
    middle.is_some_and(|middle| !middle.is_empty() && middle.bytes().all(|byte| byte.is_ascii_alphanumeric()))
}

/// The new name should reach the disk, too. Some systems refuse to open or sync a folder; the target is replaced by now, so that
/// is no failure.
fn sync_folder(folder: &Path) {
    #[cfg(unix)]
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
    #[cfg(not(unix))]
    let _ = folder;
}

/// What tells a file's content from a later one, without reading it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Stamp {
    n_bytes: u64,
    modified: Option<SystemTime>,
    /// Its file system and its number there; zeros where the system does not tell.
    file: (u64, u64),
}

impl Stamp {
    pub(crate) fn of(metadata: &Metadata) -> Self {
        #[cfg(unix)]
        let file = {
            use std::os::unix::fs::MetadataExt;
            (metadata.dev(), metadata.ino())
        };
        #[cfg(not(unix))]
        let file = (0, 0);
        Self {
            n_bytes: metadata.len(),
            modified: metadata.modified().ok(),
            file,
        }
    }
}

/// The stamp of what a name leads to now; `None` when there is nothing.
pub(crate) fn stamp(path: &Path) -> Option<Stamp> {
    fs::metadata(path).ok().as_ref().map(Stamp::of)
}

/// Whether two paths lead to the same file: the same name after links, or another name of it. False when one does not exist.
pub fn is_same_file(a: &Path, b: &Path) -> bool {
    if let (Ok(a), Ok(b)) = (fs::canonicalize(a), fs::canonicalize(b))
        && a == b
    {
        return true;
    }
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        if let (Ok(a), Ok(b)) = (fs::metadata(a), fs::metadata(b)) {
            return (a.dev(), a.ino()) == (b.dev(), b.ino());
        }
    }
    false
}

/// How many other names (hard links) the file at `path` has. They keep the old content when it is replaced. 0 where there is no
/// file, or the system does not tell.
pub fn n_other_names(path: &Path) -> u64 {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        fs::metadata(path).map_or(0, |metadata| {
            if metadata.is_file() {
                metadata.nlink().saturating_sub(1)
            } else {
                0
            }
        })
    }
    #[cfg(not(unix))]
    {
        let _ = path;
        0
    }
}

/// The file that a name leads to through symbolic links; it need not exist.
fn follow_links(path: &Path) -> io::Result<PathBuf> {
    let mut target = path.to_owned();
    for _ in 0..MOST_LINKS {
        match fs::symlink_metadata(&target) {
            Ok(metadata) if metadata.is_symlink() => {
                let next = fs::read_link(&target)?;
                target = target.parent().unwrap_or(Path::new("")).join(next);
            }
            _ => return Ok(target),
        }
    }
    Err(io::Error::other("too many symbolic links: name the file itself"))
}

/// Gives a new file the owner, permissions and attributes of the `former` one, which `path` leads to, as far as the system lets.
/// Nobody gets a right by it that they had not.
#[cfg(unix)]
fn keep_attributes(file: &File, path: &Path, former: &Metadata) -> io::Result<()> {
    use std::os::unix::fs::{MetadataExt, PermissionsExt, fchown};
    // Only the superuser can give files away; for all others the new file is their own, as with any editor.
    if fchown(file, Some(former.uid()), Some(former.gid())).is_err() {
        let _ = fchown(file, None, Some(former.gid()));
    }
    let now = file.metadata()?;
    let (has_owner, has_group) = (now.uid() == former.uid(), now.gid() == former.gid());
    file.set_permissions(fs::Permissions::from_mode(kept_mode(
        former.mode(),
        has_owner,
        has_group,
    )))?;
    if has_owner && has_group {
        copy_attributes(file, path);
    }
    Ok(())
}

/// The permission bits of a new file: those of the former one, less what they would mean for another owner or group.
#[cfg(unix)]
fn kept_mode(former: u32, has_owner: bool, has_group: bool) -> u32 {
    let mut mode = former & 0o7777;
    if !has_owner {
        mode &= !0o4000;
    }
    if !has_group {
        // The group is another one: it may what all may.
        mode = (mode & !0o2070) | (((mode & 0o007) << 3) & (mode & 0o070));
    }
    mode
}

/// Copies access lists and extended attributes. Those that the system guards the content with (capabilities, signatures) are of
/// the old content, except the label that says who may come near it.
#[cfg(unix)]
fn copy_attributes(file: &File, path: &Path) {
    use std::os::unix::ffi::OsStrExt;

    use xattr::FileExt;
    for name in xattr::list_deref(path).into_iter().flatten() {
        if name.as_bytes().starts_with(b"security.") && name != "security.selinux" {
            continue;
        }
        if let Ok(Some(value)) = xattr::get_deref(path, &name) {
            // Some are the system's own to set.
            let _ = file.set_xattr(&name, &value);
        }
    }
}

#[cfg(not(unix))]
fn keep_attributes(file: &File, _path: &Path, former: &Metadata) -> io::Result<()> {
    file.set_permissions(former.permissions())
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[cfg(unix)]
    #[test]
    fn nobody_gets_a_right_with_a_new_owner_or_group() {
        let check = |former, has_owner, has_group, expect: u32| {
            let kept = kept_mode(former, has_owner, has_group);
            assert_eq!(kept, expect, "{kept:o} of {former:o}, not {expect:o}");
        };
        check(0o100_640, true, true, 0o640);
        check(0o106_755, true, true, 0o6755);
        check(0o106_755, false, true, 0o2755);
        check(0o100_664, true, false, 0o644);
        check(0o102_770, true, false, 0o700);
        check(0o100_604, true, false, 0o604);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn access_lists_and_attributes_stay() {
        use std::os::unix::fs::{MetadataExt, PermissionsExt};

        // Version 2; then tag, permissions and id of the owner, user 1000, the group, the mask, and all others (man 5 acl).
        const ENTRIES: [(u16, u16, u32); 5] = [
            (0x01, 6, u32::MAX),
            (0x02, 4, 1000),
            (0x04, 4, u32::MAX),
            (0x10, 4, u32::MAX),
            (0x20, 0, u32::MAX),
        ];
        let mut list = 2_u32.to_le_bytes().to_vec();
        for (tag, permissions, id) in ENTRIES {
            list.extend([tag.to_le_bytes(), permissions.to_le_bytes()].concat());
            list.extend(id.to_le_bytes());
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scan.ply");
        fs::write(&path, "old").unwrap();
        fs::set_permissions(&path, fs::Permissions::from_mode(0o2640)).unwrap();
        let attributes = [
            ("user.comment", b"measured in May".to_vec()),
            ("system.posix_acl_access", list),
        ];
        let kept: Vec<_> = (attributes.into_iter())
            .filter(|(name, value)| xattr::set(&path, name, value).is_ok())
            .collect();
        if kept.len() < 2 {
            println!("skipped in part: this file system keeps no more than {kept:?}");
        }
        replace(&path, |out| out.write_all(b"new").map_err(WriteError::io(&path))).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"new");
        assert_eq!(fs::metadata(&path).unwrap().mode() & 0o7777, 0o2640);
        for (name, value) in kept {
            assert_eq!(xattr::get(&path, name).unwrap(), Some(value), "{name}");
        }
    }

    #[test]
    fn parts_are_known_by_their_names() {
        let check = |name: &str, expect| assert_eq!(is_part_name(OsStr::new(name)), expect, "{name}");
        check(".normend-a1B2c3.part", true);
        check(".normend-.part", false);
        check(".normend-a b.part", false);
        check("normend-a1B2c3.part", false);
        check(".normend-a1B2c3.part.ply", false);
        let folder = tempfile::tempdir().unwrap();
        let part = new_part(folder.path()).unwrap();
        assert!(is_part_name(part.path().file_name().unwrap()));
    }

    #[test]
    fn what_nobody_writes_any_more_is_removed() {
        let folder = tempfile::tempdir().unwrap();
        let held = new_part(folder.path()).unwrap();
        let left = new_part(folder.path()).unwrap().into_temp_path().keep().unwrap();
        let others = ["scan.ply.part", ".normend-.part", ".normend-part"].map(|name| folder.path().join(name));
        for other in &others {
            fs::write(other, "").unwrap();
        }
        assert!(left.exists());
        replace(&folder.path().join("new.ply"), |_| Ok(())).unwrap();
        assert!(!left.exists());
        assert!(held.path().exists() && others.iter().all(|other| other.exists()));
    }

    #[test]
    fn what_another_program_wrote_meanwhile_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("scan.ply");
        for before in [None, Some("old")] {
            let _ = fs::remove_file(&path);
            if let Some(before) = before {
                fs::write(&path, before).unwrap();
            }
            let error = replace(&path, |out| {
                out.write_all(b"ours").unwrap();
                fs::write(&path, "theirs, of another length").unwrap();
                Ok(())
            });
            assert!(
                error
                    .unwrap_err()
                    .to_string()
                    .contains("was changed by another program")
            );
            assert_eq!(fs::read(&path).unwrap(), b"theirs, of another length");
        }
        // One that was removed meanwhile is written anew.
        replace(&path, |out| {
            out.write_all(b"ours").unwrap();
            fs::remove_file(&path).unwrap();
            Ok(())
        })
        .unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"ours");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
