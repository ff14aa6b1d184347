//! The camera's mathematics, on random cameras.

use std::f32::consts::PI;

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
        up_axes(),
        prop_oneof![Just(0.0_f32), -PI..PI],
    )
        .prop_map(
            |(pivot, azimuth, elevation, distance, offset, perspective, up_axis, roll)| {
                let mut camera = Camera::new(StandardView::Front, up_axis);
                camera.set_angles(azimuth, elevation);
                camera.orientation *= Quat::from_rotation_z(roll);
                Camera {
                    pivot: Vec3::from_array(pivot),
                    distance,
                    pivot_offset: Vec2::from_array(offset),
                    projection: if perspective {
                        Projection::Perspective
                    } else {
                        Projection::Orthographic
                    },
                    ..camera
                }
            },
        )
}

fn up_axes() -> impl Strategy<Value = UpAxis> {
    prop::sample::select(UpAxis::ALL.as_slice())
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
    assert!((camera.angles().1 - FRAC_PI_2).abs() < 1e-6, "{:?}", camera.angles());
    camera.orbit(Vec2::new(1e6, -1e7));
    assert!((camera.angles().1 + FRAC_PI_2).abs() < 1e-6, "{:?}", camera.angles());
    assert!(camera.angles().0.abs() <= PI && camera.eye().is_finite());
    // Around the pole the picture turns, and it comes down on the side that it turned to.
    camera.set_view(StandardView::Top);
    camera.orbit(Vec2::new(FRAC_PI_2 / RADIANS_PER_PIXEL, 0.0));
    camera.orbit(Vec2::new(0.0, -FRAC_PI_2 / RADIANS_PER_PIXEL));
    assert!(camera.back().distance(Vec3::NEG_X) < 1e-5, "{}", camera.back());
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

proptest! {
    #[test]
    fn angles_are_those_that_were_set(azimuth in -3.1_f32..3.1, elevation in -FRAC_PI_2..=FRAC_PI_2, up_axis in up_axes()) {
        let mut camera = Camera::new(StandardView::Front, up_axis);
        camera.set_angles(azimuth, elevation);
        let (azimuth_again, elevation_again) = camera.angles();
        prop_assert!((azimuth_again - azimuth).abs() < 1e-5, "{azimuth_again} from {azimuth}");
        prop_assert!((elevation_again - elevation).abs() < 1e-5, "{elevation_again} from {elevation}");
    }

    #[test]
    fn leveling_takes_out_the_roll_and_keeps_the_direction(camera in cameras()) {
        let mut level = camera;
        level.level();
        let up = camera.up_axis.direction();
        prop_assert!(level.right().dot(up).abs() < 1e-5, "{}", level.right());
        prop_assert!(level.up().dot(up) > -1e-5, "{}", level.up());
        prop_assert!(level.back().distance(camera.back()) < 2e-3, "{} from {}", level.back(), camera.back());
    }

    #[test]
    fn a_ray_goes_through_what_is_seen_there(camera in cameras(), pixel in pixels(), depth in 0.3_f32..30.0) {
        let point = camera.unproject(pixel, depth, SIZE);
        let (from, direction) = camera.ray(pixel, SIZE);
        let along = (point - from).dot(direction);
        prop_assert!(along > 0.0 && (direction.length() - 1.0).abs() < 1e-5);
        prop_assert!((from + along * direction).distance(point) < 1e-4 * (depth + point.length()));
    }

    #[test]
    fn a_ball_rolled_there_and_back_is_as_before(camera in cameras(), from in pixels(), to in pixels()) {
        let mut rolled = camera;
        rolled.roll_ball(from, to, SIZE);
        rolled.roll_ball(to, from, SIZE);
        prop_assert!(rolled.right().distance(camera.right()) < 1e-5);
        prop_assert!(rolled.back().distance(camera.back()) < 1e-5);
    }

    #[test]
    fn looking_around_keeps_the_eye(camera in cameras(), x in -900.0_f32..900.0, y in -900.0_f32..900.0) {
        let mut turned = camera;
        turned.look(Vec2::new(x, y), SIZE);
        prop_assert!(turned.eye().distance(camera.eye()) < 1e-4 * camera.eye().length().max(camera.distance));
    }

    #[test]
    fn looking_from_a_direction_looks_from_there_upright(
        camera in cameras(), direction in prop::array::uniform3(-1.0_f32..1.0), scale in -18_i32..18
    ) {
        let direction = Vec3::from_array(direction) * 10.0_f32.powi(scale);
        let Some(unit) = direction.try_normalize() else { return Ok(()) };
        let mut turned = camera;
        turned.look_from(direction);
        prop_assert!(turned.back().distance(unit) < 2e-3, "{} from {unit}", turned.back());
        prop_assert!(turned.right().dot(camera.up_axis.direction()).abs() < 1e-5);
        prop_assert_eq!(turned.pivot, camera.pivot);
    }

    #[test]
    fn the_way_to_another_camera_begins_and_ends_there_and_is_a_camera(from in cameras(), to in cameras(), t in 0.0_f32..1.0) {
        let start = from.toward(&to, 0.0);
        prop_assert!(start.eye().distance(from.eye()) < 1e-3 && start.back().distance(from.back()) < 1e-5);
        prop_assert_eq!(from.toward(&to, 1.0), to);
        let between = from.toward(&to, t);
        prop_assert!((between.orientation.length() - 1.0).abs() < 1e-4 && between.eye().is_finite());
        let (near, far) = (from.distance.min(to.distance), from.distance.max(to.distance));
        prop_assert!((near * 0.999..=far * 1.001).contains(&between.distance));
    }

    /// Extents from a millionth to ten million units, anywhere: nothing is lost, however the camera is moved.
    #[test]
    fn any_motion_in_any_scene_stays_finite(
        up_axis in up_axes(), exponent in -6_i32..=7, at in prop::array::uniform3(-1.0_f32..1.0), aspect in 0.1_f32..10.0,
        motions in prop::collection::vec((0..7_u8, -3e3_f32..3e3, -3e3_f32..3e3), 1..60),
    ) {
        let extent = 10.0_f32.powi(exponent);
        let center = Vec3::from_array(at) * extent;
        let mut camera = Camera::new(StandardView::Top, up_axis);
        camera.frame(center - 0.5 * extent, center + 0.5 * extent, aspect);
        let size = Vec2::new(500.0 * aspect, 500.0);
        prop_assert!(camera.project(center, size).unwrap().distance(0.5 * size) < 0.05 * size.max_element());
        for (kind, x, y) in motions {
            let delta = Vec2::new(x, y);
            match kind {
                0 => camera.orbit(delta),
                1 => camera.turn(delta),
                2 => camera.roll_ball(Vec2::ZERO, delta, size),
                3 => camera.look(delta, size),
                4 => camera.pan(0.1 * delta, size),
                5 => camera.zoom((1e-3 * x).exp(), 0.1 * delta, size, None),
                _ => camera.travel(1e-3 * extent * delta.extend(x)),
            }
            prop_assert!(camera.eye().is_finite() && camera.distance > 0.0, "{camera:?}");
            prop_assert!((camera.orientation.length() - 1.0).abs() < 1e-5, "{camera:?}");
            let scene = BoundingSphere { center, radius: extent };
            prop_assert!(camera.clip_from_view(aspect, scene).is_finite(), "{camera:?}");
        }
    }
}

#[test]
fn a_free_orbit_goes_over_the_pole_and_a_turntable_does_not() {
    let start = Camera::new(StandardView::Front, UpAxis::ZUp);
    let over = Vec2::new(0.0, 0.75 * PI / RADIANS_PER_PIXEL);
    let (mut free, mut turntable) = (start, start);
    free.turn(over);
    turntable.orbit(over);
    assert!(free.up().z < -0.5, "upside down: {}", free.up());
    assert!(turntable.back().distance(Vec3::Z) < 1e-5, "{}", turntable.back());
    // Both follow the pointer the same way.
    let (mut free, mut turntable) = (start, start);
    free.turn(Vec2::new(20.0, 10.0));
    turntable.orbit(Vec2::new(20.0, 10.0));
    assert!(
        free.back().distance(turntable.back()) < 0.02,
        "{} {}",
        free.back(),
        turntable.back()
    );
    let mut ball = start;
    ball.roll_ball(0.5 * SIZE, 0.5 * SIZE + Vec2::new(20.0, 10.0), SIZE);
    assert!(
        ball.back().dot(turntable.back()) > 0.99 && ball.back().z > 0.0 && ball.back().x < 0.0,
        "{}",
        ball.back()
    );
}

#[test]
fn dragging_along_the_border_rolls() {
    let mut camera = Camera::new(StandardView::Front, UpAxis::ZUp);
    let middle = 0.5 * SIZE;
    let at = |angle: f32| middle + 0.5 * SIZE.y * Vec2::from_angle(angle);
    for step in 0..30 {
        camera.roll_ball(at(0.02 * step as f32), at(0.02 * (step + 1) as f32), SIZE);
    }
    // Pixels count downward, so the pointer went clockwise, and the scene with it: the camera leans to the left.
    assert!(camera.up().dot(Vec3::NEG_X) > 0.4, "{}", camera.up());
    assert!(camera.back().dot(Vec3::NEG_Y) > 0.9, "{}", camera.back());
}

#[test]
fn standard_views_follow_the_up_axis() {
    for up_axis in UpAxis::ALL {
        let frame = up_axis.frame();
        assert_eq!(frame.determinant(), 1.0, "{up_axis:?} is no mirror");
        for view in StandardView::ALL {
            let (z_up, other) = (Camera::new(view, UpAxis::ZUp), Camera::new(view, up_axis));
            assert!(
                other.back().distance(frame * z_up.back()) < 1e-6,
                "{up_axis:?} {view:?}"
            );
            assert!(other.up().distance(frame * z_up.up()) < 1e-6, "{up_axis:?} {view:?}");
            let mut turned = z_up;
            turned.set_up_axis(up_axis);
            assert!(turned.back().distance(other.back()) < 1e-5, "{up_axis:?} {view:?}");
            assert!(turned.up().distance(other.up()) < 1e-5, "{up_axis:?} {view:?}");
        }
        assert_eq!(
            Camera::new(StandardView::Front, up_axis).up().round(),
            up_axis.direction()
        );
    }
}

#[test]
fn a_turntable_turns_around_the_upright_axis_and_ends_where_it_began() {
    for up_axis in UpAxis::ALL {
        let mut camera = Camera::new(StandardView::Corner, up_axis);
        camera.pivot = Vec3::new(1.0, 2.0, 3.0);
        let up = up_axis.direction();
        let quarter = camera.on_turntable(0.25);
        assert!((quarter.back().dot(up) - camera.back().dot(up)).abs() < 1e-5);
        assert!(quarter.eye().distance(camera.eye()) > 0.1);
        assert!(camera.on_turntable(1.0).eye().distance(camera.eye()) < 1e-4);
        assert_eq!(quarter.pivot, camera.pivot);
    }
}
