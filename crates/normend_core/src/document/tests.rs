use std::collections::BTreeMap;

use fixedbitset::FixedBitSet;
use glam::DVec3;
use proptest::prelude::*;
use proptest::sample::Index;
use proptest::test_runner::TestCaseError;

use super::*;
use crate::Patches;
use crate::patches::tests::{OwnLevels, any_levels, borrowed};
use crate::regions::literal::World;

/// Few directions, so that sources are often perpendicular to stored normals.
fn directions() -> impl Strategy<Value = Vec3> {
    prop::sample::select(vec![
        Vec3::X,
        Vec3::Y,
        Vec3::Z,
        -Vec3::X,
        -Vec3::Z,
        Vec3::new(0.6, 0.0, 0.8),
        Vec3::new(-0.6, 0.64, 0.48),
    ])
}

fn source(point: u32, normal: Vec3) -> Source {
    Source {
        point,
        normal,
        origin: Origin::Picked,
        patch: None,
    }
}

/// A cloud that tells nothing: only the number of points matters here.
fn document_of(n_points: usize) -> Document {
    let positions = (0..n_points).map(|point| Vec3::X * point as f32).collect();
    Document::new(Arc::new(PointCloud::new(DVec3::ZERO, positions).unwrap()), None)
}

fn propagation_of(world: &World, normals: &[Vec3]) -> Propagation {
    Propagation {
        parameters: Parameters::default(),
        normals: Arc::new(normals.to_vec()),
        splat_radii: Arc::new(vec![1.0; world.n_points]),
        tree: Arc::clone(&world.tree),
        base_regions: Regions::new(
            Arc::clone(&world.tree),
            world.initial_cuts.clone(),
            world.initially_turned.clone(),
        ),
        default_sources: default_sources(&world.tree),
        sides: Vec::new(),
        patches: None,
        voted_sources: Arc::default(),
        votes: None,
        viewpoints: Arc::default(),
        evidence: None,
        found_station: None,
        stations: Arc::default(),
        has_track: false,
        seconds: Vec::new(),
    }
}

/// The last point of each component in preorder: any will do here.
fn default_sources(tree: &crate::SpanningTree) -> Vec<u32> {
    let last = |&root: &u32| tree.order()[tree.subtree(root).end as usize - 1];
    tree.roots().iter().map(last).collect()
}

/// A propagation with the patches of `levels`, if any.
fn propagation_in(setting: &Setting) -> Propagation {
    let (world, normals, levels) = setting;
    Propagation {
        patches: levels
            .as_ref()
            .map(|levels| Arc::new(Patches::new(&world.tree, &borrowed(levels)))),
        ..propagation_of(world, normals)
    }
}

/// The points whose patches are turned, each source decided after those of larger patches.
fn turned_points(document: &Document, world: &World) -> FixedBitSet {
    let propagation = document.propagation().unwrap();
    let mut turned = FixedBitSet::with_capacity(world.n_points);
    let Some(patches) = &propagation.patches else {
        return turned;
    };
    let mut of_sources: Vec<_> = document
        .sources()
        .iter()
        .filter_map(|source| Some((source, source.patch?)))
        .map(|(source, patch)| (source, patches.find(source.point, patch.n_points), patch.amid_mended))
        .collect();
    of_sources.sort_by_key(|(source, patch, _)| (std::cmp::Reverse(patch.n_points), source.point));
    for (source, patch, amid_mended) in of_sources {
        let point = source.point as usize;
        let around = document.is_flipped(source) != turned.contains(point);
        if around != amid_mended {
            let positions = patches.positions(patch, &world.tree);
            let points = positions.ranges().iter().flat_map(Clone::clone);
            points.for_each(|position| turned.toggle(world.tree.order()[position as usize] as usize));
        }
    }
    turned
}

/// What Algorithm 1 makes of the document's sources and turned patches.
fn expect(document: &Document, world: &World) -> FixedBitSet {
    let world = &world.with_turned(&turned_points(document, world));
    let normals = &document.propagation().unwrap().normals;
    let sources: BTreeMap<_, _> = document
        .sources()
        .iter()
        .map(|source| (source.point, source.turns(normals[source.point as usize])))
        .collect();
    let mut bits = FixedBitSet::with_capacity(world.n_points);
    for (point, (turned, _)) in world.expect(&sources).into_iter().enumerate() {
        let mark = document.marks().get(point as u32);
        let turned = mark.map_or(turned, |mark| mark.turns(normals[point]));
        bits.set(world.tree.position(point as u32) as usize, turned);
    }
    bits
}

#[derive(Clone, Debug)]
enum Act {
    Mend(u32),
    TurnWhole(u32),
    /// The patch of at least so many points.
    TurnPatch(u32, u32),
    Add(Vec<(u32, Vec3, Option<SourcePatch>)>),
    /// Some of the sources, each perhaps twice.
    Remove(Vec<Index>),
    Flip(Vec<Index>),
    FlipPoints(Vec<u32>),
    Pin(Vec<u32>),
    Unpin(Vec<u32>),
    PropagateFrom(Vec<u32>),
    PropagateInside(Vec<u32>),
    Select(Vec<u32>),
    Hide(Vec<u32>),
    Accept(Vec<u32>),
    SetParameters(usize),
    SetViewpoints(Vec<u32>),
    Undo,
    Redo,
    /// The other world with other normals.
    Install,
}

fn acts(n_points: usize, most: usize) -> impl Strategy<Value = Vec<Act>> {
    let points = 0..n_points as u32;
    let some = || prop::collection::vec(any::<Index>(), 0..5);
    let patch = prop_oneof![
        3 => Just(None),
        1 => (0..n_points as u32, any::<bool>())
            .prop_map(|(n_points, amid_mended)| Some(SourcePatch { n_points, amid_mended })),
    ];
    let set = || prop::collection::vec(0..n_points as u32, 0..6);
    let act = prop_oneof![
        2 => set().prop_map(Act::FlipPoints),
        1 => set().prop_map(Act::Pin),
        1 => set().prop_map(Act::Unpin),
        1 => set().prop_map(Act::PropagateFrom),
        1 => set().prop_map(Act::PropagateInside),
        1 => set().prop_map(Act::Select),
        1 => set().prop_map(Act::Hide),
        1 => set().prop_map(Act::Accept),
        1 => (4_usize..9).prop_map(Act::SetParameters),
        1 => set().prop_map(Act::SetViewpoints),
        4 => points.clone().prop_map(Act::Mend),
        1 => points.clone().prop_map(Act::TurnWhole),
        4 => (points.clone(), 0..n_points as u32 / 2 + 2).prop_map(|(point, n_points)| Act::TurnPatch(point, n_points)),
        2 => prop::collection::vec((points, directions(), patch), 0..8).prop_map(Act::Add),
        2 => some().prop_map(Act::Remove),
        2 => some().prop_map(Act::Flip),
        4 => Just(Act::Undo),
        3 => Just(Act::Redo),
        1 => Just(Act::Install),
    ];
    prop::collection::vec(act, 0..most)
}

/// A world with normals and perhaps levels of patches.
type Setting = (World, Vec<Vec3>, Option<OwnLevels>);

fn settings(n_points: usize) -> impl Strategy<Value = Setting> {
    let normals = prop::collection::vec(directions(), n_points);
    (World::any(n_points), normals, prop::bool::weighted(0.7)).prop_flat_map(|(world, normals, has_patches)| {
        let levels = any_levels(Arc::clone(&world.tree));
        levels.prop_map(move |levels| (world.clone(), normals.clone(), has_patches.then_some(levels)))
    })
}

/// Two settings of the same points, and what is done in them.
fn sessions(most: usize) -> impl Strategy<Value = ([Setting; 2], Vec<Act>)> {
    (1_usize..25).prop_flat_map(move |n_points| ([settings(n_points), settings(n_points)], acts(n_points, most)))
}

/// The edit that an act is, given the present sources.
fn edit_of(act: &Act, document: &Document) -> Option<Edit> {
    let sources: Vec<_> = document.sources().iter().map(|source| source.point).collect();
    let some_of = |chosen: &[Index]| -> Vec<u32> {
        if sources.is_empty() {
            Vec::new()
        } else {
            chosen.iter().map(|index| *index.get(&sources)).collect()
        }
    };
    match act {
        Act::Mend(point) => Some(Edit::Mend(*point)),
        Act::TurnWhole(point) => Some(Edit::TurnWhole(*point)),
        &Act::TurnPatch(point, n_points) => Some(Edit::TurnPatch { point, n_points }),
        Act::Add(added) => Some(Edit::AddSources(
            added
                .iter()
                .map(|&(point, normal, patch)| Source {
                    patch,
                    ..source(point, normal)
                })
                .collect(),
        )),
        Act::Remove(chosen) => Some(Edit::RemoveSources(some_of(chosen))),
        Act::Flip(chosen) => Some(Edit::FlipSources(some_of(chosen))),
        Act::FlipPoints(points) => Some(Edit::FlipPoints {
            points: points.iter().collect(),
            reason: FlipReason::Asked,
        }),
        Act::Pin(points) => Some(Edit::Pin(points.iter().collect())),
        Act::Unpin(points) => Some(Edit::Unpin(points.iter().collect())),
        Act::PropagateFrom(points) => Some(Edit::PropagateFrom(points.iter().collect())),
        Act::PropagateInside(points) => Some(Edit::PropagateInside(points.iter().collect())),
        Act::Select(points) => Some(Edit::Select(points.iter().collect())),
        Act::Hide(points) => Some(Edit::Hide(points.iter().collect())),
        Act::Accept(points) => Some(Edit::Accept(points.iter().collect())),
        &Act::SetParameters(k_graph) => Some(Edit::SetParameters(Parameters {
            k_graph,
            ..Parameters::default()
        })),
        Act::SetViewpoints(places) => Some(Edit::SetViewpoints(
            places.iter().map(|&place| Vec3::X * place as f32).collect(),
        )),
        Act::Undo | Act::Redo | Act::Install => None,
    }
}

/// The bits of `document`, as if `change` had turned them.
fn turned(document: &Document, change: &Change) -> FixedBitSet {
    let mut bits = document.orientation().unwrap().bits().clone();
    change
        .ranges()
        .iter()
        .for_each(|range| bits.toggle_range(range.start as usize..range.end as usize));
    bits
}

/// Does `acts`, and compares the document with Algorithm 1 and with its earlier states after each.
fn check_session(worlds: &[Setting; 2], acts: Vec<Act>) -> Result<(), TestCaseError> {
    let mut document = document_of(worlds[0].0.n_points);
    let mut installed = 0;
    document.install(propagation_in(&worlds[0]));
    // State and revisions after each edit that can be undone or redone, and which of these states holds.
    let state_of = |document: &Document| (document.state().clone(), document.revision(), document.signs_revision());
    let mut states = vec![state_of(&document)];
    let mut present = 0;
    for act in acts {
        let before = document.orientation().unwrap().bits().clone();
        let pinned: Vec<_> = (document.marks().iter().filter(|(_, mark)| mark.pinned))
            .map(|(point, _)| (point, document.oriented_normal(point)))
            .collect();
        let mut change = Change::default();
        match (edit_of(&act, &document), &act) {
            (Some(edit), _) => {
                let click = match edit {
                    Edit::TurnPatch { point, n_points } => Some(document.preview_turn_patch(point, n_points)),
                    Edit::Mend(point) => Some(document.preview_mend(point)),
                    Edit::TurnWhole(point) => Some(document.preview_turn_whole(point)),
                    _ => None,
                };
                let preview = document.preview(&edit);
                let applied = document.apply(edit.clone());
                prop_assert_eq!(&preview, &applied);
                if let Some(click) = click {
                    prop_assert_eq!(&click, &applied);
                    prop_assert!(
                        applied.as_ref().is_ok_and(|change| !change.is_empty())
                            || !pinned.is_empty()
                            || applied.is_err()
                    );
                }
                let Ok(applied) = applied else {
                    prop_assert_eq!(state_of(&document), states[present].clone());
                    continue;
                };
                change = applied;
                if !matches!(edit, Edit::Unpin(_)) {
                    for (point, normal) in pinned {
                        prop_assert_eq!(document.oriented_normal(point), normal, "a pin turned");
                    }
                }
                if let Edit::FlipPoints { points, .. } = &edit {
                    let free = points
                        .iter()
                        .filter(|&point| !document.marks().is_pinned(point))
                        .count();
                    prop_assert_eq!(change.n_points(), free as u64);
                }
                if let Edit::Pin(_)
                | Edit::Unpin(_)
                | Edit::Select(_)
                | Edit::Hide(_)
                | Edit::Accept(_)
                | Edit::SetParameters(_) = edit
                {
                    prop_assert!(change.is_empty());
                }
                if document.state() == &states[present].0 {
                    // An edit may come out as nothing, but what changes nothing is no step.
                    let step = document.next_undo().map(|step| step.change().is_empty());
                    prop_assert!(step != Some(true));
                }
                if document.revision() != states[present].1 {
                    states.truncate(present + 1);
                    prop_assert!(states.iter().all(|(_, revision, _)| *revision != document.revision()));
                    states.push(state_of(&document));
                    present += 1;
                }
            }
            (None, Act::Undo) => {
                let undone = document.undo();
                prop_assert_eq!(undone.is_some(), present > 0);
                change = undone.unwrap_or_default();
                present = present.saturating_sub(1);
            }
            (None, Act::Redo) => {
                let redone = document.redo();
                prop_assert_eq!(redone.is_some(), present + 1 < states.len());
                change = redone.unwrap_or_default();
                present = (present + 1).min(states.len() - 1);
            }
            (None, _) => {
                installed = 1 - installed;
                let wanted = document.parameters();
                document.install(Propagation {
                    parameters: wanted,
                    ..propagation_in(&worlds[installed])
                });
            }
        }
        if !matches!(act, Act::Install) {
            prop_assert_eq!(turned(&document, &change), before);
        }
        prop_assert_eq!(&state_of(&document), &states[present]);
        prop_assert_eq!(document.next_undo().is_some(), present > 0);
        prop_assert_eq!(
            (document.n_done(), document.steps().count()),
            (present, states.len() - 1)
        );
        prop_assert_eq!(document.next_redo().is_some(), present + 1 < states.len());
        prop_assert_eq!(
            document.orientation().unwrap().bits(),
            &expect(&document, &worlds[installed].0)
        );
        for (point, mark) in document.marks().iter() {
            let shown = document.oriented_normal(point).unwrap();
            prop_assert!(!mark.turns(shown) || mark.normal.dot(shown) == 0.0);
        }
        for source in document
            .sources()
            .iter()
            .filter(|source| document.marks().get(source.point).is_none())
        {
            let shown = document.oriented_normal(source.point).unwrap();
            prop_assert!(!source.turns(shown) || source.normal.dot(shown) == 0.0);
        }
        check_recorded(&document, &worlds[installed])?;
    }
    Ok(())
}

/// The recorded steps make the same state and signs again on another document.
fn check_recorded(document: &Document, world: &Setting) -> Result<(), TestCaseError> {
    let mut again = document_of(world.0.n_points);
    for step in document.steps().take(document.n_done()) {
        again
            .apply_recorded(step.kind(), step.change().clone(), step.n_turned())
            .unwrap();
    }
    again.install(Propagation {
        parameters: again.parameters(),
        ..propagation_in(world)
    });
    prop_assert_eq!(again.state(), document.state());
    prop_assert_eq!(again.orientation(), document.orientation());
    let mut state = document.state_before_steps();
    prop_assert_eq!(&state, &State::default());
    state.change(&StateChange::between(&state, document.state()));
    prop_assert_eq!(&state, document.state());
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn any_session_is_algorithm_1_and_undo_restores_the_state((worlds, acts) in sessions(40)) {
        check_session(&worlds, acts)?;
    }

    #[test]
    fn undoing_all_restores_every_bit_and_redoing_all_too((worlds, acts) in sessions(40)) {
        let mut document = document_of(worlds[0].0.n_points);
        document.install(propagation_in(&worlds[0]));
        let mut bits = vec![document.orientation().unwrap().clone()];
        for act in acts {
            if let Some(edit) = edit_of(&act, &document) {
                let revision = document.revision();
                // A patch may be refused; then nothing changes.
                drop(document.apply(edit));
                if document.revision() != revision {
                    bits.push(document.orientation().unwrap().clone());
                }
            }
        }
        for expect in bits.iter().rev().skip(1) {
            prop_assert!(document.undo().is_some());
            prop_assert_eq!(document.orientation().unwrap(), expect);
        }
        prop_assert!(document.undo().is_none());
        for expect in bits.iter().skip(1) {
            prop_assert!(document.redo().is_some());
            prop_assert_eq!(document.orientation().unwrap(), expect);
        }
        prop_assert!(document.redo().is_none());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20))]

    #[test]
    fn so_are_long_sessions((worlds, acts) in sessions(1000)) {
        check_session(&worlds, acts)?;
    }
}

/// Five points in a row, all normals up, ready to be mended.
fn row() -> Document {
    let edges: Vec<_> = (0..4).map(|a| (a, a + 1, 0.1, false)).collect();
    let world = World::without_cuts(5, edges);
    let mut document = document_of(5);
    // Without default sources, as where signs start as given: a first mend turns the whole region.
    document.install(Propagation {
        default_sources: Vec::new(),
        ..propagation_of(&world, &[Vec3::Z; 5])
    });
    document
}

#[test]
fn the_first_mend_vouches_for_the_default_source_too() {
    let edges = vec![
        (0, 1, 0.1, false),
        (1, 2, 0.2, false),
        (2, 3, 0.9, false),
        (3, 4, 0.3, false),
    ];
    let world = World::without_cuts(5, edges);
    let mut document = document_of(5);
    document.install(Propagation {
        default_sources: vec![0],
        ..propagation_of(&world, &[Vec3::Z; 5])
    });
    let change = document.apply(Edit::Mend(4)).unwrap();
    assert_eq!(change.n_points(), 2);
    let (up, down) = (Vec3::Z, -Vec3::Z);
    assert_eq!(document.oriented_normals().unwrap(), [up, up, up, down, down]);
    let default = Source {
        origin: Origin::Default,
        ..source(0, up)
    };
    assert_eq!(
        document.sources().iter().collect::<Vec<_>>(),
        [&default, &source(4, down)]
    );
    assert!(!document.is_flipped(&default));
    assert!(document.is_flipped(&source(4, down)));
    assert!(!document.is_flipped(&source(5, down)));
    // Who mends the default source itself says that all is wrong.
    document.undo();
    assert!(document.sources().is_empty());
    assert_eq!(document.apply(Edit::Mend(0)).unwrap().n_points(), 5);
}

#[test]
fn a_whole_region_turns_with_its_source() {
    let mut document = row();
    assert_eq!(document.apply(Edit::TurnWhole(1)).unwrap().n_points(), 5);
    assert_eq!(document.sources().iter().collect::<Vec<_>>(), [&source(1, -Vec3::Z)]);
    assert_eq!(document.apply(Edit::TurnWhole(3)).unwrap().n_points(), 5);
    assert_eq!(document.sources().iter().collect::<Vec<_>>(), [&source(1, Vec3::Z)]);
}

#[test]
fn a_mended_point_is_a_source_of_the_opposite_direction() {
    let mut document = row();
    assert_eq!(document.apply(Edit::Mend(1)).unwrap().n_points(), 5);
    assert_eq!(document.sources().get(1), Some(&source(1, -Vec3::Z)));
    assert_eq!(document.oriented_normals().unwrap(), [-Vec3::Z; 5]);
    document.apply(Edit::Mend(1)).unwrap();
    assert_eq!(document.sources().iter().collect::<Vec<_>>(), [&source(1, Vec3::Z)]);
    assert_eq!(document.oriented_normal(4), Some(Vec3::Z));
    assert_eq!(document.oriented_normal(5), None);
}

#[test]
fn a_failed_edit_changes_nothing() {
    let no_such_point = EditError::NoSuchPoint { point: 5, n_points: 5 };
    check(Edit::Mend(5), no_such_point.clone());
    check(
        Edit::AddSources(vec![source(0, Vec3::X), source(5, Vec3::Z)]),
        no_such_point.clone(),
    );
    check(
        Edit::AddSources(vec![source(0, Vec3::X), source(1, Vec3::ZERO)]),
        EditError::NoDirection { point: 1 },
    );
    check(
        Edit::AddSources(vec![source(2, Vec3::NAN)]),
        EditError::NoDirection { point: 2 },
    );
    check(Edit::RemoveSources(vec![3, 2]), EditError::NotASource { point: 2 });
    check(Edit::RemoveSources(vec![3, 5]), no_such_point.clone());
    check(Edit::FlipSources(vec![3, 0]), EditError::NotASource { point: 0 });
    check(
        Edit::FlipSources(vec![3, u32::MAX]),
        EditError::NoSuchPoint {
            point: u32::MAX,
            n_points: 5,
        },
    );

    fn check(edit: Edit, expect: EditError) {
        let mut document = row();
        document.apply(Edit::Mend(3)).unwrap();
        document.apply(Edit::Mend(4)).unwrap();
        document.undo();
        let state = |document: &Document| {
            let edits = [document.next_undo(), document.next_redo()].map(|step| step.map(Step::kind));
            (
                document.sources().clone(),
                document.revision(),
                edits,
                document.orientation().cloned(),
            )
        };
        let before = state(&document);
        assert_eq!(document.apply(edit), Err(expect));
        assert_eq!(state(&document), before);
    }
}

#[test]
fn an_edit_that_changes_no_source_is_not_remembered() {
    let mut document = row();
    document.apply(Edit::Mend(1)).unwrap();
    document.apply(Edit::Mend(3)).unwrap();
    document.undo();
    let revision = document.revision();
    for edit in [
        Edit::AddSources(vec![source(1, -Vec3::Z)]),
        Edit::AddSources(vec![source(1, Vec3::X), source(1, -Vec3::Z)]),
        Edit::AddSources(Vec::new()),
        Edit::RemoveSources(Vec::new()),
        Edit::FlipSources(Vec::new()),
    ] {
        assert!(document.apply(edit).unwrap().is_empty());
    }
    assert_eq!(
        (
            document.next_undo().map(Step::kind),
            document.next_redo().map(Step::kind)
        ),
        ([EditKind::Mend; 2].map(Some)).into()
    );
    assert_eq!(document.revision(), revision);
}

#[test]
fn points_that_stand_in_a_list_twice_count_once() {
    let mut document = row();
    document
        .apply(Edit::AddSources(vec![source(1, Vec3::Z), source(1, -Vec3::Z)]))
        .unwrap();
    assert_eq!(document.sources().get(1), Some(&source(1, -Vec3::Z)));
    document.apply(Edit::FlipSources(vec![1, 1])).unwrap();
    assert_eq!(document.sources().get(1), Some(&source(1, Vec3::Z)));
    document.apply(Edit::RemoveSources(vec![1, 1])).unwrap();
    assert!(document.sources().is_empty());
}

#[test]
fn before_the_first_propagation_sources_wait() {
    let mut document = document_of(5);
    assert_eq!(document.apply(Edit::Mend(1)), Err(EditError::NotReady));
    assert_eq!(document.preview_mend(1), Err(EditError::NotReady));
    assert_eq!(document.oriented_normals(), None);
    assert!(
        document
            .apply(Edit::AddSources(vec![source(2, -Vec3::Z)]))
            .unwrap()
            .is_empty()
    );
    document.install(row().propagation().unwrap().clone());
    assert_eq!(document.oriented_normal(0), Some(-Vec3::Z));
    assert_eq!(document.undo().unwrap().n_points(), 5);
}

#[test]
fn a_source_keeps_its_direction_when_stored_normals_change() {
    let mut document = row();
    document.apply(Edit::Mend(1)).unwrap();
    document.apply(Edit::Mend(4)).unwrap();
    let mut other = row().propagation().unwrap().clone();
    other.normals = Arc::new(vec![-Vec3::Z; 5]);
    document.install(other);
    assert_eq!(document.oriented_normal(1), Some(-Vec3::Z));
    assert_eq!(document.oriented_normal(4), Some(Vec3::Z));
    document.undo();
    assert_eq!(document.oriented_normals().unwrap(), [-Vec3::Z; 5]);
}

#[test]
fn the_history_forgets_the_oldest_edits_first() {
    let mut document = row();
    document.apply(Edit::Mend(0)).unwrap();
    document.apply(Edit::Mend(1)).unwrap();
    document.set_history_bytes(0);
    document.apply(Edit::Mend(2)).unwrap();
    let kept = document.revision();
    assert!(document.undo().is_some());
    assert!(document.undo().is_none());
    assert_eq!(document.sources().len(), 2);
    assert!(document.redo().is_some());
    assert_eq!(document.revision(), kept);
}
