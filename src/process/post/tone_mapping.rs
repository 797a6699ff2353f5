//! Tone mapping: the step that every picture needs.

use std::sync::Arc;

use super::{FullScreenStep, PostStep, declare_step};
use crate::process::{Declare, Draws, FullScreen, RenderProcess};

/// Maps radiance, which has no upper end, to a picture, which has: exposure, then the filmic curve that Narkowicz (2015)
/// fitted to ACES, then sRGB. What is below zero, because something was taken away from it, is black.
///
/// As a process of its own it leads from the target `radiance` to the target `picture`; as a [`PostStep`], from and to
/// whatever it is told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ToneMapping {
    /// Multiplies radiance; 1 leaves it. What is not above 0, and what is not a number, makes a black picture.
    pub exposure: f32,
}

impl Default for ToneMapping {
    fn default() -> Self {
        Self { exposure: 1.0 }
    }
}

impl RenderProcess for ToneMapping {
    fn name(&self) -> &str {
        NAME
    }

    fn declare(&self, declare: &mut Declare) {
        declare_step(declare, "radiance", "picture");
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(self.full_screen())
    }
}

impl PostStep for ToneMapping {
    fn process(&self, source: &str, target: &str) -> Arc<dyn RenderProcess> {
        FullScreenStep::between(source, target, NAME, self.full_screen())
    }
}

const NAME: &str = "tone mapping";

impl ToneMapping {
    fn full_screen(self) -> FullScreen<'static> {
        // Infinite, it would make what is black not a number.
        let exposure = if self.exposure > 0.0 { self.exposure.min(f32::MAX) } else { 0.0 };
        FullScreen {
            shader: include_str!("tone_mapping.wgsl"),
            parameters: bytemuck::cast_slice(&[exposure, 0.0, 0.0, 0.0]).to_vec().into(),
            ..FullScreen::default()
        }
    }
}
