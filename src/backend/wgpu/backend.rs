//! The wgpu backend: its configuration, and the resources that it keeps from frame to frame.

use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use parking_lot::Mutex;

use super::error_scope::{check_device, with_error_scope};
use super::frame::{BufferPool, WgpuPassStatistics, shares_memory};
use super::pipelines::{PipelineCache, SharedPipelines, pipeline_count};
use super::resources::{
    BindGroupLayouts, CountedQueue, ImportedTarget, LightMeshes, MaterialCache, MeshCache, StorageBuffers,
    SubdividedMesh, TargetCache, texture_format,
};
use super::strategy::{EncodingStrategy, RecordingStrategy, StrategySet};
use super::streaming::{Streamer, StreamingBudget, StreamingStatistics};
use super::timing::{DeviceClock, DeviceTiming};
use crate::backend::subdivision_cache::SubdivisionCache;
use crate::backend::{Backend, BackendError, FrameRequest, Picture, TargetMemory};
use crate::process::ShaderResource;
use crate::timeline::Timeline;

/// Draws with wgpu, on the engine's device.
///
/// Drawloom builds wgpu with WGSL, and with what the features `vulkan`, `metal`, `dx12` and `noop` name; all but the
/// last are on by default. An engine that depends on wgpu 30 itself can enable more of it.
///
/// Errors in what Drawloom records and submits are returned. Other device errors are not: for those an engine sets its
/// own `Device::set_device_lost_callback` and `Device::on_uncaptured_error`.
///
/// If the device is lost, the frame that is being recorded or submitted returns [`BackendError::DeviceLost`], and so
/// does every later one. Of the frames in flight, [`WgpuSubmission::wait`](super::WgpuSubmission::wait) and
/// [`WgpuSubmission::read`](super::WgpuSubmission::read) return it where the device has not drawn the frame; what it
/// has drawn is lost too, so `read` returns it for all of them.
/// [`Renderer::replace_backend`](crate::Renderer::replace_backend) goes on with a new device.
pub struct WgpuBackend {
    pub(super) device: wgpu::Device,
    pub(super) uploads: CountedQueue,
    pub(super) layouts: BindGroupLayouts,
    pub(super) pipelines: Mutex<PipelineCache>,
    /// What processes share, and the backends of a [`PipelineLibrary`](super::PipelineLibrary).
    pub(super) shared_pipelines: SharedPipelines,
    /// Created when a plan draws lights for the first time.
    pub(super) light_meshes: Mutex<Option<Arc<LightMeshes>>>,
    pub(super) meshes: Mutex<MeshCache>,
    pub(super) materials: Mutex<MaterialCache>,
    pub(super) subdivisions: SubdivisionCache<SubdividedMesh>,
    pub(super) targets: Mutex<TargetCache>,
    /// Textures that take the place of targets in the next frame.
    pub(super) imports: Mutex<Vec<ImportedTarget>>,
    pub(super) storage_buffers: Mutex<Arc<StorageBuffers>>,
    pub(super) buffers: Arc<BufferPool>,
    pub(super) strategies: StrategySet,
    /// The number of frames begun.
    pub(super) frames: AtomicU64,
    /// How each pass with commands was recorded in the frame that was submitted last.
    pub(super) latest: Mutex<Vec<WgpuPassStatistics>>,
    /// Whether a frame has failed because a raw pass destroyed a texture or buffer that it was lent, so that those of
    /// the frames to come may be among them.
    pub(super) has_destroyed: Mutex<bool>,
    /// `None` if passes are not timed.
    pub(super) device_timing: Option<DeviceTiming>,
    /// Whether targets share textures.
    pub(super) transient_targets: bool,
    /// `None` if all that a frame needs is uploaded when it begins.
    pub(super) streamer: Option<Streamer>,
}

impl WgpuBackend {
    /// The features that a device must have: none beyond WebGPU's own.
    pub const REQUIRED_FEATURES: wgpu::Features = wgpu::Features::empty();

    /// The feature that targets of [`Format::Depth32FloatStencil8`](crate::process::Format::Depth32FloatStencil8) need.
    pub const STENCIL_FEATURES: wgpu::Features = wgpu::Features::DEPTH32FLOAT_STENCIL8;

    /// The feature that targets of [`Format::Rgba32FloatBlendable`](crate::process::Format::Rgba32FloatBlendable) need,
    /// and with them some of [`RadianceSum`](crate::quality::RadianceSum).
    pub const BLENDING_FEATURES: wgpu::Features = wgpu::Features::FLOAT32_BLENDABLE;

    /// The feature with which what is in front of a directional light's shadow map casts shadows at no cost. Without
    /// it, a fragment shader that writes depth draws these maps, and processes of an engine's own need a
    /// [`clamped_fragment`](crate::process::CommandDraws::clamped_fragment).
    pub const DEPTH_CLIP_FEATURES: wgpu::Features = wgpu::Features::DEPTH_CLIP_CONTROL;

    /// The feature with which jobs write objects straight into the memory that a device shares with the CPU. Request it
    /// only for such devices: see [`WgpuBackend::optional_features`].
    pub const MAPPING_FEATURES: wgpu::Features = wgpu::Features::MAPPABLE_PRIMARY_BUFFERS;

    /// The optional features that an adapter has and that pay on it: request them with
    /// [`WgpuBackend::REQUIRED_FEATURES`].
    pub fn optional_features(adapter: &wgpu::Adapter) -> wgpu::Features {
        let mapping = if shares_memory(&adapter.get_info()) { Self::MAPPING_FEATURES } else { wgpu::Features::empty() };
        let of_drawing = Self::STENCIL_FEATURES | Self::BLENDING_FEATURES | Self::DEPTH_CLIP_FEATURES;
        adapter.features() & (of_drawing | Self::TIMING_FEATURES | mapping)
    }

    /// The features that [`WgpuBackend::time_passes`] uses. It requires `TIMESTAMP_QUERY`; with the other one it times
    /// raw passes as well.
    pub const TIMING_FEATURES: wgpu::Features =
        wgpu::Features::TIMESTAMP_QUERY.union(wgpu::Features::TIMESTAMP_QUERY_INSIDE_ENCODERS);

    /// The limits that a device must have. Higher limits allow larger pictures and more objects.
    pub const REQUIRED_LIMITS: wgpu::Limits = wgpu::Limits::downlevel_defaults();

    /// A backend on the engine's device. It tunes the recording and encoding strategy of each pass by measurement.
    ///
    /// # Errors
    /// If the device lacks a feature or a limit, naming it.
    pub fn new(device: wgpu::Device, queue: wgpu::Queue) -> Result<Self, BackendError> {
        let missing = Self::REQUIRED_FEATURES - device.features();
        if !missing.is_empty() {
            return Err(BackendError::MissingFeature { missing: missing.to_string() });
        }
        let mut insufficient = None;
        let limits = device.limits();
        Self::REQUIRED_LIMITS.check_limits_with_fail_fn(&limits, true, |limit, needed, allowed| {
            insufficient.get_or_insert(BackendError::Limit { limit, allowed, needed });
        });
        if let Some(error) = insufficient {
            return Err(error);
        }
        let layouts = with_error_scope(&device, "Drawloom's bind group layouts", || BindGroupLayouts::new(&device))?;
        let maps_memory = device.features().contains(Self::MAPPING_FEATURES) && shares_memory(&device.adapter_info());
        Ok(Self {
            device,
            uploads: CountedQueue::new(queue),
            layouts,
            pipelines: Mutex::default(),
            shared_pipelines: SharedPipelines::new(false),
            light_meshes: Mutex::default(),
            meshes: Mutex::default(),
            materials: Mutex::default(),
            subdivisions: SubdivisionCache::default(),
            targets: Mutex::default(),
            imports: Mutex::default(),
            storage_buffers: Mutex::default(),
            buffers: Arc::new(BufferPool::new(maps_memory)),
            strategies: StrategySet::new(),
            frames: AtomicU64::new(0),
            latest: Mutex::default(),
            has_destroyed: Mutex::default(),
            device_timing: None,
            transient_targets: false,
            streamer: None,
        })
    }

    /// Fixes the recording strategy of all passes, instead of tuning it.
    pub fn recording_strategy(self, recording: RecordingStrategy) -> Self {
        Self { strategies: self.strategies.with_recording(recording), ..self }
    }

    /// Fixes the encoding strategy of all passes, instead of tuning it.
    pub fn encoding_strategy(self, encoding: EncodingStrategy) -> Self {
        Self { strategies: self.strategies.with_encoding(encoding), ..self }
    }

    /// Draws a process whose new shader does not compile with the shader that it had, instead of failing the frame: for
    /// shaders that change while the engine runs, such as those that it reads again from a file. The error goes through
    /// `tracing` once, and is among [`WgpuBackend::shader_errors`] until the shader compiles.
    pub fn keep_working_shaders(self) -> Self {
        Self { pipelines: Mutex::new(PipelineCache::new(true)), ..self }
    }

    /// Lets the targets of a frame share textures. A target's life begins with the first pass that uses it and ends
    /// with the last one, of any view. Targets whose lives do not overlap and that are alike in format, size, samples,
    /// mip levels and use share one texture. Other targets of up to 64 × 64 pixels are layers of shared textures, so
    /// that thousands of views need few. Pictures stay the same; what the targets of all views need is often little
    /// more than what one view needs. [`WgpuBackend::resources`] and
    /// [`FrameStatistics::targets`](crate::FrameStatistics::targets) tell how much is saved.
    ///
    /// When the frame is drawn, the texture of a transient target may hold another one. So reading it back returns
    /// [`BackendError::TransientTarget`], and [`WgpuSubmission::texture`](super::WgpuSubmission::texture) returns
    /// `None`. These targets have textures of their own, and stay readable:
    ///
    /// - outputs: name what is read back with [`RendererBuilder::output`](crate::RendererBuilder::output),
    /// - imported ones, and those whose history a process reads,
    /// - those that are drawn in layers, and all of views that [not every frame draws](crate::scene::Redraw).
    ///
    /// What a target holds before it is first drawn into is undefined. So a raw pass that
    /// [writes](crate::process::Declare::writes) a target must write each of its pixels, and it must not keep the
    /// texture for later frames.
    ///
    /// Which targets share a texture is decided when the plan, the cameras or the imports change, and costs nothing in
    /// other frames.
    pub fn transient_targets(self) -> Self {
        Self { transient_targets: true, ..self }
    }

    /// Streams meshes and textures: background jobs bring them to the device, and frames draw what is there (L 3.1, M
    /// 10.3).
    ///
    /// Without it, a frame uploads all that it needs when it begins, however long that takes. With it, a frame takes
    /// over what jobs have uploaded since the frame before. Objects whose mesh is not on the device are not drawn, and
    /// counted as [`NotResident`](crate::view::IssueReason::NotResident); materials whose texture is not are drawn
    /// without it, and counted as [`TextureNotResident`](crate::view::IssueReason::TextureNotResident).
    ///
    /// First comes what the latest frame would have drawn, then all else that objects use, so that it is there before
    /// it comes into sight; in both the [priority](crate::scene::Assets::set_priority) decides. If the budget is spent,
    /// what was drawn longest ago makes room. What is in sight makes room only for what is in sight and has a higher
    /// priority: if frames draw more than the budget, a part of it is left out, counted in
    /// [`WgpuBackend::streaming_statistics`], and warned of.
    ///
    /// Two things are uploaded by the frame itself: a mesh that [replaces](crate::scene::Assets::replace) one on the
    /// device, if the budget has room for both, and meshes that are subdivided for paraboloids. Otherwise a mesh or
    /// texture that is replaced is drawn until the new one has arrived, or left out if not even evictions make room for
    /// both. What is larger than the budget of its kind is left out, counted, and warned of by name. When the format of
    /// vertices changes, or a plan first reads a vertex attribute, all meshes come anew. Scenes at rest, once
    /// everything is there, have the pictures that they have without streaming. Views that [not every frame
    /// draws](crate::scene::Redraw) are not drawn anew because something arrived: they need a frame of
    /// [`Redraw::EveryFrame`](crate::scene::Redraw::EveryFrame) then.
    ///
    /// ```no_run
    /// # use drawloom::{Renderer, Submitter, backend::{BackendError, StreamingBudget, WgpuBackend}, wgpu};
    /// # fn stream(device: wgpu::Device, queue: wgpu::Queue) -> Result<WgpuBackend, BackendError> {
    /// let budget = StreamingBudget { mesh_bytes: 32 << 20, texture_bytes: 32 << 20, ..StreamingBudget::default() };
    /// let backend = WgpuBackend::new(device, queue)?.stream_resources(budget)?;
    /// # Ok(backend)
    /// # }
    /// ```
    ///
    /// # Errors
    /// If a number of the budget is too small, naming it.
    pub fn stream_resources(self, budget: StreamingBudget) -> Result<Self, BackendError> {
        budget.check()?;
        Ok(Self { streamer: Some(Streamer::new(budget)), ..self })
    }

    /// What [streaming](WgpuBackend::stream_resources) has done, as of the frame that began last; `None` without it.
    pub fn streaming_statistics(&self) -> Option<StreamingStatistics> {
        self.streamer.as_ref().map(Streamer::statistics)
    }

    /// Makes the next recorded frame draw into `texture` instead of the target `target` of the camera named `view`: for
    /// example into a surface's texture instead of [`targets::PICTURE`](crate::process::targets::PICTURE). Of several
    /// cameras of that name, it is the first one that has this target.
    ///
    /// The texture must be a 2D texture with one layer and one sample per pixel, of the target's size. Its format must
    /// be the target's, or differ only in sRGB; then its `view_formats`, or those of the surface's configuration, must
    /// contain the target's. Its usages must include `RENDER_ATTACHMENT` if processes draw into it, `TEXTURE_BINDING`
    /// if they sample it, and `COPY_SRC` if they read its history or it is read back. Targets that are multisampled,
    /// have mip levels, are drawn in layers or are the history of another one cannot be imported; nor can a layer of an
    /// array or a face of a cube map be: a [raw pass](crate::process::RawPass) copies a target into it. If something does
    /// not fit, the frame returns [`BackendError::InvalidImport`].
    ///
    /// A second import of the same target replaces the first. Frames after the next one draw into the crate's own
    /// target again, also if that one fails.
    ///
    /// ```no_run
    /// # use drawloom::{Renderer, Submitter, backend::WgpuBackend, process::targets, scene::SceneRef, wgpu};
    /// # fn frame(renderer: &mut Renderer<WgpuBackend>, submitter: &Submitter<WgpuBackend>, surface_texture: wgpu::SurfaceTexture,
    /// #     scene: SceneRef<'_>) -> Result<(), Box<dyn std::error::Error>> {
    /// // The pipeline's tone mapping has the format of the surface.
    /// renderer.backend().import_target("main", targets::PICTURE, surface_texture.texture.clone());
    /// let recorded = renderer.record(scene)?;
    /// submitter.submit(recorded)?;
    /// renderer.backend().queue().present(surface_texture);
    /// # Ok(())
    /// # }
    /// ```
    pub fn import_target(&self, view: impl Into<String>, target: impl AsRef<str>, texture: wgpu::Texture) {
        let import = ImportedTarget { view: view.into(), target: target.as_ref().to_owned(), texture };
        let mut imports = self.imports.lock();
        imports.retain(|other| !other.is_of(&import.view, &import.target));
        imports.push(import);
    }

    /// The errors of processes that are still drawn with the [shader before](WgpuBackend::keep_working_shaders), in any
    /// order.
    pub fn shader_errors(&self) -> Vec<String> {
        self.pipelines.lock().shader_errors()
    }

    /// Has the device write timestamps at the begin and end of each pass: see
    /// [`WgpuSubmission::pass_times`](super::WgpuSubmission::pass_times), and [`DeviceClock`] for how they get into a
    /// timeline's log. The [mip levels](crate::process::Declare::mipmapped) that are generated after a pass are not
    /// part of its time. [Raw passes](crate::process::RawPass) are timed only if the device has
    /// `TIMESTAMP_QUERY_INSIDE_ENCODERS`.
    ///
    /// # Errors
    /// If the device lacks `TIMESTAMP_QUERY`, or is wgpu's `noop` backend, which claims it and writes nothing.
    pub fn time_passes(self) -> Result<Self, BackendError> {
        let device_timing = Some(DeviceTiming::new(&self.device, self.queue())?);
        Ok(Self { device_timing, ..self })
    }

    /// How the passes of commands of the frame that was submitted last were recorded, in submission order.
    pub fn pass_statistics(&self) -> Vec<WgpuPassStatistics> {
        self.latest.lock().clone()
    }

    /// The device.
    pub fn device(&self) -> &wgpu::Device {
        &self.device
    }

    /// The device's queue.
    pub fn queue(&self) -> &wgpu::Queue {
        self.uploads.queue()
    }

    /// A new texture with the pixels of a picture, for shaders to sample. It may be called on any thread, at any time,
    /// and the next submission has the pixels.
    ///
    /// # Errors
    /// If the device refuses it, the picture has other bytes than its size and format say, or it is one of depth.
    pub fn upload_picture(&self, picture: &Picture) -> Result<ShaderResource<'static>, BackendError> {
        upload_picture(&self.device, self.queue(), picture)
    }

    /// What the backend keeps on the device from frame to frame.
    pub fn resources(&self) -> WgpuResources {
        let processes = self.pipelines.lock().processes();
        let TargetMemory { textures, bytes, dedicated_bytes } = self.targets.lock().current().memory();
        let mut buffer_sizes = self.buffers.sizes();
        buffer_sizes.extend(self.storage_buffers.lock().sizes());
        WgpuResources {
            pipelines: pipeline_count(&processes),
            targets: textures,
            target_bytes: bytes,
            dedicated_target_bytes: dedicated_bytes,
            buffers: buffer_sizes.iter().filter(|size| **size > 0).count(),
            buffer_bytes: buffer_sizes.iter().sum(),
            mesh_bytes: self.meshes.lock().residents.resident_bytes(),
            texture_bytes: self.materials.lock().textures.resident_bytes(),
        }
    }

    /// Reads the device's clock. It waits for all earlier submissions, so do not call it amid a frame; and it takes
    /// several submissions, so do not call it every frame.
    ///
    /// # Errors
    /// If the device lacks `TIMESTAMP_QUERY`, is wgpu's `noop` backend, refuses or is lost.
    pub fn device_clock(&self, timeline: &Timeline) -> Result<DeviceClock, BackendError> {
        DeviceClock::read(&self.device, self.queue(), self.adapter_name(), timeline)
    }

    /// Drops all cached resources but pipelines and the buffers that processes share, because a device error may have
    /// left some unusable. The next frame creates them again.
    pub(super) fn clear(&self) {
        *self.meshes.lock() = MeshCache::default();
        *self.materials.lock() = MaterialCache::default();
        self.uploads.drop_commands();
        *self.light_meshes.lock() = None;
        self.subdivisions.clear();
        *self.targets.lock() = TargetCache::default();
        self.buffers.clear();
    }

    /// A frame has failed: its buffers may not hold what they should.
    pub(super) fn fail_frame(&self, error: &BackendError) {
        self.buffers.clear();
        // wgpu has no error type for this either.
        if matches!(error, BackendError::Validation { message, .. } if message.contains("has been destroyed")) {
            *self.has_destroyed.lock() = true;
        }
    }

    /// Makes anew what an earlier frame may have destroyed.
    ///
    /// # Errors
    /// If a cached view is among the views: what it held is gone, so it has to be drawn.
    pub(super) fn replace_destroyed(&self, request: &FrameRequest<'_>) -> Result<(), BackendError> {
        if !std::mem::take(&mut *self.has_destroyed.lock()) {
            return Ok(());
        }
        self.clear();
        let mut storage_buffers = self.storage_buffers.lock();
        *storage_buffers = Arc::new(storage_buffers.without_destroyed(&self.device));
        match request.views.iter().find(|view| view.is_cached()) {
            None => Ok(()),
            Some(view) => {
                let label = format!("view {:?}", view.name());
                let message = "a raw pass has destroyed what an earlier frame drew of it".to_owned();
                Err(BackendError::Validation { label, message })
            }
        }
    }
}

/// What a [`WgpuBackend`] keeps on the device from frame to frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WgpuResources {
    /// The number of render pipelines of all processes drawn so far. Processes share those that are the same: of one
    /// WGSL, with equal formats and state.
    pub pipelines: usize,
    /// The number of textures that the latest frame's views draw into. A shared one counts once.
    pub targets: usize,
    /// The size of these textures in bytes.
    pub target_bytes: u64,
    /// What their size would be without [transient targets](WgpuBackend::transient_targets).
    pub dedicated_target_bytes: u64,
    /// The number of all buffers that processes share, and of those for objects, views, lights, parameters and
    /// triangles that no frame in flight uses.
    pub buffers: usize,
    /// The size of these buffers in bytes.
    pub buffer_bytes: u64,
    /// The size of the pages that the scene's meshes lie in, in bytes.
    pub mesh_bytes: u64,
    /// The size of the arrays that the scene's textures lie in, in bytes.
    pub texture_bytes: u64,
}

/// A new texture with the pixels of a picture. It is uploaded before the submission that follows.
///
/// # Errors
/// If the device refuses it, or the picture is not whole.
fn upload_picture(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    picture: &Picture,
) -> Result<ShaderResource<'static>, BackendError> {
    picture.check_upload()?;
    let Picture { width, height, format, ref bytes } = *picture;
    let label = "a picture of the CPU";
    let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
    let upload = || {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: texture_format(format),
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let bytes_per_row = Some(width * format.bytes() as u32);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None };
        // No command uses the texture yet, so no submission takes its lock (wgpu issue 9460).
        #[expect(clippy::disallowed_methods, reason = "the texture is new")]
        queue.write_texture(texture.as_image_copy(), bytes, layout, size);
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    };
    let view = with_error_scope(device, label, upload)?;
    // A lost device makes textures without a word.
    check_device(device)?;
    Ok(ShaderResource::Texture { view, dimension: wgpu::TextureViewDimension::D2 })
}
