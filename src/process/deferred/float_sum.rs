//! Sums in targets of floats.

#[cfg(feature = "software")]
mod cpu_shader;

use super::LightSum;
use crate::process::{BlendEquation, ClearColor, Declare, Draws, Format, FullScreen, RenderProcess, Target, targets};

/// Adds a target of floats, in which other processes have summed small contributions, to the target `radiance` once:
/// see [`RadianceSum::Float`](crate::quality::RadianceSum::Float). The target's alpha is how much it hides of what
/// `radiance` holds.
#[derive(Clone, Copy, Debug)]
pub(super) struct FloatSum {
    name: &'static str,
    target: Target,
}

impl FloatSum {
    /// Of what lights add.
    pub(super) const LIGHTS: Self = Self { name: LightSum::NAME, target: Target::new("light sum") };

    /// Of blended objects.
    pub(super) const BLENDED_OBJECTS: Self =
        Self { name: Self::BLENDED_OBJECTS_NAME, target: Target::new("blended sum") };

    pub(super) const BLENDED_OBJECTS_NAME: &str = "sum of blended objects";

    /// Declares that a process adds to the sum, and if it is the first one, that it begins with 0.
    pub(super) fn declare_term(self, declare: &mut Declare, is_first: bool) {
        if is_first {
            declare.clears_color(self.target, Format::Rgba32FloatBlendable, ClearColor::Value([0.0; 4]));
        } else {
            declare.draws_over(self.target);
        }
    }
}

impl RenderProcess for FloatSum {
    fn name(&self) -> &str {
        self.name
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples(self.target);
        declare.draws_over(targets::RADIANCE);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen {
            shader: include_str!("float_sum/float_sum.wgsl"),
            blend_equations: vec![BlendEquation::PREMULTIPLIED_ALPHA],
            ..FullScreen::default()
        })
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<crate::process::CpuShader> {
        Some(crate::process::CpuShader::full_screen(cpu_shader::FloatSumCpuShader))
    }
}
