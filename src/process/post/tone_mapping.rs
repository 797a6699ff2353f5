//! Tone mapping, which every picture needs.

#[cfg(feature = "software")]
mod cpu_shader;

use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use super::PostStep;
use super::shipped_step::{BoundStep, ShippedStep, declare_step};
use crate::process::{Declare, Draws, Format, FullScreen, RenderProcess, targets};
use crate::quality::{Quality, ToneCurve};

/// Maps radiance, which is unlimited, to a picture: exposure, then a curve, then sRGB. Negative radiance, from
/// subtractive blending, becomes black.
///
/// As a process it reads the target `radiance` and draws the target `picture`; as a [`PostStep`], its source and target
/// are given.
#[derive(Clone, Debug)]
pub struct ToneMapping {
    /// Multiplies radiance.
    pub exposure: Exposure,
    /// Maps radiance to 0 to 1. [`Deferred::quality`](crate::process::Deferred::quality) sets it to the quality's
    /// curve.
    pub curve: ToneCurve,
    /// The format of the picture: sRGB, in the order of channels that the engine's surface has.
    pub format: Format,
}

/// What radiance is multiplied by before it is mapped. An exposure that is NaN or not above 0 makes a black picture.
///
/// Clones share their value, so an engine keeps a clone and changes the exposure between frames:
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
    /// A new exposure, which shares its value with no other.
    pub fn new(exposure: f32) -> Self {
        Self(Arc::new(AtomicU32::new(exposure.to_bits())))
    }

    /// Changes it, for frames that are recorded from now on.
    pub fn set(&self, exposure: f32) {
        // Relaxed: nothing else is read because of its value.
        self.0.store(exposure.to_bits(), Ordering::Relaxed);
    }

    /// The current exposure.
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

impl Default for ToneMapping {
    /// The filmic curve with an exposure of 1, into [`Format::Rgba8Srgb`].
    fn default() -> Self {
        Self { exposure: Exposure::default(), curve: ToneCurve::default(), format: Format::Rgba8Srgb }
    }
}

impl ToneMapping {
    /// The filmic curve with an exposure: a constant number, or an [`Exposure`] that changes.
    pub fn new(exposure: impl Into<Exposure>) -> Self {
        Self { exposure: exposure.into(), ..Self::default() }
    }

    /// The current exposure, clamped to finite numbers from 0: infinity times a radiance of 0 would be NaN.
    fn clamped_exposure(&self) -> f32 {
        let exposure = self.exposure.get();
        if exposure > 0.0 { exposure.min(f32::MAX) } else { 0.0 }
    }
}

impl RenderProcess for ToneMapping {
    fn name(&self) -> &str {
        Self::NAME
    }

    fn declare(&self, declare: &mut Declare) {
        declare_step(declare, targets::RADIANCE.name(), targets::PICTURE.name(), self.format);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(self.full_screen())
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<crate::process::CpuShader> {
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

    fn format(&self) -> Format {
        self.format
    }

    fn full_screen(&self) -> FullScreen<'static> {
        let clips = if self.curve == ToneCurve::Clipped { 1.0 } else { 0.0 };
        FullScreen {
            shader: include_str!("tone_mapping/tone_mapping.wgsl"),
            parameters: bytemuck::cast_slice(&[self.clamped_exposure(), clips, 0.0, 0.0]).to_vec().into(),
            ..FullScreen::default()
        }
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> crate::process::CpuShader {
        crate::process::CpuShader::full_screen(cpu_shader::ToneMappingCpuShader {
            exposure: self.clamped_exposure(),
            curve: self.curve,
        })
    }
}
