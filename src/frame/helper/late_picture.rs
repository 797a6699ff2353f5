//! The whole picture from the helper.

use super::post_helper::PostHelper;
use crate::process::{ClearColor, Declare, Draws, Format, FullScreen, Place, RenderProcess};

/// Draws the helper's picture, and the source where there is none yet.
pub(super) struct LatePicture {
    pub(super) name: String,
    pub(super) helper: PostHelper,
    pub(super) target: String,
    pub(super) format: Format,
}

impl RenderProcess for LatePicture {
    fn name(&self) -> &str {
        &self.name
    }

    fn declare(&self, declare: &mut Declare) {
        declare.views(self.helper.source().views);
        declare.at(Place::AfterPostProcessing);
        declare.samples(self.helper.source_target());
        declare.clears_color(&self.target, self.format, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let resources = self.helper.resources();
        let shader = if resources.is_empty() {
            include_str!("copy.wgsl")
        } else {
            concat!(include_str!("layer_lookup.wgsl"), include_str!("late_picture.wgsl"))
        };
        Draws::FullScreen(FullScreen { shader, resources, ..FullScreen::default() })
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<crate::process::CpuShader> {
        let layers = self.helper.cpu_layers();
        Some(crate::process::CpuShader::full_screen(super::cpu_shader::LatePictureCpuShader { layers }))
    }
}
