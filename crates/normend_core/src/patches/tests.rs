//! Patches against sets of points by brute force; random hierarchies over small random trees.

use std::sync::Arc;

use fixedbitset::FixedBitSet;
use proptest::prelude::*;
use proptest::sample::Index;

use super::*;
use crate::regions::literal::World;

/// Levels with their own arrays.
pub(crate) type OwnLevels = Vec<(Vec<u32>, Vec<f32>)>;

pub(crate) fn borrowed(levels: &OwnLevels) -> Vec<Level<'_>> {
    levels
        .iter()
        .map(|(parents, strengths)| Level { parents, strengths })
        .collect()
}

/// Random levels over the tree of `world`: at each, some of the edges that are left are merged over.
fn levels(tree: &SpanningTree, merges: &[Vec<Index>], strengths: &[i8]) -> OwnLevels {
    let n_points = tree.n_points();
    let mut strengths = strengths.iter().cycle().map(|&strength| f32::from(strength) / 4.0);
    let mut some = |n: usize| -> Vec<f32> { strengths.by_ref().take(n).collect() };
    let mut cluster_of: Vec<u32> = (0..n_points as u32).collect();
    let mut levels = vec![(Vec::new(), some(n_points))];
    let edges: Vec<(u32, u32)> = (0..n_points as u32)
        .filter_map(|position| Some((position, tree.parent(position)?)))
        .map(|(a, b)| (tree.order()[a as usize], tree.order()[b as usize]))
        .collect();
    for merged in merges {
        let n_clusters = levels[levels.len() - 1].1.len();
        let mut labels: Vec<u32> = (0..n_clusters as u32).collect();
        for index in merged.iter().filter(|_| !edges.is_empty()) {
            let (a, b) = edges[index.index(edges.len())];
            let (a, b) = (
                labels[cluster_of[a as usize] as usize],
                labels[cluster_of[b as usize] as usize],
            );
            labels
                .iter_mut()
                .filter(|label| **label == b)
                .for_each(|label| *label = a);
        }
        let mut names = labels.clone();
        names.sort_unstable();
        names.dedup();
        let parents: Vec<u32> = labels
            .iter()
            .map(|label| names.binary_search(label).unwrap() as u32)
            .collect();
        cluster_of
            .iter_mut()
            .for_each(|cluster| *cluster = parents[*cluster as usize]);
        let last = levels.len() - 1;
        levels[last].0 = parents;
        levels.push((Vec::new(), some(names.len())));
    }
    levels
}

/// The nested sets around each point by brute force: points, strength of the first level with these points.
fn expect(tree: &SpanningTree, levels: &OwnLevels, point: u32) -> Vec<(FixedBitSet, f32)> {
    let n_points = tree.n_points();
    let mut cluster_of: Vec<u32> = (0..n_points as u32).collect();
    let mut sets: Vec<(FixedBitSet, f32)> = Vec::new();
    let mut add = |set: FixedBitSet, strength: f32| {
        if sets.last().is_none_or(|(last, _)| *last != set) {
            sets.push((set, strength));
        }
    };
    for (level, (parents, strengths)) in levels.iter().enumerate() {
        let cluster = cluster_of[point as usize];
        let set = (0..n_points).filter(|&other| cluster_of[other] == cluster);
        let mut bits = FixedBitSet::with_capacity(n_points);
        bits.extend(set);
        add(bits, strengths[cluster as usize]);
        if level + 1 < levels.len() {
            cluster_of
                .iter_mut()
                .for_each(|cluster| *cluster = parents[*cluster as usize]);
        }
    }
    let position = tree.position(point);
    let root = tree.roots()[tree.roots().partition_point(|&root| root <= position) - 1];
    let mut component = FixedBitSet::with_capacity(n_points);
    component.extend(
        tree.subtree(root)
            .map(|position| tree.order()[position as usize] as usize),
    );
    add(component, 1.0);
    sets
}

fn points_of(change: &Change, tree: &SpanningTree) -> FixedBitSet {
    let mut points = FixedBitSet::with_capacity(tree.n_points());
    let positions = change.ranges().iter().flat_map(Clone::clone);
    points.extend(positions.map(|position| tree.order()[position as usize] as usize));
    points
}

/// Random levels over `tree`.
pub(crate) fn any_levels(tree: Arc<SpanningTree>) -> impl Strategy<Value = OwnLevels> {
    let merges = prop::collection::vec(prop::collection::vec(any::<Index>(), 0..8), 0..8);
    let strengths = prop::collection::vec(-4_i8..=4, 1..50);
    (merges, strengths).prop_map(move |(merges, strengths)| levels(&tree, &merges, &strengths))
}

fn worlds() -> impl Strategy<Value = (World, OwnLevels)> {
    (1_usize..30).prop_flat_map(|n_points| {
        World::any(n_points).prop_flat_map(|world| {
            let levels = any_levels(Arc::clone(&world.tree));
            (Just(world), levels)
        })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn patches_are_the_clusters((world, levels) in worlds()) {
        let tree = &world.tree;
        let patches = Patches::new(tree, &borrowed(&levels));
        for point in 0..world.n_points as u32 {
            let around: Vec<Patch> = patches.around(point).collect();
            let expect = expect(tree, &levels, point);
            prop_assert_eq!(around.len(), expect.len());
            for (patch, (points, strength)) in around.iter().zip(&expect) {
                prop_assert_eq!(&points_of(&patches.positions(*patch, tree), tree), points);
                prop_assert!((patch.strength() - strength).abs() <= STRENGTH_UNIT);
                prop_assert_eq!(patch.n_points as usize, points.count_ones(..));
                let leaves = (0..world.n_points).filter(|&other| patch.leaves().contains(&patches.leaf(other as u32)));
                prop_assert!(leaves.eq(points.ones()));
            }
            for n_points in 0..world.n_points as u32 + 2 {
                let found = around.iter().find(|patch| patch.n_points >= n_points).or(around.last());
                prop_assert_eq!(Some(&patches.find(point, n_points)), found);
            }
        }
    }

    #[test]
    fn the_offer_is_the_weakest_and_its_neighbors(
        (world, levels) in worlds(),
        vouched in prop::collection::vec(any::<Index>(), 0..3),
    ) {
        let patches = Patches::new(&world.tree, &borrowed(&levels));
        let vouched: Vec<u32> = vouched.iter().map(|index| patches.leaf(index.index(world.n_points) as u32)).collect();
        let may_turn = |patch: Patch| !vouched.iter().any(|leaf| patch.leaves().contains(leaf));
        for point in 0..world.n_points as u32 {
            let around: Vec<Patch> = patches.around(point).collect();
            let n_component = around[around.len() - 1].n_points;
            let allowed: Vec<Patch> = around.into_iter().filter(|patch| may_turn(*patch)).collect();
            let offer = patches.offer(point, may_turn);
            prop_assert_eq!(offer.is_some(), !allowed.is_empty());
            let Some(offer) = offer else { continue };
            prop_assert!(offer.patches.iter().all(|patch| allowed.contains(patch)));
            prop_assert!(offer.patches.windows(2).all(|pair| grows(&pair[0], &pair[1])));
            let default = offer.patches[offer.default];
            if n_component > 1 {
                prop_assert!(2 * default.n_points <= n_component);
            }
            // No other part is weaker for its size, and no equal one smaller.
            for patch in allowed.iter().filter(|patch| 2 * patch.n_points <= n_component) {
                prop_assert!(default.doubt() < patch.doubt() || (default.doubt() == patch.doubt() && default.n_points <= patch.n_points));
            }
            // Every allowed patch is less than a step away from an offered one.
            for patch in &allowed {
                prop_assert!(offer.patches.iter().any(|offered| !grows(offered, patch) && !grows(patch, offered)));
            }
        }
    }
}

#[test]
fn no_points_have_no_patches() {
    let world = World::without_cuts(0, Vec::new());
    assert_eq!(Patches::new(&world.tree, &[]).n_patches(), 0);
}
