//! The minimum spanning tree of the Riemannian graph, rooted, in preorder; built once per set of normals.
//!
//! Several components give a forest; "tree" means all of it. *Positions* are preorder indices: the subtree of a
//! position is a range of positions, and the subtrees of the components follow each other.

use std::cmp::Ordering;
use std::ops::Range;

use crate::{Cancelled, Progress, RiemannianGraph};

/// A rooted minimum spanning forest with its points in preorder.
#[derive(Clone, Debug)]
pub struct SpanningTree {
    // Flat arrays by position, e.g. order, position, parent, subtree_end, weight, phi bits.
}

impl SpanningTree {
    /// Builds the minimum spanning tree in parallel (Borůvka), roots each component at its center and sorts in preorder.
    ///
    /// # Errors
    /// [`Cancelled`] when `progress` asks to stop; nothing else.
    pub fn new(graph: &RiemannianGraph, progress: &dyn Progress) -> Result<Self, Cancelled> {
        let _ = (graph, progress);
        unimplemented!()
    }

    /// Number of points, which is also the number of positions.
    pub fn n_points(&self) -> usize {
        unimplemented!()
    }

    /// Positions of the components' roots, ascending. A component is `root..subtree(root).end`.
    pub fn roots(&self) -> &[u32] {
        unimplemented!()
    }

    /// Point ids by position: `order()[position]` is the point there.
    pub fn order(&self) -> &[u32] {
        unimplemented!()
    }

    /// The position of `point`.
    pub fn position(&self, _point: u32) -> u32 {
        unimplemented!()
    }

    /// The position of the parent of `position`; `None` for a root.
    pub fn parent(&self, _position: u32) -> Option<u32> {
        unimplemented!()
    }

    /// The positions of the subtree of `position`, itself first.
    pub fn subtree(&self, _position: u32) -> Range<u32> {
        unimplemented!()
    }

    /// Weight of the edge from `position` to its parent; 0 for a root.
    pub fn weight(&self, _position: u32) -> f32 {
        unimplemented!()
    }

    /// Compares the parent edges of two positions in the total order of edges (weight, smaller id, larger id).
    pub fn compare_edges(&self, _a: u32, _b: u32) -> Ordering {
        unimplemented!()
    }

    /// phi: whether the normal at `position` turns when signs travel to it from its component's root.
    pub fn phi(&self, _position: u32) -> bool {
        unimplemented!()
    }
}
