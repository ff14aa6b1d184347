//! The patches that a cloud was merged from, level by level: what one click can turn.
//!
//! An agglomeration merges points into clusters and clusters into larger ones, along the edges of the [`SpanningTree`].
//! [`Patches`] is that hierarchy without the levels at which a cluster did not grow: a *patch* is a set of points that
//! once was a cluster, and the patches that hold a point are nested. A patch with a weak boundary was merged with its
//! surroundings for want of something better; where signs are wrong, it is likely such a patch that is wrong as a whole.
//!
//! The positions of a patch follow from the tree: on each tree edge that leaves the patch a subtree begins or ends, and
//! such edges were merged over further up, so they are found without passing over points.
//!
//! Not here: how the hierarchy is made; what a click changes, see [`crate::document`].

use std::ops::Range;

use rayon::prelude::*;

use crate::copies::Members;
use crate::{Change, SpanningTree};

/// One level of an agglomeration. Level 0 has the points as its clusters.
#[derive(Clone, Copy, Debug)]
pub struct Level<'a> {
    /// The cluster of the next level that each cluster becomes part of; not read at the last level.
    pub parents: &'a [u32],
    /// How surely the sides of each cluster's boundary belong together as they are, −1..=1: the sum of `J s s` over the sum of
    /// `|J|` of the boundary's edges. NaN (a cluster without a boundary) counts as 1.
    pub strengths: &'a [f32],
}

/// One of the nested sets of points around a point. Patches of one [`Patches`] are equal when their points are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Patch {
    node: u32,
    /// First of its leaves.
    start: u32,
    /// Number of points, at least 1.
    pub n_points: u32,
    /// The strength of its boundary in units of [`STRENGTH_UNIT`].
    strength: i16,
}

/// How much weaker a boundary has to be to make up for twice the points. What an agglomeration leaves wrong is mostly small, and
/// a large patch that was right costs many clicks: with a simulated user this saved a quarter to a third of the clicks, and
/// with the wheel a third to a half of its steps. With thrice as much the default is hardly ever more than a point.
pub const STRENGTH_PER_DOUBLING: f32 = 0.035;

/// Strengths are kept in 16 bits: what differs by less is the same for a choice between patches.
const STRENGTH_UNIT: f32 = 1.0 / i16::MAX as f32;

impl Patch {
    /// The strength of its boundary, −1..=1; weak is small.
    pub fn strength(&self) -> f32 {
        f32::from(self.strength) * STRENGTH_UNIT
    }

    /// How little it looks like a patch that is wrong as a whole: its strength, and more the more points it has.
    fn doubt(&self) -> f32 {
        self.strength() + STRENGTH_PER_DOUBLING * (self.n_points as f32).log2()
    }

    /// Its points as leaves, see [`Patches::leaf`].
    pub fn leaves(&self) -> Range<u32> {
        self.start..self.start + self.n_points
    }
}

/// The patches that can be turned at one point, a step of the wheel apart.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Offer {
    /// Nested patches around the point, the smallest first, each at least half as large again as the one before; never empty.
    pub patches: Vec<Patch>,
    /// The index of the one that is offered first.
    pub default: usize,
}

/// The hierarchy of patches over the points of a spanning tree.
///
/// Memory is 14 bytes a point and 18 bytes for each patch of several points, of which there are fewer than points.
#[derive(Clone, Debug)]
pub struct Patches {
    n_points: usize,
    /// The first of the patches of several points are those of points in one place: so many. Only whole places are offered.
    n_places: usize,
    /// By node the node it is part of, itself for the last. Nodes are first the points, then patches of several points;
    /// a node comes before the one it is part of.
    parents: Vec<u32>,
    /// By node: the first of its leaves.
    starts: Vec<u32>,
    /// By patch of several points: how many.
    sizes: Vec<u32>,
    /// By node.
    strengths: Vec<i16>,
    /// By patch of several points: where its edges begin in [`Self::edges`]; one more at the end.
    edge_starts: Vec<u32>,
    /// The tree edges between the parts of each patch, as the positions whose parent edges they are.
    edges: Vec<u32>,
}

impl Patches {
    /// Builds the hierarchy of `levels`, the points first. What the last level leaves apart in a component of the tree is joined.
    ///
    /// O(n · levels) time at most, and O(n) where most edges are merged over at the first levels. The result does not depend
    /// on the number of threads.
    ///
    /// # Panics
    /// When the levels do not fit each other or the tree: a cluster without points, another number of points, or a
    /// cluster with points of two components.
    pub fn new(tree: &SpanningTree, levels: &[Level<'_>]) -> Self {
        let n_points = tree.n_points();
        let mut builder = Builder::new(n_points, levels.first());
        for pair in levels.windows(2) {
            assert_eq!(
                pair[0].parents.len(),
                builder.clusters.len(),
                "a level has other clusters than the one before"
            );
            builder.join(pair[0].parents, pair[1].strengths);
        }
        let component = |cluster: &Cluster| {
            let position = tree.position(cluster.point);
            tree.roots().partition_point(|&root| root <= position) as u32 - 1
        };
        let components: Vec<u32> = builder.clusters.iter().map(component).collect();
        builder.join(&components, &vec![1.0; tree.roots().len()]);
        builder.finish(tree)
    }

    /// The patches of all points of a cloud from those of its places; `tree` is over all points.
    pub(crate) fn with_copies(&self, places: &Members, tree: &SpanningTree) -> Self {
        let n_points = places.n_points();
        // Places of several points become patches, before all others.
        let mut n_places = 0;
        let mut nodes = vec![0_u32; self.parents.len()];
        for (place, node) in nodes[..self.n_points].iter_mut().enumerate() {
            let first = places.first(place as u32);
            *node = match places.copies(place as u32) {
                [] => first,
                _ => {
                    n_places += 1;
                    (n_points + n_places - 1) as u32
                }
            };
        }
        for (node, patch) in nodes[self.n_points..].iter_mut().zip(n_points + n_places..) {
            *node = patch as u32;
        }
        let mut parents: Vec<u32> = (0..(n_points + n_places + self.n_patches()) as u32).collect();
        let mut strengths = vec![0_i16; parents.len()];
        for (old, &node) in nodes.iter().enumerate() {
            parents[node as usize] = nodes[self.parents[old] as usize];
            strengths[node as usize] = self.strengths[old];
        }
        for place in (0..self.n_points).filter(|&place| places.of(place).len() > 1) {
            for &point in places.of(place) {
                parents[point as usize] = nodes[place];
                strengths[point as usize] = self.strengths[place];
            }
        }
        let builder = Builder {
            n_points,
            parents,
            strengths,
            clusters: Vec::new(),
        };
        Self {
            n_places,
            ..builder.finish(tree)
        }
    }

    /// The number of patches of several points.
    pub fn n_patches(&self) -> usize {
        self.sizes.len()
    }

    /// The place of `point` in an order in which each patch is a range.
    #[inline]
    pub fn leaf(&self, point: u32) -> u32 {
        self.starts[point as usize]
    }

    /// The patches that hold `point`: the point alone first, or all points of its place if there are several, its component last.
    pub fn around(&self, point: u32) -> impl Iterator<Item = Patch> {
        let first = match self.parents[point as usize] {
            above if (above as usize) < self.n_points + self.n_places => above,
            _ => point,
        };
        std::iter::successors(Some(first), |&node| self.parent(node)).map(|node| self.patch(node))
    }

    /// All patches with the index of the one that each is part of, itself for a component. The points come first, in the order
    /// of their ids; every patch comes before the one it is part of.
    pub fn all(&self) -> impl DoubleEndedIterator<Item = (Patch, u32)> + ExactSizeIterator {
        (0..self.parents.len()).map(|node| (self.patch(node as u32), self.parents[node]))
    }

    /// The smallest patch around `point` of at least `n_points` points; its component when that has fewer.
    pub fn find(&self, point: u32, n_points: u32) -> Patch {
        let mut found = self.patch(point);
        for patch in self.around(point) {
            found = patch;
            if patch.n_points >= n_points {
                break;
            }
        }
        found
    }

    /// The patches to turn at `point`, of those around it that `may_turn` allows; `None` when it allows none. It is asked from
    /// the smallest patch to the largest, until it refuses one.
    ///
    /// The default is the patch with the weakest boundary for its size ([`STRENGTH_PER_DOUBLING`]), the smaller of equal ones, among
    /// those of at most half the component: of two parts the smaller is the one that is wrong.
    pub fn offer(&self, point: u32, mut may_turn: impl FnMut(Patch) -> bool) -> Option<Offer> {
        let mut allowed: Vec<Patch> = Vec::new();
        let mut n_component = 0;
        let mut refused = false;
        for patch in self.around(point) {
            n_component = patch.n_points;
            refused = refused || !may_turn(patch);
            if !refused {
                allowed.push(patch);
            }
        }
        let is_part = |patch: &Patch| patch.n_points <= n_component / 2;
        let weakest = (0..allowed.len())
            .filter(|&index| is_part(&allowed[index]))
            .min_by(|&a, &b| allowed[a].doubt().total_cmp(&allowed[b].doubt()));
        // Only a component of one point has no smaller part.
        let chosen = weakest.unwrap_or(0);
        let mut patches = vec![*allowed.get(chosen)?];
        for patch in allowed[..chosen].iter().rev() {
            if grows(patch, &patches[patches.len() - 1]) {
                patches.push(*patch);
            }
        }
        patches.reverse();
        let default = patches.len() - 1;
        for patch in &allowed[chosen + 1..] {
            if grows(&patches[patches.len() - 1], patch) {
                patches.push(*patch);
            }
        }
        Some(Offer { patches, default })
    }

    /// The positions of a patch. The work is in the tree edges between the parts of the larger patches around it, not in its points.
    pub fn positions(&self, patch: Patch, tree: &SpanningTree) -> Change {
        let leaves = patch.leaves();
        let holds = |position: u32| leaves.contains(&self.leaf(tree.order()[position as usize]));
        let mut flips = Vec::new();
        let mut node = patch.node;
        while let Some(parent) = self.parent(node) {
            node = parent;
            for &position in self.edges_of(node) {
                if tree
                    .parent(position)
                    .is_some_and(|parent| holds(parent) != holds(position))
                {
                    flips.push(tree.subtree(position));
                }
            }
        }
        // Above all those edges is the root of the component.
        let inside = match self.is_point(patch.node) {
            true => tree.position(patch.node),
            false => self.edges_of(patch.node)[0],
        };
        let component = tree.roots().partition_point(|&root| root <= inside) - 1;
        let root = tree.roots()[component];
        if holds(root) {
            flips.push(tree.subtree(root));
        }
        Change::from_flips(&flips)
    }

    fn is_point(&self, node: u32) -> bool {
        (node as usize) < self.n_points
    }

    fn parent(&self, node: u32) -> Option<u32> {
        let parent = self.parents[node as usize];
        (parent != node).then_some(parent)
    }

    fn patch(&self, node: u32) -> Patch {
        let n_points = match self.is_point(node) {
            true => 1,
            false => self.sizes[node as usize - self.n_points],
        };
        Patch {
            node,
            start: self.starts[node as usize],
            n_points,
            strength: self.strengths[node as usize],
        }
    }

    /// The tree edges between the parts of a patch of several points: at least one.
    fn edges_of(&self, node: u32) -> &[u32] {
        let patch = node as usize - self.n_points;
        &self.edges[self.edge_starts[patch] as usize..self.edge_starts[patch + 1] as usize]
    }
}

/// Whether a step of the wheel leads from one patch to the next: half as many points more are seen at once, and a click
/// is some steps away from any size.
fn grows(from: &Patch, to: &Patch) -> bool {
    2 * u64::from(to.n_points) >= 3 * u64::from(from.n_points)
}

/// A cluster of the level that is being built on.
#[derive(Clone, Copy)]
struct Cluster {
    node: u32,
    /// Any of its points.
    point: u32,
}

/// Joins clusters level by level.
struct Builder {
    n_points: usize,
    parents: Vec<u32>,
    strengths: Vec<i16>,
    clusters: Vec<Cluster>,
}

impl Builder {
    /// Starts with each point alone.
    fn new(n_points: usize, points: Option<&Level<'_>>) -> Self {
        let strengths = match points {
            Some(points) => points.strengths.iter().map(|&strength| in_units(strength)).collect(),
            None => vec![in_units(1.0); n_points],
        };
        assert_eq!(strengths.len(), n_points, "level 0 has other points than the tree");
        let points = 0..n_points as u32;
        Self {
            n_points,
            parents: points.clone().collect(),
            strengths,
            clusters: points.map(|point| Cluster { node: point, point }).collect(),
        }
    }

    /// Makes the clusters the parts of those of the next level, which have these strengths. One with a single part is that
    /// part.
    fn join(&mut self, parents: &[u32], strengths: &[f32]) {
        let mut n_parts = vec![0_u32; strengths.len()];
        let mut joined: Vec<Cluster> = strengths.iter().map(|_| Cluster { node: 0, point: 0 }).collect();
        for (cluster, &parent) in self.clusters.iter().zip(parents) {
            n_parts[parent as usize] += 1;
            joined[parent as usize] = *cluster;
        }
        assert!(!n_parts.contains(&0), "a cluster of the agglomeration has no points");
        for ((cluster, &n_parts), &strength) in joined.iter_mut().zip(&n_parts).zip(strengths) {
            if n_parts > 1 {
                cluster.node = self.parents.len() as u32;
                self.parents.push(cluster.node);
                self.strengths.push(in_units(strength));
            }
        }
        for (cluster, &parent) in self.clusters.iter().zip(parents) {
            // Of a single part this says that it is its own parent, as it was.
            self.parents[cluster.node as usize] = joined[parent as usize].node;
        }
        self.clusters = joined;
    }

    /// Finds where each node lies among the leaves, and which tree edges it merges over.
    fn finish(self, tree: &SpanningTree) -> Patches {
        const NONE: u32 = u32::MAX;
        let Self {
            n_points,
            parents,
            strengths,
            ..
        } = self;
        let n_patches = parents.len() - n_points;
        // Parts come before what they are part of.
        let mut sizes = vec![0_u32; n_patches];
        let mut n_parts = vec![0_u32; n_patches];
        for (node, &parent) in parents.iter().enumerate() {
            if parent as usize != node {
                let size = if node < n_points { 1 } else { sizes[node - n_points] };
                sizes[parent as usize - n_points] += size;
                n_parts[parent as usize - n_points] += 1;
            }
        }
        let mut starts = vec![0_u32; parents.len()];
        let mut next = vec![0_u32; n_patches];
        let mut free = 0;
        for node in (0..parents.len()).rev() {
            let parent = parents[node] as usize;
            let cursor = if parent == node {
                &mut free
            } else {
                &mut next[parent - n_points]
            };
            starts[node] = *cursor;
            if node < n_points {
                *cursor += 1;
            } else {
                *cursor += sizes[node - n_points];
                next[node - n_points] = starts[node];
            }
        }
        // An edge is merged over where its ends first are in one patch.
        let merged_at = |position: u32| {
            let Some(parent) = tree.parent(position) else {
                return NONE;
            };
            let (mut a, mut b) = (tree.order()[position as usize], tree.order()[parent as usize]);
            while a != b {
                let climber = a.min(b);
                let above = parents[climber as usize];
                assert!(above != climber, "a cluster has points of two components");
                (a, b) = (above, a.max(b));
            }
            a - n_points as u32
        };
        let merged_at: Vec<u32> = (0..n_points as u32).into_par_iter().map(merged_at).collect();
        let mut edge_starts = vec![0_u32; n_patches + 1];
        for &patch in merged_at.iter().filter(|&&patch| patch != NONE) {
            edge_starts[patch as usize + 1] += 1;
        }
        for (&n_parts, &n_edges) in n_parts.iter().zip(&edge_starts[1..]) {
            assert!(n_edges + 1 == n_parts, "a cluster does not hang together in the tree");
        }
        for patch in 0..n_patches {
            edge_starts[patch + 1] += edge_starts[patch];
        }
        let mut edges = vec![0_u32; n_points - tree.roots().len()];
        let mut next = edge_starts.clone();
        for (position, &patch) in (0..).zip(&merged_at) {
            if patch != NONE {
                edges[next[patch as usize] as usize] = position;
                next[patch as usize] += 1;
            }
        }
        Patches {
            n_points,
            n_places: 0,
            parents,
            starts,
            sizes,
            strengths,
            edge_starts,
            edges,
        }
    }
}

/// A strength in units of [`STRENGTH_UNIT`].
fn in_units(strength: f32) -> i16 {
    if strength.is_nan() {
        return i16::MAX;
    }
    (strength.clamp(-1.0, 1.0) / STRENGTH_UNIT).round() as i16
}

#[cfg(test)]
pub(crate) mod tests;
