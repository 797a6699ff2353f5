//! Tone mapping: the step that every picture needs.

mod cpu_shader;

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use self::cpu_shader::ToneMappingCpuShader;
use super::PostStep;
use super::shipped_step::{BoundStep, ShippedStep, declare_step};
use crate::process::{CpuShader, Declare, Draws, FullScreen, RenderProcess};
use crate::quality::{Quality, ToneCurve};

/// Maps radiance, which has no upper end, to a picture, which has: exposure, then a curve, then sRGB. What is below zero, because
/// something was taken away from it, is black.
///
/// As a process of its own it leads from the target `radiance` to the target `picture`; as a [`PostStep`], from and to
/// whatever it is told.
#[derive(Clone, Debug, Default)]
pub struct ToneMapping {
    /// Multiplies radiance.
    pub exposure: Exposure,
    /// What ends at 1. In a [`Deferred`](crate::process::Deferred) pipeline that is told a quality, it is that of the quality.
    pub curve: ToneCurve,
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
/// let deferred = Deferred::new().post(ToneMapping::new(exposure.clone()));
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
    /// Filmic, with an exposure: a number that stays, or an [`Exposure`] that changes.
    pub fn new(exposure: impl Into<Exposure>) -> Self {
        Self { exposure: exposure.into(), curve: ToneCurve::default() }
    }

    /// The exposure of the moment, finite and 0 or more: infinite, it would make what is black not a number.
    fn usable_exposure(&self) -> f32 {
        let exposure = self.exposure.get();
        if exposure > 0.0 { exposure.min(f32::MAX) } else { 0.0 }
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

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(ShippedStep::cpu_shader(self))
    }
}

impl PostStep for ToneMapping {
    fn process(&self, source: &str, target: &str) -> Arc<dyn RenderProcess> {
        BoundStep::between(source, target, self.clone())
    }

    fn with_quality(&self, quality: &Quality) -> Option<Arc<dyn PostStep>> {
        Some(Arc::new(Self { curve: quality.tone_curve, ..self.clone() }))
    }
}

impl ShippedStep for ToneMapping {
    const NAME: &str = "tone mapping";

    fn full_screen(&self) -> FullScreen<'static> {
        let clips = if self.curve == ToneCurve::Clipped { 1.0 } else { 0.0 };
        FullScreen {
            shader: include_str!("tone_mapping/tone_mapping.wgsl"),
            parameters: bytemuck::cast_slice(&[self.usable_exposure(), clips, 0.0, 0.0]).to_vec().into(),
            ..FullScreen::default()
        }
    }

    fn cpu_shader(&self) -> CpuShader {
        CpuShader::full_screen(ToneMappingCpuShader { exposure: self.usable_exposure(), curve: self.curve })
    }
}
