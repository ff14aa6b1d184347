//! Where places of the world are in a picture, whether or not something hides them there, and what is cut away of it.

use glam::{UVec2, Vec2, Vec3};

use crate::display_mode::Clip;
use crate::pick::PictureView;
use crate::{Camera, Projection};

/// How a picture was seen, for the CPU: the twin of what the shaders do with the center of a splat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lens {
    camera: Camera,
    size: Vec2,
    near_depth: Option<f32>,
    clip: Clip,
}

impl Lens {
    pub(crate) fn new(view: &PictureView, clip: &Clip) -> Self {
        Self {
            camera: view.camera,
            size: UVec2::from(view.size).as_vec2(),
            near_depth: near_depth(view, clip),
            clip: *clip,
        }
    }

    /// The pixel (from the top left, whole numbers between pixels) of a world point; `None` behind the eye, beside the picture, and
    /// where it is cut away.
    pub fn pixel(&self, point: Vec3) -> Option<Vec2> {
        if self.cuts(point) {
            return None;
        }
        let pixel = self.camera.project(point, self.size)?;
        let is_inside = pixel.cmpge(Vec2::ZERO).all() && pixel.cmplt(self.size).all();
        is_inside.then_some(pixel)
    }

    /// Whether a world point is cut away.
    pub fn cuts(&self, point: Vec3) -> bool {
        let depth = (self.camera.eye() - point).dot(self.camera.back());
        self.near_depth.is_some_and(|near| depth < near)
            || (self.clip.bounds).is_some_and(|[min, max]| point.cmplt(min).any() || point.cmpgt(max).any())
            || self.clip.section.is_some_and(|section| {
                let across = section.direction.try_normalize();
                across.is_some_and(|across| (point - section.point).dot(across).abs() > 0.5 * section.thickness)
            })
    }
}

/// The depth (world length along the view axis) up to which all is cut away; `None` where nothing is.
pub(crate) fn near_depth(view: &PictureView, clip: &Clip) -> Option<f32> {
    let PictureView { camera, scene, .. } = view;
    let center = (camera.eye() - scene.center).dot(camera.back());
    let (nearest, farthest) = (center - scene.radius, center + scene.radius);
    let nearest = match camera.projection {
        Projection::Perspective => nearest.max(0.0),
        Projection::Orthographic => nearest,
    };
    (clip.near > 0.0).then_some(nearest + clip.near * (farthest - nearest))
}
