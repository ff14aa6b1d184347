//! Small clouds with known outward normals, for documentation, tests and benchmarks.

use glam::Vec3;

/// A generated cloud: `n` positions and their exact outward unit normals.
#[derive(Clone, Debug)]
pub struct Shape {
    /// Positions.
    pub positions: Vec<Vec3>,
    /// Exact outward unit normals.
    pub normals: Vec<Vec3>,
}
