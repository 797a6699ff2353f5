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
    /// The format in which egui is drawn over the picture: without sRGB, where the device allows.
    pub overlay_format: wgpu::TextureFormat,
    /// The largest width and height of a texture.
    max_side: u32,
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
        let has_view_formats =
            graphics.adapter.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::SURFACE_VIEW_FORMATS);
        let formats = SurfaceFormats::choose(&capabilities.formats, has_view_formats, graphics.format)
            .ok_or("the device cannot present in this window")?;
        let new_conversion = || Conversion {
            blitter: TextureBlitter::new(&graphics.device, formats.surface),
            read_as: if formats.is_linear() { graphics.format } else { graphics.format.remove_srgb_suffix() },
            picture: None,
        };
        let mut view_formats = vec![graphics.format, formats.overlay];
        view_formats.retain(|view| {
            *view != formats.surface && view.remove_srgb_suffix() == formats.surface.remove_srgb_suffix()
        });
        Ok(Self {
            window,
            surface,
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
                view_formats: if has_view_formats { view_formats } else { Vec::new() },
            },
            overlay_format: formats.overlay,
            max_side: graphics.device.limits().max_texture_dimension_2d,
            is_outdated: true,
            conversion: (converts || !formats.is_direct).then(new_conversion),
        })
    }

    /// Width and height of its textures, in pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.configuration.width, self.configuration.height]
    }

    /// Presents once for each refresh of the display, or as soon as possible.
    pub fn set_vsync(&mut self, vsync: bool) {
        self.configuration.present_mode =
            if vsync { wgpu::PresentMode::AutoVsync } else { wgpu::PresentMode::AutoNoVsync };
        self.is_outdated = true;
    }

    /// The window has another size or scale factor.
    pub fn mark_outdated(&mut self) {
        self.is_outdated = true;
    }

    /// Whether the window has pixels: not on every system does a minimised one.
    pub fn has_pixels(&self) -> bool {
        let size = self.window.inner_size();
        size.width > 0 && size.height > 0
    }

    /// The next texture; `None` if there is none this time.
    ///
    /// # Errors
    /// If the device refuses, or the surface stays lost.
    pub fn acquire(&mut self, graphics: &Graphics) -> Result<Option<SurfaceFrame>, Box<dyn Error>> {
        let mut is_lost = false;
        for _ in 0..3 {
            if !self.has_pixels() {
                return Ok(None);
            }
            if self.is_outdated {
                self.configure(&graphics.device);
            }
            is_lost = false;
            match self.surface.get_current_texture() {
                wgpu::CurrentSurfaceTexture::Success(texture) => return Ok(Some(self.frame(graphics, texture))),
                wgpu::CurrentSurfaceTexture::Suboptimal(texture) => {
                    self.is_outdated = true;
                    return Ok(Some(self.frame(graphics, texture)));
                }
                wgpu::CurrentSurfaceTexture::Timeout | wgpu::CurrentSurfaceTexture::Occluded => return Ok(None),
                wgpu::CurrentSurfaceTexture::Outdated => {}
                wgpu::CurrentSurfaceTexture::Lost => {
                    is_lost = true;
                    self.surface = graphics.instance.create_surface(Arc::clone(&self.window))?;
                }
                wgpu::CurrentSurfaceTexture::Validation => {
                    return Err("the device is lost, or refuses the window's texture".into());
                }
            }
            self.is_outdated = true;
        }
        // A window that is being resized is often outdated again.
        if is_lost { Err("the window's surface stays lost".into()) } else { Ok(None) }
    }

    /// Presents a picture that was drawn, after `draw_over` has drawn over it.
    pub fn present(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        frame: SurfaceFrame,
        draw_over: impl FnOnce(&wgpu::Texture),
    ) {
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
        self.window.pre_present_notify();
        queue.present(frame.surface_texture);
    }

    /// Configures the surface for the window's size, as far as the device has textures of that size.
    fn configure(&mut self, device: &wgpu::Device) {
        let size = self.window.inner_size();
        (self.configuration.width, self.configuration.height) =
            (size.width.min(self.max_side), size.height.min(self.max_side));
        self.surface.configure(device, &self.configuration);
        self.is_outdated = false;
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

/// The formats in which a surface's texture is made and drawn into.
#[derive(Debug, PartialEq)]
struct SurfaceFormats {
    surface: wgpu::TextureFormat,
    /// The one of egui, which wants one without sRGB.
    overlay: wgpu::TextureFormat,
    /// Whether the renderer draws into the texture, in its own format.
    is_direct: bool,
}

impl SurfaceFormats {
    /// The best of the formats that a surface offers, for a renderer that draws in `drawn`; `None` if there is none.
    ///
    /// | the surface offers | texture | renderer |
    /// | --- | --- | --- |
    /// | `drawn` | `drawn` | draws into it |
    /// | the same without sRGB, and views of other formats | that | draws into a view of it |
    /// | others | the first | draws into a texture of its own, which is converted |
    fn choose(offered: &[wgpu::TextureFormat], has_view_formats: bool, drawn: wgpu::TextureFormat) -> Option<Self> {
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

#[cfg(test)]
mod tests {
    use wgpu::TextureFormat::{Bgra8Unorm, Bgra8UnormSrgb, Rgba8Unorm, Rgba16Float};

    use super::*;

    #[test]
    fn pictures_are_drawn_into_the_surface_where_formats_allow() {
        let choose = |offered: &[_], has_view_formats| {
            let formats = SurfaceFormats::choose(offered, has_view_formats, Bgra8UnormSrgb).unwrap();
            (formats.surface, formats.overlay, formats.is_direct)
        };
        assert_eq!(choose(&[Bgra8Unorm, Bgra8UnormSrgb], true), (Bgra8UnormSrgb, Bgra8Unorm, true));
        assert_eq!(choose(&[Bgra8Unorm, Bgra8UnormSrgb], false), (Bgra8UnormSrgb, Bgra8UnormSrgb, true));
        assert_eq!(choose(&[Rgba8Unorm, Bgra8Unorm], true), (Bgra8Unorm, Bgra8Unorm, true));
        assert_eq!(choose(&[Rgba8Unorm, Bgra8Unorm], false), (Bgra8Unorm, Bgra8Unorm, false));
        assert_eq!(choose(&[Rgba16Float, Rgba8Unorm], true), (Rgba16Float, Rgba16Float, false));
        assert_eq!(SurfaceFormats::choose(&[], true, Bgra8UnormSrgb), None);
    }
}
