//! The whole picture, computed from an earlier frame.

#[cfg(feature = "software")]
use drawloom::process::CpuShader;
use drawloom::process::{ClearColor, Declare, Draws, Format, FullScreen, InjectionPoint, RenderProcess};

#[cfg(feature = "software")]
use crate::cpu_shader::{CpuLayer, LatePictureCpuShader};
use crate::selection::SharedSelection;

/// Draws the picture that the step computed, and the source where there is none yet.
pub(crate) struct LatePicture {
    pub(crate) name: String,
    pub(crate) shown: SharedSelection,
    /// The target that the step computes from, if there is one in the same frames.
    pub(crate) source: Option<String>,
    pub(crate) target: String,
    pub(crate) format: Format,
}

impl RenderProcess for LatePicture {
    fn name(&self) -> &str {
        &self.name
    }

    fn declare(&self, declare: &mut Declare) {
        if let Some(source) = &self.source {
            declare.at(InjectionPoint::AfterPostProcessing);
            declare.samples(source);
        }
        declare.clears_color(&self.target, self.format, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let resources = self.shown.resources();
        let shader = match (resources.is_empty(), &self.source) {
            (false, Some(_)) => concat!(include_str!("layer_lookup.wgsl"), include_str!("late_picture.wgsl")),
            (false, None) => concat!(include_str!("layer_lookup.wgsl"), include_str!("late_picture_alone.wgsl")),
            (true, Some(_)) => include_str!("copy.wgsl"),
            (true, None) => include_str!("nothing.wgsl"),
        };
        Draws::FullScreen(FullScreen { shader, resources, ..FullScreen::default() })
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<CpuShader> {
        let layers = CpuLayer::all(&self.shown.get());
        Some(CpuShader::full_screen(LatePictureCpuShader { layers }))
    }
}
