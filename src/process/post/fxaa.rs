//! Fast approximate anti-aliasing (FXAA) of the finished picture.

#[cfg(feature = "software")]
mod cpu_shader;

use std::sync::Arc;

use super::PostStep;
use super::shipped_step::{BoundStep, ShippedStep};
use crate::process::{Format, FullScreen, RenderProcess};

/// Smooths aliased edges, from the picture alone (Lottes, "FXAA", NVIDIA 2009, in its last version, 3.11).
///
/// Where brightness changes enough from a pixel to its neighbours, it searches along the edge for the nearer end of the
/// step, and blends in as much of the other side as a straight edge would cover. Other pixels, and straight edges along
/// rows or columns, stay the same, byte for byte.
///
/// It belongs after [`ToneMapping`](super::ToneMapping): its source and its target are sRGB.
///
/// Brightness is perceived brightness, the square root of luminance, from 0 to 1. Settings are clamped to 0 to 1; NaN
/// counts as 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fxaa {
    /// The least contrast of an edge, as a fraction of the greatest brightness among a pixel and its four neighbours.
    /// From 1/3, which skips many edges, to 1/16, which finds all visible ones.
    pub contrast_threshold: f32,
    /// The least contrast of an edge in brightness: in dark areas, even a large relative contrast is hardly visible.
    pub dark_threshold: f32,
    /// How much details smaller than a pixel are blended with their surroundings: 0 keeps thin lines and single pixels,
    /// 1 removes most of their flicker and some of their sharpness.
    pub sub_pixel: f32,
    /// The format of its target.
    pub format: Format,
}

impl Default for Fxaa {
    fn default() -> Self {
        Self { contrast_threshold: 0.125, dark_threshold: 0.0625, sub_pixel: 0.5, format: Format::Rgba8Srgb }
    }
}

impl Fxaa {
    /// The settings, clamped to 0 to 1.
    fn clamped_settings(&self) -> [f32; 3] {
        let settings = [self.contrast_threshold, self.dark_threshold, self.sub_pixel];
        settings.map(|setting| if setting > 0.0 { setting.min(1.0) } else { 0.0 })
    }
}

impl PostStep for Fxaa {
    fn process(&self, source: &str, target: &str) -> Arc<dyn RenderProcess> {
        BoundStep::between(source, target, *self)
    }
}

impl ShippedStep for Fxaa {
    const NAME: &str = "fxaa";

    fn format(&self) -> Format {
        self.format
    }

    fn full_screen(&self) -> FullScreen<'static> {
        let [contrast_threshold, dark_threshold, sub_pixel] = self.clamped_settings();
        let parameters = [contrast_threshold, dark_threshold, sub_pixel, 0.0];
        FullScreen {
            shader: include_str!("fxaa/fxaa.wgsl"),
            parameters: bytemuck::cast_slice(&parameters).to_vec().into(),
            ..FullScreen::default()
        }
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> crate::process::CpuShader {
        let [contrast_threshold, dark_threshold, sub_pixel] = self.clamped_settings();
        crate::process::CpuShader::full_screen(cpu_shader::FxaaCpuShader {
            contrast_threshold,
            dark_threshold,
            sub_pixel,
        })
    }
}
