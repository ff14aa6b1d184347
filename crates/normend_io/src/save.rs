//! Writing a file whole or not at all: beside the target first, synced, then renamed.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::error::WriteError;

/// Most symbolic links followed from one name, as the kernel does.
const MOST_LINKS: usize = 40;

/// Puts what `fill` writes in the place of `path`. Links are followed; a file that is there keeps its permissions, and
/// stays as it is when anything goes wrong.
pub(crate) fn replace(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&mut File>) -> Result<(), WriteError>,
) -> Result<(), WriteError> {
    let io = WriteError::io(path);
    let refuse = |reason| {
        Err(WriteError::Target {
            path: path.to_owned(),
            reason,
        })
    };
    let target = follow_links(path).map_err(&io)?;
    let former = match fs::metadata(&target) {
        Ok(metadata) if metadata.is_dir() => return refuse("is a folder: name a file"),
        Ok(metadata) if !metadata.is_file() => return refuse("is a device, not a file: name a file"),
        Ok(metadata) if metadata.permissions().readonly() => {
            return refuse("is write-protected: change its permissions or choose another name");
        }
        Ok(metadata) => Some(metadata),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => None,
        Err(error) => return Err(io(error)),
    };
    let folder = match target.parent() {
        Some(folder) if folder.as_os_str().is_empty() => Path::new("."),
        Some(folder) => folder,
        None => return refuse("is not the name of a file: name one"),
    };
    if target.file_name().is_none() {
        return refuse("is not the name of a file: name one");
    }
    if !folder.is_dir() {
        return refuse("lies in a folder that does not exist: create the folder first");
    }

    let mut builder = tempfile::Builder::new();
    builder.prefix(".normend-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // What any new file gets, less the user's umask; not the private mode of temporary files.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let mut temporary = builder.tempfile_in(folder).map_err(&io)?;
    let mut out = BufWriter::with_capacity(1 << 20, temporary.as_file_mut());
    fill(&mut out)?;
    out.flush().map_err(&io)?;
    drop(out);
    if let Some(former) = &former {
        keep_owner(temporary.as_file(), former);
        temporary.as_file().set_permissions(former.permissions()).map_err(&io)?;
    }
    temporary.as_file().sync_all().map_err(&io)?;
    temporary.persist(&target).map_err(|error| io(error.error))?;
    // The new name itself should reach the disk too. Some systems refuse to open or sync a folder; the target is replaced
    // by now, so that is no failure.
    #[cfg(unix)]
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
    Ok(())
}

/// Whether two paths lead to the same file.
pub(crate) fn is_same_file(a: &Path, b: &Path) -> bool {
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

/// The file that a name leads to through symbolic links; it need not exist.
fn follow_links(path: &Path) -> std::io::Result<PathBuf> {
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
    Err(std::io::Error::other("too many symbolic links: name the file itself"))
}

#[cfg(unix)]
fn keep_owner(file: &File, former: &fs::Metadata) {
    use std::os::unix::fs::{MetadataExt, fchown};
    // Only the superuser can give files away; for all others the new file is their own, as with any editor.
    let _ = fchown(file, Some(former.uid()), Some(former.gid()));
}

#[cfg(not(unix))]
fn keep_owner(_file: &File, _former: &fs::Metadata) {}
