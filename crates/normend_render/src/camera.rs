//! Orbit camera around a pivot: turntable with z up, perspective or orthographic.

use glam::{Mat4, Vec2, Vec3};

/// Perspective or parallel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Projection {
    /// Lines meet.
    #[default]
    Perspective,
    /// Parallel lines stay parallel.
    Orthographic,
}

/// Views along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StandardView {
    /// From −y.
    Front,
    /// From +y.
    Back,
    /// From +x.
    Right,
    /// From −x.
    Left,
    /// From +z.
    Top,
    /// From −z.
    Bottom,
    /// From the corner between front, right and top.
    Corner,
}

impl StandardView {
    /// All views, in the order of menus.
    pub const ALL: [Self; 7] = [
        Self::Front,
        Self::Back,
        Self::Right,
        Self::Left,
        Self::Top,
        Self::Bottom,
        Self::Corner,
    ];

    /// The name in menus ("Front").
    pub fn label(self) -> &'static str {
        unimplemented!()
    }

    /// The name on the command line ("front").
    pub fn name(self) -> &'static str {
        unimplemented!()
    }
}

/// Where the view is seen from. Lengths in the cloud's unit, angles in radians, sizes in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The point that orbiting turns around, in world space.
    pub pivot: Vec3,
    /// Angle around z; 0 looks along +y (from the front).
    pub azimuth: f32,
    /// Angle above the horizon, within ±π/2.
    pub elevation: f32,
    /// Distance from the pivot, > 0. Also sets the scale of the orthographic view.
    pub distance: f32,
    /// Vertical field of view.
    pub field_of_view: f32,
    /// Perspective or orthographic.
    pub projection: Projection,
}

impl Camera {
    /// Looks at the whole box `min..max` from `view`.
    pub fn framing(min: Vec3, max: Vec3, view: StandardView, aspect: f32) -> Self {
        let _ = (min, max, view, aspect);
        unimplemented!()
    }

    /// Turns the view to `view`, keeping pivot, distance and projection.
    pub fn set_view(&mut self, view: StandardView) {
        let _ = view;
        unimplemented!()
    }

    /// Moves so that the box is framed, keeping the direction.
    pub fn frame(&mut self, min: Vec3, max: Vec3, aspect: f32) {
        let _ = (min, max, aspect);
        unimplemented!()
    }

    /// Orbits by a pointer motion in pixels.
    pub fn orbit(&mut self, delta: Vec2) {
        let _ = delta;
        unimplemented!()
    }

    /// Pans by a pointer motion in pixels, so that what is at the pivot's depth follows the pointer.
    pub fn pan(&mut self, delta: Vec2, size: Vec2) {
        let _ = (delta, size);
        unimplemented!()
    }

    /// Zooms by `factor` (> 1 comes closer), keeping what is under `pointer` (pixels from the top left) in place.
    /// `at` is the world point under the pointer when one is known; else the pivot's depth is used.
    pub fn zoom(&mut self, factor: f32, pointer: Vec2, size: Vec2, at: Option<Vec3>) {
        let _ = (factor, pointer, size, at);
        unimplemented!()
    }

    /// Moves the pivot to `point` without moving the picture's point of view, so the next orbit turns around it.
    pub fn set_pivot(&mut self, point: Vec3) {
        let _ = point;
        unimplemented!()
    }

    /// Position of the eye in world space.
    pub fn eye(&self) -> Vec3 {
        unimplemented!()
    }

    /// Right-handed view matrix, looking along −z.
    pub fn view_from_world(&self) -> Mat4 {
        unimplemented!()
    }

    /// Reversed-z projection (near 1, far 0; infinite far in perspective) times view.
    /// `radius` bounds the scene around its `center`, for the near plane.
    pub fn clip_from_world(&self, aspect: f32) -> Mat4 {
        let _ = aspect;
        unimplemented!()
    }

    /// World length of one pixel at the pivot.
    pub fn pixel_len_at_pivot(&self, size: Vec2) -> f32 {
        let _ = size;
        unimplemented!()
    }

    /// Pixel (from the top left) of a world point; `None` behind the eye.
    pub fn project(&self, point: Vec3, size: Vec2) -> Option<Vec2> {
        let _ = (point, size);
        unimplemented!()
    }
}
