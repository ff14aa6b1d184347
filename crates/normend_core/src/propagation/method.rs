//! How signs are found.

/// How signs travel from point to point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Signed agglomeration with evidence. It takes its own normals and graph: estimator, neighborhoods, edge rule and source rule
    /// are without effect.
    #[default]
    Agglomeration,
    /// Along the minimum spanning tree, from sources (Liu et al. §3.3).
    SpanningTree,
}

impl Method {
    /// All methods, in the order of menus.
    pub const ALL: [Self; 2] = [Self::Agglomeration, Self::SpanningTree];

    /// The name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Agglomeration => "agglomeration",
            Self::SpanningTree => "spanning-tree",
        }
    }

    /// The name in menus.
    pub fn label(self) -> &'static str {
        match self {
            Self::Agglomeration => "Agglomeration",
            Self::SpanningTree => "Spanning tree",
        }
    }
}
