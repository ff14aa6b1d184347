//! What clicks on patches do, on a row of points.

use glam::DVec3;

use super::*;
use crate::patches::{Level, Patches};
use crate::regions::literal::World;

/// Eight points in a row whose normals agree, up to those where `turned` says that they start downward; patches of two,
/// of four, and all.
fn propagation(turned: [bool; 8]) -> Propagation {
    let edges = (0..7).map(|a| (a, a + 1, 0.1, turned[a as usize] != turned[a as usize + 1]));
    let world = World::without_cuts(8, edges.collect());
    let halves = |n_points: u32| -> Vec<u32> { (0..n_points).map(|cluster| cluster / 2).collect() };
    let levels = [
        (halves(8), vec![0.9; 8]),
        (halves(4), vec![0.1; 4]),
        (vec![], vec![0.5; 2]),
    ];
    let levels: Vec<_> = levels
        .iter()
        .map(|(parents, strengths)| Level { parents, strengths })
        .collect();
    let root = world.tree.order()[0] as usize;
    let mut initially_turned = world.initially_turned.clone();
    initially_turned.set(0, turned[root]);
    Propagation {
        parameters: Parameters::default(),
        normals: Arc::new(vec![Vec3::Z; 8]),
        splat_radii: Arc::new(vec![1.0; 8]),
        tree: Arc::clone(&world.tree),
        base_regions: Regions::new(Arc::clone(&world.tree), world.initial_cuts.clone(), initially_turned),
        default_sources: vec![0],
        votes: None,
        viewpoints: Arc::default(),
        voted_sources: Arc::default(),
        sides: Vec::new(),
        patches: Some(Arc::new(Patches::new(&world.tree, &levels))),
        evidence: None,
        found_station: None,
        stations: Arc::default(),
        has_track: false,
        seconds: Vec::new(),
    }
}

fn source(point: u32, normal: Vec3) -> Source {
    Source {
        point,
        normal,
        origin: Origin::Picked,
        patch: None,
    }
}

const UP: [bool; 8] = [false; 8];

fn row(turned: [bool; 8]) -> Document {
    let positions = (0..8).map(|point| Vec3::X * point as f32).collect();
    let mut document = Document::new(Arc::new(PointCloud::new(DVec3::ZERO, positions).unwrap()), None);
    document.install(propagation(turned));
    document
}

/// The points that are turned down, as digits.
fn down(document: &Document) -> String {
    let normals = document.oriented_normals().unwrap();
    (0..8)
        .filter(|&point| normals[point].z < 0.0)
        .map(|point| point.to_string())
        .collect()
}

/// Clicks the patch of `n_points` around `point`.
fn turn(document: &mut Document, point: u32, n_points: u32) {
    let preview = document.preview_turn_patch(point, n_points).unwrap();
    assert_eq!(preview.n_points(), u64::from(n_points));
    assert_eq!(document.apply(Edit::TurnPatch { point, n_points }).unwrap(), preview);
}

#[test]
fn a_patch_turns_alone_and_later_clicks_leave_it_alone() {
    let mut document = row(UP);
    turn(&mut document, 3, 2);
    assert_eq!(down(&document), "23");
    turn(&mut document, 4, 2);
    assert_eq!(down(&document), "2345");
    turn(&mut document, 0, 2);
    assert_eq!(down(&document), "012345");
    // And turning it back with its source leaves the others alone.
    document.apply(Edit::RemoveSources(vec![3])).unwrap();
    assert_eq!(down(&document), "0145");
    document.apply(Edit::FlipSources(vec![4])).unwrap();
    assert_eq!(down(&document), "01");
    for expect in ["0145", "012345", "2345", "23", ""] {
        document.undo().unwrap();
        assert_eq!(down(&document), expect);
    }
    assert!(document.undo().is_none());
}

#[test]
fn what_is_vouched_for_is_not_offered_and_not_turned() {
    let mut document = row(UP);
    let sizes = |document: &Document, point| {
        let offer = document.offer(point).unwrap()?;
        let sizes: Vec<u32> = offer.patches.iter().map(|patch| patch.n_points).collect();
        Some((sizes, offer.default))
    };
    assert_eq!(sizes(&document, 6), Some((vec![1, 2, 4, 8], 1)));
    document.apply(Edit::AddSources(vec![source(5, Vec3::Z)])).unwrap();
    assert_eq!(sizes(&document, 6), Some((vec![1, 2], 1)));
    assert_eq!(sizes(&document, 4), Some((vec![1], 0)));
    assert_eq!(sizes(&document, 5), None);
    let bits = document.orientation().unwrap().clone();
    let error = document.apply(Edit::TurnPatch { point: 6, n_points: 3 }).unwrap_err();
    assert_eq!(error, EditError::Vouched { n_vouched: 1 });
    assert!(error.to_string().contains("would turn 1 of the points you vouched for"));
    assert_eq!(document.orientation(), Some(&bits));
}

#[test]
fn a_larger_patch_leaves_the_patches_in_it_alone() {
    let mut document = row(UP);
    turn(&mut document, 2, 2);
    turn(&mut document, 5, 1);
    assert_eq!(down(&document), "235");
    // The rest of the first half, and then of the second; the clicked point must be of the rest.
    let edit = Edit::TurnPatch { point: 0, n_points: 4 };
    assert_eq!(document.preview_turn_patch(0, 4).unwrap().n_points(), 2);
    assert_eq!(document.apply(edit.clone()).unwrap().n_points(), 2);
    assert_eq!(down(&document), "01235");
    let hindered = Edit::TurnPatch { point: 3, n_points: 4 };
    assert_eq!(document.apply(hindered), Err(EditError::Vouched { n_vouched: 2 }));
    document.apply(Edit::TurnPatch { point: 7, n_points: 4 }).unwrap();
    assert_eq!(down(&document), "01234567");
    // Each is taken back alone; what a larger patch covers stays as that says.
    document.apply(Edit::RemoveSources(vec![2])).unwrap();
    assert_eq!(down(&document), "01234567");
    document.apply(Edit::RemoveSources(vec![0])).unwrap();
    assert_eq!(down(&document), "4567");
    (0..4).for_each(|_| drop(document.undo()));
    assert_eq!(document.apply(edit).unwrap().n_points(), 2);
    assert_eq!(down(&document), "01235");
}

#[test]
fn mends_and_patches_mix() {
    let mut document = row(UP);
    // The tree is cut between the vouched default source 0 and 6: at the last of equal edges.
    document.apply(Edit::Mend(6)).unwrap();
    assert_eq!(down(&document), "67");
    turn(&mut document, 7, 1);
    assert_eq!(down(&document), "6");
    // Its source holds the point now, so all that hangs together with it is the point.
    assert_eq!(document.apply(Edit::TurnWhole(7)).unwrap().n_points(), 1);
    assert_eq!(down(&document), "67");
    document.apply(Edit::FlipSources(vec![7])).unwrap();
    assert_eq!(down(&document), "6");
    // And what is mended around a turned patch moves with it.
    turn(&mut document, 2, 2);
    assert_eq!(down(&document), "236");
    document.apply(Edit::Mend(3)).unwrap();
    assert_eq!(document.sources().get(3).unwrap().patch, None);
}

#[test]
fn under_other_parameters_a_patch_turns_only_where_it_is_still_wrong() {
    let mut document = row(UP);
    turn(&mut document, 2, 2);
    turn(&mut document, 4, 4);
    let wanted = "234567";
    assert_eq!(down(&document), wanted);
    // The first patch is right by itself now.
    document.install(propagation([false, false, true, true, false, false, false, false]));
    assert_eq!(down(&document), wanted);
    // So are both.
    document.install(propagation([false, false, true, true, true, true, true, true]));
    assert_eq!(down(&document), wanted);
    // Undo takes the sources away, whatever they turn now.
    document.undo().unwrap();
    document.undo().unwrap();
    assert_eq!(down(&document), wanted);
    document.install(propagation(UP));
    assert_eq!(down(&document), "");
    document.redo().unwrap();
    assert_eq!(down(&document), "23");
}

#[test]
fn a_source_that_goes_takes_no_patch_in_its_patch_along() {
    let mut document = row(UP);
    turn(&mut document, 0, 4);
    turn(&mut document, 2, 2);
    assert_eq!(down(&document), "01");
    document.apply(Edit::RemoveSources(vec![0])).unwrap();
    assert_eq!(down(&document), "", "the user vouched for 2, and it stays up");
    document.undo().unwrap();
    assert_eq!(down(&document), "01");
}

#[test]
fn without_patches_there_is_nothing_to_offer() {
    let mut document = row(UP);
    turn(&mut document, 2, 2);
    document.install(Propagation {
        patches: None,
        ..propagation(UP)
    });
    assert_eq!(document.offer(5), Ok(None));
    let edit = Edit::TurnPatch { point: 5, n_points: 2 };
    assert_eq!(document.preview_turn_patch(5, 2), Err(EditError::NoPatches));
    assert_eq!(document.apply(edit), Err(EditError::NoPatches));
    assert_eq!(
        down(&document),
        "01234567",
        "one source alone orients all that hangs together"
    );
    document.install(propagation(UP));
    assert_eq!(down(&document), "23");
}
