//! Bits, colors, comparison, cuts and hair on pictures, counted pixel by pixel.

#![expect(clippy::single_range_in_vec_init, reason = "lists of ranges often hold one")]

use std::ops::Range;

use glam::{UVec2, Vec2, Vec3};

use super::scene::{Cloud, Picture, SIZE, Scene};
use crate::gpu_types::ID_NONE;
use crate::{
    Clip, Compare, DisplayMode, Hair, HairLen, HeadlessDevice, Hit, Projection, RenderError, Section, SeenIds, Sphere,
};

fn sphere() -> Cloud {
    Cloud::sphere(20_000, Vec3::ZERO, 1.0)
}

/// A bit per instance, set for those in `range`.
fn words(n: u32, range: Range<u32>) -> Vec<u32> {
    let mut words = vec![0; n.div_ceil(32) as usize];
    for bit in range {
        words[bit as usize / 32] |= 1 << (bit % 32);
    }
    words
}

/// How far two colors are apart, in the most different channel.
fn difference(a: [u8; 3], b: [u8; 3]) -> u8 {
    (0..3).map(|i| a[i].abs_diff(b[i])).max().unwrap_or_default()
}

#[test]
fn a_selection_changes_its_pixels_alone_clearly_and_unlike_a_highlight() {
    let Some(mut scene) = Scene::new(&sphere()) else { return };
    for mode in DisplayMode::ALL {
        scene.settings.mode = mode;
        let before = scene.shoot();
        let uploaded = scene.renderer.bytes_uploaded();
        scene.renderer.select(&scene.gpu.queue, &[8_000..9_000]);
        assert_eq!(scene.renderer.bytes_uploaded() - uploaded, 32 * 4);
        let selected = scene.shoot();
        scene.renderer.set_selected(&scene.gpu.queue, &[]);
        assert!(scene.shoot() == before, "{mode:?}: nothing selected is not as before");
        scene.highlight(&[8_000..9_000]);
        let highlighted = scene.shoot();
        scene.highlight(&[]);
        let (mut n_inside, mut n_clear) = (0, 0);
        for (((instance, old), (_, new)), (_, hovered)) in
            before.splats().zip(selected.splats()).zip(highlighted.splats())
        {
            if (8_000..9_000).contains(&instance) {
                n_inside += 1;
                // Where the surface has the color of the stripes, what is between them shows the selection.
                n_clear += usize::from(difference(old, new) > 12 && difference(hovered, new) > 12);
            } else {
                assert_eq!(old, new, "{mode:?}: instance {instance} changed");
            }
        }
        assert!(
            n_inside > 100 && n_clear > n_inside * 9 / 10,
            "{mode:?}: {n_clear} of {n_inside}"
        );
    }
}

#[test]
fn what_is_not_selected_fades() {
    let Some(mut scene) = Scene::new(&sphere()) else { return };
    scene.renderer.select(&scene.gpu.queue, &[8_000..9_000]);
    let bright = scene.shoot();
    scene.settings.dim_unselected = 1.0;
    let dim = scene.shoot();
    let background = dim.colors[0];
    for ((instance, old), (_, new)) in bright.splats().zip(dim.splats()) {
        if (8_000..9_000).contains(&instance) {
            assert_eq!(old, new);
        } else {
            // The background darkens a little downward.
            assert!(difference(new, background) < 8, "{new:?} before {background:?}");
        }
    }
}

#[test]
fn hidden_points_are_neither_drawn_nor_picked_and_come_back() {
    let cloud = sphere();
    let Some(mut scene) = Scene::new(&cloud) else { return };
    let before = scene.shoot();
    let front = |instance: u32| cloud.positions[instance as usize].y < 0.0;
    let hidden: Vec<Range<u32>> = (0..cloud.len()).filter(|&i| front(i)).map(|i| i..i + 1).collect();
    scene.renderer.hide(&scene.gpu.queue, &hidden);
    let after = scene.shoot();
    assert!(before.splats().all(|(instance, _)| front(instance)));
    assert!(after.splats().all(|(instance, _)| !front(instance)));
    let (n_front, n_all) = after.count_front();
    assert!(n_all > 10_000, "{n_all}");
    assert!(
        n_front < n_all / 100,
        "the inside of the far half is its back: {n_front} of {n_all}"
    );
    let Some(Hit::Splat { instance, point }) = scene.pick(SIZE[0] / 2, SIZE[1] / 2) else {
        panic!("the far half is not picked")
    };
    assert!(!front(instance) && point.y > 0.9, "{point}");
    scene.renderer.set_hidden(&scene.gpu.queue, &[]);
    assert!(scene.shoot() == before);
}

#[test]
fn setting_bits_uploads_the_words_that_change() {
    let Some(mut scene) = Scene::new(&sphere()) else { return };
    let queue = scene.gpu.queue.clone();
    let mut check = |range: Range<u32>, n_words: u64| {
        let uploaded = scene.renderer.bytes_uploaded();
        scene.renderer.set_selected(&queue, &words(20_000, range.clone()));
        assert_eq!(scene.renderer.bytes_uploaded() - uploaded, 4 * n_words, "{range:?}");
    };
    check(0..0, 0);
    check(3_200..6_400, 100);
    check(3_200..6_401, 1);
    check(3_200..6_401, 0);
    check(0..0, 101);
}

#[test]
fn colors_are_shown_and_updated_and_refused_when_they_do_not_fit() {
    let cloud = sphere();
    let Some(mut scene) = Scene::new(&cloud) else { return };
    let HeadlessDevice { device, queue, .. } = &scene.gpu;
    let (device, queue) = (device.clone(), queue.clone());
    scene.settings.eye_dome = 0.0;
    scene.settings.mode = DisplayMode::Lit;
    let lit = scene.shoot();
    scene.settings.mode = DisplayMode::Colors;
    assert!(scene.shoot() == lit, "without colors it is a lit surface");
    let red = 0xff00_00ff_u32;
    let green = 0xff00_ff00_u32;
    let uploaded = scene.renderer.bytes_uploaded();
    scene.renderer.set_colors(&device, Some(&vec![red; 20_000])).unwrap();
    assert_eq!(scene.renderer.bytes_uploaded() - uploaded, 80_000);
    let is_red = |[r, g, b]: [u8; 3]| r > 90 && g < 10 && b < 10;
    let is_green = |[r, g, b]: [u8; 3]| g > 90 && r < 10 && b < 10;
    assert!(scene.shoot().splats().all(|(_, color)| is_red(color)));
    scene.renderer.update_colors(&queue, 8_000, &[green; 1_000]);
    assert_eq!(scene.renderer.bytes_uploaded() - uploaded, 84_000);
    let picture = scene.shoot();
    for (instance, color) in picture.splats() {
        let is_updated = (8_000..9_000).contains(&instance);
        assert!(
            if is_updated { is_green(color) } else { is_red(color) },
            "{instance}: {color:?}"
        );
    }
    // Past the end nothing is written.
    scene.renderer.update_colors(&queue, 19_999, &[green; 5]);
    scene.renderer.update_colors(&queue, 30_000, &[green; 5]);
    assert_eq!(scene.renderer.bytes_uploaded() - uploaded, 84_004);
    // Alpha 0 says that there is no color.
    scene.renderer.set_colors(&device, Some(&vec![0; 20_000])).unwrap();
    assert!(
        scene
            .shoot()
            .splats()
            .all(|(_, [r, g, b])| r.abs_diff(g) < 16 && g.abs_diff(b) < 16)
    );
    let error = scene.renderer.set_colors(&device, Some(&[red; 7])).unwrap_err();
    assert_eq!(error.to_string(), "colors of the points: expected 20000, found 7");
    assert!(scene.shoot() == lit);
    // Uploaded in another thread, and shown here.
    let uploader = scene.renderer.uploader(&device);
    let colors = std::thread::scope(|scope| {
        let uploading = std::thread::Builder::new().spawn_scoped(scope, || uploader.upload_colors(&vec![red; 20_000]));
        uploading.unwrap().join().unwrap().unwrap()
    });
    scene.renderer.show_colors(Some(colors)).unwrap();
    assert!(scene.shoot().splats().all(|(_, color)| is_red(color)));
    scene.renderer.show_colors(None).unwrap();
    assert!(scene.shoot() == lit);
    scene.renderer.clear_cloud();
    assert!(matches!(
        scene.renderer.set_colors(&device, Some(&[red])),
        Err(RenderError::Mismatch {
            expected: 0,
            found: 1,
            ..
        })
    ));
    assert!(scene.renderer.set_colors(&device, None).is_ok());
}

#[test]
fn a_lit_surface_is_neutral_with_bright_fronts_and_dark_backs() {
    let Some(mut scene) = Scene::new(&sphere()) else { return };
    scene.settings.mode = DisplayMode::Lit;
    let mean = |picture: &Picture| {
        let (sum, n) = picture.splats().fold((0_usize, 0_usize), |(sum, n), (_, [r, g, b])| {
            assert!(r.abs_diff(g) < 12 && g.abs_diff(b) < 12, "{r} {g} {b} is not neutral");
            (sum + usize::from(g), n + 1)
        });
        sum / n
    };
    let front = mean(&scene.shoot());
    scene.turn(&[0..20_000]);
    let back = mean(&scene.shoot());
    assert!(front > 120 && back < 40, "front {front}, back {back}");
}

#[test]
fn ids_of_a_rectangle_are_those_drawn_with_their_depths() {
    let cloud = sphere();
    let Some(mut scene) = Scene::new(&cloud) else { return };
    scene.set_spheres(&[Sphere {
        center: Vec3::new(0.0, -1.0, 0.0),
        color: [1.0; 3],
        selected: false,
    }]);
    let HeadlessDevice { device, queue, .. } = &scene.gpu;
    assert!(
        scene.renderer.read_ids(device, queue, [0, 0], [1, 1]).is_none(),
        "before a picture"
    );
    for projection in [Projection::Perspective, Projection::Orthographic] {
        scene.camera.projection = projection;
        let picture = scene.shoot();
        let HeadlessDevice { device, queue, .. } = &scene.gpu;
        let read = |min, size| {
            scene
                .renderer
                .read_ids(device, queue, min, size)
                .map(|ids| ids.wait(device))
        };
        let seen = read([70, 40], [150, 130]).unwrap();
        assert_eq!(
            (seen.min, seen.size, seen.instances.len()),
            ([70, 40], [150, 130], 150 * 130)
        );
        let (mut n_none, mut n_marked) = (0, 0);
        for y in 40..170 {
            for x in 70..220 {
                let id = picture.ids[(y * SIZE[0] + x) as usize];
                let i = ((y - 40) * 150 + x - 70) as usize;
                let Some(instance) = seen.at([x, y]) else {
                    assert_eq!(seen.instances[i], SeenIds::NONE);
                    assert_eq!(seen.depths[i], f32::INFINITY);
                    assert!(id == ID_NONE || id > 20_000);
                    n_none += 1;
                    n_marked += u32::from(id > 20_000);
                    continue;
                };
                assert_eq!((instance + 1, instance), (id, seen.instances[i]));
                let point = scene.camera.unproject(
                    UVec2::new(x, y).as_vec2() + 0.5,
                    seen.depths[i],
                    UVec2::from(SIZE).as_vec2(),
                );
                assert!((point.length() - 1.0).abs() < 0.05, "{point} at {x}, {y}");
            }
        }
        assert!(n_none > 1_000 && n_marked > 100, "{n_none}, {n_marked}");
        // Brought within the picture.
        let corner = read([300, 200], [1_000, 1_000]).unwrap();
        assert_eq!((corner.size, corner.instances.len()), ([20, 40], 800));
        assert_eq!(corner.at([299, 210]), None);
        assert!(read([320, 0], [5, 5]).is_none());
        assert!(read([0, 0], [0, 5]).is_none());
    }
    // A poll gets there too.
    let HeadlessDevice { device, queue, .. } = &scene.gpu;
    let mut request = scene.renderer.read_ids(device, queue, [160, 100], [1, 1]).unwrap();
    let seen = loop {
        if let Some(seen) = request.poll(device) {
            break seen;
        }
    };
    assert!(seen.instances[0] < 20_000);
}

#[test]
fn cuts_leave_out_the_points_beyond_them_alone() {
    let cloud = sphere();
    let Some(mut scene) = Scene::new(&cloud) else { return };
    scene.camera.orbit(Vec2::new(120.0, 0.0));
    let eye_depth = |scene: &Scene, p: Vec3| (scene.camera.eye() - p).dot(scene.camera.back());
    for projection in [Projection::Perspective, Projection::Orthographic] {
        scene.camera.projection = projection;
        // Which instances are left is read off a picture; all that is seen lies within, and what is beyond is not seen.
        let mut check = |clip: Clip, keeps: &dyn Fn(&Scene, Vec3) -> bool, what: &str| {
            scene.settings.clip = clip;
            let picture = scene.shoot();
            assert!(picture.splats().count() > 500, "{what}: nothing is left");
            let mut n_inner = 0;
            for (instance, _) in picture.splats() {
                let position = cloud.positions[instance as usize];
                assert!(keeps(&scene, position), "{what}: {position} is cut away");
                assert!(!scene.renderer.lens().unwrap().cuts(position), "{what}: {position}");
                n_inner += usize::from(eye_depth(&scene, position) > scene.camera.distance);
            }
            assert!(n_inner > 100, "{what}: the inside is not seen");
            let lens = scene.renderer.lens().unwrap();
            let n_cut = cloud.positions.iter().filter(|&&p| lens.cuts(p)).count();
            let n_left_out = cloud.positions.iter().filter(|&&p| !keeps(&scene, p)).count();
            // Up to rounding at the border itself.
            assert!(n_cut.abs_diff(n_left_out) < 20, "{what}: {n_cut} and {n_left_out}");
            if let Some(Hit::Splat { instance, .. }) = scene.pick(SIZE[0] / 2, SIZE[1] / 2) {
                assert!(keeps(&scene, cloud.positions[instance as usize]), "{what}: picked");
            }
        };
        let near = Clip {
            near: 0.5,
            ..Clip::default()
        };
        // The ball around the sphere's box and largest disc is wider than the sphere, and its middle the same.
        check(
            near,
            &|scene, p| eye_depth(scene, p) > scene.camera.distance - 1e-3,
            "near",
        );
        let bounds = Clip {
            bounds: Some([Vec3::new(-0.5, -0.5, -2.0), Vec3::new(0.6, 2.0, 0.5)]),
            ..Clip::default()
        };
        let inside = |p: Vec3| p.x >= -0.5 && p.y >= -0.5 && p.x <= 0.6 && p.z <= 0.5;
        check(bounds, &|_, p| inside(p), "box");
        let section = Section {
            point: Vec3::new(0.0, 0.0, 0.2),
            direction: Vec3::new(0.0, 1.0, 1.0),
            thickness: 0.4,
        };
        let within = |p: Vec3| ((p - section.point).dot(Vec3::new(0.0, 1.0, 1.0)) / 2_f32.sqrt()).abs() <= 0.2001;
        check(
            Clip {
                section: Some(section),
                ..Clip::default()
            },
            &|_, p| within(p),
            "section",
        );
    }
    // Spheres are cut too; a section without a direction is none.
    scene.settings.clip = Clip::default();
    let before = scene.shoot();
    let flat = Section {
        point: Vec3::ZERO,
        direction: Vec3::ZERO,
        thickness: 0.1,
    };
    scene.settings.clip.section = Some(flat);
    assert!(scene.shoot() == before);
    scene.settings.clip = Clip {
        bounds: Some([Vec3::splat(0.5), Vec3::splat(0.4)]),
        ..Clip::default()
    };
    scene.set_spheres(&[Sphere {
        center: Vec3::NEG_Y,
        color: [1.0; 3],
        selected: false,
    }]);
    assert!(scene.shoot().ids.iter().all(|&id| id == ID_NONE));
}

#[test]
fn eye_dome_lighting_darkens_edges_as_strongly_as_asked() {
    let cloud = Cloud::plate(60, -0.4, 0.3).join(Cloud::plate(80, 0.5, 1.0));
    let Some(mut scene) = Scene::new(&cloud) else { return };
    let mut sum = |eye_dome: f32| {
        scene.settings.eye_dome = eye_dome;
        scene
            .shoot()
            .splats()
            .map(|(_, [r, g, b])| u64::from(r) + u64::from(g) + u64::from(b))
            .sum::<u64>()
    };
    let (none, half, full) = (sum(0.0), sum(0.5), sum(1.0));
    assert!(none > half + 10_000 && half > full + 5_000, "{none}, {half}, {full}");
}

#[test]
fn compared_signs_are_left_of_the_split_and_present_ones_right_of_it() {
    let Some(mut scene) = Scene::new(&sphere()) else { return };
    let queue = scene.gpu.queue.clone();
    scene.settings.compare = Compare::Split(140.0);
    let present = scene.shoot();
    assert_eq!(
        present.count_front().0,
        present.count_front().1,
        "nothing to compare with"
    );
    scene.renderer.set_compared(&queue, Some(&vec![u32::MAX; 625]));
    let picture = scene.shoot();
    let mut n_line = 0;
    for (i, (&id, &color)) in picture.ids.iter().zip(&picture.colors).enumerate() {
        let x = i as u32 % SIZE[0];
        // The line at the split is gray, on the background too.
        let [r, g, b] = color;
        if x == 139 || x == 140 {
            n_line += usize::from(r.abs_diff(g) < 40 && g.abs_diff(b) < 40 && g > 90);
        } else if id != ID_NONE {
            assert_eq!(Picture::is_front(color), x > 139, "at column {x}");
        }
    }
    assert!((SIZE[1] as usize..=2 * SIZE[1] as usize).contains(&n_line), "{n_line}");
    scene.settings.compare = Compare::All;
    assert_eq!(scene.shoot().count_front().0, 0);
    scene.settings.compare = Compare::Off;
    assert!(scene.shoot() == present);
    scene.settings.compare = Compare::All;
    scene.renderer.set_compared(&queue, None);
    assert!(scene.shoot() == present);
}

#[test]
fn wrong_points_have_blue_balls_and_are_picked_as_themselves() {
    let cloud = sphere();
    let Some(mut scene) = Scene::new(&cloud) else { return };
    scene.camera.distance = 30.0;
    let before = scene.shoot();
    let queue = scene.gpu.queue.clone();
    // The point in the middle of the picture.
    let Some(Hit::Splat { instance, .. }) = scene.pick(SIZE[0] / 2, SIZE[1] / 2) else {
        panic!("nothing there")
    };
    let uploaded = scene.renderer.bytes_uploaded();
    scene.renderer.mark_wrong(&queue, &[instance..instance + 1]);
    assert_eq!(scene.renderer.bytes_uploaded() - uploaded, 4);
    let after = scene.shoot();
    let blue = |[r, g, b]: [u8; 3]| b > 45 && r < b / 2 && g < b / 2;
    assert_eq!(before.colors.iter().filter(|&&color| blue(color)).count(), 0);
    let n_blue = after.colors.iter().filter(|&&color| blue(color)).count();
    // The inner part of a disc of radius 4 pixels.
    assert!((15..=49).contains(&n_blue), "{n_blue}");
    match scene.pick(SIZE[0] / 2, SIZE[1] / 2) {
        Some(Hit::Splat { instance: again, .. }) => assert_eq!(again, instance),
        other => panic!("{other:?}"),
    }
    scene.renderer.set_wrong(&queue, &[]);
    assert!(scene.shoot() == before);
    // On the far side it is hidden.
    let far = (0..cloud.len()).max_by(|&a, &b| cloud.positions[a as usize].y.total_cmp(&cloud.positions[b as usize].y));
    let far = far.unwrap();
    scene.renderer.set_wrong(&queue, &words(cloud.len(), far..far + 1));
    assert!(scene.shoot().colors == before.colors);
}

#[test]
fn wrong_points_are_marked_where_the_present_signs_are_shown() {
    let cloud = sphere();
    let Some(mut scene) = Scene::new(&cloud) else { return };
    let queue = scene.gpu.queue.clone();
    let split = SIZE[0] / 2;
    scene.settings.compare = Compare::Split(split as f32);
    scene.renderer.set_compared(&queue, Some(&vec![0; 625]));
    scene.renderer.set_wrong(&queue, &vec![u32::MAX; 625]);
    // Pixels of balls left of the line and right of it.
    let n_balls = |picture: &Picture| {
        let blue = |[r, g, b]: [u8; 3]| b > 45 && r < b / 2 && g < b / 2;
        let balls = (0..).zip(&picture.colors).filter(|&(_, &color)| blue(color));
        let (left, right): (Vec<_>, Vec<_>) = balls.partition(|&(at, _)| at % SIZE[0] < split);
        [left.len(), right.len()]
    };
    let [left, right] = n_balls(&scene.shoot());
    assert!(left == 0 && right > 1000, "{left} left, {right} right of the line");
    scene.settings.compare = Compare::All;
    assert_eq!(n_balls(&scene.shoot()), [0, 0]);
    scene.settings.compare = Compare::Off;
    let [left, right] = n_balls(&scene.shoot());
    assert!(left > 1000 && right > 1000, "{left} left, {right} right");
}

#[test]
fn hair_stands_on_the_front_turns_with_the_signs_and_changes_no_id() {
    let Some(mut scene) = Scene::new(&sphere()) else { return };
    let bald = scene.shoot();
    let white = [255, 255, 255];
    let hair = Hair {
        len: HairLen::Pixels(12.0),
        every: 10,
        color: Some([1.0; 3]),
    };
    scene.settings.hair = Some(hair);
    let count = |picture: &Picture, on_background: bool| {
        let pixels = picture.colors.iter().zip(&picture.ids);
        pixels
            .filter(|(color, id)| **color == white && (**id == ID_NONE) == on_background)
            .count()
    };
    let outward = scene.shoot();
    assert!(outward.ids == bald.ids);
    assert_eq!(count(&bald, false) + count(&bald, true), 0);
    assert!(
        count(&outward, true) > 200,
        "hair beyond the silhouette: {}",
        count(&outward, true)
    );
    assert!(
        count(&outward, false) > 1_000,
        "hair on the front: {}",
        count(&outward, false)
    );
    // Turned inward it is hidden by the surface that it grows from.
    scene.turn(&[0..20_000]);
    let inward = scene.shoot();
    assert_eq!(count(&inward, true), 0);
    assert!(count(&inward, false) < 200, "{}", count(&inward, false));
    scene.turn(&[0..20_000]);
    assert!(scene.shoot() == outward, "turning twice");
    // Of world length, on fewer points, as hidden ones have none.
    scene.settings.hair = Some(Hair {
        len: HairLen::World(0.2),
        every: 40,
        color: Some([1.0; 3]),
    });
    let fewer = scene.shoot();
    let n_fewer = count(&fewer, true) + count(&fewer, false);
    assert!(n_fewer > 100 && n_fewer < count(&outward, true) + count(&outward, false));
    scene.renderer.hide(&scene.gpu.queue, &[0..20_000]);
    assert!(scene.shoot().colors.iter().all(|&color| color != white));
    // By side: a hair has the color of the side that it shows.
    scene.renderer.hide(&scene.gpu.queue, &[0..20_000]);
    scene.settings.hair = Some(Hair { color: None, ..hair });
    let by_side = scene.shoot();
    let beyond = by_side.colors.iter().zip(&by_side.ids).zip(&bald.colors);
    let n_hair = beyond
        .filter(|((color, id), bald)| **id == ID_NONE && color != bald)
        .count();
    assert!(n_hair > 200, "{n_hair}");
    scene.settings.hair = None;
    assert!(scene.shoot() == bald);
}
