//! Wrong normals against a reference.

use glam::Vec3;

use crate::{Cancelled, PointCloud, Progress};

/// How many normals point to the wrong side. A point whose reference normal is zero is not judged.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Points whose reference normal is not zero.
    pub n_judged: usize,
    /// `dot < 0`, or no normal (zero or not finite).
    pub n_wrong: usize,
    /// The same when the whole cloud may be flipped, whichever is better.
    pub n_wrong_global_flip: usize,
    /// The same when each connected component of the symmetric k = 10 graph may be flipped.
    pub n_wrong_component_flip: usize,
    /// Number of those components.
    pub n_components: usize,
    /// Points of the result without a normal.
    pub n_undefined: usize,
    /// Mean angle between the normals' lines, in radians, over judged points with a normal; NaN when there are none.
    pub mean_unsigned_angle: f64,
    /// By point: judged wrong as is.
    pub wrong: fixedbitset::FixedBitSet,
}

/// Compares `result` with `reference` (both `n`, by point of `cloud`).
///
/// # Errors
/// [`Cancelled`] when `progress` asks to stop; nothing else.
pub fn compare(
    cloud: &PointCloud,
    reference: &[Vec3],
    result: &[Vec3],
    progress: &dyn Progress,
) -> Result<Comparison, Cancelled> {
    let _ = (cloud, reference, result, progress);
    unimplemented!()
}
