//! [`SplatRenderer`]: uploads, draws when something changed, picks.
//!
//! A picture has two steps. Geometry leaves what is seen at each pixel; it depends on the cloud and the camera. Shading
//! makes colors of that; it depends on signs and highlights too. A turn or a hover redraws the second step alone.

use std::ops::Range;

use egui_wgpu::wgpu;
use glam::{Mat4, UVec2, Vec2, Vec3};

use crate::camera::BoundingSphere;
use crate::cloud_buffers::{CloudBuffers, CloudSlices, MAX_CHUNK_POINTS};
use crate::gpu_types::{Frame, Look, SphereMark};
use crate::marks::{GrowingBuffer, highlight_words};
use crate::pass::shade::ShadePass;
use crate::pass::{self, PICTURE_FORMAT, SEEN_FORMAT, SURFACE_FORMAT, Targets};
use crate::pick::PictureView;
use crate::{Camera, DrawSettings, PickRequest, Projection, RenderError, Sphere};

/// Radius of a sphere, in points of the user interface.
const SPHERE_RADIUS: f32 = 6.0;
/// Storage buffers that a shader stage reads: spheres, signs, highlights.
const STORAGE_BUFFERS: u32 = 3;

/// Everything a picture is drawn from, apart from what the setters upload.
#[derive(Clone, Copy, PartialEq)]
struct Drawn {
    view: PictureView,
    pixels_per_point: f32,
    settings: DrawSettings,
}

impl Drawn {
    fn same_geometry(&self, other: &Self) -> bool {
        self.view == other.view
            && self.pixels_per_point == other.pixels_per_point
            && self.settings.splat_scale == other.settings.splat_scale
            && self.settings.stride == other.settings.stride
    }
}

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
}

/// Draws a cloud of oriented disc splats into its own texture.
pub struct SplatRenderer {
    chunk_layout: wgpu::BindGroupLayout,
    frame_layout: wgpu::BindGroupLayout,
    splat_pipeline: wgpu::RenderPipeline,
    sphere_pipeline: wgpu::RenderPipeline,
    shade_pass: ShadePass,
    frame_buffer: wgpu::Buffer,
    look_buffer: wgpu::Buffer,
    /// Bound as signs while there is no cloud.
    no_signs: wgpu::Buffer,
    cloud: Option<CloudBuffers>,
    highlights: GrowingBuffer<[u32; 2]>,
    spheres: GrowingBuffer<SphereMark>,
    targets: Option<Targets>,
    /// Of the frame and of the shade pass; `None` after a buffer or texture in them was replaced.
    bound: Option<(wgpu::BindGroup, wgpu::BindGroup)>,
    drawn: Option<Drawn>,
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
            "three storage buffers in a shader"
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
        let chunk_layout = pass::uniform_and_storage(device, "chunk", wgpu::ShaderStages::VERTEX);
        // Every pass shares these: frame and spheres.
        let frame_layout = pass::uniform_and_storage(device, "frame", wgpu::ShaderStages::VERTEX_FRAGMENT);
        let buffer = |label, size: usize, usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size: size as u64,
                usage: usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        Self {
            splat_pipeline: pass::splat::pipeline(device, &frame_layout, &chunk_layout),
            sphere_pipeline: pass::sphere::pipeline(device, &frame_layout),
            shade_pass: ShadePass::new(device, &frame_layout),
            chunk_layout,
            frame_layout,
            frame_buffer: buffer("frame", size_of::<Frame>(), wgpu::BufferUsages::UNIFORM),
            look_buffer: buffer("look", size_of::<Look>(), wgpu::BufferUsages::UNIFORM),
            no_signs: buffer("no signs", size_of::<u32>(), wgpu::BufferUsages::STORAGE),
            cloud: None,
            highlights: GrowingBuffer::new(device, "highlighted ranges"),
            spheres: GrowingBuffer::new(device, "spheres"),
            targets: None,
            bound: None,
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
    /// nothing is highlighted. O(n), parallel.
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
            layout: self.chunk_layout.clone(),
            max_chunk_points: self.max_chunk_points,
        }
    }

    /// Draws `cloud` from now on, with all signs 0 and nothing highlighted. It comes from [`Self::uploader`]. O(1).
    pub fn show_cloud(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, cloud: UploadedCloud) {
        self.clear_cloud();
        self.set_highlight(device, queue, &[]);
        self.bytes_uploaded += cloud.bytes;
        self.cloud = Some(cloud.buffers);
    }

    /// Draws no cloud from now on.
    pub fn clear_cloud(&mut self) {
        self.cloud = None;
        self.bound = None;
        self.geometry_is_stale = true;
    }

    /// Toggles the sign of `ranges` of instances: uploads the words that hold them and no more.
    pub fn turn(&mut self, queue: &wgpu::Queue, ranges: &[Range<u32>]) {
        if let Some(cloud) = &mut self.cloud {
            let bytes = cloud.turn(queue, ranges);
            self.bytes_uploaded += bytes;
            self.shade_is_stale |= bytes > 0;
        }
    }

    /// Sets all signs from a bit per instance (words of 32, lowest first); words that are missing are 0.
    pub fn set_turned(&mut self, queue: &wgpu::Queue, words: &[u32]) {
        if let Some(cloud) = &mut self.cloud {
            self.bytes_uploaded += cloud.set_turned(queue, words);
            self.shade_is_stale = true;
        }
    }

    /// Highlights `ranges` of instances (ascending, disjoint); empty for none. Uploads the ranges only.
    pub fn set_highlight(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, ranges: &[Range<u32>]) {
        let change = self.highlights.set(device, queue, highlight_words(ranges));
        self.shade_is_stale |= change.changed;
        self.bytes_uploaded += change.uploaded;
        if change.replaced {
            self.bound = None;
        }
    }

    /// The spheres to draw, in the order that [`crate::Hit::Sphere`] counts.
    pub fn set_spheres(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, spheres: &[Sphere]) {
        let change = self
            .spheres
            .set(device, queue, spheres.iter().map(SphereMark::from).collect());
        self.geometry_is_stale |= change.changed;
        self.bytes_uploaded += change.uploaded;
        if change.replaced {
            self.bound = None;
        }
    }

    /// Bytes of cloud, signs, highlights and spheres uploaded since this renderer was made.
    pub fn bytes_uploaded(&self) -> u64 {
        self.bytes_uploaded
    }

    /// Draws if anything changed since the last call (camera, size, settings, cloud, signs, highlight, spheres); says
    /// whether it did. `size` in physical pixels, brought within the device's limits; `pixels_per_point` scales lines
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
        let settings = DrawSettings {
            stride: settings.stride.max(1),
            ..*settings
        };
        let view = PictureView {
            camera: *camera,
            size,
            scene: self.scene(&settings),
        };
        let drawn = Drawn {
            view,
            pixels_per_point,
            settings,
        };
        let draws_geometry =
            self.geometry_is_stale || !self.drawn.is_some_and(|previous| previous.same_geometry(&drawn));
        if !draws_geometry && !self.shade_is_stale && self.drawn == Some(drawn) {
            return false;
        }

        if self.targets.as_ref().is_none_or(|targets| targets.size != size) {
            self.targets = Some(Targets::new(device, size));
            self.texture_number += 1;
            self.bound = None;
        }
        let Some(targets) = &self.targets else { return false };
        let (frame_group, shade_group) = self.bound.get_or_insert_with(|| {
            let frame = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("frame"),
                layout: &self.frame_layout,
                entries: &[
                    wgpu::BindGroupEntry {
                        binding: 0,
                        resource: self.frame_buffer.as_entire_binding(),
                    },
                    wgpu::BindGroupEntry {
                        binding: 1,
                        resource: self.spheres.buffer().as_entire_binding(),
                    },
                ],
            });
            let signs = self.cloud.as_ref().map_or(&self.no_signs, CloudBuffers::turned_buffer);
            let shade = self
                .shade_pass
                .bind(device, targets, &self.look_buffer, signs, self.highlights.buffer());
            (frame, shade)
        });

        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("picture") });
        if draws_geometry {
            let max_radius = self.cloud.as_ref().map_or(0.0, CloudBuffers::max_radius);
            queue.write_buffer(&self.frame_buffer, 0, bytemuck::bytes_of(&frame(&drawn, max_radius)));
            let mut pass = targets.begin_geometry(&mut encoder);
            pass.set_bind_group(0, &*frame_group, &[]);
            if let Some(cloud) = &self.cloud {
                pass.set_pipeline(&self.splat_pipeline);
                cloud.draw(&mut pass, settings.stride);
            }
            if self.spheres.len() > 0 {
                pass.set_pipeline(&self.sphere_pipeline);
                pass.draw(0..3 * self.spheres.len(), 0..1);
            }
        }
        queue.write_buffer(
            &self.look_buffer,
            0,
            bytemuck::bytes_of(&look(&settings, self.highlights.len())),
        );
        self.shade_pass.draw(&mut encoder, targets, frame_group, shade_group);
        queue.submit([encoder.finish()]);

        self.geometry_is_stale = false;
        self.shade_is_stale = false;
        self.drawn = Some(drawn);
        true
    }

    /// The picture of the last [`Self::draw`] (`Rgba8Unorm`, gamma-encoded), with a number that changes with the texture.
    pub fn picture(&self) -> Option<(&wgpu::TextureView, u64)> {
        self.targets
            .as_ref()
            .map(|targets| (&targets.picture_view, self.texture_number))
    }

    /// Reads back what the last picture shows at `pixel` (from the top left): the nearest in a small window wins, so a
    /// click never falls through a gap to the back. `None` before the first picture.
    pub fn pick(&self, device: &wgpu::Device, queue: &wgpu::Queue, pixel: [u32; 2]) -> Option<PickRequest> {
        let (targets, drawn) = (self.targets.as_ref()?, self.drawn?);
        Some(PickRequest::new(device, queue, &targets.seen, drawn.view, pixel))
    }

    /// Reads the picture back as RGBA rows from the top, with its width and height; for screenshots and tests. Blocks.
    /// `None` before the first picture and when the device is lost.
    pub fn read_picture(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Option<([u32; 2], Vec<u8>)> {
        let targets = self.targets.as_ref()?;
        Some((
            targets.size,
            read_texture(device, queue, &targets.picture, targets.size, 4)?,
        ))
    }

    /// Reads ids and depth bits back; for tests.
    #[cfg(test)]
    pub(crate) fn read_seen(&self, device: &wgpu::Device, queue: &wgpu::Queue) -> Option<Vec<[u32; 2]>> {
        let targets = self.targets.as_ref()?;
        let bytes = read_texture(device, queue, &targets.seen, targets.size, 8)?;
        Some(bytes.chunks_exact(8).map(bytemuck::pod_read_unaligned).collect())
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

/// Factor on the radii of splats; those of a thinned cloud grow to cover as much.
fn radius_scale(settings: &DrawSettings) -> f32 {
    settings.splat_scale * (settings.stride as f32).sqrt()
}

fn frame(drawn: &Drawn, max_radius: f32) -> Frame {
    let PictureView { camera, size, scene } = drawn.view;
    let size = UVec2::from(size).as_vec2();
    let is_perspective = camera.projection == Projection::Perspective;
    let center = (camera.eye() - scene.center).dot(camera.back());
    Frame {
        clip_from_eye: camera.clip_from_view(size.x / size.y, scene) * Mat4::from_mat3(camera.view_rotation()),
        eye: camera.eye(),
        perspective: if is_perspective { 1.0 } else { 0.0 },
        right: camera.right(),
        pixel_len: camera.pixel_len(1.0, size),
        back: camera.back(),
        max_radius: max_radius * radius_scale(&drawn.settings),
        depth_from_clip: camera.depth_from_clip(scene),
        scene_depth: Vec2::new(center - scene.radius, center + scene.radius),
        size,
        pivot_depth: camera.distance,
        sphere_radius: SPHERE_RADIUS * drawn.pixels_per_point,
        line_width: drawn.pixels_per_point,
        stride: drawn.settings.stride,
    }
}

fn look(settings: &DrawSettings, n_highlights: u32) -> Look {
    let palette = &settings.palette;
    Look {
        front: palette.front.into(),
        mode: settings.mode.code(),
        back: palette.back.into(),
        n_highlights,
        background: palette.background.into(),
        pad_0: 0,
        highlight: palette.highlight.into(),
        pad_1: 0,
    }
}

/// Rows of a texture from the top, without padding. Blocks; `None` when the device is lost.
fn read_texture(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    texture: &wgpu::Texture,
    [width, height]: [u32; 2],
    pixel_bytes: u32,
) -> Option<Vec<u8>> {
    let row_bytes = width * pixel_bytes;
    let padded = row_bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read back"),
        size: u64::from(padded) * u64::from(height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor {
        label: Some("read back"),
    });
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: &buffer,
            layout: wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(padded),
                rows_per_image: None,
            },
        },
        wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
    );
    queue.submit([encoder.finish()]);
    buffer.map_async(wgpu::MapMode::Read, .., |result| {
        if let Err(error) = result {
            tracing::warn!("reading a picture back: {error}");
        }
    });
    device.poll(wgpu::PollType::wait_indefinitely()).ok()?;
    let bytes = buffer.get_mapped_range(..).ok()?;
    Some(
        bytes
            .chunks(padded as usize)
            .flat_map(|row| &row[..row_bytes as usize])
            .copied()
            .collect(),
    )
}
