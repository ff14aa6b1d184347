use proptest::prelude::*;

use super::literal::World;
use super::*;

/// What `regions` say, by point: whether the stored normal is turned, and the source that says so.
fn say(regions: &Regions) -> Vec<(bool, Option<u32>)> {
    (0..regions.tree.n_points() as u32)
        .map(|point| {
            (
                regions.orientation().is_turned(regions.tree.position(point)),
                regions.source_of(point),
            )
        })
        .collect()
}

/// The change between two orientations.
fn difference(before: &Orientation, after: &Orientation) -> Change {
    let turned: Vec<_> = before
        .bits()
        .symmetric_difference(after.bits())
        .map(|position| position as u32..position as u32 + 1)
        .collect();
    Change::from_flips(&turned)
}

fn regions_of(world: &World) -> Regions {
    Regions::new(
        Arc::clone(&world.tree),
        world.initial_cuts.clone(),
        world.initially_turned.clone(),
    )
}

/// As [`Regions::set`] takes it.
type Batch = Vec<(u32, Option<bool>)>;

/// A world and edits of its sources.
fn worlds_and_batches() -> impl Strategy<Value = (World, Vec<Batch>)> {
    (1_usize..40).prop_flat_map(|n_points| {
        let edit = (
            0..n_points as u32,
            prop_oneof![3 => any::<bool>().prop_map(Some), 2 => Just(None)],
        );
        let batches = prop_oneof![
            prop::collection::vec(prop::collection::vec(edit.clone(), 1), 0..30),
            prop::collection::vec(prop::collection::vec(edit, 0..30), 0..6),
        ];
        (World::any(n_points), batches)
    })
}

/// A patch of any points as positions.
fn positions_of(patch: &FixedBitSet, tree: &SpanningTree) -> Change {
    let positions: Vec<_> = patch
        .ones()
        .map(|point| tree.position(point as u32))
        .map(|position| position..position + 1)
        .collect();
    Change::from_flips(&positions)
}

/// A world, and edits of its sources that each come with a patch to turn.
fn worlds_and_turns() -> impl Strategy<Value = (World, Vec<(Batch, FixedBitSet)>)> {
    worlds_and_batches().prop_flat_map(|(world, batches)| {
        let n_points = world.n_points;
        let patch = prop_oneof![
            1 => Just(vec![false; n_points]),
            2 => prop::collection::vec(any::<bool>(), n_points),
        ];
        let patch = patch.prop_map(|bits| {
            bits.iter()
                .enumerate()
                .filter(|(_, bit)| **bit)
                .map(|(i, _)| i)
                .collect()
        });
        let patches: Vec<_> = batches.iter().map(|_| patch.clone()).collect();
        let turns = patches.prop_map(move |patches| batches.iter().cloned().zip(patches).collect());
        (Just(world), turns)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn turned_patches_change_what_edges_say_and_nothing_else((world, turns) in worlds_and_turns()) {
        let mut regions = regions_of(&world);
        let mut sources = BTreeMap::new();
        let mut turned = FixedBitSet::with_capacity(world.n_points);
        for (batch, patch) in turns {
            let before = regions.orientation().clone();
            let change = regions.set_and_turn(batch.iter().copied(), &positions_of(&patch, &world.tree));
            prop_assert_eq!(change, difference(&before, regions.orientation()));
            for (&point, turned) in &mut sources {
                *turned ^= patch.contains(point as usize);
            }
            for (point, turned) in batch {
                match turned {
                    Some(turned) => sources.insert(point, turned),
                    None => sources.remove(&point),
                };
            }
            turned.symmetric_difference_with(&patch);
            let expect = world.with_turned(&turned).expect(&sources);
            prop_assert_eq!(&say(&regions), &expect);

            let mut at_once = regions_of(&world);
            let all = sources.iter().map(|(&point, &turned)| (point, Some(turned)));
            at_once.set_and_turn(all, &positions_of(&turned, &world.tree));
            prop_assert_eq!(&say(&at_once), &expect);
        }
        // All taken back, nothing is left of it.
        let all: Vec<_> = sources.keys().map(|&point| (point, None)).collect();
        regions.set_and_turn(all, &positions_of(&turned, &world.tree));
        prop_assert_eq!(say(&regions), say(&regions_of(&world)));
    }

    #[test]
    fn batches_are_the_same_as_one_by_one_as_at_once_and_as_algorithm_1((world, batches) in worlds_and_batches()) {
        let mut batched = regions_of(&world);
        let mut one_by_one = batched.clone();
        let mut sources = BTreeMap::new();
        prop_assert_eq!(say(&batched), world.expect(&sources));
        for batch in batches {
            let before = batched.orientation().clone();
            let change = batched.set(batch.iter().copied());
            prop_assert_eq!(change, difference(&before, batched.orientation()));
            for (point, turned) in batch {
                let before = one_by_one.orientation().clone();
                let change = match turned {
                    Some(turned) => one_by_one.add(point, turned),
                    None => one_by_one.remove(point),
                };
                prop_assert_eq!(change, difference(&before, one_by_one.orientation()));
                match turned {
                    Some(turned) => sources.insert(point, turned),
                    None => sources.remove(&point),
                };
            }
            let expect = world.expect(&sources);
            prop_assert_eq!(&say(&batched), &expect);
            prop_assert_eq!(&say(&one_by_one), &expect);
            prop_assert_eq!(batched.n_sources(), sources.len());

            let mut at_once = regions_of(&world);
            at_once.set(sources.iter().map(|(&point, &turned)| (point, Some(turned))));
            prop_assert_eq!(&say(&at_once), &expect);
        }
    }

    #[test]
    fn preview_is_what_adding_turns((world, batches) in worlds_and_batches()) {
        let mut regions = regions_of(&world);
        for batch in batches {
            regions.set(batch);
            for point in 0..world.n_points as u32 {
                let turned = regions.orientation().is_turned(world.tree.position(point));
                let preview = regions.preview(point);
                let mut clicked = regions.clone();
                prop_assert_eq!(&clicked.add(point, !turned), &preview);
                prop_assert!(preview.n_points() > 0);
            }
        }
    }

    #[test]
    fn removing_in_any_order_leads_back((world, batches) in worlds_and_batches()) {
        let mut regions = regions_of(&world);
        let start = say(&regions);
        batches.into_iter().for_each(|batch| drop(regions.set(batch)));
        regions.set((0..world.n_points as u32).map(|point| (point, None)));
        prop_assert_eq!(say(&regions), start);
        prop_assert_eq!(regions.n_sources(), 0);
    }
}

/// A path 0 – 1 – … with the given weights of its edges, all normals agreeing.
fn path(weights: &[f32]) -> Regions {
    let edges: Vec<_> = weights
        .iter()
        .zip(0_u32..)
        .map(|(&weight, a)| (a, a + 1, weight, false))
        .collect();
    regions_of(&World::without_cuts(weights.len() + 1, edges))
}

#[test]
fn a_region_without_a_source_flips_whole_and_one_with_a_source_splits_at_the_heaviest_edge() {
    let mut regions = path(&[0.1, 0.3, 0.2]);
    assert_eq!(regions.add(0, true).n_points(), 4);
    assert_eq!(regions.add(3, false).n_points(), 2);
    assert_eq!(
        say(&regions),
        [(true, Some(0)), (true, Some(0)), (false, Some(3)), (false, Some(3))]
    );
    assert_eq!(regions.remove(0).n_points(), 2);
    assert_eq!(say(&regions), [(false, Some(3)); 4]);
    assert!(regions.remove(0).is_empty(), "there is no source any more");
    assert!(regions.remove(3).is_empty(), "the default is not turned either");
}

#[test]
fn of_equal_edges_the_one_with_the_larger_ids_is_cut() {
    let mut regions = path(&[0.5, 0.5, 0.5]);
    regions.add(0, true);
    assert_eq!(regions.add(3, false).n_points(), 1);
    assert_eq!(regions.preview(1).n_points(), 2);
}

#[test]
fn no_points_have_no_regions() {
    let regions = regions_of(&World::without_cuts(0, Vec::new()));
    assert_eq!(regions.orientation().n_points(), 0);
}
