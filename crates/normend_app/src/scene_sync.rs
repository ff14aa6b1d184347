//! The picture of the document: the only place that turns a core [`Change`] into GPU ranges.
//!
//! The splats are uploaded in the tree's preorder, so an instance of the renderer is a position of the tree and the
//! ranges of a [`Change`] are the ranges that the renderer turns. Source spheres follow the document's sources.

use std::ops::Range;
use std::sync::Arc;

use eframe::egui_wgpu::RenderState;
use egui::TextureId;
use fixedbitset::FixedBitSet;
use glam::Vec3;
use normend_core::{Change, PointCloud, PointSet, Propagation, SpanningTree};
use normend_render::{
    Camera, Clip, CloudUploader, Compare, DrawSettings, Hair, HairLen, Hit, IdsRequest, Lens, PickRequest,
    PictureMaker, RenderError, SeenIds, SplatRenderer, UploadedCloud, UploadedColors, wgpu,
};

use crate::point_ranges;
use crate::session::Session;
use crate::source_spheres::SourceSpheres;

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
    /// The id of the point, or of the source's point.
    pub fn point(self) -> u32 {
        match self {
            Self::Point { point, .. } | Self::Source { point, .. } => point,
        }
    }

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
    /// What is highlighted while nothing else is.
    outlined: Option<Change>,
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
            outlined: None,
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
    pub fn show_document(&mut self, session: &mut Session, uploaded: Option<UploadedCloud>) -> Result<(), RenderError> {
        let document = &session.document;
        let Some(propagation) = document.propagation() else {
            return Ok(());
        };
        self.forget_ids();
        let tree = Arc::clone(&propagation.tree);
        self.renderer.clear_cloud();
        let uploaded = uploaded.map_or_else(|| upload_oriented(&self.uploader(), document.cloud(), propagation), Ok)?;
        let (device, queue) = (&self.state.device, &self.state.queue);
        self.renderer.show_cloud(device, queue, uploaded);
        self.tree = Some(tree);
        self.show_state(session);
        Ok(())
    }

    /// Shows the signs, what is selected and hidden, and the sources from scratch, on the points that are there. O(n / 32) and what is
    /// selected and hidden.
    pub fn show_state(&mut self, session: &mut Session) {
        if let Some(orientation) = session.document.orientation() {
            self.renderer.set_turned(&self.state.queue, &orientation.to_words());
        }
        session.take_toggled();
        self.show_sets(session);
        self.show_sources(session);
    }

    /// Shows what an edit, an undo or a redo turned, and the sources after it.
    pub fn apply(&mut self, change: &Change, session: &mut Session) {
        self.renderer.turn(&self.state.queue, change.ranges());
        match session.take_toggled() {
            Some([selected, hidden]) => {
                let queue = &self.state.queue;
                let n_points = session.document.cloud().n_points();
                let [selects, hides] = [&selected, &hidden].map(|set| self.ranges_of(set, n_points));
                self.renderer.select(queue, &selects);
                self.renderer.hide(queue, &hides);
                if !hidden.is_empty() {
                    // What was behind is seen now: earlier picks no longer hold.
                    self.picture_id += 1;
                    self.ids_version += 1;
                }
            }
            None => self.show_sets(session),
        }
        self.show_sources(session);
    }

    /// Shows what is selected and hidden from scratch, as fast as [`Self::ranges_of`].
    fn show_sets(&mut self, session: &Session) {
        let document = &session.document;
        let n_points = document.cloud().n_points();
        let [selected, hidden] = [document.selected(), document.hidden()].map(|set| {
            let mut bits = FixedBitSet::with_capacity(n_points);
            for range in self.ranges_of(set, n_points) {
                bits.insert_range(range.start as usize..range.end as usize);
            }
            normend_core::Orientation::new(bits).to_words()
        });
        self.renderer.set_selected(&self.state.queue, &selected);
        self.renderer.set_hidden(&self.state.queue, &hidden);
        self.picture_id += 1;
        self.ids_version += 1;
    }

    /// The instances of points out of `n_points`, as ranges. O(n / 64), and the points or else the others, whichever are fewer: all
    /// points are as cheap as none.
    fn ranges_of(&self, points: &PointSet, n_points: usize) -> Vec<Range<u32>> {
        point_ranges::renumbered(points, n_points, |point| {
            self.tree.as_ref().map_or(point, |tree| tree.position(point))
        })
    }

    /// The points of instances.
    pub fn points_of(&self, instances: &[u32]) -> PointSet {
        let Some(tree) = &self.tree else {
            return instances.iter().copied().collect();
        };
        let order = tree.order();
        let mut points: Vec<u32> = instances
            .iter()
            .filter_map(|&instance| order.get(instance as usize).copied())
            .collect();
        points.sort_unstable();
        points.into_iter().collect()
    }

    /// Asks which instances the last picture shows in a rectangle of the view, in physical pixels. `None` while the picture is
    /// older than the ids or not in full detail, which the next ones will be.
    pub fn read_ids(&self, min: [u32; 2], size: [u32; 2]) -> Option<IdsRequest> {
        let is_full = self.pixel_side == 1 && self.geometry.is_some_and(|geometry| geometry.stride <= 1);
        if self.drawn_ids_version != self.ids_version || !is_full {
            return None;
        }
        self.renderer.read_ids(&self.state.device, &self.state.queue, min, size)
    }

    /// The point at each pixel of the last picture: width, height, and rows from the top. Blocks; for tests.
    pub fn read_points(&self) -> Option<([u32; 2], Vec<Option<u32>>)> {
        let ([width, height], _) = self.read_picture()?;
        let seen = self.read_ids([0, 0], [width, height])?.wait(&self.state.device);
        let point = |&instance: &u32| match &self.tree {
            Some(tree) => tree.order().get(instance as usize).copied(),
            None => Some(instance).filter(|&instance| instance != SeenIds::NONE),
        };
        Some((seen.size, seen.instances.iter().map(point).collect()))
    }

    /// The answer of [`Self::read_ids`]: `None` while under way. Never blocks.
    pub fn poll_ids(&self, request: &mut IdsRequest) -> Option<SeenIds> {
        request.poll(&self.state.device)
    }

    /// Where places are in the last picture; `None` before the first.
    pub fn lens(&self) -> Option<Lens> {
        // In full detail: while the camera moves a pixel of the picture may stand for several of the screen.
        self.renderer.lens().filter(|_| self.pixel_side == 1)
    }

    /// From where the last picture is seen; `None` before the first.
    pub fn drawn_camera(&self) -> Option<Camera> {
        self.geometry.map(|geometry| geometry.camera)
    }

    /// Bytes uploaded to the graphics adapter so far.
    pub fn bytes_uploaded(&self) -> u64 {
        self.renderer.bytes_uploaded()
    }

    /// Keeps these positions highlighted while nothing else is, or none.
    pub fn outline(&mut self, change: Option<Change>) {
        self.outlined = change;
        self.highlight(None);
    }

    /// What draws a picture beside the window's; see [`SplatRenderer::picture_maker`].
    pub fn picture_maker(
        &self,
        camera: &Camera,
        size: [u32; 2],
        pixels_per_point: f32,
        settings: &DrawSettings,
    ) -> PictureMaker {
        let (device, queue) = (&self.state.device, &self.state.queue);
        self.renderer
            .picture_maker(device, queue, camera, size, pixels_per_point, settings)
    }

    /// Shows colors that a job uploaded: by position, or by point before points are oriented.
    ///
    /// # Errors
    /// As [`SplatRenderer::show_colors`].
    pub fn show_colors(&mut self, colors: Option<UploadedColors>) -> Result<(), RenderError> {
        self.renderer.show_colors(colors)
    }

    /// Colors the positions from `first` on.
    pub fn update_colors(&mut self, first: u32, colors: &[u32]) {
        self.renderer.update_colors(&self.state.queue, first, colors);
    }

    /// The signs to compare with: a bit a position, in words of 32.
    pub fn set_compared(&mut self, words: &[u32]) {
        self.renderer.set_compared(&self.state.queue, Some(words));
    }

    /// Marks these positions as wrong, and no others. O(n / 64).
    pub fn set_wrong(&mut self, wrong: &FixedBitSet) {
        let words = normend_core::Orientation::new(wrong.clone()).to_words();
        self.renderer.set_wrong(&self.state.queue, &words);
    }

    /// Marks these positions as wrong, or those of them that are marked as right.
    pub fn mark_wrong(&mut self, toggled: &Change) {
        self.renderer.mark_wrong(&self.state.queue, toggled.ranges());
    }

    /// Highlights what a click would turn, or what is outlined.
    pub fn highlight(&mut self, change: Option<&Change>) {
        let ranges = change.or(self.outlined.as_ref()).map_or(&[][..], Change::ranges);
        self.renderer
            .set_highlight(&self.state.device, &self.state.queue, ranges);
    }

    /// Shows sources and what else says a side as spheres.
    pub fn show_sources(&mut self, session: &Session) {
        let SourceSpheres { points, spheres, n_own } = SourceSpheres::of(session);
        self.n_own_sources = n_own;
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
        self.outlined = None;
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
        let mut settings = *settings;
        if let Compare::Split(x) = &mut settings.compare {
            *x /= pixel_side as f32;
        }
        if let Some(Hair {
            len: HairLen::Pixels(len),
            ..
        }) = &mut settings.hair
        {
            *len /= pixel_side as f32;
        }
        self.renderer.draw(
            &self.state.device,
            &self.state.queue,
            camera,
            size,
            pixels_per_point,
            &settings,
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
