//! What the shaders are told of one picture: camera, settings, and which tile of it is drawn.

use glam::{Mat4, UVec2, Vec2, Vec3};

use crate::display_mode::{Compare, Hair, HairLen};
use crate::gpu_types::{Frame, Look};
use crate::lens::near_depth;
use crate::pick::PictureView;
use crate::{DrawSettings, Projection};

/// Radius of a sphere, in points of the user interface.
const SPHERE_RADIUS: f32 = 6.0;
/// Radius of the ball that marks a wrong point, likewise: of thousands, each is still seen.
const BALL_RADIUS: f32 = 4.0;
/// Beyond every place: a float that a comparison in a shader takes for any length, unlike infinity.
const FAR: f32 = 1e30;

/// Everything a picture is drawn from, apart from what is on the GPU.
#[derive(Clone, Copy, PartialEq)]
pub struct Shot {
    /// Camera, size and scene.
    pub view: PictureView,
    /// Scale of lines and spheres.
    pub pixels_per_point: f32,
    /// Leaves the background out.
    pub transparent: bool,
    /// The rest.
    pub settings: DrawSettings,
}

/// A part of a picture, in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Its first pixel.
    pub origin: UVec2,
    /// Its width and height.
    pub size: UVec2,
}

impl Shot {
    /// Whether the same is seen at each pixel, whatever its color.
    pub fn same_geometry(&self, other: &Self) -> bool {
        let (a, b) = (&self.settings, &other.settings);
        self.view == other.view
            && self.pixels_per_point == other.pixels_per_point
            && a.splat_scale == b.splat_scale
            && a.stride == b.stride
            && a.clip == b.clip
            && a.spheres == b.spheres
            // The depths that hide hair are kept only when there is hair.
            && a.hair.is_some() == b.hair.is_some()
    }

    /// The whole picture.
    pub fn whole(&self) -> Tile {
        Tile {
            origin: UVec2::ZERO,
            size: self.view.size.into(),
        }
    }

    /// Each so-many-th instance is drawn.
    pub fn stride(&self) -> u32 {
        self.settings.stride.max(1)
    }

    /// Instances from one hair to the next.
    pub fn hair_step(&self) -> Option<u32> {
        self.settings
            .hair
            .map(|hair| self.stride().saturating_mul(hair.every.max(1)))
    }

    /// The frame of `tile`, for a cloud with splats up to `max_radius` and `plane_words` words in each plane of flags.
    pub fn frame(&self, tile: Tile, max_radius: f32, plane_words: u32) -> Frame {
        let PictureView { camera, size, scene } = self.view;
        let whole = UVec2::from(size).as_vec2();
        let (origin, tile_size) = (tile.origin.as_vec2(), tile.size.as_vec2());
        let is_perspective = camera.projection == Projection::Perspective;
        let center = (camera.eye() - scene.center).dot(camera.back());
        let scene_depth = Vec2::new(center - scene.radius, center + scene.radius);
        // The tile's part of clip space fills it; pixels count downward.
        let scale = whole / tile_size;
        let shift = (whole - 2.0 * origin - tile_size) / tile_size * Vec2::new(1.0, -1.0);
        let tile_from_clip = Mat4::from_translation(shift.extend(0.0)) * Mat4::from_scale(scale.extend(1.0));
        let clip = &self.settings.clip;
        let [clip_min, clip_max] = clip.bounds.unwrap_or([Vec3::splat(-FAR), Vec3::splat(FAR)]);
        let section = clip
            .section
            .and_then(|section| Some((section, section.direction.try_normalize()?)));
        Frame {
            clip_from_eye: tile_from_clip
                * camera.clip_from_view(whole.x / whole.y, scene)
                * Mat4::from_mat3(camera.view_rotation()),
            eye: camera.eye(),
            perspective: if is_perspective { 1.0 } else { 0.0 },
            right: camera.right(),
            pixel_len: camera.pixel_len(1.0, whole),
            back: camera.back(),
            max_radius: max_radius * radius_scale(&self.settings),
            depth_from_clip: camera.depth_from_clip(scene),
            scene_depth,
            size: tile_size,
            pivot_depth: camera.distance,
            sphere_radius: SPHERE_RADIUS * self.pixels_per_point,
            line_width: self.pixels_per_point,
            stride: self.stride(),
            clip_min,
            near_depth: near_depth(&self.view, clip).unwrap_or(-FAR),
            clip_max,
            plane_words,
            section: section.map_or(Vec3::ZERO, |(_, direction)| direction),
            section_offset: section.map_or(0.0, |(section, direction)| {
                (section.point - camera.eye()).dot(direction)
            }),
            origin,
            whole,
            section_half: section.map_or(FAR, |(section, _)| 0.5 * section.thickness),
            ball_radius: BALL_RADIUS * self.pixels_per_point,
            pad_0: 0,
            pad_1: 0,
        }
    }

    /// Colors and mode.
    pub fn look(&self, has: Has) -> Look {
        let settings = &self.settings;
        let palette = &settings.palette;
        let split = match settings.compare {
            Compare::Split(x) if has.compared => x,
            Compare::All if has.compared => FAR,
            _ => -FAR,
        };
        let hair = settings.hair.unwrap_or(Hair {
            len: HairLen::Pixels(0.0),
            every: 1,
            color: None,
        });
        let (hair_len, hair_in_pixels) = match hair.len {
            HairLen::Pixels(len) => (len, 1),
            HairLen::World(len) => (len, 0),
        };
        Look {
            front: palette.front.into(),
            mode: settings.mode.code(),
            back: palette.back.into(),
            n_highlights: has.n_highlights,
            background: palette.background.into(),
            transparent: self.transparent.into(),
            highlight: palette.highlight.into(),
            eye_dome: settings.eye_dome.clamp(0.0, 1.0),
            selected: palette.selected.into(),
            dim_unselected: settings.dim_unselected.clamp(0.0, 1.0),
            surface: palette.surface.into(),
            split,
            wrong: palette.wrong.into(),
            has_colors: has.colors.into(),
            hair: hair.color.unwrap_or_default().into(),
            hair_len,
            hair_every: hair.every.max(1),
            hair_in_pixels,
            hair_by_side: hair.color.is_none().into(),
            pad_0: 0,
        }
    }
}

/// What of the things that settings speak of is there.
#[derive(Clone, Copy, Debug)]
pub struct Has {
    /// Highlighted ranges.
    pub n_highlights: u32,
    /// Whether the instances have colors.
    pub colors: bool,
    /// Whether there are signs to compare with.
    pub compared: bool,
}

/// Factor on the radii of splats; those of a thinned cloud grow to cover as much.
pub fn radius_scale(settings: &DrawSettings) -> f32 {
    settings.splat_scale * (settings.stride.max(1) as f32).sqrt()
}
