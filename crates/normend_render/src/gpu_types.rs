//! Every struct and flag that also exists in WGSL, and nothing else: same names, same fields, same order.

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec2, Vec3, Vec4};

/// Id of nothing: the background.
pub const ID_NONE: u32 = 0;
/// Set in ids of spheres; the other bits are their index. Ids of splats are their instance + 1.
pub const ID_SPHERE: u32 = 1 << 31;
/// The most splats that ids can number.
pub const MAX_SPLATS: usize = (ID_SPHERE - 2) as usize;

/// Largest value of one octahedral coordinate; one more says that the point has no normal.
pub const OCT_MAX: u32 = 2046;
/// The packed normal of a point without one.
pub const NO_NORMAL: u32 = OCT_MAX + 1;
/// Largest code of a radius.
pub const RADIUS_CODE_MAX: u32 = 1023;
/// Codes per octave of the radius: 1023 codes reach 2⁻¹⁶ of the largest radius, in steps of 1.1 %.
pub const RADIUS_CODES_PER_OCTAVE: f32 = 64.0;

/// A bit that every point has; its number is that of its plane of words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flag {
    /// The normal is shown the other way.
    Turned = 0,
    /// Marked as selected.
    Selected = 1,
    /// Neither drawn nor picked.
    Hidden = 2,
    /// Like [`Self::Turned`], of the signs to compare with.
    Compared = 3,
    /// Marked with a ball.
    Wrong = 4,
}

impl Flag {
    /// Planes of bits.
    pub const COUNT: usize = 5;
}

/// What the geometry needs to know of the camera, the cloud, and what is cut away.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Frame {
    /// Clip space from world axes around the eye: positions relative to the eye stay exact far from the origin.
    pub clip_from_eye: Mat4,
    /// Eye in world space.
    pub eye: Vec3,
    /// 1 in perspective, 0 in a parallel view.
    pub perspective: f32,
    /// Unit vector to the right, in world space.
    pub right: Vec3,
    /// World length of one pixel where clip-space w is 1.
    pub pixel_len: f32,
    /// Unit vector from the scene toward the eye, in world space.
    pub back: Vec3,
    /// World radius of a splat with the largest code.
    pub max_radius: f32,
    /// a, b, c, d of depth = (a + b·z)/(c + d·z) from clip-space z.
    pub depth_from_clip: Vec4,
    /// Depths of the nearest and the farthest point of the scene.
    pub scene_depth: Vec2,
    /// Size of what is drawn at once in pixels: the picture, or a tile of it.
    pub size: Vec2,
    /// Depth of the pivot.
    pub pivot_depth: f32,
    /// Radius of a sphere in pixels.
    pub sphere_radius: f32,
    /// Width of lines in pixels.
    pub line_width: f32,
    /// Each `stride`-th instance is drawn.
    pub stride: u32,
    /// Low corner of the box outside of which nothing is drawn, in world space.
    pub clip_min: Vec3,
    /// Nothing is drawn nearer than this depth.
    pub near_depth: f32,
    /// High corner of that box.
    pub clip_max: Vec3,
    /// Words of each plane of flags.
    pub plane_words: u32,
    /// Unit vector across the slab outside of which nothing is drawn; zero without one.
    pub section: Vec3,
    /// Where the middle of the slab lies along that vector, from the eye.
    pub section_offset: f32,
    /// First pixel of what is drawn at once, in the whole picture.
    pub origin: Vec2,
    /// Size of the whole picture in pixels.
    pub whole: Vec2,
    /// Half the thickness of the slab.
    pub section_half: f32,
    /// Radius in pixels of the ball that marks a wrong point.
    pub ball_radius: f32,
    /// Zero.
    pub pad_0: u32,
    /// Zero.
    pub pad_1: u32,
}

/// Colors and mode: what the shade pass and the hair need, and the geometry does not.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Look {
    /// Front color.
    pub front: Vec3,
    /// [`crate::DisplayMode::code`].
    pub mode: u32,
    /// Back color.
    pub back: Vec3,
    /// Number of highlighted ranges.
    pub n_highlights: u32,
    /// Background color.
    pub background: Vec3,
    /// 1 leaves the background out.
    pub transparent: u32,
    /// Highlight color.
    pub highlight: Vec3,
    /// Strength of the darkening of edges and creases; 1 is the most.
    pub eye_dome: f32,
    /// Selection color.
    pub selected: Vec3,
    /// How much of what is not selected fades into the background.
    pub dim_unselected: f32,
    /// Color of a surface where no other color is asked for.
    pub surface: Vec3,
    /// Pixels of the whole picture left of this one show the compared signs.
    pub split: f32,
    /// Color of the balls on wrong points.
    pub wrong: Vec3,
    /// 1 when the instances have colors.
    pub has_colors: u32,
    /// Hair color, unless by side.
    pub hair: Vec3,
    /// Length of a hair in pixels or in world length.
    pub hair_len: f32,
    /// Each so-many-th drawn instance has a hair.
    pub hair_every: u32,
    /// 1 when the length is in pixels.
    pub hair_in_pixels: u32,
    /// 1 when hair has the colors of front and back.
    pub hair_by_side: u32,
    /// Zero.
    pub pad_0: u32,
}

/// Which part of the cloud a chunk holds.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Chunk {
    /// First instance.
    pub first: u32,
    /// Zero.
    pub pad_0: u32,
    /// Zero.
    pub pad_1: u32,
    /// Zero.
    pub pad_2: u32,
}

/// One point: 16 bytes.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable, PartialEq)]
pub struct Point {
    /// World position.
    pub position: Vec3,
    /// Octahedral normal in the low 22 bits, radius code in the high 10.
    pub packed: u32,
}

/// One sphere.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable, PartialEq)]
pub struct SphereMark {
    /// World position.
    pub center: Vec3,
    /// 1 when selected.
    pub selected: u32,
    /// Color as displayed.
    pub color: Vec3,
    /// Zero.
    pub pad_0: u32,
}

/// Packs a normal of any length into 22 bits by the octahedral map (Cigolle et al. 2014); zero and not finite vectors
/// give [`NO_NORMAL`].
pub fn pack_normal(normal: Vec3) -> u32 {
    let sum = normal.abs().element_sum();
    if !(sum.is_finite() && sum > 0.0) {
        return NO_NORMAL;
    }
    let folded = normal / sum;
    let mut square = folded.truncate();
    if folded.z < 0.0 {
        square = (Vec2::ONE - Vec2::new(folded.y, folded.x).abs()) * Vec2::ONE.copysign(square);
    }
    let code = |v: f32| (v.mul_add(0.5, 0.5).clamp(0.0, 1.0) * OCT_MAX as f32).round() as u32;
    code(square.x) | code(square.y) << 11
}

/// Codes a radius relative to the largest one, rounded up so that surfaces stay closed. What is not positive gets the
/// smallest code.
pub fn pack_radius(radius: f32, max_radius: f32) -> u32 {
    let octaves = (radius / max_radius).log2();
    if octaves.is_nan() {
        return 0;
    }
    let code = (octaves * RADIUS_CODES_PER_OCTAVE + RADIUS_CODE_MAX as f32 - 1e-3).ceil();
    code.clamp(0.0, RADIUS_CODE_MAX as f32) as u32
}

impl Point {
    /// Packs one point.
    pub fn new(position: Vec3, normal: Option<Vec3>, radius: f32, max_radius: f32) -> Self {
        let normal = normal.map_or(NO_NORMAL, pack_normal);
        Self {
            position,
            packed: normal | pack_radius(radius, max_radius) << 22,
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The decoder of common.wgsl, in Rust.
    fn unpack_normal(packed: u32) -> Option<Vec3> {
        if packed & 0x7ff == NO_NORMAL {
            return None;
        }
        let square = Vec2::new((packed & 0x7ff) as f32, (packed >> 11 & 0x7ff) as f32) / OCT_MAX as f32 * 2.0 - 1.0;
        let z = 1.0 - square.x.abs() - square.y.abs();
        let folded = square - Vec2::ONE.copysign(square) * (-z).max(0.0);
        folded.extend(z).try_normalize()
    }

    fn unpack_radius(code: u32, max_radius: f32) -> f32 {
        max_radius * ((code as f32 - RADIUS_CODE_MAX as f32) / RADIUS_CODES_PER_OCTAVE).exp2()
    }

    proptest! {
        #[test]
        fn normals_survive_within_a_sixth_of_a_degree(v in prop::array::uniform3(-1.0_f32..1.0)) {
            let Some(normal) = Vec3::from_array(v).try_normalize() else { return Ok(()) };
            let back = unpack_normal(pack_normal(normal)).unwrap();
            prop_assert!(back.angle_between(normal) < (1.0_f32 / 6.0).to_radians(), "{normal} came back as {back}");
        }

        #[test]
        fn radii_grow_by_little_and_never_shrink(octaves in -15.9_f32..0.0) {
            let radius = 3.0 * octaves.exp2();
            let back = unpack_radius(pack_radius(radius, 3.0), 3.0);
            prop_assert!(back >= radius * 0.9999 && back <= radius * 1.0112, "{radius} came back as {back}");
        }
    }

    #[test]
    fn special_values_have_their_codes() {
        for axis in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z] {
            assert_eq!(unpack_normal(pack_normal(axis)), Some(axis));
        }
        for bad in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY] {
            assert_eq!(pack_normal(bad), NO_NORMAL);
        }
        assert_eq!(pack_radius(2.0, 2.0), RADIUS_CODE_MAX);
        for bad in [0.0, -1.0, f32::NAN] {
            assert_eq!(pack_radius(bad, 2.0), 0);
        }
        assert_eq!(pack_radius(0.0, 0.0), 0);
    }
}
