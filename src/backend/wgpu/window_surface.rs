//! A window's surface, and the device that presents in it.

use std::sync::Arc;

use wgpu::util::TextureBlitter;
use wgpu::wgt::WgpuHasDisplayHandle;

use super::WgpuBackend;
use super::error_scope::{check_device, with_error_scope};
use super::resources::texture_format;
use super::surface_error::SurfaceError;
use super::surface_formats::{SurfaceFormats, picture_format};
use crate::backend::BackendError;
use crate::process::Format;

/// A device that presents in windows, and what else of wgpu another window needs. All of them are handles, and clones
/// are cheap.
///
/// An engine that opens its device itself makes one of its handles.
#[derive(Clone, Debug)]
pub struct WindowDevice {
    /// The instance that the adapter belongs to.
    pub instance: wgpu::Instance,
    /// The adapter that the device was opened on.
    pub adapter: wgpu::Adapter,
    /// The device, with [`WgpuBackend::REQUIRED_FEATURES`].
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
}

/// The surface of a window, into whose textures pictures are drawn.
///
/// The renderer draws straight into the surface's texture, in the place of a target of its own. Where the texture's
/// format does not allow that, it draws into another texture, which [`SurfaceFrame::present`] converts.
///
/// ```no_run
/// use std::error::Error;
/// use std::sync::Arc;
///
/// use drawloom::backend::{WgpuBackend, WindowDevice, WindowSurface};
/// use drawloom::process::{Deferred, ToneMapping, targets};
/// use drawloom::scene::Scene;
/// use drawloom::task::Scheduler;
/// use drawloom::{Renderer, Submitter};
///
/// fn build(graphics: &WindowDevice, surface: &WindowSurface) -> Result<(Renderer<WgpuBackend>, Submitter<WgpuBackend>), Box<dyn Error>> {
///     let tone_mapping = ToneMapping { format: surface.picture_format(), ..ToneMapping::default() };
///     let backend = WgpuBackend::new(graphics.device.clone(), graphics.queue.clone())?;
///     let scheduler = Arc::new(Scheduler::with_available_parallelism()?);
///     Ok(Renderer::builder(backend).pipeline(Deferred::new().post(tone_mapping)).build(scheduler)?)
/// }
///
/// /// When the window asks to be drawn.
/// fn draw(
///     window_size: [u32; 2],
///     surface: &mut WindowSurface,
///     world: &mut Scene,
///     renderer: &mut Renderer<WgpuBackend>,
///     submitter: &Submitter<WgpuBackend>,
/// ) -> Result<(), Box<dyn Error>> {
///     let Some(frame) = surface.acquire(window_size)? else { return Ok(()) };
///     world.cameras[0].size = frame.size();
///     renderer.backend().import_target(&world.cameras[0].name, targets::PICTURE, frame.target().clone());
///     let recorded = renderer.record(world.as_scene_ref())?;
///     submitter.submit(recorded)?;
///     frame.present(|_texture| { /* a user interface over it */ });
///     Ok(())
/// }
/// ```
pub struct WindowSurface {
    graphics: WindowDevice,
    surface: wgpu::Surface<'static>,
    make_anew: MakeSurface,
    configuration: wgpu::SurfaceConfiguration,
    /// What the surface offers.
    offered: Vec<wgpu::TextureFormat>,
    picture: Format,
    overlay: wgpu::TextureFormat,
    /// The surface must be configured before it has textures.
    is_outdated: bool,
    /// The surface was configured anew because it was suboptimal. If it still is, that is how it stays.
    stays_suboptimal: bool,
    converts_always: bool,
    /// `None` where pictures are drawn straight into the surface's textures.
    conversion: Option<Conversion>,
}

type MakeSurface = Box<dyn FnMut() -> Result<wgpu::Surface<'static>, wgpu::CreateSurfaceError> + Send>;

/// A texture of a surface, to be drawn into and presented. One that is dropped is not shown.
///
/// The surface cannot change its size while there is one: present or drop it before the next is acquired.
pub struct SurfaceFrame {
    device: wgpu::Device,
    queue: wgpu::Queue,
    surface_texture: wgpu::SurfaceTexture,
    /// `None` where the picture is drawn straight into the surface's texture.
    conversion: Option<(Conversion, wgpu::Texture)>,
}

impl WindowDevice {
    /// Opens the best device that presents in a window, with all that Drawloom makes use of, and the window's surface.
    /// `WGPU_BACKEND` in the environment chooses among Vulkan, Metal and DX12.
    ///
    /// An engine that wants another adapter, features or limits makes a `WindowDevice` of its own.
    ///
    /// Errors of the device that nobody waits for go to wgpu's default handler, which panics:
    /// see [`wgpu::Device::on_uncaptured_error`].
    ///
    /// # Errors
    /// If Drawloom was built without a backend of wgpu, no adapter presents in the window, or the adapter lacks what
    /// Drawloom requires.
    ///
    /// # Panics
    /// As [`wgpu::Instance::create_surface`]: on macOS, unless this is the main thread.
    pub fn open<W: Into<wgpu::SurfaceTarget<'static>> + Clone + Send + 'static>(
        display: impl WgpuHasDisplayHandle,
        window: W,
    ) -> Result<(Self, WindowSurface), SurfaceError> {
        // Without a backend, wgpu panics.
        if wgpu::Instance::enabled_backend_features().is_empty() {
            return Err(SurfaceError::NoBackend);
        }
        let descriptor = wgpu::InstanceDescriptor::new_with_display_handle_from_env(Box::new(display));
        let instance = wgpu::Instance::new(descriptor);
        let surface = instance.create_surface(window.clone())?;
        let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::HighPerformance,
            compatible_surface: Some(&surface),
            ..wgpu::RequestAdapterOptions::default()
        }))?;
        let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            required_features: WgpuBackend::REQUIRED_FEATURES | WgpuBackend::optional_features(&adapter),
            // Limits above Drawloom's own requirements allow larger pictures, and more objects and columns.
            required_limits: adapter.limits(),
            ..wgpu::DeviceDescriptor::default()
        }))?;
        let graphics = Self { instance, adapter, device, queue };
        let surface = WindowSurface::new(&graphics, surface, graphics.make_surface(window))?;
        Ok((graphics, surface))
    }

    /// The surface of another window.
    ///
    /// # Errors
    /// If the device does not present in it.
    ///
    /// # Panics
    /// As [`wgpu::Instance::create_surface`]: on macOS, unless this is the main thread.
    pub fn surface<W: Into<wgpu::SurfaceTarget<'static>> + Clone + Send + 'static>(
        &self,
        window: W,
    ) -> Result<WindowSurface, SurfaceError> {
        let mut make_anew = self.make_surface(window);
        WindowSurface::new(self, make_anew()?, make_anew)
    }

    fn make_surface<W: Into<wgpu::SurfaceTarget<'static>> + Clone>(
        &self,
        window: W,
    ) -> impl FnMut() -> Result<wgpu::Surface<'static>, wgpu::CreateSurfaceError> + use<W> {
        let instance = self.instance.clone();
        move || instance.create_surface(window.clone())
    }
}

impl WindowSurface {
    /// A surface that the engine made, and how it makes another one when that is lost: for engines that choose their
    /// adapter by the surface, and for windows that wgpu accepts only as raw handles.
    ///
    /// # Errors
    /// If the device does not present in it.
    pub fn new(
        graphics: &WindowDevice,
        surface: wgpu::Surface<'static>,
        make_anew: impl FnMut() -> Result<wgpu::Surface<'static>, wgpu::CreateSurfaceError> + Send + 'static,
    ) -> Result<Self, SurfaceError> {
        let capabilities = surface.get_capabilities(&graphics.adapter);
        let first = *capabilities.formats.first().ok_or(SurfaceError::CannotPresent)?;
        let mut surface = Self {
            configuration: wgpu::SurfaceConfiguration {
                // A screenshot is a copy of the texture, where that is allowed.
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | (capabilities.usages & wgpu::TextureUsages::COPY_SRC),
                format: first,
                color_space: wgpu::SurfaceColorSpace::Auto,
                width: 0,
                height: 0,
                present_mode: wgpu::PresentMode::AutoVsync,
                desired_maximum_frame_latency: 2,
                alpha_mode: wgpu::CompositeAlphaMode::Auto,
                view_formats: Vec::new(),
            },
            graphics: graphics.clone(),
            surface,
            make_anew: Box::new(make_anew),
            picture: picture_format(&capabilities.formats),
            offered: capabilities.formats,
            overlay: first,
            is_outdated: true,
            stays_suboptimal: false,
            converts_always: false,
            conversion: None,
        };
        surface.choose_formats()?;
        Ok(surface)
    }

    /// The same surface for pictures of another format than the one that it prefers: that of a renderer which draws
    /// into several windows.
    ///
    /// # Errors
    /// If the format is neither [`Format::Rgba8Srgb`] nor [`Format::Bgra8Srgb`].
    pub fn with_picture_format(mut self, picture: Format) -> Result<Self, SurfaceError> {
        if !matches!(picture, Format::Rgba8Srgb | Format::Bgra8Srgb) {
            return Err(SurfaceError::PictureFormat(picture));
        }
        self.picture = picture;
        self.choose_formats()?;
        Ok(self)
    }

    /// The same surface, whose pictures are converted even where they could be drawn straight into its textures: to
    /// see, on any system, what an engine does on one where they must be.
    ///
    /// # Errors
    /// If the device does not present in the window.
    pub fn always_converting(mut self) -> Result<Self, SurfaceError> {
        self.converts_always = true;
        self.choose_formats()?;
        Ok(self)
    }

    /// The format of pictures: that of the last step of post-processing, such as
    /// [`ToneMapping::format`](crate::process::ToneMapping::format).
    pub fn picture_format(&self) -> Format {
        self.picture
    }

    /// The format of the views in which an overlay is drawn over the picture: egui wants one without sRGB, and has it
    /// where the device allows.
    pub fn overlay_format(&self) -> wgpu::TextureFormat {
        self.overlay
    }

    /// Presents once for each refresh of the display, as it does from the start, or as soon as possible.
    pub fn set_vsync(&mut self, vsync: bool) {
        let mode = if vsync { wgpu::PresentMode::AutoVsync } else { wgpu::PresentMode::AutoNoVsync };
        if self.configuration.present_mode != mode {
            self.configuration.present_mode = mode;
            self.mark_outdated();
        }
    }

    /// The next texture, of the window's size in pixels, as far as the device has textures of that size. It waits until
    /// the display has one: up to a second, in which other windows wait too.
    ///
    /// `None` if there is none this time: the window is minimised or hidden, or changes its size right now. A surface
    /// that is outdated or lost is made anew.
    ///
    /// # Errors
    /// If the device refuses or is lost, or the surface stays lost.
    pub fn acquire(&mut self, size: impl Into<[u32; 2]>) -> Result<Option<SurfaceFrame>, SurfaceError> {
        let max_side = self.graphics.device.limits().max_texture_dimension_2d;
        let size = size.into().map(|side| side.min(max_side));
        if size.contains(&0) {
            return Ok(None);
        }
        if size != [self.configuration.width, self.configuration.height] {
            [self.configuration.width, self.configuration.height] = size;
            self.mark_outdated();
        }
        let mut failure = None;
        for _ in 0..3 {
            if self.is_outdated
                && let Err(refusal) = self.configure()
            {
                failure = Some(refusal);
                continue;
            }
            failure = match self.surface.get_current_texture() {
                wgpu::CurrentSurfaceTexture::Success(texture) => return Ok(Some(self.frame(texture))),
                wgpu::CurrentSurfaceTexture::Suboptimal(texture) => {
                    self.is_outdated = !self.stays_suboptimal;
                    self.stays_suboptimal = true;
                    return Ok(Some(self.frame(texture)));
                }
                wgpu::CurrentSurfaceTexture::Timeout | wgpu::CurrentSurfaceTexture::Occluded => return Ok(None),
                // A window that is being resized is often outdated again.
                wgpu::CurrentSurfaceTexture::Outdated => None,
                wgpu::CurrentSurfaceTexture::Lost => {
                    self.surface = (self.make_anew)()?;
                    Some(SurfaceError::StaysLost)
                }
                wgpu::CurrentSurfaceTexture::Validation => {
                    let reason = "it has no texture".to_owned();
                    return Err(self.cause_of(SurfaceError::Refused { reason }));
                }
            };
            self.mark_outdated();
        }
        failure.map_or(Ok(None), |failure| Err(self.cause_of(failure)))
    }

    /// The loss of the device, if that is why the surface has no textures.
    fn cause_of(&self, failure: SurfaceError) -> SurfaceError {
        match check_device(&self.graphics.device) {
            Err(BackendError::DeviceLost { message }) => SurfaceError::DeviceLost { message },
            _ => failure,
        }
    }

    fn mark_outdated(&mut self) {
        (self.is_outdated, self.stays_suboptimal) = (true, false);
    }

    /// # Errors
    /// If the device refuses the settings. Without the scope its error would go to a handler that the engine may not
    /// have.
    fn configure(&mut self) -> Result<(), SurfaceError> {
        let device = &self.graphics.device;
        with_error_scope(device, "the window's surface", || self.surface.configure(device, &self.configuration))
            .map_err(|error| SurfaceError::Refused { reason: error.to_string() })?;
        self.is_outdated = false;
        Ok(())
    }

    /// # Errors
    /// If the surface offers no format.
    fn choose_formats(&mut self) -> Result<(), SurfaceError> {
        let has_view_formats = has_view_formats(&self.graphics);
        let formats =
            SurfaceFormats::choose(&self.offered, has_view_formats, self.picture).ok_or(SurfaceError::CannotPresent)?;
        let drawn = texture_format(self.picture);
        self.configuration.format = formats.surface;
        self.configuration.view_formats.clear();
        if has_view_formats {
            let is_another_view = |view: &wgpu::TextureFormat| {
                *view != formats.surface && view.remove_srgb_suffix() == formats.surface.remove_srgb_suffix()
            };
            self.configuration.view_formats.extend([drawn, formats.overlay].into_iter().filter(is_another_view));
        }
        self.conversion = (self.converts_always || !formats.is_direct).then(|| Conversion {
            blitter: Arc::new(TextureBlitter::new(&self.graphics.device, formats.surface)),
            read_as: if formats.is_linear() { drawn } else { drawn.remove_srgb_suffix() },
            picture: None,
        });
        self.overlay = formats.overlay;
        self.mark_outdated();
        Ok(())
    }

    fn frame(&mut self, surface_texture: wgpu::SurfaceTexture) -> SurfaceFrame {
        let size = surface_texture.texture.size();
        let WindowDevice { device, queue, .. } = &self.graphics;
        let format = texture_format(self.picture);
        let conversion = self.conversion.as_mut().map(|conversion| {
            let fitting = conversion.picture.take().filter(|picture| picture.size() == size);
            let picture = fitting.unwrap_or_else(|| new_picture(device, format, size));
            conversion.picture = Some(picture.clone());
            (conversion.clone(), picture)
        });
        SurfaceFrame { device: device.clone(), queue: queue.clone(), surface_texture, conversion }
    }
}

impl SurfaceFrame {
    /// What the renderer draws into, in the place of its own picture: for [`WgpuBackend::import_target`].
    pub fn target(&self) -> &wgpu::Texture {
        self.conversion.as_ref().map_or(&self.surface_texture.texture, |(_, picture)| picture)
    }

    /// Width and height in pixels: that of the camera whose picture it is.
    pub fn size(&self) -> [u32; 2] {
        [self.target().width(), self.target().height()]
    }

    /// Presents a picture that was submitted. `draw_over` draws over it before it is shown, into a view of the window's
    /// texture in the [format of overlays](WindowSurface::overlay_format).
    pub fn present(self, draw_over: impl FnOnce(&wgpu::Texture)) {
        let Self { device, queue, surface_texture, conversion } = self;
        if let Some((conversion, picture)) = conversion {
            let source = picture.create_view(&wgpu::TextureViewDescriptor {
                format: Some(conversion.read_as),
                usage: Some(wgpu::TextureUsages::TEXTURE_BINDING),
                ..wgpu::TextureViewDescriptor::default()
            });
            let target = surface_texture.texture.create_view(&wgpu::TextureViewDescriptor::default());
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            conversion.blitter.copy(&device, &mut encoder, &source, &target);
            queue.submit([encoder.finish()]);
        }
        draw_over(&surface_texture.texture);
        queue.present(surface_texture);
    }
}

/// Draws pictures of the renderer's format into textures of another one.
#[derive(Clone)]
struct Conversion {
    blitter: Arc<TextureBlitter>,
    /// The format in which the picture is read: sRGB encoded, as displays expect it, unless the surface is linear.
    read_as: wgpu::TextureFormat,
    picture: Option<wgpu::Texture>,
}

fn has_view_formats(graphics: &WindowDevice) -> bool {
    graphics.adapter.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::SURFACE_VIEW_FORMATS)
}

fn new_picture(device: &wgpu::Device, format: wgpu::TextureFormat, size: wgpu::Extent3d) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("picture to convert"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[format.remove_srgb_suffix()],
    })
}
