//! Pictures beside the window's: of any size, transparent, in tiles, in other threads, and everything on OpenGL.

#![expect(clippy::single_range_in_vec_init, reason = "lists of ranges often hold one")]

use egui_wgpu::wgpu;
use glam::{Vec2, Vec3};

use super::scene::{Cloud, Picture, SIZE, Scene};
use crate::{Compare, DisplayMode, Hair, HairLen, HeadlessDevice, RenderError, Section, Sphere};

fn sphere() -> Cloud {
    Cloud::sphere(20_000, Vec3::ZERO, 1.0)
}

#[test]
fn a_picture_of_another_size_disturbs_nothing_and_tiles_leave_no_seam() {
    let Some(mut scene) = Scene::new(&sphere()) else { return };
    scene.turn(&[3_000..9_000]);
    scene.renderer.select(&scene.gpu.queue, &[12_000..13_000]);
    scene.settings.hair = Some(Hair {
        len: HairLen::World(0.1),
        every: 50,
        color: None,
    });
    scene.camera.distance = 3.5;
    let window = scene.shoot();
    let size = [500, 410];
    let mut make = |transparent: bool, max_tile_side: Option<u32>| {
        let mut maker = scene.maker(size, transparent);
        maker.max_tile_side = max_tile_side.unwrap_or(maker.max_tile_side);
        let mut fractions = Vec::new();
        let rgba = maker.make(&mut |fraction| {
            fractions.push(fraction);
            true
        });
        assert!(fractions.is_sorted() && fractions.last() == Some(&1.0), "{fractions:?}");
        assert!(!scene.draw(), "the window's picture is as it was");
        rgba.unwrap()
    };
    let whole = make(false, None);
    assert_eq!(whole.len(), 500 * 410 * 4);
    assert!(whole.chunks_exact(4).all(|pixel| pixel[3] == 255));
    let tiled = make(false, Some(250));
    // Triangles are rounded to another grid in each tile, so a few pixels on their edges differ.
    let n_other = whole
        .chunks_exact(4)
        .zip(tiled.chunks_exact(4))
        .filter(|(a, b)| a != b)
        .count();
    assert!(n_other < 500 * 410 / 200, "{n_other} pixels differ");
    let transparent = make(true, None);
    let (mut n_clear, mut n_opaque) = (0, 0);
    for (clear, opaque) in transparent.chunks_exact(4).zip(whole.chunks_exact(4)) {
        if clear == [0; 4] {
            n_clear += 1;
        } else {
            n_opaque += 1;
            assert_eq!(clear, opaque);
        }
    }
    assert!(
        n_clear > 20_000 && n_opaque > 50_000,
        "{n_clear} clear, {n_opaque} opaque"
    );
    assert!(scene.shoot() == window);
}

#[test]
fn a_picture_of_the_windows_size_is_the_windows_picture() {
    let Some(mut scene) = Scene::new(&sphere()) else { return };
    scene.highlight(&[9_000..9_500]);
    let maker = scene.maker(SIZE, false);
    // In another thread.
    let rgba = std::thread::scope(|scope| {
        let making = std::thread::Builder::new().spawn_scoped(scope, || maker.make(&mut |_| true));
        making.unwrap().join().unwrap().unwrap()
    });
    let rgba_of =
        |picture: &Picture| -> Vec<u8> { picture.colors.iter().flat_map(|&[r, g, b]| [r, g, b, 255]).collect() };
    assert!(rgba == rgba_of(&scene.shoot()));
    // With a highlight and a camera of its own.
    let other = maker
        .clone()
        .with_highlight(&[10_000..11_000])
        .make(&mut |_| true)
        .unwrap();
    scene.camera.orbit(Vec2::new(50.0, 0.0));
    let turned = maker.with_camera(&scene.camera).make(&mut |_| true).unwrap();
    assert!(turned == rgba_of(&scene.shoot()));
    scene.camera.orbit(Vec2::new(-50.0, 0.0));
    scene.highlight(&[10_000..11_000]);
    let n_other = rgba_of(&scene.shoot())
        .iter()
        .zip(&other)
        .filter(|(a, b)| a != b)
        .count();
    // The camera that was turned there and back is not quite the same.
    assert!(n_other < other.len() / 100, "{n_other}");
    assert!(other != rgba);
}

#[test]
fn sizes_that_cannot_be_and_a_word_to_stop_are_errors() {
    let Some(scene) = Scene::new(&sphere()) else { return };
    for size in [[0, 10], [8_193, 10], [u32::MAX, u32::MAX]] {
        let error = scene.maker(size, false).make(&mut |_| true).unwrap_err();
        assert!(error.to_string().contains("1 to 8192 pixels"), "{error}");
    }
    let canceled = scene.maker([50, 50], false).make(&mut |_| false);
    assert!(matches!(canceled, Err(RenderError::Canceled)));
    // The largest one, through its progress alone.
    let mut n_asked = 0;
    let canceled = scene.maker([8_192, 8_192], true).make(&mut |_| {
        n_asked += 1;
        n_asked < 2
    });
    assert!(matches!(canceled, Err(RenderError::Canceled)) && n_asked == 2);
}

#[test]
fn spheres_can_be_left_out() {
    let Some(mut scene) = Scene::new(&sphere()) else { return };
    let before = scene.shoot();
    scene.set_spheres(&[Sphere {
        center: Vec3::NEG_Y,
        color: [1.0; 3],
        selected: true,
    }]);
    assert!(scene.shoot() != before);
    scene.settings.spheres = false;
    assert!(scene.shoot() == before);
}

/// Everything at once, as both backends draw it; they round differently, so a few pixels may differ.
#[test]
fn opengl_shows_what_vulkan_shows() {
    let cloud = sphere().join(Cloud::plate(60, 0.4, 1.2));
    let shoot = |backends: Option<wgpu::Backends>| {
        let mut scene = Scene::with(&cloud, backends, 7_000)?;
        let HeadlessDevice { device, queue, .. } = &scene.gpu;
        let (device, queue) = (device.clone(), queue.clone());
        scene.turn(&[2_000..8_000]);
        scene.highlight(&[9_000..9_300]);
        scene.set_spheres(&[Sphere {
            center: Vec3::NEG_Y,
            color: [0.1, 0.9, 0.2],
            selected: true,
        }]);
        let renderer = &mut scene.renderer;
        renderer.select(&queue, &[10_000..12_000]);
        renderer.hide(&queue, &[13_000..13_500]);
        renderer.mark_wrong(&queue, &[9_600..9_603, 12_300..12_303]);
        renderer.set_compared(&queue, Some(&[u32::MAX; 700]));
        let colors: Vec<u32> = (0..cloud.len())
            .map(|i| i.wrapping_mul(2_654_435_761) | 0x8000_0000)
            .collect();
        renderer.set_colors(&device, Some(&colors)).unwrap();
        scene.settings.compare = Compare::Split(150.0);
        scene.settings.hair = Some(Hair {
            len: HairLen::Pixels(9.0),
            every: 30,
            color: None,
        });
        let section = Section {
            point: Vec3::ZERO,
            direction: Vec3::X,
            thickness: 1.7,
        };
        scene.settings.clip.section = Some(section);
        scene.settings.clip.near = 0.2;
        scene.settings.dim_unselected = 0.3;
        let pictures: Vec<(Picture, Vec<u32>)> = DisplayMode::ALL
            .into_iter()
            .map(|mode| {
                scene.settings.mode = mode;
                let picture = scene.shoot();
                let seen = scene.renderer.read_ids(&device, &queue, [100, 80], [60, 50]).unwrap();
                (picture, seen.wait(&device).instances)
            })
            .collect();
        let made = scene.maker([333, 222], true).make(&mut |_| true).unwrap();
        Some((pictures, made))
    };
    let (Some((vulkan, vulkan_made)), Some((gl, gl_made))) = (shoot(None), shoot(Some(wgpu::Backends::GL))) else {
        return;
    };
    for (mode, ((a, a_seen), (b, b_seen))) in DisplayMode::ALL.into_iter().zip(vulkan.iter().zip(&gl)) {
        let n_other = a
            .colors
            .iter()
            .zip(&b.colors)
            .filter(|(a, b)| (0..3).any(|i| a[i].abs_diff(b[i]) > 8))
            .count();
        assert!(n_other < a.colors.len() / 50, "{mode:?}: {n_other} pixels differ");
        let n_other = a_seen.iter().zip(b_seen).filter(|(a, b)| a != b).count();
        assert!(n_other < a_seen.len() / 20, "{mode:?}: {n_other} ids differ");
    }
    let n_other = vulkan_made
        .iter()
        .zip(&gl_made)
        .filter(|(a, b)| a.abs_diff(**b) > 8)
        .count();
    assert!(n_other < gl_made.len() / 50, "{n_other}");
}
