//! Whole components, with cuts, sources and votes in them.

use std::collections::BTreeMap;

use glam::DVec3;
use proptest::prelude::*;
use proptest::sample::Index;

use super::*;
use crate::SideRule;
use crate::patches::Level;
use crate::regions::literal::World;

/// A document whose normals all point up as they are stored. With one patch a component, where `has_patches`.
fn document(world: &World, voted: &BTreeMap<u32, bool>) -> Document {
    let voted: Vec<Source> = (voted.iter())
        .map(|(&point, &turned)| Source {
            point,
            normal: if turned { Vec3::NEG_Z } else { Vec3::Z },
            origin: Origin::Voted,
            patch: None,
        })
        .collect();
    let tree = &world.tree;
    let mut base_regions = Regions::new(
        Arc::clone(tree),
        world.initial_cuts.clone(),
        world.initially_turned.clone(),
    );
    base_regions.set((voted.iter()).map(|source| (source.point, Some(source.normal.z < 0.0))));
    let pairs: Vec<u32> = (0..world.n_points as u32).map(|position| position / 2).collect();
    let is_pair = |pair: &[u32]| tree.parent(pair[1]) == Some(pair[0]);
    let positions: Vec<u32> = (0..world.n_points as u32).collect();
    // Pairs of parent and child in preorder are patches, where all positions pair up like that.
    let has_pairs = world.n_points.is_multiple_of(2) && positions.chunks(2).all(is_pair);
    let of_point: Vec<u32> = (0..world.n_points as u32)
        .map(|point| pairs[tree.position(point) as usize])
        .collect();
    let strengths = [vec![0.9; world.n_points], vec![0.5; world.n_points / 2]];
    let levels = [
        Level {
            parents: &of_point,
            strengths: &strengths[0],
        },
        Level {
            parents: &[],
            strengths: &strengths[1],
        },
    ];
    let positions = (0..world.n_points).map(|point| Vec3::X * point as f32).collect();
    let mut document = Document::new(Arc::new(PointCloud::new(DVec3::ZERO, positions).unwrap()), None);
    document.install(Propagation {
        parameters: Parameters::default(),
        normals: Arc::new(vec![Vec3::Z; world.n_points]),
        splat_radii: Arc::new(vec![1.0; world.n_points]),
        tree: Arc::clone(tree),
        base_regions,
        default_sources: (tree.roots().iter()).map(|&root| tree.order()[root as usize]).collect(),
        votes: None,
        viewpoints: Arc::default(),
        voted_sources: Arc::new(voted),
        sides: Vec::new(),
        patches: has_pairs.then(|| Arc::new(crate::Patches::new(tree, &levels))),
        evidence: None,
        found_station: None,
        stations: Arc::default(),
        has_track: false,
        seconds: Vec::new(),
    });
    document
}

#[derive(Clone, Debug)]
enum Act {
    Mend(u32),
    TurnPatch(u32),
    Flip(u32),
}

fn settings() -> impl Strategy<Value = (World, BTreeMap<u32, bool>, Vec<Act>, Index)> {
    (1_usize..20).prop_flat_map(|n_points| {
        let points = 0..n_points as u32;
        let act = prop_oneof![
            points.clone().prop_map(Act::Mend),
            points.clone().prop_map(Act::TurnPatch),
            points.clone().prop_map(Act::Flip),
        ];
        let voted = prop::collection::btree_map(points, any::<bool>(), 0..4);
        let acts = prop::collection::vec(act, 0..8);
        (World::any(n_points), voted, acts, any::<Index>())
    })
}

fn component_of(document: &Document, index: &Index) -> usize {
    index.index(document.propagation().unwrap().tree.roots().len())
}

fn points_of(document: &Document, component: usize) -> PointSet {
    let tree = &document.propagation().unwrap().tree;
    let positions = tree.subtree(tree.roots()[component]);
    positions.map(|position| tree.order()[position as usize]).collect()
}

fn perform(document: &mut Document, acts: &[Act]) {
    for act in acts {
        let edit = match *act {
            Act::Mend(point) => Edit::Mend(point),
            Act::TurnPatch(point) => Edit::TurnPatch { point, n_points: 2 },
            Act::Flip(point) => Edit::FlipPoints {
                points: [point].into_iter().collect(),
                reason: FlipReason::Asked,
            },
        };
        // Some are refused, which is for others to test.
        drop(document.apply(edit));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn a_component_turns_exactly((world, voted, acts, index) in settings()) {
        let mut document = document(&world, &voted);
        perform(&mut document, &acts);
        let component = component_of(&document, &index);
        let before = document.oriented_normals().unwrap();
        let edit = document.turn_component_edit(component).unwrap().unwrap();
        document.apply(edit).unwrap();
        let after = document.oriented_normals().unwrap();
        let points = points_of(&document, component);
        for point in 0..world.n_points {
            let turned = before[point] != after[point];
            prop_assert_eq!(turned, points.contains(point as u32), "point {}", point);
        }
        document.undo().unwrap();
        prop_assert_eq!(document.oriented_normals().unwrap(), before);
    }

    #[test]
    fn a_rule_turns_what_it_must_and_leaves_its_source((world, voted, acts, index) in settings(), turned: bool) {
        let mut document = document(&world, &voted);
        perform(&mut document, &acts);
        let component = component_of(&document, &index);
        let side = ComponentSide { component, rule: SideRule::Up, turned };
        let before = document.oriented_normals().unwrap();
        // Asked twice, the source is the same.
        for is_turned in [turned, false] {
            let edit = document.show_sides(&[ComponentSide { turned: is_turned, ..side }]).unwrap().unwrap();
            prop_assert_eq!(edit.kind(), EditKind::Rule);
            document.apply(edit).unwrap();
            let after = document.oriented_normals().unwrap();
            let points = points_of(&document, component);
            for point in 0..world.n_points {
                prop_assert_eq!(before[point] != after[point], turned && points.contains(point as u32));
            }
            let of_rule = document.sources().iter().filter(|source| source.origin == Origin::Rule(SideRule::Up));
            prop_assert_eq!(of_rule.count(), 1);
        }
    }
}

#[test]
fn what_was_flipped_alone_is_known() {
    let edges = (0..3).map(|a| (a, a + 1, 0.1, false)).collect();
    let mut document = document(&World::without_cuts(4, edges), &BTreeMap::new());
    let points = |points: &[u32]| points.iter().copied().collect::<PointSet>();
    let reason = FlipReason::Asked;
    document
        .apply(Edit::FlipPoints {
            points: points(&[1, 2]),
            reason,
        })
        .unwrap();
    document.apply(Edit::Pin(points(&[2, 3]))).unwrap();
    assert_eq!(document.flipped_alone(), points(&[1]));
    document
        .apply(Edit::FlipPoints {
            points: document.flipped_alone(),
            reason,
        })
        .unwrap();
    assert!(document.flipped_alone().is_empty());
    assert_eq!(document.marks().len(), 2);
}
