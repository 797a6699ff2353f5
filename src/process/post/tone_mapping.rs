//! Tone mapping: the step that every picture needs.

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use super::{Placed, PlacedStep, PostStep, declare_step};
use crate::process::{Declare, Draws, FullScreen, RenderProcess};

/// Maps radiance, which has no upper end, to a picture, which has: exposure, then the filmic curve that Narkowicz (2015)
/// fitted to ACES, then sRGB. What is below zero, because something was taken away from it, is black.
///
/// As a process of its own it leads from the target `radiance` to the target `picture`; as a [`PostStep`], from and to
/// whatever it is told.
#[derive(Clone, Debug, Default)]
pub struct ToneMapping {
    /// Multiplies radiance.
    pub exposure: Exposure,
}

/// What radiance is multiplied by before it is mapped; 1 leaves it. What is not above 0, and what is not a number, makes a
/// black picture.
///
/// Clones are one and the same, so an engine keeps one and changes it between frames:
///
/// ```
/// use drawloom::process::{Deferred, Exposure, ToneMapping};
///
/// let exposure = Exposure::new(1.0);
/// let deferred = Deferred::new().post(ToneMapping { exposure: exposure.clone() });
/// // Out of the cave.
/// exposure.set(0.25);
/// # let _ = deferred;
/// ```
#[derive(Clone, Debug)]
pub struct Exposure(Arc<AtomicU32>);

impl Exposure {
    /// An exposure of its own.
    pub fn new(exposure: f32) -> Self {
        Self(Arc::new(AtomicU32::new(exposure.to_bits())))
    }

    /// Changes it, from the next frame on that is recorded.
    pub fn set(&self, exposure: f32) {
        // It stands for itself: nothing else is read after it.
        self.0.store(exposure.to_bits(), Ordering::Relaxed);
    }

    /// What it is.
    pub fn get(&self) -> f32 {
        f32::from_bits(self.0.load(Ordering::Relaxed))
    }
}

impl Default for Exposure {
    fn default() -> Self {
        Self::new(1.0)
    }
}

impl From<f32> for Exposure {
    fn from(exposure: f32) -> Self {
        Self::new(exposure)
    }
}

impl ToneMapping {
    /// With an exposure: a number that stays, or an [`Exposure`] that changes.
    pub fn new(exposure: impl Into<Exposure>) -> Self {
        Self { exposure: exposure.into() }
    }
}

impl RenderProcess for ToneMapping {
    fn name(&self) -> &str {
        Self::NAME
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
        Placed::between(source, target, self.clone())
    }
}

impl PlacedStep for ToneMapping {
    const NAME: &str = "tone mapping";

    fn full_screen(&self) -> FullScreen<'static> {
        let exposure = self.exposure.get();
        // Infinite, it would make what is black not a number.
        let exposure = if exposure > 0.0 { exposure.min(f32::MAX) } else { 0.0 };
        FullScreen {
            shader: include_str!("tone_mapping.wgsl"),
            parameters: bytemuck::cast_slice(&[exposure, 0.0, 0.0, 0.0]).to_vec().into(),
            ..FullScreen::default()
        }
    }
}
