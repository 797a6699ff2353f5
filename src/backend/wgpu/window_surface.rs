//! A window's surface, and the device that presents in it.

use std::sync::Arc;

use wgpu::util::TextureBlitter;
use wgpu::wgt::WgpuHasDisplayHandle;

use super::WgpuBackend;
use super::resources::texture_format;
use crate::process::Format;

/// A device that presents in windows, and what else of wgpu another window needs. All of them are handles, and clones are cheap.
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
/// The renderer draws straight into the surface's texture, in the place of a target of its own. Where the texture's format does not
/// allow that, it draws into another texture, which [`WindowSurface::present`] converts.
///
/// ```no_run
/// use std::sync::Arc;
///
/// use drawloom::backend::{WgpuBackend, WindowDevice, WindowSurface};
/// use drawloom::process::{Deferred, ToneMapping};
/// use drawloom::scene::Scene;
/// use drawloom::task::Scheduler;
/// use drawloom::{Renderer, Submitter};
/// # use drawloom::wgpu;
///
/// # fn open<W: Into<wgpu::SurfaceTarget<'static>> + Clone>(display: impl wgpu::wgt::WgpuHasDisplayHandle, window: W) -> Result<(), Box<dyn std::error::Error>> {
/// // `display` is winit's `event_loop.owned_display_handle()`, and `window` an `Arc<winit::window::Window>`.
/// let (graphics, surface) = WindowDevice::open(display, window)?;
/// let (renderer, submitter) = Renderer::builder(WgpuBackend::new(graphics.device, graphics.queue)?)
///     .deferred(Deferred::new().post(ToneMapping { format: surface.picture_format(), ..ToneMapping::default() }))
///     .build(Arc::new(Scheduler::with_available_parallelism()?))?;
/// # Ok(())
/// # }
///
/// // When the window asks to be drawn; `size` is winit's `window.inner_size()`.
/// fn draw<W: Into<wgpu::SurfaceTarget<'static>> + Clone>(
///     size: [u32; 2],
///     surface: &mut WindowSurface<W>,
///     world: &mut Scene,
///     renderer: &mut Renderer<WgpuBackend>,
///     submitter: &Submitter<WgpuBackend>,
/// ) -> Result<(), Box<dyn std::error::Error>> {
///     let Some(frame) = surface.acquire(size)? else { return Ok(()) };
///     world.cameras[0].size = frame.size();
///     renderer.backend().import_target(&world.cameras[0].name, "picture", frame.target().clone());
///     let recorded = renderer.record(world.as_scene_ref())?;
///     submitter.submit(recorded)?;
///     surface.present(frame, |_texture| { /* egui, for example */ });
///     Ok(())
/// }
/// ```
pub struct WindowSurface<W> {
    graphics: WindowDevice,
    window: W,
    surface: wgpu::Surface<'static>,
    configuration: wgpu::SurfaceConfiguration,
    /// What the surface offers.
    offered: Vec<wgpu::TextureFormat>,
    picture: Format,
    formats: SurfaceFormats,
    /// The surface must be configured before it has textures.
    is_outdated: bool,
    /// `None` where pictures are drawn straight into the surface's textures.
    conversion: Option<Conversion>,
}

/// A texture of a surface, to be drawn into and presented. One that is dropped is not shown.
pub struct SurfaceFrame {
    surface_texture: wgpu::SurfaceTexture,
    converted: Option<wgpu::Texture>,
}

/// Why a window has no device or no surface, or its surface no texture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// wgpu makes no surface for the window.
    #[error("the window can have no surface: {0}")]
    Create(#[from] wgpu::CreateSurfaceError),
    /// No adapter presents in the window.
    #[error(
        "no graphics adapter presents in this window ({0}); on Debian, `apt install mesa-vulkan-drivers` provides one in software"
    )]
    NoAdapter(#[from] wgpu::RequestAdapterError),
    /// The adapter opens no device.
    #[error("the graphics adapter opens no device: {0}")]
    NoDevice(#[from] wgpu::RequestDeviceError),
    /// The device's adapter does not present in the window.
    #[error("the device does not present in this window")]
    CannotPresent,
    /// Pictures in windows are [`Format::Rgba8Srgb`] or [`Format::Bgra8Srgb`].
    #[error("pictures in windows are Rgba8Srgb or Bgra8Srgb, and not {0:?}")]
    PictureFormat(Format),
    /// The surface is lost again as soon as it is made.
    #[error("the window's surface stays lost")]
    StaysLost,
    /// The device is lost, or refuses the surface's settings. The device's error callback has more about it.
    #[error("the device is lost, or refuses the window's surface")]
    Refused,
}

impl WindowDevice {
    /// Opens the best device that presents in a window, with all that Drawloom makes use of, and the window's surface.
    ///
    /// Errors of the device that nobody waits for go to wgpu's default handler, which panics:
    /// see [`wgpu::Device::on_uncaptured_error`].
    ///
    /// # Errors
    /// If no adapter presents in the window, or the adapter lacks what Drawloom requires.
    pub fn open<W: Into<wgpu::SurfaceTarget<'static>> + Clone>(
        display: impl WgpuHasDisplayHandle,
        window: W,
    ) -> Result<(Self, WindowSurface<W>), SurfaceError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_with_display_handle(Box::new(display)));
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
        let surface = WindowSurface::of(graphics.clone(), window, surface)?;
        Ok((graphics, surface))
    }

    /// The surface of another window.
    ///
    /// # Errors
    /// If the device does not present in it.
    pub fn surface<W: Into<wgpu::SurfaceTarget<'static>> + Clone>(
        &self,
        window: W,
    ) -> Result<WindowSurface<W>, SurfaceError> {
        let surface = self.instance.create_surface(window.clone())?;
        WindowSurface::of(self.clone(), window, surface)
    }
}

impl<W: Into<wgpu::SurfaceTarget<'static>> + Clone> WindowSurface<W> {
    fn of(graphics: WindowDevice, window: W, surface: wgpu::Surface<'static>) -> Result<Self, SurfaceError> {
        let capabilities = surface.get_capabilities(&graphics.adapter);
        let picture = picture_format(&capabilities.formats);
        let formats = SurfaceFormats::choose(&capabilities.formats, has_view_formats(&graphics), picture)
            .ok_or(SurfaceError::CannotPresent)?;
        let mut surface = Self {
            configuration: wgpu::SurfaceConfiguration {
                // A screenshot is a copy of the texture, where that is allowed.
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | (capabilities.usages & wgpu::TextureUsages::COPY_SRC),
                format: formats.surface,
                color_space: wgpu::SurfaceColorSpace::Auto,
                width: 0,
                height: 0,
                present_mode: wgpu::PresentMode::AutoVsync,
                desired_maximum_frame_latency: 2,
                alpha_mode: wgpu::CompositeAlphaMode::Auto,
                view_formats: Vec::new(),
            },
            graphics,
            window,
            surface,
            offered: capabilities.formats,
            picture,
            formats,
            is_outdated: true,
            conversion: None,
        };
        surface.set_formats(formats);
        Ok(surface)
    }

    /// The same surface for pictures of another format than the one that it prefers: that of a renderer which draws into several
    /// windows.
    ///
    /// # Errors
    /// If the format is neither [`Format::Rgba8Srgb`] nor [`Format::Bgra8Srgb`].
    pub fn with_picture_format(mut self, picture: Format) -> Result<Self, SurfaceError> {
        if !matches!(picture, Format::Rgba8Srgb | Format::Bgra8Srgb) {
            return Err(SurfaceError::PictureFormat(picture));
        }
        let formats = SurfaceFormats::choose(&self.offered, has_view_formats(&self.graphics), picture)
            .ok_or(SurfaceError::CannotPresent)?;
        self.picture = picture;
        self.set_formats(formats);
        Ok(self)
    }

    /// The same surface, whose pictures are converted even where they could be drawn straight into its textures: for tests.
    #[must_use]
    pub fn converting(mut self) -> Self {
        self.formats.is_direct = false;
        self.set_formats(self.formats);
        self
    }

    /// The format of pictures: that of the last step of post-processing, such as
    /// [`ToneMapping::format`](crate::process::ToneMapping::format).
    pub fn picture_format(&self) -> Format {
        self.picture
    }

    /// The format in which an overlay is drawn over the picture: egui wants one without sRGB, and has it where the device allows.
    pub fn overlay_format(&self) -> wgpu::TextureFormat {
        self.formats.overlay
    }

    /// The window.
    pub fn window(&self) -> &W {
        &self.window
    }

    /// Width and height of the latest frame's texture, in pixels; 0 × 0 before the first.
    pub fn size(&self) -> [u32; 2] {
        [self.configuration.width, self.configuration.height]
    }

    /// Presents once for each refresh of the display, as it does from the start, or as soon as possible.
    pub fn set_vsync(&mut self, vsync: bool) {
        self.configuration.present_mode =
            if vsync { wgpu::PresentMode::AutoVsync } else { wgpu::PresentMode::AutoNoVsync };
        self.is_outdated = true;
    }

    /// The next texture, of the window's size in pixels, as far as the device has textures of that size. It may wait for the display.
    ///
    /// `None` if there is none this time: the window is minimised or hidden, or changes its size right now. A surface that is outdated
    /// or lost is made anew.
    ///
    /// # Errors
    /// If the device refuses, or the surface stays lost.
    pub fn acquire(&mut self, size: impl Into<[u32; 2]>) -> Result<Option<SurfaceFrame>, SurfaceError> {
        let max_side = self.graphics.device.limits().max_texture_dimension_2d;
        let size = size.into().map(|side| side.min(max_side));
        if size.contains(&0) {
            return Ok(None);
        }
        let mut is_lost = false;
        for _ in 0..3 {
            if self.is_outdated || size != self.size() {
                [self.configuration.width, self.configuration.height] = size;
                self.surface.configure(&self.graphics.device, &self.configuration);
                self.is_outdated = false;
            }
            is_lost = false;
            match self.surface.get_current_texture() {
                wgpu::CurrentSurfaceTexture::Success(texture) => return Ok(Some(self.frame(texture))),
                wgpu::CurrentSurfaceTexture::Suboptimal(texture) => {
                    self.is_outdated = true;
                    return Ok(Some(self.frame(texture)));
                }
                wgpu::CurrentSurfaceTexture::Timeout | wgpu::CurrentSurfaceTexture::Occluded => return Ok(None),
                wgpu::CurrentSurfaceTexture::Outdated => {}
                wgpu::CurrentSurfaceTexture::Lost => {
                    is_lost = true;
                    self.surface = self.graphics.instance.create_surface(self.window.clone())?;
                }
                wgpu::CurrentSurfaceTexture::Validation => return Err(SurfaceError::Refused),
            }
            self.is_outdated = true;
        }
        // A window that is being resized is often outdated again.
        if is_lost { Err(SurfaceError::StaysLost) } else { Ok(None) }
    }

    /// Presents a picture that was submitted. `draw_over` draws over it, into the window's texture, before it is shown.
    pub fn present(&self, frame: SurfaceFrame, draw_over: impl FnOnce(&wgpu::Texture)) {
        let WindowDevice { device, queue, .. } = &self.graphics;
        if let Some((conversion, picture)) = self.conversion.as_ref().zip(frame.converted) {
            let source = picture.create_view(&wgpu::TextureViewDescriptor {
                format: Some(conversion.read_as),
                usage: Some(wgpu::TextureUsages::TEXTURE_BINDING),
                ..wgpu::TextureViewDescriptor::default()
            });
            let target = frame.surface_texture.texture.create_view(&wgpu::TextureViewDescriptor::default());
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            conversion.blitter.copy(device, &mut encoder, &source, &target);
            queue.submit([encoder.finish()]);
        }
        draw_over(&frame.surface_texture.texture);
        queue.present(frame.surface_texture);
    }

    fn set_formats(&mut self, formats: SurfaceFormats) {
        let drawn = texture_format(self.picture);
        self.configuration.format = formats.surface;
        self.configuration.view_formats = if has_view_formats(&self.graphics) {
            let mut views = vec![drawn, formats.overlay];
            views.retain(|view| {
                *view != formats.surface && view.remove_srgb_suffix() == formats.surface.remove_srgb_suffix()
            });
            views
        } else {
            Vec::new()
        };
        self.conversion = (!formats.is_direct).then(|| Conversion {
            blitter: Arc::new(TextureBlitter::new(&self.graphics.device, formats.surface)),
            read_as: if formats.is_linear() { drawn } else { drawn.remove_srgb_suffix() },
            picture: None,
        });
        self.formats = formats;
        self.is_outdated = true;
    }

    fn frame(&mut self, surface_texture: wgpu::SurfaceTexture) -> SurfaceFrame {
        let size = surface_texture.texture.size();
        let (device, format) = (&self.graphics.device, texture_format(self.picture));
        let converted = self.conversion.as_mut().map(|conversion| {
            let fitting = conversion.picture.take().filter(|picture| picture.size() == size);
            conversion.picture.insert(fitting.unwrap_or_else(|| new_picture(device, format, size))).clone()
        });
        SurfaceFrame { surface_texture, converted }
    }
}

impl SurfaceFrame {
    /// What the renderer draws into, in the place of its own picture: for [`WgpuBackend::import_target`].
    pub fn target(&self) -> &wgpu::Texture {
        self.converted.as_ref().unwrap_or(&self.surface_texture.texture)
    }

    /// Width and height in pixels: that of the camera whose picture it is.
    pub fn size(&self) -> [u32; 2] {
        [self.target().width(), self.target().height()]
    }
}

/// Draws pictures of the renderer's format into textures of another one.
struct Conversion {
    blitter: Arc<TextureBlitter>,
    /// The format in which the picture is read: sRGB encoded, as displays expect it, unless the surface is linear.
    read_as: wgpu::TextureFormat,
    picture: Option<wgpu::Texture>,
}

/// The formats in which a surface's texture is made and drawn into.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SurfaceFormats {
    surface: wgpu::TextureFormat,
    /// The one of an overlay, which wants one without sRGB.
    overlay: wgpu::TextureFormat,
    /// Whether the renderer draws into the texture, in its own format.
    is_direct: bool,
}

impl SurfaceFormats {
    /// The best of the formats that a surface offers, for pictures of the format `picture`; `None` if there is none.
    ///
    /// | the surface offers | texture | renderer |
    /// | --- | --- | --- |
    /// | `picture` | `picture` | draws into it |
    /// | the same without sRGB, and views of other formats | that | draws into a view of it |
    /// | others | the first | draws into a texture of its own, which is converted |
    fn choose(offered: &[wgpu::TextureFormat], has_view_formats: bool, picture: Format) -> Option<Self> {
        let drawn = texture_format(picture);
        let same_bytes = |format: &&wgpu::TextureFormat| format.remove_srgb_suffix() == drawn.remove_srgb_suffix();
        let exact = offered.iter().find(|format| **format == drawn);
        let surface = *exact.or_else(|| offered.iter().find(same_bytes)).or(offered.first())?;
        let is_direct = surface == drawn || (has_view_formats && same_bytes(&&surface));
        Some(Self {
            surface,
            overlay: if has_view_formats { surface.remove_srgb_suffix() } else { surface },
            is_direct,
        })
    }

    /// Whether what is written counts as linear, so that it must not be sRGB encoded yet.
    fn is_linear(&self) -> bool {
        self.surface == wgpu::TextureFormat::Rgba16Float || self.surface.is_srgb()
    }
}

/// The format of pictures that need no conversion for a surface that offers these formats, if there is one.
fn picture_format(offered: &[wgpu::TextureFormat]) -> Format {
    let find = |format: &wgpu::TextureFormat| match format.remove_srgb_suffix() {
        wgpu::TextureFormat::Bgra8Unorm => Some(Format::Bgra8Srgb),
        wgpu::TextureFormat::Rgba8Unorm => Some(Format::Rgba8Srgb),
        _ => None,
    };
    offered.iter().find_map(find).unwrap_or(Format::Rgba8Srgb)
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

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use wgpu::TextureFormat::{Bgra8Unorm, Bgra8UnormSrgb, Rgb10a2Unorm, Rgba8Unorm, Rgba8UnormSrgb, Rgba16Float};

    use super::*;

    #[test]
    fn pictures_are_drawn_into_the_surface_where_formats_allow() {
        let choose = |offered: &[_], has_view_formats| {
            let formats = SurfaceFormats::choose(offered, has_view_formats, Format::Bgra8Srgb).unwrap();
            (formats.surface, formats.overlay, formats.is_direct)
        };
        assert_eq!(choose(&[Bgra8Unorm, Bgra8UnormSrgb], true), (Bgra8UnormSrgb, Bgra8Unorm, true));
        assert_eq!(choose(&[Bgra8Unorm, Bgra8UnormSrgb], false), (Bgra8UnormSrgb, Bgra8UnormSrgb, true));
        assert_eq!(choose(&[Rgba8Unorm, Bgra8Unorm], true), (Bgra8Unorm, Bgra8Unorm, true));
        assert_eq!(choose(&[Rgba8Unorm, Bgra8Unorm], false), (Bgra8Unorm, Bgra8Unorm, false));
        assert_eq!(choose(&[Rgba16Float, Rgba8Unorm], true), (Rgba16Float, Rgba16Float, false));
        assert_eq!(SurfaceFormats::choose(&[], true, Format::Bgra8Srgb), None);
    }

    #[test]
    fn pictures_have_the_first_format_that_needs_no_conversion() {
        assert_eq!(picture_format(&[Rgba16Float, Bgra8Unorm, Rgba8Unorm]), Format::Bgra8Srgb);
        assert_eq!(picture_format(&[Rgba8UnormSrgb, Bgra8Unorm]), Format::Rgba8Srgb);
        assert_eq!(picture_format(&[Rgb10a2Unorm]), Format::Rgba8Srgb);
    }
}
