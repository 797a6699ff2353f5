//! The source of a step, made smaller.

#[cfg(feature = "software")]
use drawloom::process::CpuShader;
use drawloom::process::{ClearColor, Declare, Draws, Format, FullScreen, RenderProcess, TargetSize};

#[cfg(feature = "software")]
use crate::cpu_shader::DownsampleCpuShader;
use crate::source::StepSource;

/// Draws the source of a step into a smaller target.
pub(crate) struct Downsample {
    name: String,
    target: String,
    source: String,
    divisor: u32,
    format: Format,
}

impl Downsample {
    /// The name of the target that a step with this source reads back.
    pub(crate) fn target_of(step: &str, source: &StepSource) -> String {
        if source.downsampled.is_some() { format!("{step} source") } else { source.target.clone() }
    }

    /// `None` for a source that is read back as it is.
    pub(crate) fn new(step: &str, source: &StepSource) -> Option<Self> {
        let (divisor, format) = source.downsampled?;
        let (name, target) = (format!("{step} source"), Self::target_of(step, source));
        Some(Self { name, target, source: source.target.clone(), divisor, format })
    }
}

impl RenderProcess for Downsample {
    fn name(&self) -> &str {
        &self.name
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples(&self.source);
        declare.clears_color(&self.target, self.format, ClearColor::Value([0.0; 4]));
        declare.size(&self.target, TargetSize::Divided(self.divisor));
    }

    fn draws(&self) -> Draws<'_> {
        // A shader that does not branch on it may read its first bytes; this one loops, so they are 0: see
        // `Parameters`.
        let parameters = drawloom::bytemuck::cast_slice(&[0, 0, 0, self.divisor]).to_vec().into();
        Draws::FullScreen(FullScreen { shader: include_str!("downsample.wgsl"), parameters, ..FullScreen::default() })
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<CpuShader> {
        let divisor = self.divisor as usize;
        Some(CpuShader::full_screen(DownsampleCpuShader { divisor }))
    }
}
