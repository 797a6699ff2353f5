//! A late layer over the current picture.

use std::sync::Arc;

#[cfg(feature = "software")]
use drawloom::process::CpuShader;
use drawloom::process::{ClearColor, Declare, Draws, FullScreen, PostStep, RenderProcess, targets};

#[cfg(feature = "software")]
use crate::cpu_shader::{CpuLayer, LayerCpuShader};
use crate::layer_settings::{LayerBlend, LayerReprojection, LayerSettings};
use crate::selection::SharedSelection;

/// The step of post-processing that composites the layer.
#[derive(Clone)]
pub(crate) struct LayerStep {
    /// The name of the step that computes it.
    pub(crate) name: Arc<str>,
    pub(crate) shown: SharedSelection,
    pub(crate) settings: LayerSettings,
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
        self.step.settings.reprojection != LayerReprojection::None
    }

    /// `Settings` in `layer.wgsl`.
    fn parameters(&self) -> Vec<u8> {
        let outside = match self.step.settings.reprojection {
            LayerReprojection::None | LayerReprojection::ByDepthOrSamePlace => 0,
            LayerReprojection::ByDepth => 1,
            LayerReprojection::ByDepthOrNone => 2,
        };
        let multiplies = u32::from(self.step.settings.blend == LayerBlend::Multiply);
        let words = [0, 0, 0, 0, self.step.settings.strength.to_bits(), multiplies, outside, 0];
        drawloom::bytemuck::cast_slice(&words).to_vec()
    }
}

impl RenderProcess for LayerProcess {
    fn name(&self) -> &str {
        &self.step.name
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples(&self.source);
        if self.is_reprojected() {
            declare.samples(targets::DEPTH);
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
