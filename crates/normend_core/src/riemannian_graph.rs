//! The Riemannian graph: symmetric union of the k-neighborhoods, with a weight and a sign for each edge.

use glam::Vec3;

use crate::{Neighbors, PointCloud};

/// How two neighbors' normals are compared across an edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EdgeRule {
    /// The paper's: weight `1 − |n_i·n_j|`, the neighbor turns when `n_i·n_j < 0`.
    #[default]
    Dot,
    /// The neighbor as a mirror image across the edge `u`: `r = n_i·n_j − 2 (n_i·u)(n_j·u)` in place of the dot product.
    Reflection,
}

impl EdgeRule {
    /// All rules, in the order of menus.
    pub const ALL: [Self; 2] = [Self::Dot, Self::Reflection];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Dot => "dot",
            Self::Reflection => "reflection",
        }
    }

    /// The name in menus.
    pub fn label(self) -> &'static str {
        match self {
            Self::Dot => "Dot product",
            Self::Reflection => "Reflection",
        }
    }
}

/// An undirected graph over the points; each edge has a weight and says whether its ends' normals disagree.
///
/// Edges are in a total order (weight, smaller id, larger id), which makes the minimum spanning tree unique.
#[derive(Clone, Debug)]
pub struct RiemannianGraph {
    n_points: usize,
    // Private representation: chosen by the implementation (directed rows, weights computed once, in parallel).
}

impl RiemannianGraph {
    /// The union of the first `k` neighbors of each point, weighted by `rule` on `normals` (`n` unit vectors).
    pub fn new(cloud: &PointCloud, neighbors: &Neighbors, k: usize, normals: &[Vec3], rule: EdgeRule) -> Self {
        let _ = (cloud, neighbors, k, normals, rule);
        unimplemented!()
    }

    /// A graph from explicit edges `(a, b, weight, disagree)`; for tests and other graphs than neighborhoods.
    pub fn from_edges(n_points: usize, edges: &[(u32, u32, f32, bool)]) -> Self {
        let _ = (n_points, edges);
        unimplemented!()
    }

    /// Number of points.
    pub fn n_points(&self) -> usize {
        self.n_points
    }
}
