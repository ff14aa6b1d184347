//! Small clouds, the device that draws them, and pictures whose pixels can be counted.

use std::f32::consts::PI;

use egui_wgpu::wgpu;
use glam::Vec3;

use crate::gpu_types::{ID_NONE, ID_SPHERE};
use crate::{Camera, DrawSettings, HeadlessDevice, Hit, PictureMaker, Sphere, SplatRenderer, StandardView};

pub const SIZE: [u32; 2] = [320, 240];
pub const ASPECT: f32 = SIZE[0] as f32 / SIZE[1] as f32;

/// A device; `None`, said aloud, on a machine without graphics. `NORMEND_REQUIRE_GPU=1` makes that a failure, unless
/// certain backends are asked for.
pub fn device_for(backends: Option<wgpu::Backends>) -> Option<HeadlessDevice> {
    let error = match backends.map_or_else(HeadlessDevice::new, HeadlessDevice::with_backends) {
        Ok(device) => return Some(device),
        Err(error) => error,
    };
    let is_required = std::env::var_os("NORMEND_REQUIRE_GPU").is_some_and(|value| value == "1");
    assert!(backends.is_some() || !is_required, "{error}");
    eprintln!("skipped: no graphics adapter ({error})");
    None
}

/// A small cloud with unit normals and radii that close its surface.
pub struct Cloud {
    pub positions: Vec<Vec3>,
    pub normals: Vec<Vec3>,
    pub radii: Vec<f32>,
}

impl Cloud {
    /// `n` points spread evenly over a sphere (Fibonacci lattice), normals outward. Ascending in z.
    pub fn sphere(n: usize, center: Vec3, radius: f32) -> Self {
        let golden = PI * (3.0 - 5.0_f32.sqrt());
        let normals: Vec<Vec3> = (0..n)
            .map(|i| {
                let z = (2.0 * i as f32 + 1.0) / n as f32 - 1.0;
                let (sin, cos) = (golden * i as f32).sin_cos();
                Vec3::new(cos * (1.0 - z * z).sqrt(), sin * (1.0 - z * z).sqrt(), z)
            })
            .collect();
        let spacing = radius * (4.0 * PI / n as f32).sqrt();
        Self {
            positions: normals.iter().map(|&d| center + radius * d).collect(),
            normals,
            radii: vec![spacing; n],
        }
    }

    /// A square plate in the plane y = `y`, `n` × `n` points, normals toward −y.
    pub fn plate(n: usize, y: f32, half: f32) -> Self {
        let step = 2.0 * half / (n - 1) as f32;
        let at = |i: usize| step * i as f32 - half;
        let positions = (0..n * n).map(|i| Vec3::new(at(i % n), y, at(i / n))).collect();
        Self {
            positions,
            normals: vec![Vec3::NEG_Y; n * n],
            radii: vec![step; n * n],
        }
    }

    pub fn join(mut self, other: Self) -> Self {
        self.positions.extend(other.positions);
        self.normals.extend(other.normals);
        self.radii.extend(other.radii);
        self
    }

    /// Cosine between a normal and the direction to the eye.
    pub fn cosine(&self, instance: u32, eye: Vec3) -> f32 {
        let (position, normal) = (self.positions[instance as usize], self.normals[instance as usize]);
        normal.dot((eye - position).normalize_or_zero())
    }

    pub fn len(&self) -> u32 {
        self.positions.len() as u32
    }
}

/// A renderer with a cloud, and what it drew last.
pub struct Scene {
    pub gpu: HeadlessDevice,
    pub renderer: SplatRenderer,
    pub camera: Camera,
    pub settings: DrawSettings,
}

impl Scene {
    pub fn new(cloud: &Cloud) -> Option<Self> {
        Self::with(cloud, None, usize::MAX)
    }

    pub fn with(cloud: &Cloud, backends: Option<wgpu::Backends>, chunk_points: usize) -> Option<Self> {
        let gpu = device_for(backends)?;
        let mut renderer = match chunk_points {
            usize::MAX => SplatRenderer::new(&gpu.device),
            n => SplatRenderer::with_chunks(&gpu.device, n),
        };
        let Cloud {
            positions,
            normals,
            radii,
        } = cloud;
        renderer
            .set_cloud(&gpu.device, &gpu.queue, positions, Some(normals), radii, None)
            .unwrap();
        let camera = Camera::framing(Vec3::splat(-1.0), Vec3::ONE, StandardView::Front, ASPECT);
        Some(Self {
            gpu,
            renderer,
            camera,
            settings: DrawSettings::default(),
        })
    }

    /// A maker of a picture as [`Self::draw`] draws it, of `size`.
    pub fn maker(&self, size: [u32; 2], transparent: bool) -> PictureMaker {
        let HeadlessDevice { device, queue, .. } = &self.gpu;
        self.renderer
            .picture_maker(device, queue, &self.camera, size, 1.0, &self.settings)
            .with_transparency(transparent)
    }

    pub fn draw(&mut self) -> bool {
        let HeadlessDevice { device, queue, .. } = &self.gpu;
        self.renderer
            .draw(device, queue, &self.camera, SIZE, 1.0, &self.settings)
    }

    /// Draws and reads colors and ids back.
    pub fn shoot(&mut self) -> Picture {
        self.draw();
        let HeadlessDevice { device, queue, .. } = &self.gpu;
        let (size, bytes) = self.renderer.read_picture(device, queue).unwrap();
        assert_eq!(size, SIZE);
        let colors = bytes.chunks_exact(4).map(|c| [c[0], c[1], c[2]]).collect();
        let ids = self
            .renderer
            .read_seen(device, queue)
            .unwrap()
            .iter()
            .map(|seen| seen[0])
            .collect();
        Picture { colors, ids }
    }

    pub fn turn(&mut self, ranges: &[std::ops::Range<u32>]) {
        self.renderer.turn(&self.gpu.queue, ranges);
    }

    pub fn highlight(&mut self, ranges: &[std::ops::Range<u32>]) {
        self.renderer.set_highlight(&self.gpu.device, &self.gpu.queue, ranges);
    }

    pub fn set_spheres(&mut self, spheres: &[Sphere]) {
        self.renderer.set_spheres(&self.gpu.device, &self.gpu.queue, spheres);
    }

    pub fn pick(&self, x: u32, y: u32) -> Option<Hit> {
        self.renderer
            .pick(&self.gpu.device, &self.gpu.queue, [x, y])
            .unwrap()
            .wait(&self.gpu.device)
    }
}

/// Colors and ids of a picture, row by row from the top.
#[derive(Clone, PartialEq)]
pub struct Picture {
    pub colors: Vec<[u8; 3]>,
    pub ids: Vec<u32>,
}

impl Picture {
    /// In the palette of these tests the front is blue and the back orange.
    pub fn is_front(color: [u8; 3]) -> bool {
        color[2] > color[0]
    }

    /// Instance and color at each pixel that shows a splat.
    pub fn splats(&self) -> impl Iterator<Item = (u32, [u8; 3])> {
        let pairs = self.ids.iter().zip(&self.colors);
        pairs
            .filter(|(id, _)| **id != ID_NONE && **id & ID_SPHERE == 0)
            .map(|(id, color)| (id - 1, *color))
    }

    /// Pixels of splats that show their front, and all pixels of splats.
    pub fn count_front(&self) -> (usize, usize) {
        let front = self.splats().filter(|&(_, color)| Self::is_front(color)).count();
        (front, self.splats().count())
    }

    /// Background pixels that have splats to their left, right, above and below: holes in a convex silhouette.
    pub fn count_holes(&self) -> usize {
        let [width, height] = SIZE.map(|len| len as usize);
        let seen = |x: usize, y: usize| self.ids[y * width + x] != ID_NONE;
        let hole = |x: usize, y: usize| {
            !seen(x, y)
                && (0..x).any(|x| seen(x, y))
                && (x..width).any(|x| seen(x, y))
                && (0..y).any(|y| seen(x, y))
                && (y..height).any(|y| seen(x, y))
        };
        (0..width * height).filter(|i| hole(i % width, i / width)).count()
    }
}
