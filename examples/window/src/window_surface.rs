//! The surface of a window, into whose textures pictures are drawn.

use std::error::Error;
use std::sync::Arc;

use drawloom::wgpu;
use drawloom::wgpu::util::TextureBlitter;
use winit::window::Window;

use crate::graphics::Graphics;

/// The surface of a window.
pub struct WindowSurface {
    window: Arc<Window>,
    surface: wgpu::Surface<'static>,
    configuration: wgpu::SurfaceConfiguration,
    /// The window has another size, or other settings, since the surface was configured.
    is_outdated: bool,
    /// `None` where pictures are drawn straight into the surface's textures.
    conversion: Option<Conversion>,
}

/// Draws pictures of the renderer's format into textures of another one.
struct Conversion {
    blitter: TextureBlitter,
    /// The format in which the picture is read: sRGB encoded, as displays expect it, unless the surface is linear.
    read_as: wgpu::TextureFormat,
    picture: Option<wgpu::Texture>,
}

/// A texture of the surface, to be drawn into and presented.
pub struct SurfaceFrame {
    surface_texture: wgpu::SurfaceTexture,
    converted: Option<wgpu::Texture>,
}

impl WindowSurface {
    /// The surface of a window. If `converts`, or where the renderer cannot draw into its textures, pictures are converted.
    ///
    /// # Errors
    /// If the device cannot present in this window.
    pub fn new(
        graphics: &Graphics,
        window: Arc<Window>,
        surface: wgpu::Surface<'static>,
        converts: bool,
    ) -> Result<Self, Box<dyn Error>> {
        let capabilities = surface.get_capabilities(&graphics.adapter);
        let same_bytes =
            |format: &&wgpu::TextureFormat| format.remove_srgb_suffix() == graphics.format.remove_srgb_suffix();
        let exact = capabilities.formats.iter().find(|format| **format == graphics.format);
        let format = exact.or_else(|| capabilities.formats.iter().find(same_bytes));
        let has_views =
            graphics.adapter.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::SURFACE_VIEW_FORMATS);
        let is_drawn = format.is_some_and(|format| *format == graphics.format || has_views) && !converts;
        let format = *format.or(capabilities.formats.first()).ok_or("the device cannot present in this window")?;
        // A screenshot is a copy of the texture, where that is allowed.
        let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | capabilities.usages & wgpu::TextureUsages::COPY_SRC;
        let mut view_formats = vec![graphics.format];
        view_formats.retain(|view| is_drawn && *view != format);
        let is_linear = matches!(format, wgpu::TextureFormat::Rgba16Float) || format.is_srgb();
        let conversion = Conversion {
            blitter: TextureBlitter::new(&graphics.device, format),
            read_as: if is_linear { graphics.format } else { graphics.format.remove_srgb_suffix() },
            picture: None,
        };
        Ok(Self {
            window,
            surface,
            configuration: wgpu::SurfaceConfiguration {
                usage,
                format,
                color_space: wgpu::SurfaceColorSpace::Auto,
                width: 0,
                height: 0,
                present_mode: wgpu::PresentMode::AutoVsync,
                desired_maximum_frame_latency: 2,
                alpha_mode: wgpu::CompositeAlphaMode::Auto,
                view_formats,
            },
            is_outdated: true,
            conversion: (!is_drawn).then_some(conversion),
        })
    }

    /// Width and height of its textures, in pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.configuration.width, self.configuration.height]
    }

    /// Presents once for each picture of the display, or as soon as possible.
    pub fn set_vsync(&mut self, vsync: bool) {
        self.configuration.present_mode =
            if vsync { wgpu::PresentMode::AutoVsync } else { wgpu::PresentMode::AutoNoVsync };
        self.is_outdated = true;
    }

    /// The window has another size or scale factor.
    pub fn resize(&mut self) {
        self.is_outdated = true;
    }

    /// The next texture; `None` while there is nothing to draw into, as of a minimised window.
    ///
    /// # Errors
    /// If the device refuses, or the surface stays lost.
    pub fn acquire(&mut self, graphics: &Graphics) -> Result<Option<SurfaceFrame>, Box<dyn Error>> {
        let mut problem = "outdated";
        for _ in 0..3 {
            if self.is_outdated && !self.configure(graphics) {
                return Ok(None);
            }
            match self.surface.get_current_texture() {
                wgpu::CurrentSurfaceTexture::Success(texture) => return Ok(Some(self.frame(graphics, texture))),
                wgpu::CurrentSurfaceTexture::Suboptimal(texture) => {
                    self.is_outdated = true;
                    return Ok(Some(self.frame(graphics, texture)));
                }
                wgpu::CurrentSurfaceTexture::Timeout | wgpu::CurrentSurfaceTexture::Occluded => return Ok(None),
                wgpu::CurrentSurfaceTexture::Outdated => problem = "outdated",
                wgpu::CurrentSurfaceTexture::Lost => {
                    problem = "lost";
                    self.surface = graphics.instance.create_surface(Arc::clone(&self.window))?;
                }
                wgpu::CurrentSurfaceTexture::Validation => return Err("the device refused a surface's texture".into()),
            }
            self.is_outdated = true;
        }
        Err(format!("the window's surface stays {problem}").into())
    }

    /// Presents a picture that was drawn.
    pub fn present(&self, graphics: &Graphics, frame: SurfaceFrame) {
        if let Some((conversion, picture)) = self.conversion.as_ref().zip(frame.converted) {
            let source = picture.create_view(&wgpu::TextureViewDescriptor {
                format: Some(conversion.read_as),
                usage: Some(wgpu::TextureUsages::TEXTURE_BINDING),
                ..wgpu::TextureViewDescriptor::default()
            });
            let target = frame.surface_texture.texture.create_view(&wgpu::TextureViewDescriptor::default());
            let mut encoder = graphics.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
            conversion.blitter.copy(&graphics.device, &mut encoder, &source, &target);
            graphics.queue.submit([encoder.finish()]);
        }
        self.window.pre_present_notify();
        graphics.queue.present(frame.surface_texture);
    }

    /// Configures the surface for the window's size. Returns false if the window has no pixels.
    fn configure(&mut self, graphics: &Graphics) -> bool {
        let size = self.window.inner_size();
        if size.width == 0 || size.height == 0 {
            return false;
        }
        (self.configuration.width, self.configuration.height) = (size.width, size.height);
        self.surface.configure(&graphics.device, &self.configuration);
        self.is_outdated = false;
        true
    }

    fn frame(&mut self, graphics: &Graphics, surface_texture: wgpu::SurfaceTexture) -> SurfaceFrame {
        let size = surface_texture.texture.size();
        let converted = self.conversion.as_mut().map(|conversion| {
            let fitting = conversion.picture.take().filter(|picture| picture.size() == size);
            let picture = fitting.unwrap_or_else(|| new_picture(graphics, size));
            conversion.picture.insert(picture).clone()
        });
        SurfaceFrame { surface_texture, converted }
    }
}

impl SurfaceFrame {
    /// What the renderer draws into, in the place of its own picture.
    pub fn target(&self) -> &wgpu::Texture {
        self.converted.as_ref().unwrap_or(&self.surface_texture.texture)
    }
}

fn new_picture(graphics: &Graphics, size: wgpu::Extent3d) -> wgpu::Texture {
    graphics.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("picture to convert"),
        size,
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: graphics.format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT
            | wgpu::TextureUsages::TEXTURE_BINDING
            | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[graphics.format.remove_srgb_suffix()],
    })
}
