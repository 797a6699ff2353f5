//! A layer from the helper over the current picture.

use std::sync::Arc;

#[cfg(feature = "software")]
use super::cpu_shader::{CpuLayer, LayerCpuShader};
use super::layer_settings::{HelperBlend, HelperLayer, HelperReprojection};
use super::selection::SharedSelection;
#[cfg(feature = "software")]
use crate::process::CpuShader;
use crate::process::{ClearColor, Declare, Draws, FullScreen, PostStep, RenderProcess};

/// The step that composites the helper's layer.
#[derive(Clone)]
pub(super) struct LayerStep {
    /// The name of the helper's step.
    pub(super) name: Arc<str>,
    pub(super) shown: SharedSelection,
    pub(super) settings: HelperLayer,
}

impl PostStep for LayerStep {
    fn process(&self, source: &str, target: &str) -> Arc<dyn RenderProcess> {
        let (source, target) = (source.to_owned(), target.to_owned());
        Arc::new(LayerProcess { step: self.clone(), source, target })
    }
}

struct LayerProcess {
    step: LayerStep,
    source: String,
    target: String,
}

impl LayerProcess {
    fn is_reprojected(&self) -> bool {
        self.step.settings.reprojection != HelperReprojection::None
    }

    /// `Settings` in `layer.wgsl`.
    fn parameters(&self) -> Vec<u8> {
        let outside = match self.step.settings.reprojection {
            HelperReprojection::None | HelperReprojection::ByDepthOrSamePlace => 0,
            HelperReprojection::ByDepth => 1,
            HelperReprojection::ByDepthOrNone => 2,
        };
        let multiplies = u32::from(self.step.settings.blend == HelperBlend::Multiply);
        let words = [0, 0, 0, 0, self.step.settings.strength.to_bits(), multiplies, outside, 0];
        bytemuck::cast_slice(&words).to_vec()
    }
}

impl RenderProcess for LayerProcess {
    fn name(&self) -> &str {
        &self.step.name
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples(&self.source);
        if self.is_reprojected() {
            declare.samples("depth");
        }
        declare.clears_color(&self.target, self.step.settings.format, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let resources = self.step.shown.resources();
        if resources.is_empty() {
            return Draws::FullScreen(FullScreen { shader: include_str!("copy.wgsl"), ..FullScreen::default() });
        }
        let shader = if self.is_reprojected() {
            concat!(
                include_str!("layer_lookup.wgsl"),
                include_str!("layer_reprojected.wgsl"),
                include_str!("layer.wgsl")
            )
        } else {
            concat!(
                include_str!("layer_lookup.wgsl"),
                include_str!("layer_same_place.wgsl"),
                include_str!("layer.wgsl")
            )
        };
        Draws::FullScreen(FullScreen {
            shader,
            parameters: self.parameters().into(),
            resources,
            ..FullScreen::default()
        })
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<CpuShader> {
        let layers = CpuLayer::all(&self.step.shown.get());
        Some(CpuShader::full_screen(LayerCpuShader { layers, settings: self.step.settings }))
    }
}
