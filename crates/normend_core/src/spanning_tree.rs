//! The minimum spanning tree of the Riemannian graph, rooted, in preorder; built once per set of normals.
//!
//! Several components give a forest; "tree" means all of it. *Positions* are preorder indices: the subtree of a
//! position is a range of positions, and the subtrees of the components follow each other.
//!
//! Invariants: a parent comes before its children; each component is rooted at its center, so no path to a root is
//! longer than half the longest path of the tree; children stand in descending order of height.
//! Not here: sources and signs; see [`crate::regions`].

use std::cmp::Ordering;
use std::ops::Range;

use fixedbitset::FixedBitSet;

use crate::copies::Members;
use crate::progress::Part;
use crate::{Cancelled, Progress, RiemannianGraph};

mod boruvka;

/// A rooted minimum spanning forest with its points in preorder. About 20 bytes a point.
#[derive(Clone, Debug)]
pub struct SpanningTree {
    /// Positions of the components' roots, ascending.
    roots: Vec<u32>,
    /// Point ids by position.
    order: Vec<u32>,
    /// Positions by point id.
    positions: Vec<u32>,
    /// Positions of the parents by position; a root is its own parent.
    parents: Vec<u32>,
    /// Ends of the subtrees by position.
    subtree_ends: Vec<u32>,
    /// Weights of the parent edges by position; 0 for a root.
    weights: Vec<f32>,
    /// By position: whether a sign turns on the way from the root.
    phi: FixedBitSet,
}

/// An edge of the tree between two point ids, `a < b`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct TreeEdge {
    a: u32,
    b: u32,
    weight: f32,
    disagree: bool,
}

impl SpanningTree {
    /// Builds the minimum spanning tree in parallel (Borůvka), roots each component at its center and sorts in preorder.
    ///
    /// The result does not depend on the number of threads.
    ///
    /// # Errors
    /// [`Cancelled`] when `progress` asks to stop; nothing else.
    pub fn new(graph: &RiemannianGraph, progress: &dyn Progress) -> Result<Self, Cancelled> {
        let edges = boruvka::minimum_spanning_forest(graph, &Part::new(progress, 0.0..0.85))?;
        let tree = Self::from_forest(graph.n_points(), &edges);
        progress.report(1.0)?;
        Ok(tree)
    }

    /// Roots a forest and sorts it in preorder, without recursion, in O(n).
    fn from_forest(n_points: usize, edges: &[TreeEdge]) -> Self {
        // A point keeps the xor of its edges' indices. At a leaf that is the one edge left, so leaves can be taken off
        // level by level without adjacency lists, until the center of each component is left.
        let mut degrees = vec![0_u32; n_points];
        let mut edge_xors = vec![0_u32; n_points];
        for (index, edge) in edges.iter().enumerate() {
            for end in [edge.a, edge.b] {
                degrees[end as usize] += 1;
                edge_xors[end as usize] ^= index as u32;
            }
        }
        let mut peeled: Vec<u32> = Vec::with_capacity(n_points);
        peeled.extend((0..n_points as u32).filter(|&point| degrees[point as usize] <= 1));
        let mut sizes = vec![1_u32; n_points];
        let mut next = 0;
        while next < peeled.len() {
            let point = peeled[next] as usize;
            next += 1;
            if degrees[point] == 0 {
                continue;
            }
            let index = edge_xors[point];
            let edge = edges[index as usize];
            let parent = if edge.a as usize == point { edge.b } else { edge.a } as usize;
            sizes[parent] += sizes[point];
            edge_xors[parent] ^= index;
            degrees[parent] -= 1;
            if degrees[parent] == 1 {
                peeled.push(parent as u32);
            }
        }
        // From here `degrees` is 1 for a point with a parent, whose edge is `edge_xors`, and 0 for a root.

        let mut tree = Self::of_nothing(n_points);
        let mut free = 0;
        for point in 0..n_points {
            if degrees[point] == 0 {
                tree.roots.push(free);
                tree.place(point, free, free, 0.0, sizes[point]);
                free += sizes[point];
            }
        }
        // Parents are peeled after their children, so backwards they come first, and high subtrees before low ones.
        // From the placing of a point on, its entry of `sizes` is the position that its next child takes.
        for root in &tree.roots {
            sizes[tree.order[*root as usize] as usize] = root + 1;
        }
        for &point in peeled.iter().rev() {
            let point = point as usize;
            if degrees[point] == 0 {
                continue;
            }
            let edge = edges[edge_xors[point] as usize];
            let parent = if edge.a as usize == point { edge.b } else { edge.a } as usize;
            let position = sizes[parent];
            let size = sizes[point];
            sizes[parent] += size;
            sizes[point] = position + 1;
            let parent_position = tree.positions[parent];
            tree.place(point, position, parent_position, edge.weight, size);
            let turned = tree.phi.contains(parent_position as usize) ^ edge.disagree;
            tree.phi.set(position as usize, turned);
        }
        tree
    }

    fn place(&mut self, point: usize, position: u32, parent: u32, weight: f32, size: u32) {
        self.positions[point] = position;
        let position_index = position as usize;
        self.order[position_index] = point as u32;
        self.parents[position_index] = parent;
        self.subtree_ends[position_index] = position + size;
        self.weights[position_index] = weight;
    }

    /// The tree over all points of a cloud from the one over its places, and where each old position went.
    ///
    /// The first point of a place stands for it, its copies are the last children of that, over edges of weight 0, turned where
    /// `turned` (by point) says so. O(n).
    pub(crate) fn with_copies(&self, places: &Members, turned: &FixedBitSet) -> (Self, Vec<u32>) {
        let (n_places, n_points) = (self.n_points(), places.n_points());
        // Copies come after the subtree of their place, so a position moves by those of all subtrees that end before it.
        let mut positions = vec![0_u32; n_places + 1];
        // How many points are at the old positions before each.
        let mut points_before = vec![0_u32; n_places + 1];
        for position in 0..n_places {
            let n_copies = places.copies(self.order[position]).len() as u32;
            positions[self.subtree_ends[position] as usize] += n_copies;
            points_before[position + 1] = points_before[position] + 1 + n_copies;
        }
        let mut moved_by = 0;
        for (position, moved) in (0..).zip(&mut positions) {
            moved_by += *moved;
            *moved = position + moved_by;
        }
        let mut tree = Self {
            roots: self.roots.iter().map(|&root| positions[root as usize]).collect(),
            ..Self::of_nothing(n_points)
        };
        for (old, &place) in self.order.iter().enumerate() {
            let position = positions[old];
            let size = points_before[self.subtree_ends[old] as usize] - points_before[old];
            let parent = positions[self.parents[old] as usize];
            tree.place(places.first(place) as usize, position, parent, self.weights[old], size);
            tree.phi.set(position as usize, self.phi.contains(old));
            let copies = places.copies(place);
            let first_copy = position + size - copies.len() as u32;
            for (copy, &point) in (first_copy..).zip(copies) {
                tree.place(point as usize, copy, position, 0.0, 1);
                let turns = self.phi.contains(old) != turned.contains(point as usize);
                tree.phi.set(copy as usize, turns);
            }
        }
        positions.truncate(n_places);
        (tree, positions)
    }

    /// Room for a tree of so many points.
    fn of_nothing(n_points: usize) -> Self {
        Self {
            roots: Vec::new(),
            order: vec![0; n_points],
            positions: vec![0; n_points],
            parents: vec![0; n_points],
            subtree_ends: vec![0; n_points],
            weights: vec![0.0; n_points],
            phi: FixedBitSet::with_capacity(n_points),
        }
    }

    /// Number of points, which is also the number of positions.
    #[inline]
    pub fn n_points(&self) -> usize {
        self.order.len()
    }

    /// Positions of the components' roots, ascending. A component is `root..subtree(root).end`.
    #[inline]
    pub fn roots(&self) -> &[u32] {
        &self.roots
    }

    /// Point ids by position: `order()[position]` is the point there.
    #[inline]
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// The position of `point`.
    #[inline]
    pub fn position(&self, point: u32) -> u32 {
        self.positions[point as usize]
    }

    /// The position of the parent of `position`; `None` for a root.
    #[inline]
    pub fn parent(&self, position: u32) -> Option<u32> {
        let parent = self.parents[position as usize];
        (parent != position).then_some(parent)
    }

    /// The component that `position` belongs to, as an index of [`Self::roots`]. O(log components).
    pub fn component(&self, position: u32) -> usize {
        // The first root is at position 0, so at least one counts.
        self.roots().partition_point(|&root| root <= position) - 1
    }

    /// The positions whose parent is `position`, ascending.
    pub fn children(&self, position: u32) -> impl Iterator<Item = u32> {
        let end = self.subtree(position).end;
        let first = Some(position + 1).filter(|&child| child < end);
        std::iter::successors(first, move |&child| {
            Some(self.subtree(child).end).filter(|&next| next < end)
        })
    }

    /// The positions of the subtree of `position`, itself first.
    #[inline]
    pub fn subtree(&self, position: u32) -> Range<u32> {
        position..self.subtree_ends[position as usize]
    }

    /// Weight of the edge from `position` to its parent; 0 for a root.
    #[inline]
    pub fn weight(&self, position: u32) -> f32 {
        self.weights[position as usize]
    }

    /// Compares the parent edges of two positions in the total order of edges (weight, smaller id, larger id).
    ///
    /// Neither position is a root.
    #[inline]
    pub fn compare_edges(&self, a: u32, b: u32) -> Ordering {
        // Weights are neither negative nor NaN, so their bits compare as they do.
        let bits = |position: u32| self.weight(position).to_bits();
        bits(a).cmp(&bits(b)).then_with(|| self.ends(a).cmp(&self.ends(b)))
    }

    /// The point ids of a parent edge, the smaller first.
    fn ends(&self, position: u32) -> (u32, u32) {
        let child = self.order[position as usize];
        let parent = self.order[self.parents[position as usize] as usize];
        (child.min(parent), child.max(parent))
    }

    /// phi: whether the normal at `position` turns when signs travel to it from its component's root.
    #[inline]
    pub fn phi(&self, position: u32) -> bool {
        self.phi.contains(position as usize)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::Silent;

    type Edge = (u32, u32, f32, bool);

    fn build(n_points: usize, edges: &[Edge]) -> SpanningTree {
        SpanningTree::new(&RiemannianGraph::from_edges(n_points, edges), &Silent).unwrap()
    }

    /// Kruskal's algorithm, as the textbook has it, with the same total order on edges.
    fn kruskal(n_points: usize, edges: &[Edge]) -> Vec<Edge> {
        let mut sorted: Vec<Edge> = edges.iter().filter(|edge| edge.0 != edge.1).copied().collect();
        for edge in &mut sorted {
            *edge = (edge.0.min(edge.1), edge.0.max(edge.1), edge.2, edge.3);
        }
        sorted.sort_by(|a, b| a.2.total_cmp(&b.2).then((a.0, a.1, a.3).cmp(&(b.0, b.1, b.3))));
        let mut labels: Vec<u32> = (0..n_points as u32).collect();
        let mut chosen = Vec::new();
        for edge in sorted {
            let (from, to) = (labels[edge.0 as usize], labels[edge.1 as usize]);
            if from != to {
                for label in &mut labels {
                    if *label == from {
                        *label = to;
                    }
                }
                chosen.push(edge);
            }
        }
        chosen.sort_by_key(|edge| (edge.0, edge.1));
        chosen
    }

    /// The parent edges of `tree` as explicit edges, the sign from phi of both ends.
    fn edges_of(tree: &SpanningTree) -> Vec<Edge> {
        let mut edges: Vec<Edge> = (0..tree.n_points() as u32)
            .filter_map(|position| {
                let parent = tree.parent(position)?;
                let (a, b) = tree.ends(position);
                Some((a, b, tree.weight(position), tree.phi(position) ^ tree.phi(parent)))
            })
            .collect();
        edges.sort_by_key(|edge| (edge.0, edge.1));
        edges
    }

    fn assert_preorder(tree: &SpanningTree) {
        let n_points = tree.n_points() as u32;
        let mut component_starts = Vec::new();
        for position in 0..n_points {
            assert_eq!(tree.position(tree.order()[position as usize]), position);
            match tree.parent(position) {
                None => {
                    component_starts.push(position);
                    assert_eq!(tree.weight(position), 0.0);
                    assert!(!tree.phi(position));
                }
                Some(parent) => {
                    assert!(parent < position);
                    assert!(tree.subtree(position).end <= tree.subtree(parent).end);
                }
            }
            // The children's ranges follow each other and fill the subtree.
            let mut next = position + 1;
            while next < tree.subtree(position).end {
                assert_eq!(tree.parent(next), Some(position));
                next = tree.subtree(next).end;
            }
            assert_eq!(next, tree.subtree(position).end);
        }
        assert_eq!(tree.roots(), component_starts);
    }

    fn depth(tree: &SpanningTree, mut position: u32) -> usize {
        let mut depth = 0;
        while let Some(parent) = tree.parent(position) {
            position = parent;
            depth += 1;
        }
        depth
    }

    fn any_graph() -> impl Strategy<Value = (usize, Vec<Edge>)> {
        (1_usize..40).prop_flat_map(|n_points| {
            let end = 0..n_points as u32;
            // Four distinct weights: nearly every choice is a tie.
            let edge = (end.clone(), end, 0_u8..4, any::<bool>())
                .prop_map(|(a, b, weight, disagree)| (a, b, f32::from(weight) / 4.0, disagree));
            (Just(n_points), prop::collection::vec(edge, 0..100))
        })
    }

    proptest! {
        #[test]
        fn is_the_minimum_spanning_forest((n_points, edges) in any_graph()) {
            let tree = build(n_points, &edges);
            assert_preorder(&tree);
            prop_assert_eq!(edges_of(&tree), kruskal(n_points, &edges));
        }

        #[test]
        fn roots_are_centers((n_points, edges) in any_graph()) {
            let tree = build(n_points, &edges);
            for &root in tree.roots() {
                let depths: Vec<usize> = tree.subtree(root).map(|position| depth(&tree, position)).collect();
                let height = depths.iter().max().copied().unwrap();
                // At a center the two highest branches differ by at most one level.
                let mut second = 0;
                let mut child = root + 1;
                let mut heights = Vec::new();
                while child < tree.subtree(root).end {
                    heights.push(tree.subtree(child).map(|position| depth(&tree, position)).max().unwrap());
                    child = tree.subtree(child).end;
                }
                heights.sort_unstable();
                if heights.len() > 1 {
                    second = heights[heights.len() - 2];
                }
                prop_assert!(height <= second + 1, "branches {heights:?}");
            }
        }

        #[test]
        fn edge_order_is_weight_then_ids((n_points, edges) in any_graph()) {
            let tree = build(n_points, &edges);
            let inner: Vec<u32> = (0..n_points as u32).filter(|&position| tree.parent(position).is_some()).collect();
            for &a in &inner {
                for &b in &inner {
                    let expect = tree.weight(a).total_cmp(&tree.weight(b)).then(tree.ends(a).cmp(&tree.ends(b)));
                    prop_assert_eq!(tree.compare_edges(a, b), expect);
                }
            }
        }
    }

    #[test]
    fn does_not_depend_on_threads() {
        // A grid with few distinct weights, and enough points for several tasks.
        let side = 200_u32;
        let mut edges = Vec::new();
        for y in 0..side {
            for x in 0..side {
                let point = y * side + x;
                let weight = ((point.wrapping_mul(2_654_435_761) >> 28) & 3) as f32;
                if x + 1 < side {
                    edges.push((point, point + 1, weight, point.is_multiple_of(3)));
                }
                if y + 1 < side {
                    edges.push((point, point + side, weight, point.is_multiple_of(5)));
                }
            }
        }
        let graph = RiemannianGraph::from_edges((side * side) as usize, &edges);
        let with_threads = |n_threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
            pool.install(|| SpanningTree::new(&graph, &Silent).unwrap())
        };
        let (one, four) = (with_threads(1), with_threads(4));
        assert_preorder(&one);
        assert_eq!(one.order, four.order);
        assert_eq!(one.parents, four.parents);
        assert_eq!(one.phi, four.phi);
    }

    #[test]
    fn a_long_chain_needs_no_recursion() {
        let n_points = 200_000_u32;
        // Ascending ties make every component choose the one before it: the longest chain of joins there is.
        let edges: Vec<Edge> = (1..n_points).map(|point| (point - 1, point, 0.0, true)).collect();
        let tree = build(n_points as usize, &edges);
        assert_eq!(tree.roots().len(), 1);
        assert!(depth(&tree, n_points - 1) <= n_points as usize / 2);
        let turned = tree.phi(tree.position(0)) ^ tree.phi(tree.position(1));
        assert!(turned);
    }

    #[test]
    fn no_points_no_edges() {
        assert_eq!(build(0, &[]).n_points(), 0);
        let lonely = build(3, &[]);
        assert_eq!(lonely.roots(), [0, 1, 2]);
        assert_eq!(lonely.order(), [0, 1, 2]);
    }

    #[test]
    fn stops_when_cancelled() {
        struct Stop;
        impl Progress for Stop {
            fn report(&self, _fraction: f32) -> Result<(), Cancelled> {
                Err(Cancelled)
            }
        }
        let graph = RiemannianGraph::from_edges(2, &[(0, 1, 0.5, false)]);
        assert_eq!(SpanningTree::new(&graph, &Stop).unwrap_err(), Cancelled);
    }
}
