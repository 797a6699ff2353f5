//! The whole picture from the helper.

#[cfg(feature = "software")]
use super::cpu_shader::{CpuLayer, LatePictureCpuShader};
use super::selection::SharedSelection;
#[cfg(feature = "software")]
use crate::process::CpuShader;
use crate::process::{ClearColor, Declare, Draws, Format, FullScreen, Place, RenderProcess};

/// Draws the helper's picture, and the source where there is none yet.
pub(super) struct LatePicture {
    pub(super) name: String,
    pub(super) shown: SharedSelection,
    /// The target that the step computes from.
    pub(super) source: String,
    pub(super) target: String,
    pub(super) format: Format,
}

impl RenderProcess for LatePicture {
    fn name(&self) -> &str {
        &self.name
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(Place::AfterPostProcessing);
        declare.samples(&self.source);
        declare.clears_color(&self.target, self.format, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let resources = self.shown.resources();
        let shader = if resources.is_empty() {
            include_str!("copy.wgsl")
        } else {
            concat!(include_str!("layer_lookup.wgsl"), include_str!("late_picture.wgsl"))
        };
        Draws::FullScreen(FullScreen { shader, resources, ..FullScreen::default() })
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<CpuShader> {
        let layers = CpuLayer::all(&self.shown.get());
        Some(CpuShader::full_screen(LatePictureCpuShader { layers }))
    }
}
