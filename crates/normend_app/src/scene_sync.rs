//! The picture of the document: the only place that turns a core [`Change`] into GPU ranges.
//!
//! The splats are uploaded in the tree's preorder, so an instance of the renderer is a position of the tree and the
//! ranges of a [`Change`] are the ranges that the renderer turns. Source spheres follow the document's sources.

use std::collections::BTreeSet;
use std::sync::Arc;

use eframe::egui_wgpu::RenderState;
use egui::TextureId;
use glam::Vec3;
use normend_core::{Change, PointCloud, Propagation, SpanningTree};
use normend_render::{
    Camera, Clip, CloudUploader, DrawSettings, Hit, PickRequest, RenderError, Sphere, SplatRenderer, UploadedCloud,
    wgpu,
};

use crate::session::Session;
use crate::theme;

/// What is under the pointer, in the document's words.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// A point of the scan.
    Point {
        /// The point's id.
        point: u32,
        /// Where its splat is seen, in world space.
        position: Vec3,
    },
    /// The sphere of a source.
    Source {
        /// The id of the source's point.
        point: u32,
        /// Where the sphere is seen, in world space.
        position: Vec3,
    },
}

impl Target {
    /// Where it is seen, in world space.
    pub fn position(self) -> Vec3 {
        match self {
            Self::Point { position, .. } | Self::Source { position, .. } => position,
        }
    }
}

/// Everything that decides which splat is at which pixel; while it is equal, an earlier pick still holds.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Geometry {
    camera: Camera,
    size: [u32; 2],
    pixels_per_point: f32,
    splat_scale: f32,
    stride: u32,
    clip: Clip,
}

/// The renderer, its texture, and what it shows.
pub struct Scene {
    renderer: SplatRenderer,
    state: RenderState,
    texture: Option<(TextureId, u64)>,
    /// Gives the point of an instance; `None` while instances are points.
    tree: Option<Arc<SpanningTree>>,
    /// Points of the source spheres, in the renderer's order: first those of the document, then voted ones.
    source_points: Vec<u32>,
    /// How many of them are sources of the document.
    n_own_sources: usize,
    geometry: Option<Geometry>,
    /// Side of the squares of screen pixels that the last picture has one pixel for.
    pixel_side: u32,
    picture_id: u64,
    ids_version: u64,
    /// The ids that the last picture was drawn with.
    drawn_ids_version: u64,
}

impl Scene {
    /// A scene without points on eframe's device.
    pub fn new(state: RenderState) -> Self {
        Self {
            renderer: SplatRenderer::new(&state.device),
            state,
            texture: None,
            tree: None,
            source_points: Vec::new(),
            n_own_sources: 0,
            geometry: None,
            pixel_side: 1,
            picture_id: 0,
            ids_version: 0,
            drawn_ids_version: 0,
        }
    }

    /// Gives the graphics device up, as a driver that fails does; for trying out what happens then.
    pub(crate) fn lose_device(&self) {
        self.state.device.destroy();
    }

    /// Shows nothing.
    pub fn clear(&mut self) {
        self.renderer.clear_cloud();
        self.forget_ids();
        self.renderer.set_spheres(&self.state.device, &self.state.queue, &[]);
    }

    /// Uploads clouds from a job's thread.
    pub fn uploader(&self) -> CloudUploader {
        self.renderer.uploader(&self.state.device)
    }

    /// Shows points that were just read: no normals yet, one radius for all. `uploaded` is what [`upload_points`] gave;
    /// without it the upload is done here, after the present cloud made room.
    ///
    /// # Errors
    /// [`RenderError`] when the graphics adapter cannot hold them.
    pub fn show_points(&mut self, cloud: &PointCloud, uploaded: Option<UploadedCloud>) -> Result<(), RenderError> {
        self.clear();
        let uploaded = uploaded.map_or_else(|| upload_points(&self.uploader(), cloud), Ok)?;
        self.renderer
            .show_cloud(&self.state.device, &self.state.queue, uploaded);
        Ok(())
    }

    /// Shows the document in full after a propagation was installed. Without one, does nothing. `uploaded` is what
    /// [`upload_oriented`] gave; without it the upload is done here, after the present cloud made room.
    ///
    /// # Errors
    /// [`RenderError`] when the graphics adapter cannot hold it.
    pub fn show_document(&mut self, session: &Session, uploaded: Option<UploadedCloud>) -> Result<(), RenderError> {
        let document = &session.document;
        let (Some(propagation), Some(orientation)) = (document.propagation(), document.orientation()) else {
            return Ok(());
        };
        self.forget_ids();
        let tree = Arc::clone(&propagation.tree);
        self.renderer.clear_cloud();
        let uploaded = uploaded.map_or_else(|| upload_oriented(&self.uploader(), document.cloud(), propagation), Ok)?;
        let (device, queue) = (&self.state.device, &self.state.queue);
        self.renderer.show_cloud(device, queue, uploaded);
        self.tree = Some(tree);
        self.renderer.set_turned(queue, &orientation.to_words());
        self.show_sources(session);
        Ok(())
    }

    /// Shows what an edit, an undo or a redo turned, and the sources after it.
    pub fn apply(&mut self, change: &Change, session: &Session) {
        self.renderer.turn(&self.state.queue, change.ranges());
        self.show_sources(session);
    }

    /// Highlights what a click would turn, or nothing.
    pub fn highlight(&mut self, change: Option<&Change>) {
        let ranges = change.map_or(&[][..], Change::ranges);
        self.renderer
            .set_highlight(&self.state.device, &self.state.queue, ranges);
    }

    /// Shows the sources as spheres: green where they keep the side that was there, pink where they flipped it; and of those that
    /// were voted for some, evenly picked, so that thousands neither hide the scan nor slow it down.
    pub fn show_sources(&mut self, session: &Session) {
        let positions = session.document.cloud().positions();
        let selected: &BTreeSet<u32> = &session.selected;
        let sources = session.document.sources();
        let own = sources.iter().filter_map(|source| {
            let color = if session.document.is_flipped(source) {
                theme::SOURCE_FLIPPED
            } else {
                theme::SOURCE_KEPT
            };
            let center = *positions.get(source.point as usize)?;
            Some((
                source.point,
                Sphere {
                    center,
                    color,
                    selected: selected.contains(&source.point),
                },
            ))
        });
        let voted = session
            .document
            .propagation()
            .map_or(&[][..], |propagation| propagation.voted_sources.as_slice());
        let some_voted = voted
            .iter()
            .step_by(voted.len().div_ceil(MAX_VOTED_SPHERES).max(1))
            .filter(|source| !sources.contains(source.point))
            .filter_map(|source| {
                let center = *positions.get(source.point as usize)?;
                let sphere = Sphere {
                    center,
                    color: theme::SOURCE_VOTED,
                    selected: false,
                };
                Some((source.point, sphere))
            });
        let (points, spheres): (Vec<u32>, Vec<Sphere>) = own.chain(some_voted).unzip();
        self.n_own_sources = sources.len();
        if points != self.source_points {
            // Spheres cover other pixels now: earlier picks no longer hold.
            self.source_points = points;
            self.picture_id += 1;
            self.ids_version += 1;
        }
        self.renderer
            .set_spheres(&self.state.device, &self.state.queue, &spheres);
    }

    fn forget_ids(&mut self) {
        self.tree = None;
        self.source_points.clear();
        self.picture_id += 1;
        self.ids_version += 1;
    }

    /// Draws if anything changed and returns the picture for egui. `size` in physical pixels; the picture has one pixel for
    /// each square of `pixel_side` of them.
    pub fn draw(
        &mut self,
        camera: &Camera,
        size: [u32; 2],
        pixel_side: u32,
        pixels_per_point: f32,
        settings: &DrawSettings,
    ) -> Option<TextureId> {
        let size = size.map(|len| len.div_ceil(pixel_side));
        let pixels_per_point = pixels_per_point / pixel_side as f32;
        self.pixel_side = pixel_side;
        let geometry = Geometry {
            camera: *camera,
            size,
            pixels_per_point,
            splat_scale: settings.splat_scale,
            stride: settings.stride,
            clip: settings.clip,
        };
        if self.geometry != Some(geometry) {
            self.geometry = Some(geometry);
            self.picture_id += 1;
        }
        self.renderer.draw(
            &self.state.device,
            &self.state.queue,
            camera,
            size,
            pixels_per_point,
            settings,
        );
        self.drawn_ids_version = self.ids_version;
        let (view, version) = self.renderer.picture()?;
        let mut egui_renderer = self.state.renderer.write();
        let filter = if pixel_side == 1 {
            wgpu::FilterMode::Nearest
        } else {
            wgpu::FilterMode::Linear
        };
        let id = match self.texture {
            Some((id, shown)) if shown == version => id,
            Some((id, _)) => {
                egui_renderer.update_egui_texture_from_wgpu_texture(&self.state.device, view, filter, id);
                id
            }
            None => egui_renderer.register_native_texture(&self.state.device, view, filter),
        };
        self.texture = Some((id, version));
        Some(id)
    }

    /// A number for the present assignment of points to pixels: while it is equal, an earlier pick still holds.
    pub fn picture_id(&self) -> u64 {
        self.picture_id
    }

    /// A number for the meaning of the ids in a picture: the answer to a pick is read with the one it was asked with.
    pub fn ids_version(&self) -> u64 {
        self.ids_version
    }

    /// Asks what the last picture shows at `pixel` (physical, from the top left of the view). `None` while that picture
    /// is older than the ids; it is drawn anew in the next frame.
    pub fn pick(&self, pixel: [u32; 2]) -> Option<PickRequest> {
        if self.drawn_ids_version != self.ids_version {
            return None;
        }
        let pixel = pixel.map(|place| place / self.pixel_side);
        self.renderer.pick(&self.state.device, &self.state.queue, pixel)
    }

    /// The answer of a pick: `None` while under way, `Some(None)` for background. Never blocks.
    pub fn poll(&self, request: &mut PickRequest) -> Option<Option<Target>> {
        let hit = request.poll(&self.state.device)?;
        Some(hit.and_then(|hit| self.target(hit)))
    }

    fn target(&self, hit: Hit) -> Option<Target> {
        match hit {
            Hit::Splat {
                instance,
                point: position,
            } => {
                let point = match &self.tree {
                    Some(tree) => tree.order().get(instance as usize).copied(),
                    None => Some(instance),
                };
                point.map(|point| Target::Point { point, position })
            }
            Hit::Sphere { index, point: position } => {
                let &point = self.source_points.get(index as usize)?;
                // A voted source is not the user's to select: a click on it is a click on its point.
                Some(if (index as usize) < self.n_own_sources {
                    Target::Source { point, position }
                } else {
                    Target::Point { point, position }
                })
            }
        }
    }

    /// Reads the last picture back: width, height, and RGBA rows from the top. Blocks; for tests and screenshots.
    pub fn read_picture(&self) -> Option<([u32; 2], Vec<u8>)> {
        self.renderer.read_picture(&self.state.device, &self.state.queue)
    }
}

/// Most spheres of voted sources: enough to see where they are.
const MAX_VOTED_SPHERES: usize = 500;

/// Uploads points that were just read, for [`Scene::show_points`]. O(n); in any thread.
///
/// # Errors
/// [`RenderError`] when the graphics adapter cannot hold them.
pub fn upload_points(uploader: &CloudUploader, cloud: &PointCloud) -> Result<UploadedCloud, RenderError> {
    let radii = vec![even_radius(cloud); cloud.n_points()];
    uploader.upload(cloud.positions(), None, &radii, None)
}

/// Uploads oriented points in the tree's preorder, for [`Scene::show_document`]. O(n); in any thread.
///
/// # Errors
/// [`RenderError`] when the graphics adapter cannot hold them.
pub fn upload_oriented(
    uploader: &CloudUploader,
    cloud: &PointCloud,
    propagation: &Propagation,
) -> Result<UploadedCloud, RenderError> {
    uploader.upload(
        cloud.positions(),
        Some(&propagation.normals),
        &propagation.splat_radii,
        Some(propagation.tree.order()),
    )
}

/// A radius that roughly closes a surface of the bounding box's size, until neighbors are known.
fn even_radius(cloud: &PointCloud) -> f32 {
    let (min, max) = cloud.bounding_box();
    let sides = max - min;
    let area = 2.0 * (sides.x * sides.y + sides.y * sides.z + sides.z * sides.x);
    let n_points = cloud.n_points().max(1) as f32;
    let radius = 0.5 * (area / n_points).sqrt();
    // A line or a single place has no area.
    if radius > 0.0 {
        radius
    } else {
        (sides.length() / n_points).max(f32::MIN_POSITIVE)
    }
}
