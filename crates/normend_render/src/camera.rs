//! Camera that orbits a pivot, as a turntable or freely, or flies; perspective or orthographic.
//!
//! As a turntable it has an azimuth and an elevation in a world whose [`UpAxis`] stands upright. It holds a rotation instead of
//! those two angles, so that it may also roll; what asks for a turntable takes the roll out.
//!
//! View space is right-handed and looks along −z: x to the right, y up, z ("back") toward the eye. Pixels count from
//! the top left corner of the picture.

mod directions;

use std::f32::consts::FRAC_PI_2;

use glam::camera::rh::proj::directx;
use glam::{BVec3, Mat3, Mat4, Quat, Vec2, Vec3, Vec4};

pub use directions::{StandardView, UpAxis};

/// Radians that the view turns per pixel of an orbiting drag.
const RADIANS_PER_PIXEL: f32 = 0.006;
/// Radius of the ball that a free orbit rolls, as a part of half the picture's shorter side: a drag through its middle turns
/// about as far as the turntable does, one along the border rolls the picture.
const BALL_RADIUS: f32 = 0.5;
/// A camera whose right hand points up or down by less than this (sine) counts as level.
const LEVEL: f32 = 1e-3;
/// Room around a framed box, as a factor on the distance.
const FRAME_MARGIN: f32 = 1.06;
/// Vertical field of view of a new camera, in radians.
const DEFAULT_FIELD_OF_VIEW: f32 = 0.7;

/// Perspective or parallel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Projection {
    /// Lines meet.
    #[default]
    Perspective,
    /// Parallel lines stay parallel.
    Orthographic,
}

/// A ball that holds everything drawn, in world space.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BoundingSphere {
    /// Its center.
    pub center: Vec3,
    /// Its radius, ≥ 0.
    pub radius: f32,
}

impl BoundingSphere {
    /// The ball around the box `min..max`.
    pub fn of_box(min: Vec3, max: Vec3) -> Self {
        Self {
            center: 0.5 * (min + max),
            radius: 0.5 * (max - min).length(),
        }
    }
}

/// Where the view is seen from. Lengths in the cloud's unit, angles in radians, sizes in pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// The point that orbiting turns around, in world space.
    pub pivot: Vec3,
    /// Rotation from view to world space, a unit quaternion.
    pub orientation: Quat,
    /// What stands upright: [`Self::orbit`] keeps it so, and views are named after it. [`Self::set_up_axis`] changes it.
    pub up_axis: UpAxis,
    /// Depth of the pivot below the eye, > 0. Also sets the scale of the orthographic view.
    pub distance: f32,
    /// Where the pivot is seen, as an offset from the view axis (x right, y up, world length at the pivot's depth).
    /// Zero shows the pivot in the middle; [`Self::set_pivot`] sets it so that the picture stays as it is.
    pub pivot_offset: Vec2,
    /// Vertical field of view.
    pub field_of_view: f32,
    /// Perspective or orthographic.
    pub projection: Projection,
}

impl Camera {
    /// Looks at the origin from `view`, one unit away.
    pub fn new(view: StandardView, up_axis: UpAxis) -> Self {
        let mut camera = Self {
            pivot: Vec3::ZERO,
            orientation: Quat::IDENTITY,
            up_axis,
            distance: 1.0,
            pivot_offset: Vec2::ZERO,
            field_of_view: DEFAULT_FIELD_OF_VIEW,
            projection: Projection::default(),
        };
        camera.set_view(view);
        camera
    }

    /// Looks at the whole box `min..max` from `view`, with z up.
    pub fn framing(min: Vec3, max: Vec3, view: StandardView, aspect: f32) -> Self {
        let mut camera = Self::new(view, UpAxis::default());
        camera.frame(min, max, aspect);
        camera
    }

    /// Turns the view to `view`, keeping pivot, distance and projection.
    pub fn set_view(&mut self, view: StandardView) {
        let (azimuth, elevation) = view.angles();
        self.set_angles(azimuth, elevation);
    }

    /// Looks at the pivot from that side of it, upright. `direction` points from the pivot toward the eye, of any length; one
    /// that is zero or not finite changes nothing. Seen from above or below, the picture is that of the standard view.
    pub fn look_from(&mut self, direction: Vec3) {
        let Some(back) = (self.up_axis.frame().transpose() * direction).try_normalize() else {
            return;
        };
        let across = back.truncate().length();
        let azimuth = if across > LEVEL { back.x.atan2(-back.y) } else { 0.0 };
        self.set_angles(azimuth, back.z.atan2(across));
    }

    /// Stands another axis upright and keeps the angles: what was seen from the front still is.
    pub fn set_up_axis(&mut self, up_axis: UpAxis) {
        let (azimuth, elevation) = self.angles();
        self.up_axis = up_axis;
        self.set_angles(azimuth, elevation);
    }

    /// Azimuth around the up axis (0 looks from the front, π/2 from the right) in ±π, and elevation above the horizon in
    /// ±π/2, both in radians and without the roll.
    pub fn angles(&self) -> (f32, f32) {
        let upright = self.up_axis.frame().transpose();
        let (right, back) = (upright * self.right(), upright * self.back());
        let across = back.truncate().length();
        let elevation = back.z.atan2(across);
        // The right hand also tells at the poles, where the eye is above or below. Upside down it points the other way.
        let is_level = right.z.abs() < LEVEL && (upright * self.up()).z > -LEVEL;
        let azimuth = if is_level || across < LEVEL {
            right.y.atan2(right.x)
        } else {
            back.x.atan2(-back.y)
        };
        (azimuth, elevation)
    }

    /// Turns the view to these angles, upright; see [`Self::angles`]. The elevation stops at the poles.
    pub fn set_angles(&mut self, azimuth: f32, elevation: f32) {
        let (sin_azimuth, cos_azimuth) = azimuth.sin_cos();
        let (sin, cos) = elevation.clamp(-FRAC_PI_2, FRAC_PI_2).sin_cos();
        let right = Vec3::new(cos_azimuth, sin_azimuth, 0.0);
        let back = Vec3::new(cos * sin_azimuth, -cos * cos_azimuth, sin);
        let upright = Mat3::from_cols(right, back.cross(right), back);
        self.set_orientation(Quat::from_mat3(&(self.up_axis.frame() * upright)));
    }

    /// The camera of a picture of a turntable: `share` of a turn around the upright axis through the pivot.
    #[must_use]
    pub fn on_turntable(&self, share: f32) -> Self {
        let turn = Quat::from_axis_angle(self.up_axis.direction(), share * std::f32::consts::TAU);
        let mut camera = *self;
        camera.set_orientation(turn * self.orientation);
        camera
    }

    /// Takes the roll out: the horizon is level, and what is up in the world is up in the picture.
    pub fn level(&mut self) {
        let (azimuth, elevation) = self.angles();
        self.set_angles(azimuth, elevation);
    }

    /// The only way in, so that rounding never adds up and an angle that is not finite changes nothing.
    fn set_orientation(&mut self, orientation: Quat) {
        let len = orientation.length();
        if len.is_finite() && len > 0.0 {
            self.orientation = orientation / len;
        }
    }

    /// The camera on the way from `self` to `to`: `t` = 0 is `self` but for the projection, 1 is `to`. Directions turn evenly, the
    /// distance grows or shrinks by the same factor in the same time.
    pub fn toward(&self, to: &Self, t: f32) -> Self {
        if t >= 1.0 {
            return *to;
        }
        Self {
            pivot: self.pivot.lerp(to.pivot, t),
            orientation: self.orientation.slerp(to.orientation, t),
            distance: self.distance * (to.distance / self.distance).powf(t),
            pivot_offset: self.pivot_offset.lerp(to.pivot_offset, t),
            field_of_view: self.field_of_view + t * (to.field_of_view - self.field_of_view),
            up_axis: to.up_axis,
            projection: to.projection,
        }
    }

    /// Moves so that the box is framed, keeping the direction. A box that is empty or not finite changes nothing.
    pub fn frame(&mut self, min: Vec3, max: Vec3, aspect: f32) {
        if min.cmple(max).all() {
            let corner = |bits: u32| {
                let pick = |bit: u32| bits >> bit & 1 == 1;
                Vec3::select(BVec3::new(pick(0), pick(1), pick(2)), max, min)
            };
            self.frame_points([0, 1, 2, 3, 4, 5, 6, 7].map(corner), aspect);
        }
    }

    /// Moves so that `points` fill the picture from edge to edge, keeping the direction; the pivot goes to the middle of their
    /// box. No points, or points that are not finite, change nothing. O(n).
    pub fn frame_points(&mut self, points: impl IntoIterator<Item = Vec3> + Clone, aspect: f32) {
        let empty = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let (min, max) = points
            .clone()
            .into_iter()
            .fold(empty, |(min, max), point| (min.min(point), max.max(point)));
        let center = min + 0.5 * (max - min);
        if !(min.is_finite() && max.is_finite() && center.is_finite()) {
            return;
        }
        // All points must be on the inner side of the four planes through the eye and the picture's edges. In view space
        // around the center, with the eye at (x, y, d): x_i - x <= slope (d - z_i) and x - x_i <= slope (d - z_i).
        let tan_y = (0.5 * self.field_of_view).tan();
        let slope = Vec2::new(tan_y * aspect, tan_y);
        let rotation = self.view_rotation();
        let (mut low, mut high) = (Vec2::INFINITY, Vec2::NEG_INFINITY);
        for point in points {
            let in_view = rotation * (point - center);
            let nearer = match self.projection {
                Projection::Perspective => slope * in_view.z,
                Projection::Orthographic => Vec2::ZERO,
            };
            low = low.min(in_view.truncate() - nearer);
            high = high.max(in_view.truncate() + nearer);
        }
        let distance = (0.5 * (high - low) / slope).max_element();
        self.pivot = center;
        self.pivot_offset = -0.5 * (low + high);
        self.distance = if distance > 0.0 {
            limit_distance(distance * FRAME_MARGIN, center)
        } else {
            1.0
        };
    }

    /// Orbits as a turntable by a pointer motion in pixels: the scene follows the pointer, the elevation stops at the poles.
    /// A roll is taken out.
    pub fn orbit(&mut self, delta: Vec2) {
        let (azimuth, elevation) = self.angles();
        let angles = Vec2::new(azimuth, elevation) + Vec2::new(-delta.x, delta.y) * RADIANS_PER_PIXEL;
        self.set_angles(angles.x, angles.y);
    }

    /// Orbits freely by a pointer motion in pixels: about the picture's own axes, over the poles.
    pub fn turn(&mut self, delta: Vec2) {
        let turn = Vec3::new(-delta.y, -delta.x, 0.0) * RADIANS_PER_PIXEL;
        self.set_orientation(self.orientation * Quat::from_scaled_axis(turn));
    }

    /// Orbits freely as if the pointer rolled a ball in the middle of the picture, from pixel `from` to pixel `to`; along the
    /// border of the picture the view rolls.
    pub fn roll_ball(&mut self, from: Vec2, to: Vec2, size: Vec2) {
        // A ball that flares into a sheet below the picture (Bell), so that there is no edge to fall off.
        let on_ball = |pixel: Vec2| {
            let across = (pixel - 0.5 * size) * Vec2::new(1.0, -1.0) / (0.5 * size.min_element());
            let (len, ball) = (across.length_squared(), BALL_RADIUS * BALL_RADIUS);
            let height = if len < 0.5 * ball {
                (ball - len).sqrt()
            } else {
                0.5 * ball / len.sqrt()
            };
            across.extend(height).normalize_or(Vec3::Z)
        };
        let turn = Quat::from_rotation_arc(on_ball(to), on_ball(from));
        self.set_orientation(self.orientation * turn);
    }

    /// Looks around from where the eye is, by a pointer motion in pixels: what is in the middle follows the pointer. A roll is
    /// taken out, the elevation stops at the poles.
    pub fn look(&mut self, delta: Vec2, size: Vec2) {
        let eye = self.eye();
        let (azimuth, elevation) = self.angles();
        let angles = delta * (2.0 * (0.5 * self.field_of_view).tan() / size.y);
        self.set_angles(azimuth + angles.x, elevation - angles.y);
        self.pivot += eye - self.eye();
    }

    /// Moves eye and pivot to the right, up and forward, in world lengths.
    pub fn travel(&mut self, by: Vec3) {
        self.pivot += self.right() * by.x + self.up() * by.y - self.back() * by.z;
    }

    /// Pans by a pointer motion in pixels, so that what is at the pivot's depth follows the pointer.
    pub fn pan(&mut self, delta: Vec2, size: Vec2) {
        let len = self.pixel_len_at_pivot(size);
        self.pivot += (self.up() * delta.y - self.right() * delta.x) * len;
    }

    /// Zooms by `factor` (> 1 comes closer), keeping what is under `pointer` (pixels from the top left) in place.
    /// `at` is the world point under the pointer when one is known; else the pivot's depth is used.
    pub fn zoom(&mut self, factor: f32, pointer: Vec2, size: Vec2, at: Option<Vec3>) {
        let at = at.unwrap_or_else(|| self.unproject(pointer, self.distance, size));
        let distance = limit_distance(self.distance / factor, self.pivot);
        let scale = distance / self.distance;
        if !scale.is_finite() || scale <= 0.0 {
            return;
        }
        // The camera shrinks toward `at` as a whole, so the ray from the eye through `at` stays the same.
        self.pivot = at + (self.pivot - at) * scale;
        self.pivot_offset *= scale;
        self.distance = distance;
    }

    /// Moves the pivot to `point` without changing the picture, so the next orbit turns around it. A point behind the
    /// eye changes nothing.
    pub fn set_pivot(&mut self, point: Vec3) {
        let in_view = self.view_rotation() * (point - self.eye());
        match self.projection {
            Projection::Perspective if -in_view.z > 1e-6 * self.distance => self.distance = -in_view.z,
            Projection::Perspective => return,
            // Here the distance is the scale, so it stays and the eye slides along the view axis.
            Projection::Orthographic => {}
        }
        self.pivot = point;
        self.pivot_offset = in_view.truncate();
    }

    /// Unit vector to the right of the picture, in world space.
    pub fn right(&self) -> Vec3 {
        self.orientation * Vec3::X
    }

    /// Unit vector to the top of the picture, in world space.
    pub fn up(&self) -> Vec3 {
        self.orientation * Vec3::Y
    }

    /// Unit vector from the scene toward the eye, in world space.
    pub fn back(&self) -> Vec3 {
        self.orientation * Vec3::Z
    }

    /// Position of the eye in world space.
    pub fn eye(&self) -> Vec3 {
        self.pivot - self.right() * self.pivot_offset.x - self.up() * self.pivot_offset.y + self.back() * self.distance
    }

    /// Rotation from world to view space.
    pub(crate) fn view_rotation(&self) -> Mat3 {
        Mat3::from_quat(self.orientation).transpose()
    }

    /// Depths (along the view axis, from the eye) of the near and the far plane that hold `scene`. The far plane of a
    /// perspective view is at infinity.
    pub(crate) fn depth_range(&self, scene: BoundingSphere) -> (f32, f32) {
        let center = (self.eye() - scene.center).dot(self.back());
        match self.projection {
            Projection::Perspective => {
                let nearest = (self.eye() - scene.center).length() - scene.radius;
                ((0.5 * nearest).max(1e-3 * self.distance), f32::INFINITY)
            }
            Projection::Orthographic => {
                // Parallel views show what is behind the eye as well. The margin holds what sticks out of the scene.
                let reach = 1.05 * scene.radius + 0.05 * self.distance;
                (center - reach, center + reach)
            }
        }
    }

    /// Reversed-z projection: near 1, far 0, infinite far in perspective.
    pub(crate) fn clip_from_view(&self, aspect: f32, scene: BoundingSphere) -> Mat4 {
        let (near, far) = self.depth_range(scene);
        match self.projection {
            Projection::Perspective => directx::perspective_infinite_reverse(self.field_of_view, aspect, near),
            Projection::Orthographic => {
                let y = self.distance * (0.5 * self.field_of_view).tan();
                let x = y * aspect;
                directx::orthographic(-x, x, -y, y, far, near)
            }
        }
    }

    /// The four numbers a, b, c, d that give the depth of a clip-space z as (a + b·z)/(c + d·z).
    pub(crate) fn depth_from_clip(&self, scene: BoundingSphere) -> Vec4 {
        let (near, far) = self.depth_range(scene);
        match self.projection {
            Projection::Perspective => Vec4::new(near, 0.0, 0.0, 1.0),
            Projection::Orthographic => Vec4::new(far, near - far, 1.0, 0.0),
        }
    }

    /// World length of one pixel at `depth` below the eye.
    pub(crate) fn pixel_len(&self, depth: f32, size: Vec2) -> f32 {
        match self.projection {
            Projection::Perspective => 2.0 * depth * (0.5 * self.field_of_view).tan() / size.y,
            Projection::Orthographic => self.pixel_len_at_pivot(size),
        }
    }

    /// World length of one pixel at the pivot.
    pub fn pixel_len_at_pivot(&self, size: Vec2) -> f32 {
        2.0 * self.distance * (0.5 * self.field_of_view).tan() / size.y
    }

    /// Pixel (from the top left) of a world point; `None` behind the eye.
    pub fn project(&self, point: Vec3, size: Vec2) -> Option<Vec2> {
        let in_view = self.view_rotation() * (point - self.eye());
        let len = match self.projection {
            Projection::Perspective if -in_view.z <= f32::MIN_POSITIVE => return None,
            _ => self.pixel_len(-in_view.z, size),
        };
        Some(0.5 * size + Vec2::new(in_view.x, -in_view.y) / len)
    }

    /// What is seen at `pixel` (from the top left), near and far: the place in the eye's plane where the line of sight begins, and
    /// its direction of unit length, away from the eye.
    pub fn ray(&self, pixel: Vec2, size: Vec2) -> (Vec3, Vec3) {
        let across = (pixel - 0.5 * size) * self.pixel_len_at_pivot(size) / self.distance;
        let forward = match self.projection {
            Projection::Perspective => self.right() * across.x - self.up() * across.y - self.back(),
            Projection::Orthographic => -self.back(),
        };
        (self.unproject(pixel, 0.0, size), forward.normalize_or(-self.back()))
    }

    /// World point seen at `pixel` (from the top left) at `depth` along the view axis; the inverse of [`Self::project`].
    pub fn unproject(&self, pixel: Vec2, depth: f32, size: Vec2) -> Vec3 {
        let across = (pixel - 0.5 * size) * self.pixel_len(depth, size);
        self.eye() + self.right() * across.x - self.up() * across.y - self.back() * depth
    }
}

/// Keeps a distance where `f32` still tells neighboring places apart.
fn limit_distance(distance: f32, around: Vec3) -> f32 {
    let smallest = (1e-6 * around.abs().max_element()).max(1e-18);
    distance.clamp(smallest, 1e18)
}

#[cfg(test)]
mod tests;
