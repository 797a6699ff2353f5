//! Anti-aliasing of the finished picture.

mod cpu_shader;

use std::sync::Arc;

use self::cpu_shader::FxaaCpuShader;
use super::PostStep;
use super::shipped_step::{BoundStep, ShippedStep};
use crate::process::{CpuShader, FullScreen, RenderProcess};

/// Smooths the steps that edges have where a pixel shows one surface or the other, from the picture alone (Lottes, "FXAA",
/// NVIDIA 2009, in the form of its last version, 3.11).
///
/// Where brightness changes enough from a pixel to its neighbours, it looks along the edge for the nearer end of the step,
/// and mixes in as much of the other side as a straight edge would cover. A pixel elsewhere, and a straight edge along
/// rows or columns, stays as it is, byte for byte.
///
/// It belongs behind [`ToneMapping`](super::ToneMapping): its source is [`Format::Rgba8Srgb`](crate::process::Format), and
/// so is its target.
///
/// Brightness is perceived brightness, the square root of luminance, from 0 to 1. A setting that is below 0 or is not a
/// number counts as 0; one above 1 counts as 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fxaa {
    /// How much of the brightest pixel's brightness, among a pixel and its four neighbours, must lie between it and the
    /// darkest for them to have an edge. From 1/3, which leaves much as it is, to 1/16, which finds all that one can see.
    pub contrast_threshold: f32,
    /// How much brightness that must be in any case: in the dark, a large share of it is hardly seen.
    pub dark_threshold: f32,
    /// How much of what is smaller than a pixel is mixed with its surroundings: 0 keeps thin lines and single pixels as they
    /// are, 1 takes away most of their flicker, and some of their sharpness.
    pub sub_pixel: f32,
}

impl Default for Fxaa {
    fn default() -> Self {
        Self { contrast_threshold: 0.125, dark_threshold: 0.0625, sub_pixel: 0.5 }
    }
}

impl Fxaa {
    /// The settings, each brought to between 0 and 1.
    fn usable_settings(&self) -> [f32; 3] {
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

    fn full_screen(&self) -> FullScreen<'static> {
        let [contrast_threshold, dark_threshold, sub_pixel] = self.usable_settings();
        let parameters = [contrast_threshold, dark_threshold, sub_pixel, 0.0];
        FullScreen {
            shader: include_str!("fxaa/fxaa.wgsl"),
            parameters: bytemuck::cast_slice(&parameters).to_vec().into(),
            ..FullScreen::default()
        }
    }

    fn cpu_shader(&self) -> CpuShader {
        let [contrast_threshold, dark_threshold, sub_pixel] = self.usable_settings();
        CpuShader::full_screen(FxaaCpuShader { contrast_threshold, dark_threshold, sub_pixel })
    }
}
