//! Algorithm 1 of Liu et al. as it is printed, with a heap on the graph, for tests to compare with; and small random
//! graphs to compare on.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};
use std::sync::Arc;

use fixedbitset::FixedBitSet;
use proptest::prelude::*;
use proptest::sample::Index;

use crate::{RiemannianGraph, Silent, SpanningTree};

/// `(a, b, weight, disagree)` as [`RiemannianGraph::from_edges`] takes them.
pub(crate) type Edge = (u32, u32, f32, bool);

/// Whether a point's stored normal is turned, and the source that says so.
pub(crate) type Oriented = (bool, u32);

/// Algorithm 1: spreads the signs of `sources` (point, turned) over `edges`, the lightest first, ties by smaller and
/// then larger id. Points that no source reaches stay `None`.
pub(crate) fn multi_source_propagation(
    n_points: usize,
    edges: &[Edge],
    sources: impl IntoIterator<Item = (u32, bool)>,
) -> Vec<Option<Oriented>> {
    let mut edges_of = vec![Vec::new(); n_points];
    for &(a, b, weight, disagree) in edges {
        // Weights are not negative, so their bits are in their order.
        let order = (weight.to_bits(), a.min(b), a.max(b));
        edges_of[a as usize].push((order, disagree));
        edges_of[b as usize].push((order, disagree));
    }
    let mut oriented: Vec<Option<Oriented>> = vec![None; n_points];
    let mut heap = BinaryHeap::new();
    for (source, turned) in sources {
        oriented[source as usize] = Some((turned, source));
        heap.extend(edges_of[source as usize].iter().map(|&edge| Reverse(edge)));
    }
    while let Some(Reverse(((_, a, b), disagree))) = heap.pop() {
        for (from, next) in [(a, b), (b, a)] {
            if let (Some((turned, source)), None) = (oriented[from as usize], oriented[next as usize]) {
                oriented[next as usize] = Some((turned != disagree, source));
                heap.extend(edges_of[next as usize].iter().map(|&edge| Reverse(edge)));
            }
        }
    }
    oriented
}

/// Drawn edges without loops, one for each pair of points.
fn simple(n_points: usize, drawn: Vec<(Index, Index, u8, bool)>) -> Vec<Edge> {
    let mut by_ends = BTreeMap::new();
    for (a, b, weight, disagree) in drawn {
        let (a, b) = (a.index(n_points) as u32, b.index(n_points) as u32);
        if a != b {
            by_ends.insert((a.min(b), a.max(b)), (f32::from(weight) / 4.0, disagree));
        }
    }
    by_ends
        .into_iter()
        .map(|((a, b), (weight, disagree))| (a, b, weight, disagree))
        .collect()
}

/// A random graph with its tree and initial cuts.
#[derive(Clone, Debug)]
pub(crate) struct World {
    pub n_points: usize,
    pub edges: Vec<Edge>,
    pub tree: Arc<SpanningTree>,
    pub initial_cuts: FixedBitSet,
    pub initially_turned: FixedBitSet,
}

impl World {
    /// Graphs of `n_points` points with few distinct weights, mostly of several components; half of them without initial cuts.
    pub fn any(n_points: usize) -> impl Strategy<Value = Self> {
        let edge = (any::<Index>(), any::<Index>(), 0_u8..5, any::<bool>());
        let bits = || prop::collection::vec(any::<bool>(), n_points);
        let sparse_bits = prop::collection::vec(prop::bool::weighted(0.2), n_points);
        (
            prop::collection::vec(edge, 0..=3 * n_points),
            prop_oneof![Just(vec![false; n_points]), bits(), sparse_bits],
            bits(),
        )
            .prop_map(move |(edges, cuts, turned)| Self::new(n_points, simple(n_points, edges), &cuts, &turned))
    }

    /// The graph of these edges, each default sign as stored.
    pub fn without_cuts(n_points: usize, edges: Vec<Edge>) -> Self {
        Self::new(n_points, edges, &vec![false; n_points], &vec![false; n_points])
    }

    fn new(n_points: usize, edges: Vec<Edge>, cuts: &[bool], turned: &[bool]) -> Self {
        let graph = RiemannianGraph::from_edges(n_points, &edges);
        let tree = SpanningTree::new(&graph, &Silent).expect("silent progress never cancels");
        let mut initial_cuts = FixedBitSet::with_capacity(n_points);
        let mut initially_turned = FixedBitSet::with_capacity(n_points);
        for position in 0..n_points {
            let is_root = tree.parent(position as u32).is_none();
            initial_cuts.set(position, cuts[position] && !is_root);
            initially_turned.set(position, turned[position] && (cuts[position] || is_root));
        }
        Self {
            n_points,
            edges,
            tree: Arc::new(tree),
            initial_cuts,
            initially_turned,
        }
    }

    /// What Algorithm 1 says, by point, in each base region on its own: from its vouched sources (`turned` by point), else
    /// from its top, which is no source to name then.
    pub fn expect(&self, sources: &BTreeMap<u32, bool>) -> Vec<(bool, Option<u32>)> {
        let order = self.tree.order();
        let mut base_tops = vec![0; self.n_points];
        for position in 0..self.n_points as u32 {
            let point = order[position as usize] as usize;
            base_tops[point] = match self.tree.parent(position) {
                Some(parent) if !self.initial_cuts.contains(position as usize) => {
                    base_tops[order[parent as usize] as usize]
                }
                _ => order[position as usize],
            };
        }
        let has_source: BTreeSet<u32> = sources.keys().map(|&point| base_tops[point as usize]).collect();
        let defaults = (0..self.n_points as u32)
            .filter(|&point| base_tops[point as usize] == point && !has_source.contains(&point))
            .map(|point| {
                (
                    point,
                    self.initially_turned.contains(self.tree.position(point) as usize),
                )
            });
        let mut edges = self.edges.clone();
        edges.retain(|&(a, b, ..)| base_tops[a as usize] == base_tops[b as usize]);
        let all = sources.iter().map(|(&point, &turned)| (point, turned)).chain(defaults);
        multi_source_propagation(self.n_points, &edges, all)
            .into_iter()
            .map(|oriented| oriented.expect("every base region has a source or its default"))
            .map(|(turned, source)| (turned, sources.contains_key(&source).then_some(source)))
            .collect()
    }

    /// The world with the points of a patch turned: as if their stored normals were the opposite ones, in the eyes of
    /// everything but the sources. Of its tree only the order of positions still holds.
    pub fn with_turned(&self, patch: &FixedBitSet) -> Self {
        let mut turned = self.clone();
        for (a, b, _, disagree) in &mut turned.edges {
            *disagree ^= patch.contains(*a as usize) != patch.contains(*b as usize);
        }
        for position in 0..self.n_points {
            let point = self.tree.order()[position] as usize;
            let is_top = self.tree.parent(position as u32).is_none() || self.initial_cuts.contains(position);
            if is_top && patch.contains(point) {
                turned.initially_turned.toggle(position);
            }
        }
        turned
    }
}
