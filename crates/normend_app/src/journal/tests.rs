use std::sync::Arc;

use glam::{DVec3, Vec3};
use normend_core::{Document, Edit, Parameters, PointCloud, PointSet};
use normend_io::recipe::ScanIdentity;

use super::*;

fn scan(hash: u8, path: &str) -> ScanIdentity {
    ScanIdentity {
        name: "a scan.ply".to_owned(),
        path: Some(path.to_owned()),
        n_bytes: 10,
        hash: [hash; 32],
        n_points: 100,
        columns: None,
        files: Vec::new(),
    }
}

fn head() -> Head {
    Head::new(scan(1, "/a scan.ply"), Parameters::default())
}

/// Selects one point.
fn change(point: u32) -> StateChange {
    StateChange {
        selected: PointSet::from_iter([point]),
        ..StateChange::default()
    }
}

fn select(journal: &mut Journal, points: std::ops::Range<u32>) {
    for point in points {
        journal.step(EditKind::Select, &change(point), 0);
    }
}

/// The points of the steps in a file, as it is now.
fn selected(path: &Path) -> Vec<u32> {
    let reading = recipe::read(path).unwrap();
    assert_eq!(reading.end, recipe::End::Whole);
    let points = reading.recipe.history().0.into_iter();
    points.filter_map(|step| step.change.selected.min()).collect()
}

fn find_in(folder: &Path) -> found::Findings {
    found::find(folder, &head().scan, Duration::ZERO)
}

#[test]
fn every_edit_is_in_the_file_before_it_returns() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path().join("journals");
    let mut journal = Journal::new(&folder, head());
    assert!(
        !folder.exists() && journal.path().is_none(),
        "nothing is written before the first edit"
    );
    select(&mut journal, 0..1);
    let path = journal.path().unwrap();
    assert_eq!(path, folder.join("0101010101010101-a_scan.ply.journal"));
    assert_eq!(selected(&path), [0]);
    select(&mut journal, 1..3);
    journal.undo();
    assert_eq!(selected(&path), [0, 1, 2]);
    assert_eq!(recipe::read(&path).unwrap().recipe.history().1, 2);
    journal.redo();
    assert_eq!(recipe::read(&path).unwrap().recipe.history().1, 3);

    // Held by this editor, so no other one is offered it.
    assert!(find_in(&folder).offers.is_empty());
    let mut other = Journal::new(&folder, head());
    select(&mut other, 7..8);
    assert_eq!(
        other.path().unwrap(),
        folder.join("0101010101010101-a_scan.ply-2.journal")
    );
    assert_eq!(selected(&path), [0, 1, 2]);
    drop(journal);
    drop(other);
    let findings = find_in(&folder);
    assert_eq!(findings.offers.len(), 2);
    // The newest first.
    assert_eq!(findings.offers.iter().map(Offer::n_edits).collect::<Vec<_>>(), [1, 3]);
}

#[test]
fn a_journal_goes_on_where_it_was_left() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = Journal::new(folder.path(), head());
    select(&mut journal, 0..3);
    let path = journal.path().unwrap();
    drop(journal);
    // The editor ended in the middle of a line.
    let whole = fs::read(&path).unwrap();
    fs::write(&path, [&whole[..], b"{\"do\":\"st"].concat()).unwrap();
    let mut offers = find_in(folder.path()).offers;
    let offer = offers.pop().unwrap();
    assert_eq!((offer.n_edits(), offer.damage(), offer.is_same), (3, None, true));
    assert!(find_in(folder.path()).offers.is_empty(), "an offer is held");
    let mut journal = Journal::resume(offer);
    select(&mut journal, 3..5);
    assert_eq!(selected(&path), [0, 1, 2, 3, 4]);
    drop(journal);
    // The last line without its end.
    let whole = fs::read(&path).unwrap();
    fs::write(&path, &whole[..whole.len() - 1]).unwrap();
    let mut journal = Journal::resume(find_in(folder.path()).offers.pop().unwrap());
    select(&mut journal, 5..6);
    assert_eq!(selected(&path), [0, 1, 2, 3, 4, 5]);
    journal.remove();
    assert!(!path.exists());
}

#[test]
fn what_is_damaged_is_said_and_kept() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = Journal::new(folder.path(), head());
    select(&mut journal, 0..4);
    let path = journal.path().unwrap();
    drop(journal);
    let mut bytes = fs::read(&path).unwrap();
    let third_line = bytes
        .iter()
        .enumerate()
        .filter(|(_, byte)| **byte == b'\n')
        .nth(1)
        .unwrap()
        .0
        + 10;
    bytes[third_line] ^= 1;
    fs::write(&path, &bytes).unwrap();
    let offer = find_in(folder.path()).offers.pop().unwrap();
    assert_eq!(offer.n_edits(), 1);
    assert!(offer.damage().unwrap().starts_with("line 3: the line is damaged"));
    let copy = offer.keep_damaged().unwrap();
    let mut journal = Journal::resume(offer);
    select(&mut journal, 9..10);
    assert_eq!(selected(&path), [0, 9]);
    assert_eq!(fs::read(&copy).unwrap(), bytes);
    // Without a place for the copy that is said.
    drop(journal);
    fs::remove_file(&copy).unwrap();
    fs::create_dir(&copy).unwrap();
    assert!(find_in(folder.path()).offers[0].keep_damaged().is_err());
}

#[test]
fn what_is_exported_is_not_offered_unless_there_was_more() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = Journal::new(folder.path(), head());
    journal.exported();
    assert!(
        journal.path().is_none(),
        "nothing was done, so there is nothing to write"
    );
    select(&mut journal, 0..1);
    journal.exported();
    select(&mut journal, 1..2);
    let path = journal.path().unwrap();
    drop(journal);
    let offer = find_in(folder.path()).offers.pop().unwrap();
    assert_eq!(offer.n_edits(), 2);
    let mut journal = Journal::resume(offer);
    journal.exported();
    drop(journal);
    assert!(find_in(folder.path()).offers.is_empty());
    assert!(!path.exists());
}

#[test]
fn journals_of_other_files_and_of_changed_ones_are_told_apart() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = Journal::new(folder.path(), head());
    select(&mut journal, 0..1);
    drop(journal);
    let find = |scan: &ScanIdentity| {
        let offers = found::find(folder.path(), scan, Duration::ZERO).offers;
        offers.iter().map(|offer| offer.is_same).collect::<Vec<_>>()
    };
    assert_eq!(find(&scan(1, "/elsewhere.ply")), [true]);
    assert_eq!(find(&scan(2, "/a scan.ply")), [false]);
    assert!(find(&scan(2, "/elsewhere.ply")).is_empty());
    // The hash's beginning is in the name, all of it in the file.
    let mut nearly = scan(1, "/elsewhere.ply");
    nearly.hash[31] = 0;
    assert!(find(&nearly).is_empty());
    // A file that is no journal is said to be none.
    fs::write(folder.path().join("0101010101010101-x.journal"), "PLY").unwrap();
    let findings = find_in(folder.path());
    assert_eq!(findings.offers.len(), 1);
    assert!(
        findings.problems[0].contains("this is no recipe"),
        "{:?}",
        findings.problems
    );
}

#[test]
fn a_folder_that_cannot_be_used_is_said_once_and_nothing_is_lost() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path().join("journals");
    fs::write(&folder, "in the way").unwrap();
    let mut journal = Journal::new(&folder, head());
    select(&mut journal, 0..2);
    assert!(matches!(journal.news(), Some(News::Failing(_))));
    assert_eq!(journal.news(), None);
    assert!(!journal.is_kept());
    fs::remove_file(&folder).unwrap();
    select(&mut journal, 2..3);
    assert_eq!(journal.news(), Some(News::Works));
    assert_eq!(selected(&journal.path().unwrap()), [0, 1, 2]);
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_said_and_all_is_written_when_there_is_room() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = Journal::new(folder.path(), head());
    select(&mut journal, 0..1);
    let (file, path) = {
        let mut out = lock(&journal.out);
        // A device that takes nothing.
        let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        out.file.replace((full, PathBuf::from("/dev/full"))).unwrap()
    };
    select(&mut journal, 1..3);
    let Some(News::Failing(reason)) = journal.news() else {
        panic!("not said")
    };
    assert!(reason.contains("the disk is full"), "{reason}");
    lock(&journal.out).file = Some((file, path.clone()));
    // A part of a line that was written before the disk was full.
    fs::write(&path, [&fs::read(&path).unwrap()[..], b"{\"do\":"].concat()).unwrap();
    journal.undo();
    assert_eq!(journal.news(), Some(News::Works));
    assert_eq!(selected(&path), [0, 1, 2]);
}

#[test]
fn a_failed_sync_is_said_until_all_is_synced() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = Journal::new(folder.path(), head());
    // From here on only the test syncs.
    journal.finish();
    select(&mut journal, 0..2);
    sync(&journal.out, |_| Err(io::ErrorKind::StorageFull.into()));
    assert!(matches!(journal.news(), Some(News::Failing(_))));
    select(&mut journal, 2..3);
    assert_eq!(journal.news(), None, "a line that is written is not synced");
    assert!(!journal.is_kept());
    sync(&journal.out, File::sync_data);
    assert_eq!(journal.news(), Some(News::Works));
    assert!(journal.is_kept());
    assert_eq!(selected(&journal.path().unwrap()), [0, 1, 2]);
}

#[test]
fn a_long_journal_is_shortened_to_what_can_be_reached() {
    let folder = tempfile::tempdir().unwrap();
    let cloud = PointCloud::new(DVec3::ZERO, vec![Vec3::ZERO; 100]).unwrap();
    let mut document = Document::new(Arc::new(cloud), None);
    let mut journal = Journal::new(folder.path(), head());
    for point in 0..100 {
        // Each but the last ten is taken back and something else done.
        document.apply(Edit::Select(PointSet::from_iter([point]))).unwrap();
        let step = document.next_undo().unwrap();
        journal.step(step.kind(), step.change(), step.n_turned());
        if point < 90 {
            document.undo().unwrap();
            journal.undo();
        }
    }
    document.undo().unwrap();
    journal.undo();
    let path = journal.path().unwrap();
    let n_bytes = fs::metadata(&path).unwrap().len();
    lock(&journal.out).shorten_above = 100;
    write_anew(&journal.out).unwrap();
    assert!(fs::metadata(&path).unwrap().len() < n_bytes / 5);
    assert!(find_in(folder.path()).offers.is_empty(), "the new file is held too");
    document.redo().unwrap();
    journal.redo();
    drop(journal);
    let offer = find_in(folder.path()).offers.pop().unwrap();
    assert_eq!(&offer.reading.recipe.state(), document.state());
    assert_eq!((offer.n_edits(), offer.n_undone()), (document.n_done(), 0));
}

#[test]
fn a_journal_follows_its_scan_to_another_content() {
    let folder = tempfile::tempdir().unwrap();
    let of = |path: &Path| recipe::read(path).unwrap().recipe.head.scan;
    let find = |hash| found::find(folder.path(), &scan(hash, "/a scan.ply"), Duration::ZERO);
    let mut journal = Journal::new(folder.path(), head());
    // Before the first edit there is nothing to write anew.
    journal.follow(scan(2, "/a scan.ply"));
    select(&mut journal, 0..2);
    let path = journal.path().unwrap();
    assert_eq!(of(&path).hash, [2; 32]);
    journal.undo();
    journal.exported();
    journal.follow(scan(3, "/a scan.ply"));
    select(&mut journal, 2..3);
    // Held, under either content.
    assert_eq!(find(3).held, std::slice::from_ref(&path));
    assert!(found::is_held(&path));
    // An editor that closes at once writes it anew all the same.
    drop(journal);
    assert!(!found::is_held(&path));
    assert_eq!(of(&path).hash, [3; 32]);
    assert_eq!(selected(&path), [0, 2]);
    assert!(find(2).offers.iter().all(|offer| !offer.is_same));
    let offer = find(3).offers.pop().unwrap();
    assert!(offer.is_same && offer.n_edits() == 2);
    let mut journal = Journal::resume(offer);
    select(&mut journal, 3..4);
    assert_eq!(selected(&path), [0, 2, 3]);
}

#[cfg(unix)]
#[test]
fn what_is_no_file_is_no_journal() {
    let folder = tempfile::tempdir().unwrap();
    let mut journal = Journal::new(folder.path(), head());
    select(&mut journal, 0..3);
    let path = journal.path().unwrap();
    drop(journal);
    let name = |number: u32| path.with_file_name(format!("0101010101010101-a_scan.ply-{number}.journal"));
    // Nobody ever writes into this pipe: reading it would wait forever. The device has no end.
    assert!(
        std::process::Command::new("mkfifo")
            .arg(name(2))
            .status()
            .unwrap()
            .success()
    );
    std::os::unix::fs::symlink("/dev/zero", name(3)).unwrap();
    let elsewhere = folder.path().join("elsewhere");
    fs::copy(&path, &elsewhere).unwrap();
    std::os::unix::fs::symlink(&elsewhere, name(4)).unwrap();
    fs::create_dir(name(5)).unwrap();
    let findings = find_in(folder.path());
    assert_eq!(findings.problems, Vec::<String>::new());
    let found: Vec<&Path> = findings.offers.iter().map(|offer| offer.path()).collect();
    assert_eq!(found, [path.as_path()]);
}
