//! Marks, verbs and recorded changes, on rows of points.

use fixedbitset::FixedBitSet;
use glam::DVec3;

use super::*;
use crate::patches::{Level, Patches};
use crate::regions::literal::World;

/// Eight points in a row along x, normals up, in patches of two, four and all; the edges get heavier toward the end. Signs start as
/// given at `cuts`: from each of these points on they are the other way round.
fn row(cuts: &[u32], has_patches: bool) -> Document {
    let edges = (0..7).map(|a| (a, a + 1, 0.1 + 0.01 * a as f32, false));
    let world = World::without_cuts(8, edges.collect());
    let tree = &world.tree;
    let mut bits = FixedBitSet::with_capacity(8);
    let (mut initial_cuts, mut turned) = (bits.clone(), FixedBitSet::with_capacity(8));
    for point in 0..8 {
        bits.set(
            point,
            cuts.iter().filter(|&&cut| cut as usize <= point).count() % 2 == 1,
        );
    }
    for position in 0..8 {
        let is_down = |position: u32| bits.contains(tree.order()[position as usize] as usize);
        let differs = tree
            .parent(position)
            .is_some_and(|parent| is_down(parent) != is_down(position));
        initial_cuts.set(position as usize, differs);
        turned.set(position as usize, is_down(position));
    }
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
    let positions = (0..8).map(|point| Vec3::X * point as f32).collect();
    let mut document = Document::new(Arc::new(PointCloud::new(DVec3::ZERO, positions).unwrap()), None);
    document.install(Propagation {
        parameters: Parameters::default(),
        normals: Arc::new(vec![Vec3::Z; 8]),
        splat_radii: Arc::new(vec![1.0; 8]),
        tree: Arc::clone(tree),
        base_regions: Regions::new(Arc::clone(tree), initial_cuts, turned),
        default_sources: vec![0],
        votes: None,
        viewpoints: Arc::default(),
        voted_sources: Arc::default(),
        sides: Vec::new(),
        patches: has_patches.then(|| Arc::new(Patches::new(tree, &levels))),
        evidence: None,
        found_station: None,
        stations: Arc::default(),
        has_track: false,
        seconds: Vec::new(),
    });
    document
}

/// The points that are turned down, as digits.
fn down(document: &Document) -> String {
    let normals = document.oriented_normals().unwrap();
    let down = (0..8).filter(|&point| normals[point].z < 0.0);
    down.map(|point| point.to_string()).collect()
}

fn points<const N: usize>(points: [u32; N]) -> PointSet {
    PointSet::from_iter(points)
}

fn flip(document: &mut Document, flipped: PointSet) {
    let reason = FlipReason::Asked;
    document
        .apply(Edit::FlipPoints {
            points: flipped,
            reason,
        })
        .unwrap();
}

#[test]
fn flipping_points_turns_them_alone_and_twice_leaves_nothing() {
    let mut document = row(&[], true);
    flip(&mut document, points([2, 3, 6]));
    assert_eq!(down(&document), "236");
    assert_eq!(document.marks().len(), 3);
    flip(&mut document, points([3, 4]));
    assert_eq!(down(&document), "246");
    assert_eq!(document.marks().len(), 3, "point 3 is what its region says again");
    flip(&mut document, points([2, 4, 6]));
    assert_eq!((down(&document).as_str(), document.marks().len()), ("", 0));
    for expect in ["246", "236", ""] {
        document.undo().unwrap();
        assert_eq!(down(&document), expect);
    }
}

#[test]
fn a_patch_takes_its_flipped_points_along_but_not_the_pinned() {
    let mut document = row(&[], true);
    flip(&mut document, points([1, 2]));
    document.apply(Edit::Pin(points([2, 3]))).unwrap();
    assert_eq!(down(&document), "12");
    assert_eq!(document.n_pinned_in_patch(0, 4), Ok(2));
    let change = document.apply(Edit::TurnPatch { point: 0, n_points: 4 }).unwrap();
    assert_eq!((down(&document).as_str(), change.n_points()), ("02", 2));
    // Pinned points are left out of what flips, and refuse a click.
    flip(&mut document, points([2, 5]));
    assert_eq!(down(&document), "025");
    assert_eq!(document.apply(Edit::Mend(3)), Err(EditError::Pinned { n_pinned: 1 }));
    let only_pinned = Edit::FlipPoints {
        points: points([2, 3]),
        reason: FlipReason::Asked,
    };
    assert_eq!(document.apply(only_pinned), Err(EditError::Pinned { n_pinned: 2 }));
    document.apply(Edit::Unpin(points([2, 3]))).unwrap();
    assert_eq!((down(&document).as_str(), document.marks().n_pinned()), ("025", 0));
}

#[test]
fn inside_a_selection_signs_come_from_beside_it() {
    let mut document = row(&[], true);
    flip(&mut document, points([2, 3, 4]));
    document.apply(Edit::PropagateInside(points([2, 3]))).unwrap();
    // The edge to point 1 is lighter than the one to point 4.
    assert_eq!((down(&document).as_str(), document.marks().len()), ("4", 1));
    flip(&mut document, points([0, 1, 2, 3, 5, 6, 7]));
    document.apply(Edit::PropagateInside((0..8).collect())).unwrap();
    assert_eq!(down(&document), "01234567", "nothing is beside all");
}

#[test]
fn from_a_selection_signs_go_across_cuts_and_over_marks_but_not_over_pins() {
    let mut document = row(&[2, 5], false);
    assert_eq!(down(&document), "234");
    flip(&mut document, points([0, 7]));
    document.apply(Edit::Pin(points([7]))).unwrap();
    document.apply(Edit::Mend(4)).unwrap();
    assert_eq!(down(&document), "07");
    document.undo();
    let n_before = document.steps().count();
    document.apply(Edit::PropagateFrom(points([3]))).unwrap();
    assert_eq!(down(&document), "01234567");
    assert_eq!(document.steps().count(), n_before);
    assert_eq!(
        document.sources().get(3).map(|source| source.origin),
        Some(Origin::Selected)
    );
    document.apply(Edit::PropagateFrom(points([3]))).unwrap();
    assert_eq!(document.steps().count(), n_before, "nothing changes the second time");
    document.apply(Edit::PropagateFrom(points([5]))).unwrap();
    assert_eq!(down(&document), "01234567");
    document.undo();
    document.undo();
    assert_eq!(down(&document), "02347");
    document.apply(Edit::PropagateFrom(points([0, 1, 5]))).unwrap();
    assert_eq!(
        down(&document),
        "07",
        "two of three are up; the third stays, and so does the pin"
    );
}

#[test]
fn what_a_viewer_sees_from_behind_turns_patch_by_patch() {
    let above = Viewer::Toward(Vec3::Z);
    let mut document = row(&[0, 4], true);
    assert_eq!(down(&document), "0123");
    assert_eq!(
        document.seen(&points([4, 5, 6]), above),
        Ok(None),
        "all of it faces the viewer"
    );
    assert_eq!(
        document.seen(&points([0, 1]), above),
        Ok(None),
        "two looks may be noise"
    );
    let edit = document.seen(&points([0, 1, 2, 4, 5, 6]), above).unwrap().unwrap();
    // Whoever sees only a part of a patch, all of it from behind, sees the patch.
    assert_eq!(edit, Edit::TurnSeenPatches(vec![(0, 4)]));
    let preview = document.preview(&edit).unwrap();
    assert_eq!(document.apply(edit), Ok(preview));
    assert_eq!(down(&document), "");
    // What a click says is not overruled by a look.
    document.apply(Edit::TurnPatch { point: 5, n_points: 4 }).unwrap();
    assert_eq!(document.seen(&points([4, 5, 6, 7]), above), Ok(None));
}

#[test]
fn points_face_the_viewer() {
    let mut document = row(&[], true);
    flip(&mut document, points([1, 2]));
    let above = Viewer::At(Vec3::new(3.0, 0.0, 10.0));
    assert_eq!(document.facing_away(&(0..8).collect(), above), Ok(points([1, 2])));
    assert_eq!(document.facing_away(&points([2, 3]), above), Ok(points([2])));
    let below = Viewer::Toward(-Vec3::Z);
    assert_eq!(document.facing_away(&points([2, 3]), below), Ok(points([3])));
    // From the side no point says anything.
    assert_eq!(
        document.facing_away(&(0..8).collect(), Viewer::Toward(Vec3::X)),
        Ok(PointSet::new())
    );
}

#[test]
fn without_patches_the_clearest_views_become_sources() {
    let mut document = row(&[], false);
    document.apply(Edit::TurnWhole(0)).unwrap();
    let above = Viewer::Toward(Vec3::Z);
    let edit = document.seen(&points([2, 3]), above).unwrap().unwrap();
    assert_eq!(edit.kind(), EditKind::Seen);
    document.apply(edit).unwrap();
    assert_eq!(document.oriented_normal(2), Some(Vec3::Z));
    assert_eq!(document.seen(&points([2, 3]), above), Ok(None));
}

#[test]
fn selecting_and_hiding_leave_nothing_to_save() {
    let mut document = row(&[], true);
    let saved = document.signs_revision();
    document.apply(Edit::Select(points([1, 2]))).unwrap();
    document.apply(Edit::Hide(points([3]))).unwrap();
    document.apply(Edit::Accept(points([4]))).unwrap();
    assert_eq!(document.signs_revision(), saved);
    assert_eq!(
        (document.selected(), document.hidden()),
        (&points([1, 2]), &points([3]))
    );
    document.apply(Edit::Select(points([2, 5]))).unwrap();
    let step = document.next_undo().unwrap();
    assert_eq!(
        (step.kind(), &step.change().selected),
        (EditKind::Select, &points([1, 5]))
    );
    document.undo();
    assert_eq!(document.selected(), &points([1, 2]));
    flip(&mut document, points([1]));
    assert_ne!(document.signs_revision(), saved);
    document.undo();
    assert_eq!(document.signs_revision(), saved);
}

#[test]
fn parameters_are_wanted_until_a_propagation_with_them_is_installed() {
    let mut document = row(&[], true);
    let before = document.parameters();
    let wanted = Parameters { k_graph: 9, ..before };
    document.apply(Edit::SetParameters(wanted)).unwrap();
    assert_eq!(document.parameters(), wanted);
    assert_eq!(document.propagation().unwrap().parameters, before);
    assert!(document.apply(Edit::SetParameters(wanted)).unwrap().is_empty());
    document.undo();
    assert_eq!(document.parameters(), before);
    assert!(document.next_undo().is_none());
}

#[test]
fn recorded_changes_that_do_not_fit_are_refused() {
    let mut document = row(&[], true);
    let far = StateChange {
        selected: points([8]),
        ..StateChange::default()
    };
    let no_such_point = EditError::NoSuchPoint { point: 8, n_points: 8 };
    assert_eq!(
        document.apply_recorded(EditKind::Select, far, 0),
        Err(no_such_point.clone())
    );
    let nowhere = Mark {
        normal: Vec3::NAN,
        pinned: false,
    };
    let nowhere = StateChange {
        marks: vec![(3, Some(nowhere))],
        ..StateChange::default()
    };
    let no_direction = EditError::NoDirection { point: 3 };
    assert_eq!(document.apply_recorded(EditKind::Pin, nowhere, 0), Err(no_direction));
    let beyond = Vec3::new(0.0, f32::INFINITY, 0.0);
    for (places, expect) in [
        (vec![Vec3::ZERO, beyond], EditError::NoPlace { index: 1 }),
        (vec![Vec3::ZERO; 27], EditError::TooManyViewpoints { n_viewpoints: 27 }),
    ] {
        let change = StateChange {
            viewpoints: Some(places.clone().into()),
            ..StateChange::default()
        };
        let recorded = document.apply_recorded(EditKind::SetViewpoints, change, 0);
        assert_eq!(recorded, Err(expect.clone()));
        assert_eq!(document.apply(Edit::SetViewpoints(places.into())), Err(expect));
    }
    assert!(document.next_undo().is_none());
}
