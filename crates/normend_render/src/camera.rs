//! Orbit camera around a pivot: turntable with z up, perspective or orthographic.
//!
//! View space is right-handed and looks along −z: x to the right, y up, z ("back") toward the eye. Pixels count from
//! the top left corner of the picture.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

use glam::camera::rh::proj::directx;
use glam::{BVec3, Mat3, Mat4, Vec2, Vec3, Vec4};

/// Radians that the view turns per pixel of an orbiting drag.
const RADIANS_PER_PIXEL: f32 = 0.006;
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
        match self {
            Self::Front => "Front",
            Self::Back => "Back",
            Self::Right => "Right",
            Self::Left => "Left",
            Self::Top => "Top",
            Self::Bottom => "Bottom",
            Self::Corner => "Corner",
        }
    }

    /// The name on the command line ("front").
    pub fn name(self) -> &'static str {
        match self {
            Self::Front => "front",
            Self::Back => "back",
            Self::Right => "right",
            Self::Left => "left",
            Self::Top => "top",
            Self::Bottom => "bottom",
            Self::Corner => "corner",
        }
    }

    /// Azimuth and elevation in radians.
    fn angles(self) -> (f32, f32) {
        match self {
            Self::Front => (0.0, 0.0),
            Self::Back => (PI, 0.0),
            Self::Right => (FRAC_PI_2, 0.0),
            Self::Left => (-FRAC_PI_2, 0.0),
            Self::Top => (0.0, FRAC_PI_2),
            Self::Bottom => (0.0, -FRAC_PI_2),
            // The diagonal of a cube rises by asin(1/√3).
            Self::Corner => (FRAC_PI_4, 0.615_479_7),
        }
    }
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
    /// Angle around z; 0 looks along +y (from the front).
    pub azimuth: f32,
    /// Angle above the horizon, within ±π/2.
    pub elevation: f32,
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
    /// Looks at the whole box `min..max` from `view`.
    pub fn framing(min: Vec3, max: Vec3, view: StandardView, aspect: f32) -> Self {
        let (azimuth, elevation) = view.angles();
        let mut camera = Self {
            pivot: Vec3::ZERO,
            azimuth,
            elevation,
            distance: 1.0,
            pivot_offset: Vec2::ZERO,
            field_of_view: DEFAULT_FIELD_OF_VIEW,
            projection: Projection::default(),
        };
        camera.frame(min, max, aspect);
        camera
    }

    /// Turns the view to `view`, keeping pivot, distance and projection.
    pub fn set_view(&mut self, view: StandardView) {
        (self.azimuth, self.elevation) = view.angles();
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

    /// Orbits by a pointer motion in pixels: the scene follows the pointer, the elevation stops at the poles.
    pub fn orbit(&mut self, delta: Vec2) {
        let azimuth = self.azimuth - delta.x * RADIANS_PER_PIXEL;
        self.azimuth = (azimuth + PI).rem_euclid(TAU) - PI;
        self.elevation = (self.elevation + delta.y * RADIANS_PER_PIXEL).clamp(-FRAC_PI_2, FRAC_PI_2);
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
        let (sin, cos) = self.azimuth.sin_cos();
        Vec3::new(cos, sin, 0.0)
    }

    /// Unit vector to the top of the picture, in world space.
    pub fn up(&self) -> Vec3 {
        self.back().cross(self.right())
    }

    /// Unit vector from the scene toward the eye, in world space.
    pub fn back(&self) -> Vec3 {
        let (sin_azimuth, cos_azimuth) = self.azimuth.sin_cos();
        let (sin, cos) = self.elevation.sin_cos();
        Vec3::new(cos * sin_azimuth, -cos * cos_azimuth, sin)
    }

    /// Position of the eye in world space.
    pub fn eye(&self) -> Vec3 {
        self.pivot - self.right() * self.pivot_offset.x - self.up() * self.pivot_offset.y + self.back() * self.distance
    }

    /// Rotation from world to view space.
    pub(crate) fn view_rotation(&self) -> Mat3 {
        Mat3::from_cols(self.right(), self.up(), self.back()).transpose()
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
mod tests {
    use proptest::prelude::*;

    use super::*;

    const SIZE: Vec2 = Vec2::new(1280.0, 720.0);

    fn cameras() -> impl Strategy<Value = Camera> {
        (
            prop::array::uniform3(-5.0_f32..5.0),
            -PI..PI,
            -FRAC_PI_2..=FRAC_PI_2,
            0.5_f32..20.0,
            prop::array::uniform2(-1.0_f32..1.0),
            prop::bool::ANY,
        )
            .prop_map(|(pivot, azimuth, elevation, distance, offset, perspective)| Camera {
                pivot: Vec3::from_array(pivot),
                azimuth,
                elevation,
                distance,
                pivot_offset: Vec2::from_array(offset),
                field_of_view: DEFAULT_FIELD_OF_VIEW,
                projection: if perspective {
                    Projection::Perspective
                } else {
                    Projection::Orthographic
                },
            })
    }

    fn pixels() -> impl Strategy<Value = Vec2> {
        (0.0..SIZE.x, 0.0..SIZE.y).prop_map(|(x, y)| Vec2::new(x, y))
    }

    proptest! {
        #[test]
        fn project_inverts_unproject(camera in cameras(), pixel in pixels(), depth in 0.3_f32..30.0) {
            let point = camera.unproject(pixel, depth, SIZE);
            let back = camera.project(point, SIZE).unwrap();
            prop_assert!(back.distance(pixel) < 0.05, "{back} from {pixel}");
        }

        #[test]
        fn the_matrix_projects_as_project_does(camera in cameras(), pixel in pixels(), depth in 0.3_f32..30.0) {
            let scene = BoundingSphere { center: camera.pivot, radius: 40.0 };
            let point = camera.unproject(pixel, depth, SIZE);
            let in_view = camera.view_rotation() * (point - camera.eye());
            let clip = camera.clip_from_view(SIZE.x / SIZE.y, scene) * in_view.extend(1.0);
            let ndc = clip / clip.w;
            let seen = (Vec2::new(ndc.x, -ndc.y) * 0.5 + 0.5) * SIZE;
            prop_assert!(seen.distance(pixel) < 0.05, "{seen} from {pixel}");
            prop_assert!((0.0..=1.0).contains(&ndc.z), "z {}", ndc.z);
            let a = camera.depth_from_clip(scene);
            let depth_again = (a.x + a.y * ndc.z) / (a.z + a.w * ndc.z);
            prop_assert!((depth_again - depth).abs() < 1e-4 * depth.max(1.0) + 1e-5 * 80.0, "{depth_again} from {depth}");
        }

        #[test]
        fn zoom_keeps_what_is_under_the_pointer(
            camera in cameras(), pixel in pixels(), depth in 0.5_f32..30.0, factor in 0.3_f32..3.0, known in prop::bool::ANY
        ) {
            let mut zoomed = camera;
            let at = camera.unproject(pixel, if known { depth } else { camera.distance }, SIZE);
            zoomed.zoom(factor, pixel, SIZE, known.then_some(at));
            let seen = zoomed.project(at, SIZE).unwrap();
            prop_assert!(seen.distance(pixel) < 0.1, "{seen} from {pixel}");
            prop_assert!((zoomed.distance * factor / camera.distance - 1.0).abs() < 1e-4);
        }

        #[test]
        fn pan_moves_the_pivots_place_by_the_pointer(camera in cameras(), x in -300.0_f32..300.0, y in -300.0_f32..300.0) {
            let mut panned = camera;
            let before = camera.project(camera.pivot, SIZE).unwrap();
            panned.pan(Vec2::new(x, y), SIZE);
            let after = panned.project(camera.pivot, SIZE).unwrap();
            prop_assert!((after - before).distance(Vec2::new(x, y)) < 0.05, "{before} to {after}");
        }

        #[test]
        fn a_new_pivot_keeps_the_picture_and_stays_in_place_while_orbiting(
            camera in cameras(), pixel in pixels(), depth in 0.5_f32..30.0, other in pixels()
        ) {
            let mut turned = camera;
            let pivot = camera.unproject(pixel, depth, SIZE);
            let elsewhere = camera.unproject(other, 0.5 * depth, SIZE);
            turned.set_pivot(pivot);
            prop_assert!(turned.project(elsewhere, SIZE).unwrap().distance(other) < 0.1);
            turned.orbit(Vec2::new(40.0, -25.0));
            prop_assert!(turned.project(pivot, SIZE).unwrap().distance(pixel) < 0.1);
        }

        #[test]
        fn a_framed_box_is_inside_the_picture(
            camera in cameras(), min in prop::array::uniform3(-9.0_f32..0.0), len in prop::array::uniform3(0.01_f32..9.0)
        ) {
            let mut camera = camera;
            let (min, len) = (Vec3::from_array(min), Vec3::from_array(len));
            camera.frame(min, min + len, SIZE.x / SIZE.y);
            for corner in 0..8 {
                let pick = Vec3::new((corner & 1) as f32, (corner >> 1 & 1) as f32, (corner >> 2 & 1) as f32);
                let seen = camera.project(min + len * pick, SIZE).unwrap();
                prop_assert!(seen.cmpge(Vec2::ZERO).all() && seen.cmple(SIZE).all(), "corner {corner} at {seen}");
            }
        }

        #[test]
        fn framed_points_fill_the_picture_from_edge_to_edge(
            camera in cameras(),
            points in prop::collection::vec(prop::array::uniform3(-9.0_f32..9.0).prop_map(Vec3::from_array), 2..20),
        ) {
            let mut camera = camera;
            camera.frame_points(points.iter().copied(), SIZE.x / SIZE.y);
            let seen = points.iter().map(|&point| camera.project(point, SIZE).unwrap());
            let empty = (Vec2::INFINITY, Vec2::NEG_INFINITY);
            let (min, max) = seen.fold(empty, |(min, max), pixel| (min.min(pixel), max.max(pixel)));
            prop_assert!(min.cmpge(Vec2::ZERO).all() && max.cmple(SIZE).all(), "{min} {max}");
            // Without the margin, two of them touch opposite edges. In perspective the eye may have to stand in one of them.
            camera.distance /= FRAME_MARGIN;
            let (min, max) = points
                .iter()
                .filter_map(|&point| camera.project(point, SIZE))
                .fold(empty, |(min, max), pixel| (min.min(pixel), max.max(pixel)));
            let fills = ((max - min) / SIZE).max_element() > 0.99;
            prop_assert!(fills || camera.projection == Projection::Perspective, "{min} {max}");
        }
    }

    #[test]
    fn standard_views_look_from_their_side_with_a_steady_up() {
        let check = |view: StandardView, back: Vec3, up: Vec3| {
            let camera = Camera::framing(Vec3::splat(-1.0), Vec3::splat(1.0), view, 1.5);
            assert!(camera.back().distance(back) < 1e-6, "{view:?} {}", camera.back());
            assert!(camera.up().distance(up) < 1e-6, "{view:?} {}", camera.up());
        };
        check(StandardView::Front, Vec3::NEG_Y, Vec3::Z);
        check(StandardView::Back, Vec3::Y, Vec3::Z);
        check(StandardView::Right, Vec3::X, Vec3::Z);
        check(StandardView::Left, Vec3::NEG_X, Vec3::Z);
        check(StandardView::Top, Vec3::Z, Vec3::Y);
        check(StandardView::Bottom, Vec3::NEG_Z, Vec3::NEG_Y);
        let corner = Camera::framing(Vec3::splat(-1.0), Vec3::splat(1.0), StandardView::Corner, 1.0);
        assert!(corner.back().distance(Vec3::new(1.0, -1.0, 1.0) / 3.0_f32.sqrt()) < 1e-6);
    }

    #[test]
    fn framing_centers_what_is_seen_not_the_box() {
        // A pyramid: from the corner, its box reaches far above its tip's sides.
        let points = [
            Vec3::ZERO,
            Vec3::X,
            Vec3::Y,
            Vec3::new(1.0, 1.0, 0.0),
            Vec3::new(0.5, 0.5, 1.5),
        ];
        let mut camera = Camera::framing(
            Vec3::ZERO,
            Vec3::new(1.0, 1.0, 1.5),
            StandardView::Corner,
            SIZE.x / SIZE.y,
        );
        camera.frame_points(points, SIZE.x / SIZE.y);
        let seen = points.map(|point| camera.project(point, SIZE).unwrap());
        let (min, max) = seen.iter().fold((SIZE, Vec2::ZERO), |(min, max), &pixel| {
            (min.min(pixel), max.max(pixel))
        });
        let above_and_below = [min.y, SIZE.y - max.y];
        assert!(
            above_and_below.iter().all(|&room| room > 5.0 && room < 0.06 * SIZE.y),
            "{above_and_below:?}"
        );
    }

    #[test]
    fn orbit_stops_at_the_poles() {
        let mut camera = Camera::framing(Vec3::splat(-1.0), Vec3::splat(1.0), StandardView::Front, 1.0);
        camera.orbit(Vec2::new(0.0, 1e6));
        assert_eq!(camera.elevation, FRAC_PI_2);
        camera.orbit(Vec2::new(1e6, -1e7));
        assert_eq!(camera.elevation, -FRAC_PI_2);
        assert!(camera.azimuth.abs() <= PI && camera.eye().is_finite());
    }

    #[test]
    fn degenerate_boxes_and_endless_zoom_stay_finite() {
        let mut camera = Camera::framing(Vec3::ONE, Vec3::ONE, StandardView::Corner, 1.0);
        assert_eq!(camera.distance, 1.0);
        let before = camera;
        camera.frame(Vec3::splat(f32::INFINITY), Vec3::splat(f32::NEG_INFINITY), 1.0);
        assert_eq!(camera, before);
        for factor in [1e3, 1e-3] {
            for _ in 0..100 {
                camera.zoom(factor, Vec2::new(3.0, 9.0), SIZE, None);
            }
            assert!(camera.eye().is_finite() && camera.distance > 0.0, "{camera:?}");
        }
    }
}
