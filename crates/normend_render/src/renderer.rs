//! [`SplatRenderer`]: uploads, draws when something changed, picks.
//!
//! A picture has two steps. Geometry leaves what is seen at each pixel; it depends on the cloud, the camera, and what is
//! hidden or cut away. Shading makes colors of that; it depends on signs, colors and highlights too. A turn or a hover
//! redraws the second step alone.

use std::ops::Range;

use egui_wgpu::wgpu;
use glam::{UVec2, Vec3};

use crate::camera::BoundingSphere;
use crate::canvas::{Canvas, Stage};
use crate::cloud_buffers::{CloudBuffers, CloudSlices, ColorBuffer, MAX_CHUNK_POINTS};
use crate::gpu_types::{Flag, SphereMark};
use crate::marks::{GrowingBuffer, highlight_words};
use crate::pass::{PICTURE_FORMAT, Passes, SEEN_FORMAT, SURFACE_FORMAT};
use crate::pick::PictureView;
#[cfg(test)]
use crate::read_back::SEEN_BYTES;
use crate::read_back::{COLOR_BYTES, ReadBack};
use crate::uniforms::{Has, Shot, radius_scale};
use crate::{Camera, DrawSettings, IdsRequest, Lens, PickRequest, PictureMaker, RenderError, Sphere};

/// Storage buffers that a shader stage reads, at most: spheres, flags, highlights, colors.
const STORAGE_BUFFERS: u32 = 4;

/// Uploads clouds for one renderer, in any thread.
#[derive(Clone, Debug)]
pub struct CloudUploader {
    device: wgpu::Device,
    layout: wgpu::BindGroupLayout,
    max_chunk_points: usize,
}

/// A cloud on the GPU, to be handed to [`SplatRenderer::show_cloud`].
pub struct UploadedCloud {
    buffers: CloudBuffers,
    bytes: u64,
}

/// Colors on the GPU, to be handed to [`SplatRenderer::show_colors`].
pub struct UploadedColors(ColorBuffer);

impl CloudUploader {
    /// Packs and uploads a cloud; arguments and errors are those of [`SplatRenderer::set_cloud`]. O(n), parallel.
    ///
    /// # Errors
    /// As [`SplatRenderer::set_cloud`].
    pub fn upload(
        &self,
        positions: &[Vec3],
        normals: Option<&[Vec3]>,
        radii: &[f32],
        order: Option<&[u32]>,
    ) -> Result<UploadedCloud, RenderError> {
        let slices = CloudSlices {
            positions,
            normals,
            radii,
            order,
        };
        let (buffers, bytes) = CloudBuffers::new(&self.device, &self.layout, slices, self.max_chunk_points)?;
        Ok(UploadedCloud { buffers, bytes })
    }

    /// Uploads colors in the order of the instances: RGBA8, as [`SplatRenderer::set_colors`] takes them. O(n).
    ///
    /// # Errors
    /// [`RenderError::BufferTooLarge`] (for more points than a fourth of the bytes of the adapter's largest binding),
    /// [`RenderError::TooManyPoints`] and [`RenderError::OutOfMemory`].
    pub fn upload_colors(&self, colors: &[u32]) -> Result<UploadedColors, RenderError> {
        Ok(UploadedColors(ColorBuffer::new(&self.device, colors)?))
    }
}

/// Draws a cloud of oriented disc splats into its own texture.
pub struct SplatRenderer {
    passes: Passes,
    /// Bound as flags and colors while there are none.
    nothing: wgpu::Buffer,
    cloud: Option<CloudBuffers>,
    has_compared: bool,
    highlights: GrowingBuffer<[u32; 2]>,
    spheres: GrowingBuffer<SphereMark>,
    canvas: Option<Canvas>,
    /// A buffer that the canvas binds was replaced.
    bindings_are_stale: bool,
    drawn: Option<Shot>,
    geometry_is_stale: bool,
    shade_is_stale: bool,
    texture_number: u64,
    max_chunk_points: usize,
    bytes_uploaded: u64,
}

impl SplatRenderer {
    /// The device that this renderer needs: the adapter's own limits, so that big buffers are allowed.
    pub fn device_descriptor(adapter: &wgpu::Adapter) -> wgpu::DeviceDescriptor<'static> {
        wgpu::DeviceDescriptor {
            label: Some("Normend"),
            required_limits: adapter.limits(),
            ..wgpu::DeviceDescriptor::default()
        }
    }

    /// Whether `adapter` has what this renderer cannot do without; ask before opening a device.
    ///
    /// # Errors
    /// [`RenderError::Unsupported`] with what is missing.
    pub fn check_adapter(adapter: &wgpu::Adapter) -> Result<(), RenderError> {
        let flags = adapter.get_downlevel_capabilities().flags;
        let limits = adapter.limits();
        let is_target = |format| {
            let usages = adapter.get_texture_format_features(format).allowed_usages;
            usages.contains(wgpu::TextureUsages::RENDER_ATTACHMENT)
        };
        let lacks = if !flags.contains(wgpu::DownlevelFlags::VERTEX_STORAGE) {
            "storage buffers in vertex shaders"
        } else if limits.max_storage_buffers_per_shader_stage < STORAGE_BUFFERS {
            "four storage buffers in a shader"
        } else if !(is_target(SEEN_FORMAT) && is_target(SURFACE_FORMAT) && is_target(PICTURE_FORMAT)) {
            "drawing to integer textures"
        } else {
            return Ok(());
        };
        Err(RenderError::Unsupported {
            adapter: adapter.get_info().name,
            lacks,
        })
    }

    /// Pipelines for `device`, no cloud. The device must come from [`Self::device_descriptor`] and an adapter that
    /// passes [`Self::check_adapter`].
    pub fn new(device: &wgpu::Device) -> Self {
        Self::with_chunks(device, MAX_CHUNK_POINTS)
    }

    /// [`Self::new`] with chunks of at most `max_chunk_points`.
    pub(crate) fn with_chunks(device: &wgpu::Device, max_chunk_points: usize) -> Self {
        Self {
            passes: Passes::new(device),
            nothing: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("nothing"),
                size: size_of::<u32>() as u64,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            }),
            cloud: None,
            has_compared: false,
            highlights: GrowingBuffer::new(device, "highlighted ranges"),
            spheres: GrowingBuffer::new(device, "spheres"),
            canvas: None,
            bindings_are_stale: false,
            drawn: None,
            geometry_is_stale: true,
            shade_is_stale: true,
            texture_number: 0,
            max_chunk_points,
            bytes_uploaded: 0,
        }
    }

    /// Uploads a cloud of `n` points: positions in world space, unit normals, radii of the discs (world length).
    /// `normals` may be absent (points just read): then splats face the camera; so does a point whose normal is zero.
    /// `order` gives instance → index in `positions`, `normals`, `radii`; absent: as they are. All signs become 0 and
    /// nothing is marked, highlighted or colored. O(n), parallel; uploads 17 bytes a point.
    ///
    /// # Errors
    /// [`RenderError::BufferTooLarge`], [`RenderError::TooManyPoints`], [`RenderError::OutOfMemory`], and
    /// [`RenderError::Mismatch`] for slices of different lengths; the renderer then draws no cloud.
    pub fn set_cloud(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        positions: &[Vec3],
        normals: Option<&[Vec3]>,
        radii: &[f32],
        order: Option<&[u32]>,
    ) -> Result<(), RenderError> {
        // The old buffers go first, so that both need not fit at once.
        self.clear_cloud();
        let cloud = self.uploader(device).upload(positions, normals, radii, order)?;
        self.show_cloud(device, queue, cloud);
        Ok(())
    }

    /// Uploads clouds for this renderer from other threads, while it goes on drawing the present one.
    pub fn uploader(&self, device: &wgpu::Device) -> CloudUploader {
        CloudUploader {
            device: device.clone(),
            layout: self.passes.chunk_layout.clone(),
            max_chunk_points: self.max_chunk_points,
        }
    }

    /// Draws `cloud` from now on, with all signs 0 and nothing marked, highlighted or colored. It comes from
    /// [`Self::uploader`]. O(1).
    pub fn show_cloud(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, cloud: UploadedCloud) {
        self.clear_cloud();
        self.set_highlight(device, queue, &[]);
        self.bytes_uploaded += cloud.bytes;
        self.cloud = Some(cloud.buffers);
    }

    /// Draws no cloud from now on.
    pub fn clear_cloud(&mut self) {
        self.cloud = None;
        self.has_compared = false;
        self.bindings_are_stale = true;
        self.geometry_is_stale = true;
    }

    /// Toggles the sign of `ranges` of instances: uploads the words (32 instances in 4 bytes) that hold them and no more
    /// than a kilobyte between two of them.
    pub fn turn(&mut self, queue: &wgpu::Queue, ranges: &[Range<u32>]) {
        self.toggle(queue, Flag::Turned, ranges);
    }

    /// Sets all signs from a bit per instance (words of 32, lowest first); words that are missing are 0. Compares and
    /// uploads words as [`Self::turn`] does: O(n/32), bytes as what changes.
    pub fn set_turned(&mut self, queue: &wgpu::Queue, words: &[u32]) {
        self.set(queue, Flag::Turned, words);
    }

    /// Toggles whether `ranges` of instances are selected; uploads as [`Self::turn`].
    pub fn select(&mut self, queue: &wgpu::Queue, ranges: &[Range<u32>]) {
        self.toggle(queue, Flag::Selected, ranges);
    }

    /// Sets what is selected; words and upload as [`Self::set_turned`].
    pub fn set_selected(&mut self, queue: &wgpu::Queue, words: &[u32]) {
        self.set(queue, Flag::Selected, words);
    }

    /// Toggles whether `ranges` of instances are hidden: neither drawn nor picked. Uploads as [`Self::turn`].
    pub fn hide(&mut self, queue: &wgpu::Queue, ranges: &[Range<u32>]) {
        self.toggle(queue, Flag::Hidden, ranges);
    }

    /// Sets what is hidden; words and upload as [`Self::set_turned`].
    pub fn set_hidden(&mut self, queue: &wgpu::Queue, words: &[u32]) {
        self.set(queue, Flag::Hidden, words);
    }

    /// Toggles whether `ranges` of instances are marked as wrong, each by a small ball; uploads as [`Self::turn`].
    pub fn mark_wrong(&mut self, queue: &wgpu::Queue, ranges: &[Range<u32>]) {
        self.toggle(queue, Flag::Wrong, ranges);
    }

    /// Sets what is marked as wrong; words and upload as [`Self::set_turned`].
    pub fn set_wrong(&mut self, queue: &wgpu::Queue, words: &[u32]) {
        self.set(queue, Flag::Wrong, words);
    }

    /// The signs to compare with, as [`Self::set_turned`] takes the present ones, or none. They are shown where
    /// [`DrawSettings::compare`] says.
    pub fn set_compared(&mut self, queue: &wgpu::Queue, words: Option<&[u32]>) {
        if let Some(words) = words {
            self.set(queue, Flag::Compared, words);
        }
        let has_compared = words.is_some() && self.cloud.is_some();
        self.shade_is_stale |= self.has_compared != has_compared;
        self.has_compared = has_compared;
    }

    fn toggle(&mut self, queue: &wgpu::Queue, flag: Flag, ranges: &[Range<u32>]) {
        if let Some(cloud) = &mut self.cloud {
            let bytes = cloud.flags.toggle(queue, flag, ranges);
            self.flags_changed(flag, bytes);
        }
    }

    fn set(&mut self, queue: &wgpu::Queue, flag: Flag, words: &[u32]) {
        if let Some(cloud) = &mut self.cloud {
            let bytes = cloud.flags.set(queue, flag, words);
            self.flags_changed(flag, bytes);
        }
    }

    fn flags_changed(&mut self, flag: Flag, bytes: u64) {
        self.bytes_uploaded += bytes;
        let changes_geometry = matches!(flag, Flag::Hidden | Flag::Wrong);
        self.geometry_is_stale |= bytes > 0 && changes_geometry;
        self.shade_is_stale |= bytes > 0;
    }

    /// Gives every instance a color for [`crate::DisplayMode::Colors`], or none: RGBA8 with red in the lowest byte,
    /// gamma-encoded; alpha mixes it with the palette's color of surfaces, so 0 says that there is none. Uploads 4 bytes
    /// a point, in O(n): many points are better left to [`CloudUploader::upload_colors`].
    ///
    /// # Errors
    /// As [`CloudUploader::upload_colors`] and [`Self::show_colors`]; there are no colors then.
    pub fn set_colors(&mut self, device: &wgpu::Device, colors: Option<&[u32]>) -> Result<(), RenderError> {
        // The old ones go first, so that both need not fit at once.
        self.show_colors(None)?;
        match colors {
            Some(colors) => self.show_colors(Some(self.uploader(device).upload_colors(colors)?)),
            None => Ok(()),
        }
    }

    /// Shows `colors` from now on, or none. O(1).
    ///
    /// # Errors
    /// [`RenderError::Mismatch`] when they are not one for each instance; there are no colors then.
    pub fn show_colors(&mut self, colors: Option<UploadedColors>) -> Result<(), RenderError> {
        self.bindings_are_stale = true;
        self.shade_is_stale = true;
        let colors = colors.map(|colors| colors.0);
        let bytes = colors.as_ref().map_or(0, ColorBuffer::n_bytes);
        match &mut self.cloud {
            Some(cloud) => cloud.set_colors(colors)?,
            None if bytes > 0 => {
                return Err(RenderError::Mismatch {
                    what: "colors of the points",
                    expected: 0,
                    found: bytes as usize / size_of::<u32>(),
                });
            }
            None => {}
        }
        self.bytes_uploaded += bytes;
        Ok(())
    }

    /// Replaces the colors of the instances from `first` on, as many as there are; nothing before [`Self::set_colors`].
    /// Uploads 4 bytes for each.
    pub fn update_colors(&mut self, queue: &wgpu::Queue, first: u32, colors: &[u32]) {
        if let Some(cloud) = &self.cloud {
            let bytes = cloud.update_colors(queue, first, colors);
            self.bytes_uploaded += bytes;
            self.shade_is_stale |= bytes > 0;
        }
    }

    /// Highlights `ranges` of instances (ascending, disjoint); empty for none. Uploads 8 bytes a range.
    pub fn set_highlight(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, ranges: &[Range<u32>]) {
        let change = self.highlights.set(device, queue, highlight_words(ranges));
        self.shade_is_stale |= change.changed;
        self.bytes_uploaded += change.uploaded;
        self.bindings_are_stale |= change.replaced;
    }

    /// The spheres to draw, in the order that [`crate::Hit::Sphere`] counts. Uploads 32 bytes a sphere, when any differs.
    pub fn set_spheres(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, spheres: &[Sphere]) {
        let change = self
            .spheres
            .set(device, queue, spheres.iter().map(SphereMark::from).collect());
        self.geometry_is_stale |= change.changed;
        self.bytes_uploaded += change.uploaded;
        self.bindings_are_stale |= change.replaced;
    }

    /// Bytes of cloud, flags, colors, highlights and spheres uploaded since this renderer was made.
    pub fn bytes_uploaded(&self) -> u64 {
        self.bytes_uploaded
    }

    /// Draws if anything changed since the last call (camera, size, settings, cloud, flags, colors, highlight, spheres);
    /// says whether it did. Uploads what the shaders are told of it, 600 bytes; no work on the CPU depends on the cloud.
    /// `size` in physical pixels, brought within the device's limits; `pixels_per_point` scales lines
    /// and spheres.
    pub fn draw(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        camera: &Camera,
        size: [u32; 2],
        pixels_per_point: f32,
        settings: &DrawSettings,
    ) -> bool {
        let largest = device.limits().max_texture_dimension_2d;
        let size = size.map(|len| len.clamp(1, largest));
        let shot = self.shot(camera, size, pixels_per_point, settings);
        let draws_geometry =
            self.geometry_is_stale || !self.drawn.is_some_and(|previous| previous.same_geometry(&shot));
        if !draws_geometry && !self.shade_is_stale && self.drawn == Some(shot) {
            return false;
        }

        let stage = self.stage();
        let canvas = match self.canvas.take() {
            Some(mut canvas) if canvas.targets().size == size => {
                if self.bindings_are_stale {
                    canvas.bind(device, &stage);
                }
                canvas
            }
            _ => {
                self.texture_number += 1;
                Canvas::new(device, &stage, size)
            }
        };
        canvas.draw(device, queue, &stage, &shot, shot.whole(), draws_geometry);
        self.canvas = Some(canvas);
        self.bindings_are_stale = false;
        self.geometry_is_stale = false;
        self.shade_is_stale = false;
        self.drawn = Some(shot);
        true
    }

    fn shot(&self, camera: &Camera, size: [u32; 2], pixels_per_point: f32, settings: &DrawSettings) -> Shot {
        let view = PictureView {
            camera: *camera,
            size,
            scene: self.scene(settings),
        };
        Shot {
            view,
            pixels_per_point,
            transparent: false,
            settings: *settings,
        }
    }

    fn stage(&self) -> Stage {
        let cloud = self.cloud.as_ref();
        let colors = cloud.and_then(CloudBuffers::colors);
        Stage {
            passes: self.passes.clone(),
            chunks: cloud.map(|cloud| cloud.chunks().clone()),
            max_radius: cloud.map_or(0.0, CloudBuffers::max_radius),
            flags: cloud.map_or(&self.nothing, |cloud| cloud.flags.buffer()).clone(),
            plane_words: cloud.map_or(0, |cloud| cloud.flags.plane_words()),
            colors: colors.unwrap_or(&self.nothing).clone(),
            highlights: self.highlights.buffer().clone(),
            spheres: self.spheres.buffer().clone(),
            n_spheres: self.spheres.len(),
            has: Has {
                n_highlights: self.highlights.len(),
                colors: colors.is_some(),
                compared: self.has_compared,
            },
        }
    }

    /// The picture of the last [`Self::draw`] (`Rgba8Unorm`, gamma-encoded), with a number that changes with the texture.
    pub fn picture(&self) -> Option<(&wgpu::TextureView, u64)> {
        self.canvas
            .as_ref()
            .map(|canvas| (&canvas.targets().picture_view, self.texture_number))
    }

    /// Reads back what the last picture shows at `pixel` (from the top left): the nearest in a small window wins, so a
    /// click never falls through a gap to the back. `None` before the first picture.
    pub fn pick(&self, device: &wgpu::Device, queue: &wgpu::Queue, pixel: [u32; 2]) -> Option<PickRequest> {
        let (canvas, drawn) = (self.canvas.as_ref()?, self.drawn?);
        Some(PickRequest::new(
            device,
            queue,
            &canvas.targets().seen,
            drawn.view,
            pixel,
        ))
    }

    /// Reads back which instance the last picture shows at each pixel of a rectangle (`min` from the top left, `size` in
    /// pixels; what lies outside of the picture is left out). `None` before the first picture and when nothing of the
    /// rectangle lies inside. 8 bytes a pixel come back.
    pub fn read_ids(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        min: [u32; 2],
        size: [u32; 2],
    ) -> Option<IdsRequest> {
        let (canvas, drawn) = (self.canvas.as_ref()?, self.drawn?);
        IdsRequest::new(device, queue, &canvas.targets().seen, drawn.view, min, size)
    }

    /// Where places are in the last picture; `None` before the first.
    pub fn lens(&self) -> Option<Lens> {
        self.drawn.map(|drawn| Lens::new(&drawn.view, &drawn.settings.clip))
    }

    /// Reads the picture back as RGBA rows from the top, with its width and height; for screenshots and tests. Blocks.
    /// `None` before the first picture and when the device is lost.
    pub fn read_picture(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Option<([u32; 2], Vec<u8>)> {
        let targets = self.canvas.as_ref()?.targets();
        let (picture, size) = (&targets.picture, targets.size);
        let read_back = ReadBack::new(device, queue, picture, UVec2::ZERO, size.into(), COLOR_BYTES);
        read_back.wait(device);
        let mut rgba = Vec::new();
        read_back
            .rows(|row| rgba.extend_from_slice(row))
            .then_some((size, rgba))
    }

    /// What draws a picture of `size` pixels, beside the window's and without changing it, in this thread or another:
    /// see [`PictureMaker::make`]. The arguments are those of [`Self::draw`]. O(1).
    pub fn picture_maker(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        camera: &Camera,
        size: [u32; 2],
        pixels_per_point: f32,
        settings: &DrawSettings,
    ) -> PictureMaker {
        PictureMaker {
            device: device.clone(),
            queue: queue.clone(),
            stage: self.stage(),
            shot: self.shot(camera, size, pixels_per_point, settings),
            max_tile_side: PictureMaker::tile_side(device),
        }
    }

    /// Reads ids and depth bits back; for tests.
    #[cfg(test)]
    pub(crate) fn read_seen(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Option<Vec<[u32; 2]>> {
        let targets = self.canvas.as_ref()?.targets();
        let (seen, size) = (&targets.seen, targets.size.into());
        let read_back = ReadBack::new(device, queue, seen, UVec2::ZERO, size, SEEN_BYTES);
        read_back.wait(device);
        Some(read_back.pixels())
    }

    /// A ball around everything drawn.
    fn scene(&self, settings: &DrawSettings) -> BoundingSphere {
        let spheres = self.spheres.content();
        let first = spheres.first().map(|sphere| BoundingSphere {
            center: sphere.center,
            radius: 0.0,
        });
        let mut scene = self
            .cloud
            .as_ref()
            .map(CloudBuffers::bounds)
            .or(first)
            .unwrap_or_default();
        for sphere in spheres {
            scene.radius = scene.radius.max(sphere.center.distance(scene.center));
        }
        let splat = self.cloud.as_ref().map_or(0.0, CloudBuffers::max_radius) * radius_scale(settings);
        BoundingSphere {
            radius: scene.radius + splat,
            ..scene
        }
    }
}
