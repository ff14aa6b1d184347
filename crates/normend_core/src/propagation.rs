//! From cloud and parameters to the tree that signs travel along: everything slow, once, in a job.

use std::sync::Arc;

use fixedbitset::FixedBitSet;
use glam::Vec3;

use crate::{Cancelled, EdgeRule, Estimator, PointCloud, Progress, SpanningTree};

/// Which normals and signs a document starts from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Start {
    /// Normals are estimated; each component gets a default source.
    #[default]
    Estimate,
    /// The normals that came with the file, with their signs; points without one get an estimated normal.
    Keep,
}

impl Start {
    /// All starts, in the order of menus.
    pub const ALL: [Self; 2] = [Self::Estimate, Self::Keep];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Estimate => "estimate",
            Self::Keep => "keep",
        }
    }

    /// The name in menus.
    pub fn label(self) -> &'static str {
        match self {
            Self::Estimate => "Estimate",
            Self::Keep => "Keep given",
        }
    }
}

/// What a user can set about the propagation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameters {
    /// How normals are fitted.
    pub estimator: Estimator,
    /// Neighbors that a normal is fitted to, at least 3.
    pub k_normals: usize,
    /// Neighbors of each point in the Riemannian graph, at least 1.
    pub k_graph: usize,
    /// How neighbors' normals are compared.
    pub edge_rule: EdgeRule,
    /// Estimated or given normals.
    pub start: Start,
}

impl Default for Parameters {
    fn default() -> Self {
        Self {
            estimator: Estimator::Obne,
            k_normals: 12,
            k_graph: 8,
            edge_rule: EdgeRule::Dot,
            start: Start::Estimate,
        }
    }
}

/// The stages of [`Propagation::new`], in order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// k-neighborhoods.
    Neighbors,
    /// Normals of any sign.
    Normals,
    /// Riemannian graph.
    Graph,
    /// Minimum spanning tree in preorder.
    Tree,
}

impl Stage {
    /// The name in reports: `neighbors`, `normals`, `graph`, `tree`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Neighbors => "neighbors",
            Self::Normals => "normals",
            Self::Graph => "graph",
            Self::Tree => "tree",
        }
    }
}

/// All that is derived from a cloud and its parameters, and does not depend on sources.
#[derive(Clone, Debug)]
pub struct Propagation {
    /// The parameters it was made with.
    pub parameters: Parameters,
    /// `n` unit normals by point; signs are arbitrary (estimated) or as given ([`Start::Keep`]).
    pub normals: Arc<Vec<Vec3>>,
    /// `n` radii by point, in the cloud's unit, so that discs of neighbors overlap and surfaces look closed.
    pub splat_radii: Arc<Vec<f32>>,
    /// The tree that signs travel along.
    pub tree: Arc<SpanningTree>,
    /// Initial cuts by position: the parent edge of a set position carries no sign, because the given signs of its
    /// ends disagree with the edge rule. Empty for [`Start::Estimate`]. Roots are never set.
    pub initial_cuts: FixedBitSet,
    /// For each initial region (roots and initial cuts), by the position of its top: whether the stored normal *there*
    /// starts turned. With [`Start::Estimate`]: so that the component's default source points up.
    pub initially_turned: FixedBitSet,
    /// Wall seconds of each stage.
    pub seconds: Vec<(Stage, f64)>,
}

impl Propagation {
    /// Runs neighbors → normals → graph → tree → initial cuts. `given` are the file's normals by point, if it has any
    /// (zero or NaN where a point has none); without them [`Start::Keep`] is the same as [`Start::Estimate`].
    ///
    /// # Errors
    /// [`Cancelled`] when `progress` asks to stop; nothing else.
    pub fn new(
        cloud: &PointCloud,
        given: Option<&[Vec3]>,
        parameters: Parameters,
        progress: &dyn Progress,
    ) -> Result<Self, Cancelled> {
        let _ = (cloud, given, parameters, progress);
        unimplemented!()
    }
}
