//! Sources of the document on top of voted ones.

use std::collections::BTreeMap;

use glam::DVec3;
use proptest::prelude::*;

use super::*;
use crate::regions::literal::World;

type Signs = BTreeMap<u32, bool>;

/// A propagation of upward normals whose voted sources turn their points or not.
fn propagation(world: &World, voted: &Signs) -> Propagation {
    let source = |(&point, &turned): (&u32, &bool)| Source {
        point,
        normal: if turned { Vec3::NEG_Z } else { Vec3::Z },
        origin: Origin::Voted,
        patch: None,
    };
    let mut base_regions = Regions::new(
        Arc::clone(&world.tree),
        world.initial_cuts.clone(),
        world.initially_turned.clone(),
    );
    base_regions.set(voted.iter().map(|(&point, &turned)| (point, Some(turned))));
    Propagation {
        parameters: Parameters::default(),
        normals: Arc::new(vec![Vec3::Z; world.n_points]),
        splat_radii: Arc::new(vec![1.0; world.n_points]),
        tree: Arc::clone(&world.tree),
        base_regions,
        default_sources: world
            .tree
            .roots()
            .iter()
            .map(|&root| world.tree.order()[root as usize])
            .collect(),
        votes: None,
        viewpoints: Arc::default(),
        voted_sources: Arc::new(voted.iter().map(source).collect()),
        sides: Vec::new(),
        patches: None,
        evidence: None,
        found_station: None,
        stations: Arc::default(),
        has_track: false,
        seconds: Vec::new(),
    }
}

fn document(world: &World, voted: &Signs) -> Document {
    let positions = (0..world.n_points).map(|point| Vec3::X * point as f32).collect();
    let mut document = Document::new(Arc::new(PointCloud::new(DVec3::ZERO, positions).unwrap()), None);
    document.install(propagation(world, voted));
    document
}

/// The signs of Algorithm 1 with the voted sources, except where the document has its own.
fn check(document: &Document, world: &World, voted: &Signs) {
    let mut all = voted.clone();
    all.extend(
        document
            .sources()
            .iter()
            .map(|source| (source.point, source.normal.z < 0.0)),
    );
    for (point, (turned, _)) in (0..).zip(world.expect(&all)) {
        let shown = document.oriented_normal(point).unwrap();
        assert_eq!(shown.z < 0.0, turned, "point {point} of {all:?}");
    }
}

#[derive(Clone, Debug)]
enum Act {
    Mend(u32),
    TurnWhole(u32),
    Remove(prop::sample::Index),
    Undo,
    Redo,
}

fn worlds() -> impl Strategy<Value = (World, Signs, Vec<Act>)> {
    (1_usize..20).prop_flat_map(|n_points| {
        let points = 0..n_points as u32;
        let act = prop_oneof![
            3 => points.clone().prop_map(Act::Mend),
            2 => points.clone().prop_map(Act::TurnWhole),
            2 => any::<prop::sample::Index>().prop_map(Act::Remove),
            1 => Just(Act::Undo),
            1 => Just(Act::Redo),
        ];
        let voted = prop::collection::btree_map(points, any::<bool>(), 0..6);
        (World::any(n_points), voted, prop::collection::vec(act, 0..20))
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(500))]

    #[test]
    fn the_documents_sources_overrule_voted_ones((world, voted, acts) in worlds()) {
        let mut document = document(&world, &voted);
        check(&document, &world, &voted);
        let start = document.orientation().unwrap().clone();
        for act in acts {
            let edit = match act {
                Act::Mend(point) => Some(Edit::Mend(point)),
                Act::TurnWhole(point) => Some(Edit::TurnWhole(point)),
                Act::Remove(index) => {
                    let points: Vec<u32> = document.sources().iter().map(|source| source.point).collect();
                    (!points.is_empty()).then(|| Edit::RemoveSources(vec![*index.get(&points)]))
                }
                Act::Undo => {
                    document.undo();
                    None
                }
                Act::Redo => {
                    document.redo();
                    None
                }
            };
            if let Some(edit) = edit {
                let preview = match &edit {
                    Edit::Mend(point) => Some(document.preview_mend(*point).unwrap()),
                    Edit::TurnWhole(point) => Some(document.preview_turn_whole(*point).unwrap()),
                    _ => None,
                };
                let change = document.apply(edit).unwrap();
                prop_assert_eq!(preview.unwrap_or_else(|| change.clone()), change);
            }
            check(&document, &world, &voted);
        }
        while document.undo().is_some() {}
        prop_assert_eq!(document.orientation().unwrap(), &start);
    }
}

#[test]
fn a_click_in_a_voted_region_mends_a_part_of_it() {
    // Six points in a row, the heaviest edge between 2 and 3; point 0 is voted for.
    let weights = [0.1, 0.2, 0.9, 0.3, 0.1];
    let edges = (0..5).map(|a| (a, a + 1, weights[a as usize], false)).collect();
    let world = World::without_cuts(6, edges);
    let voted = Signs::from([(0, false)]);
    let mut document = document(&world, &voted);
    let change = document.apply(Edit::Mend(4)).unwrap();
    assert_eq!(document.sources().len(), 1);
    let turned = |document: &Document, point| document.oriented_normal(point).unwrap().z < 0.0;
    assert_eq!(
        [0, 1, 2, 3, 4, 5].map(|point| turned(&document, point)),
        [false, false, false, true, true, true]
    );
    assert_eq!(change.n_points(), 3);

    // All of a voted region turns by a source at the voted point; without it the vote holds again.
    document.apply(Edit::TurnWhole(1)).unwrap();
    let own = *document.sources().get(0).unwrap();
    assert_eq!((own.origin, document.is_flipped(&own)), (Origin::Picked, true));
    assert!(turned(&document, 2) && turned(&document, 3));
    document.apply(Edit::RemoveSources(vec![0])).unwrap();
    assert!(!turned(&document, 2) && turned(&document, 3));
}
