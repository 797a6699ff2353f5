//! Tone mapping: the post-processing that every picture needs.

use std::borrow::Cow;

use super::{ClearColor, Declare, Draws, Format, FullScreen, RenderProcess};

/// Maps the target `radiance`, which has no upper end, to the target `picture`, which has: exposure, then the filmic curve
/// that Narkowicz (2015) fitted to ACES, then sRGB.
#[derive(Clone, Copy, Debug)]
pub struct ToneMapping {
    /// Multiplies radiance; 1 leaves it.
    pub exposure: f32,
}

impl Default for ToneMapping {
    fn default() -> Self {
        Self { exposure: 1.0 }
    }
}

impl RenderProcess for ToneMapping {
    fn name(&self) -> &str {
        "tone mapping"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples("radiance");
        declare.clears_color("picture", Format::Rgba8Srgb, ClearColor::Value([0.0, 0.0, 0.0, 1.0]));
    }

    fn draws(&self) -> Draws<'_> {
        let parameters = [self.exposure, 0.0, 0.0, 0.0];
        Draws::FullScreen(FullScreen {
            shader: include_str!("tone_mapping.wgsl"),
            parameters: Cow::Owned(bytemuck::cast_slice(&parameters).to_vec()),
            ..FullScreen::default()
        })
    }
}
