//! What is on pictures of small clouds, counted pixel by pixel on a real device.

#![expect(clippy::single_range_in_vec_init, reason = "lists of ranges often hold one")]

use egui_wgpu::wgpu;
use glam::{UVec2, Vec2, Vec3};

use super::scene::{ASPECT, Cloud, Picture, SIZE, Scene};
use crate::gpu_types::ID_SPHERE;
use crate::{
    Camera, DisplayMode, HeadlessDevice, Hit, Palette, Projection, RenderError, Sphere, SplatRenderer, StandardView,
};

#[test]
fn a_sphere_is_closed_and_all_front_from_outside_at_any_zoom() {
    let cloud = Cloud::sphere(20_000, Vec3::ZERO, 1.0);
    let Some(mut scene) = Scene::new(&cloud) else { return };
    for projection in [Projection::Perspective, Projection::Orthographic] {
        for distance in [1.6, 3.0, 9.0, 40.0, 400.0] {
            scene.camera = Camera::framing(Vec3::splat(-1.0), Vec3::ONE, StandardView::Corner, ASPECT);
            scene.camera.projection = projection;
            scene.camera.distance = distance;
            let picture = scene.shoot();
            let (front, all) = picture.count_front();
            assert!(all > 2, "nothing drawn at distance {distance}");
            assert_eq!(front, all, "back pixels at distance {distance}, {projection:?}");
            assert_eq!(picture.count_holes(), 0, "holes at distance {distance}, {projection:?}");
        }
    }
}

#[test]
fn a_sphere_is_closed_and_all_back_from_inside() {
    let cloud = Cloud::sphere(20_000, Vec3::ZERO, 1.0);
    let Some(mut scene) = Scene::new(&cloud) else { return };
    scene.camera.distance = 0.2;
    for azimuth in [0.0, 1.0, 2.0] {
        scene.camera.set_angles(azimuth, 0.0);
        let picture = scene.shoot();
        assert_eq!(picture.count_front(), (0, (SIZE[0] * SIZE[1]) as usize));
    }
}

#[test]
fn turning_a_range_changes_exactly_its_pixels_and_uploads_its_words() {
    let cloud = Cloud::sphere(20_000, Vec3::ZERO, 1.0);
    let Some(mut scene) = Scene::new(&cloud) else { return };
    let before = scene.shoot();
    let ranges = [100..900, 9_990..10_111, 10_500..10_501];
    let uploaded = scene.renderer.bytes_uploaded();
    scene.turn(&ranges);
    // 26 words of the first range; the others lie near each other and go together, 17 words with those between.
    assert_eq!(scene.renderer.bytes_uploaded() - uploaded, (26 + 17) * 4);
    let after = scene.shoot();
    let is_turned = |instance: u32| ranges.iter().any(|range| range.contains(&instance));
    assert!(before.splats().any(|(instance, _)| is_turned(instance)));
    assert!(before.ids == after.ids);
    for ((instance, old), (_, new)) in before.splats().zip(after.splats()) {
        // Splats that are edge-on take the side of their neighbors.
        if cloud.cosine(instance, scene.camera.eye()).abs() < 0.21 {
            continue;
        }
        assert_eq!(
            old != new,
            is_turned(instance),
            "instance {instance}: {old:?} to {new:?}"
        );
        assert_eq!(Picture::is_front(new), !is_turned(instance), "instance {instance}");
    }
    scene.turn(&ranges);
    assert!(scene.shoot() == before, "turning twice is not the same as nothing");
    let mut words = vec![0_u32; cloud.positions.len() / 32];
    words[320] = u32::MAX;
    scene.renderer.set_turned(&scene.gpu.queue, &words);
    scene.turn(&[10_240..10_272]);
    assert!(
        scene.shoot() == before,
        "setting words and turning them back is not the same as nothing"
    );
}

#[test]
fn a_highlight_changes_its_pixels_alone_and_uploads_ranges_alone() {
    let cloud = Cloud::sphere(20_000, Vec3::ZERO, 1.0);
    let Some(mut scene) = Scene::new(&cloud) else { return };
    for mode in DisplayMode::ALL {
        scene.settings.mode = mode;
        scene.highlight(&[]);
        let before = scene.shoot();
        let ranges = [3..5, 8_000..9_000, 12_000..12_700];
        let uploaded = scene.renderer.bytes_uploaded();
        scene.highlight(&ranges);
        assert_eq!(scene.renderer.bytes_uploaded() - uploaded, 3 * 8);
        let after = scene.shoot();
        let mut n_changed = 0;
        for ((instance, old), (_, new)) in before.splats().zip(after.splats()) {
            let inside = ranges.iter().any(|range| range.contains(&instance));
            assert_eq!(old != new, inside, "instance {instance}: {old:?} to {new:?}");
            n_changed += usize::from(inside);
        }
        assert!(n_changed > 100);
    }
}

#[test]
fn picks_return_what_is_drawn_and_where() {
    let cloud = Cloud::sphere(20_000, Vec3::ZERO, 1.0);
    let Some(mut scene) = Scene::new(&cloud) else { return };
    for projection in [Projection::Perspective, Projection::Orthographic] {
        scene.camera.projection = projection;
        let picture = scene.shoot();
        let center = UVec2::from(SIZE) / 2;
        for (x, y) in [
            (center.x, center.y),
            (center.x - 60, center.y + 40),
            (center.x + 75, center.y - 10),
        ] {
            let id = picture.ids[(y * SIZE[0] + x) as usize];
            let Some(Hit::Splat { instance, point }) = scene.pick(x, y) else {
                panic!("no splat at {x}, {y}")
            };
            assert_eq!(instance + 1, id, "at {x}, {y}");
            assert!((point.length() - 1.0).abs() < 2e-3, "{point} is not on the sphere");
            let seen = scene.camera.project(point, UVec2::from(SIZE).as_vec2()).unwrap();
            assert!(
                seen.distance(Vec2::new(x as f32, y as f32) + 0.5) < 0.01,
                "{point} is seen at {seen}"
            );
        }
        assert_eq!(scene.pick(0, 0), None);
        // Past the picture: the pixel in its corner.
        assert_eq!(scene.pick(u32::MAX, u32::MAX), None);
    }
}

#[test]
fn a_pick_never_falls_through_a_gap() {
    // A front plate with gaps before a back plate without.
    let mut front = Cloud::plate(60, -1.0, 1.0);
    front.radii.fill(0.012);
    let n_front = front.len();
    let cloud = front.join(Cloud::plate(60, 0.5, 1.0));
    let Some(mut scene) = Scene::new(&cloud) else { return };
    let picture = scene.shoot();
    let (mut n_gaps, mut n_picks) = (0, 0);
    for y in (100..140).step_by(3) {
        for x in (120..200).step_by(3) {
            n_gaps += usize::from(picture.ids[(y * SIZE[0] + x) as usize] > n_front);
            n_picks += 1;
            match scene.pick(x, y) {
                Some(Hit::Splat { instance, .. }) => assert!(instance < n_front, "the back is picked at {x}, {y}"),
                other => panic!("{other:?} at {x}, {y}"),
            }
        }
    }
    assert!(
        n_gaps > n_picks / 10,
        "{n_gaps} gaps in {n_picks} picks: the test tests nothing"
    );
}

#[test]
fn pictures_are_drawn_on_change_alone() {
    let cloud = Cloud::sphere(1_000, Vec3::ZERO, 1.0);
    let Some(mut scene) = Scene::new(&cloud) else { return };
    let check = |scene: &mut Scene, what: &str, changes: bool| {
        assert_eq!(scene.draw(), changes, "{what}");
        assert!(!scene.draw(), "again after {what}");
    };
    check(&mut scene, "first picture", true);
    scene.turn(&[]);
    scene.turn(&[7..7]);
    scene.highlight(&[]);
    scene.set_spheres(&[]);
    check(&mut scene, "nothing", false);
    scene.turn(&[1..2]);
    check(&mut scene, "turn", true);
    scene.highlight(&[4..8]);
    check(&mut scene, "highlight", true);
    scene.highlight(&[4..8]);
    check(&mut scene, "same highlight", false);
    scene.camera.orbit(Vec2::X);
    check(&mut scene, "orbit", true);
    scene.settings.palette = Palette::PAPER;
    check(&mut scene, "palette", true);
    scene.settings.mode = DisplayMode::Normals;
    check(&mut scene, "mode", true);
    scene.set_spheres(&[Sphere {
        center: Vec3::ZERO,
        color: [1.0; 3],
        selected: false,
    }]);
    check(&mut scene, "spheres", true);
    let number = scene.renderer.picture().unwrap().1;
    let HeadlessDevice { device, queue, .. } = &scene.gpu;
    assert!(
        scene
            .renderer
            .draw(device, queue, &scene.camera, [100, 50], 1.0, &scene.settings)
    );
    assert_ne!(
        scene.renderer.picture().unwrap().1,
        number,
        "another size is another texture"
    );
    scene.renderer.clear_cloud();
    check(&mut scene, "no cloud", true);
}

#[test]
fn a_stride_draws_each_sth_and_stays_closed() {
    let cloud = Cloud::sphere(20_000, Vec3::ZERO, 1.0);
    // Chunks that are no multiple of the stride.
    for chunk_points in [usize::MAX, 1_001] {
        let Some(mut scene) = Scene::with(&cloud, None, chunk_points) else {
            return;
        };
        scene.settings.stride = 7;
        // A lattice thinned in its own order is not even, so cover more.
        scene.settings.splat_scale = 2.0;
        let picture = scene.shoot();
        assert!(picture.splats().all(|(instance, _)| instance % 7 == 0));
        let mut drawn: Vec<u32> = picture.splats().map(|(instance, _)| instance).collect();
        drawn.sort_unstable();
        drawn.dedup();
        assert!(drawn.len() > 1_000, "{} instances", drawn.len());
        assert_eq!(picture.count_holes(), 0);
    }
}

#[test]
fn chunks_change_nothing() {
    let cloud = Cloud::sphere(5_000, Vec3::ZERO, 1.0).join(Cloud::plate(40, -0.3, 0.9));
    let Some(mut whole) = Scene::new(&cloud) else { return };
    let Some(mut chunked) = Scene::with(&cloud, None, 700) else {
        return;
    };
    for scene in [&mut whole, &mut chunked] {
        scene.turn(&[650..1_500, 6_000..6_001]);
        scene.highlight(&[690..710, 5_100..5_900]);
    }
    for mode in DisplayMode::ALL {
        (whole.settings.mode, chunked.settings.mode) = (mode, mode);
        assert!(whole.shoot() == chunked.shoot(), "{mode:?}");
    }
}

#[test]
fn spheres_are_seen_on_their_surface_and_picked_and_hidden_behind_others() {
    let cloud = Cloud::sphere(20_000, Vec3::ZERO, 1.0);
    let Some(mut scene) = Scene::new(&cloud) else { return };
    let sphere = |center, selected| Sphere {
        center,
        color: [0.1, 0.9, 0.2],
        selected,
    };
    let spheres = [
        sphere(Vec3::NEG_Y, false),
        sphere(Vec3::Y, false),
        sphere(Vec3::new(0.6, -0.8, 0.0), true),
    ];
    scene.set_spheres(&spheres);
    let picture = scene.shoot();
    let count = |index: u32| picture.ids.iter().filter(|id| **id == ID_SPHERE | index).count();
    // A disc of radius 6 pixels, and one of radius 10.2 with its ring.
    assert!((105..=121).contains(&count(0)), "{}", count(0));
    assert_eq!(count(1), 0, "the sphere on the far side shines through");
    assert!((310..=343).contains(&count(2)), "{}", count(2));
    let size = UVec2::from(SIZE).as_vec2();
    for (index, mark) in [(0, &spheres[0]), (2, &spheres[2])] {
        let at = scene.camera.project(mark.center, size).unwrap().as_uvec2();
        let Some(Hit::Sphere { index: found, point }) = scene.pick(at.x, at.y) else {
            panic!("no sphere at {at}")
        };
        assert_eq!(found, index);
        assert!(point.distance(mark.center) < 0.2, "{point}");
        let [red, green, blue] = picture.colors[(at.y * SIZE[0] + at.x) as usize];
        assert!(green > 150 && red < 80 && blue < 80, "{red} {green} {blue}");
    }
}

#[test]
fn points_without_normals_are_gray_discs() {
    let cloud = Cloud::sphere(20_000, Vec3::ZERO, 1.0);
    let Some(mut scene) = Scene::new(&cloud) else { return };
    let HeadlessDevice { device, queue, .. } = &scene.gpu;
    scene
        .renderer
        .set_cloud(device, queue, &cloud.positions, None, &cloud.radii, None)
        .unwrap();
    let picture = scene.shoot();
    assert!(picture.splats().count() > 10_000);
    assert_eq!(picture.count_holes(), 0);
    assert!(
        picture
            .splats()
            .all(|(_, [red, green, blue])| red == green && green == blue)
    );
    scene.turn(&[0..20_000]);
    assert!(scene.shoot() == picture, "there is nothing to turn");
}

#[test]
fn the_order_maps_instances_to_points() {
    let cloud = Cloud::sphere(3_000, Vec3::ZERO, 1.0);
    let Some(mut scene) = Scene::new(&cloud) else { return };
    let plain = scene.shoot();
    let order: Vec<u32> = (0..cloud.len()).rev().collect();
    let HeadlessDevice { device, queue, .. } = &scene.gpu;
    let Cloud {
        positions,
        normals,
        radii,
    } = &cloud;
    scene
        .renderer
        .set_cloud(device, queue, positions, Some(normals), radii, Some(&order))
        .unwrap();
    let turned_over = scene.shoot();
    assert_eq!(plain.splats().count(), turned_over.splats().count());
    let n_other = plain
        .splats()
        .zip(turned_over.splats())
        .filter(|((a, _), (b, _))| *a != cloud.len() - 1 - b)
        .count();
    // At equal depths the first one drawn is seen.
    assert!(
        n_other < plain.splats().count() / 500,
        "{n_other} pixels show another point"
    );
}

#[test]
fn bad_slices_are_refused_in_words_and_leave_no_cloud() {
    let cloud = Cloud::sphere(100, Vec3::ZERO, 1.0);
    let Some(mut scene) = Scene::new(&cloud) else { return };
    let HeadlessDevice { device, queue, .. } = &scene.gpu;
    let error = scene
        .renderer
        .set_cloud(device, queue, &cloud.positions, None, &[1.0], None)
        .unwrap_err();
    assert!(
        matches!(
            error,
            RenderError::Mismatch {
                expected: 100,
                found: 1,
                ..
            }
        ),
        "{error}"
    );
    assert_eq!(scene.shoot().splats().count(), 0);
    // Nothing at all, points in one place, and lengths that are not finite draw without trouble.
    let HeadlessDevice { device, queue, .. } = &scene.gpu;
    scene
        .renderer
        .set_cloud(device, queue, &[], Some(&[]), &[], None)
        .unwrap();
    assert_eq!(scene.shoot().splats().count(), 0);
    let HeadlessDevice { device, queue, .. } = &scene.gpu;
    let radii = [0.0, f32::NAN, f32::INFINITY];
    scene
        .renderer
        .set_cloud(device, queue, &[Vec3::ZERO; 3], Some(&[Vec3::ZERO; 3]), &radii, None)
        .unwrap();
    assert!(scene.shoot().splats().count() > 0);
}

#[test]
fn limits_of_the_adapter_are_kept_by_chunks_or_told_in_words() {
    let cloud = Cloud::sphere(2_000, Vec3::ZERO, 1.0);
    let Some(mut scene) = Scene::new(&cloud) else { return };
    let whole = scene.shoot();
    let mut descriptor = SplatRenderer::device_descriptor(&scene.gpu.adapter);
    descriptor.required_limits.max_storage_buffer_binding_size = 1_280;
    let (device, queue) = pollster::block_on(scene.gpu.adapter.request_device(&descriptor)).unwrap();
    scene.renderer = SplatRenderer::new(&device);
    (scene.gpu.device, scene.gpu.queue) = (device, queue);
    let HeadlessDevice { device, queue, .. } = &scene.gpu;
    // 80 points fit into a binding, and the five bits of 2048.
    let Cloud {
        positions,
        normals,
        radii,
    } = &cloud;
    scene
        .renderer
        .set_cloud(device, queue, positions, Some(normals), radii, None)
        .unwrap();
    assert!(scene.shoot() == whole);
    let HeadlessDevice { device, queue, .. } = &scene.gpu;
    let error = scene
        .renderer
        .set_cloud(device, queue, &[Vec3::ZERO; 2_049], None, &[1.0; 2_049], None)
        .unwrap_err();
    let expect = "signs and marks of the points: 1300 bytes are needed in one buffer, and this graphics adapter allows 1280; open fewer points";
    assert_eq!(error.to_string(), expect);
    assert_eq!(scene.shoot().splats().count(), 0);
    let uploader = scene.renderer.uploader(&scene.gpu.device);
    assert!(uploader.upload_colors(&[0; 320]).is_ok());
    let error = uploader.upload_colors(&[0; 321]).err().unwrap();
    let expect = "colors of the points: 1284 bytes are needed in one buffer, and this graphics adapter allows 1280; open fewer points";
    assert_eq!(error.to_string(), expect);
}

#[test]
fn opengl_draws_the_same_surfaces() {
    let cloud = Cloud::sphere(20_000, Vec3::ZERO, 1.0);
    let Some(mut scene) = Scene::with(&cloud, Some(wgpu::Backends::GL), 7_000) else {
        return;
    };
    assert_eq!(scene.gpu.adapter.get_info().backend, wgpu::Backend::Gl);
    let picture = scene.shoot();
    let (front, all) = picture.count_front();
    assert!(front == all && all > 10_000, "{front} of {all}");
    assert_eq!(picture.count_holes(), 0);
    scene.turn(&[0..cloud.len()]);
    assert_eq!(scene.shoot().count_front().0, 0);
    // The upper half of the picture shows the upper half of the sphere.
    let up = scene
        .camera
        .project(Vec3::new(0.0, -0.6, 0.8), UVec2::from(SIZE).as_vec2())
        .unwrap()
        .as_uvec2();
    let Some(Hit::Splat { point, .. }) = scene.pick(up.x, up.y) else {
        panic!("no splat")
    };
    assert!(point.distance(Vec3::new(0.0, -0.6, 0.8)) < 0.02, "{point}");
}
