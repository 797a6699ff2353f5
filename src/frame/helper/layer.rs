//! A layer from the helper over the current picture.

use std::sync::Arc;

use super::post_helper::PostHelper;
use crate::process::{ClearColor, Declare, Draws, Format, FullScreen, PostStep, RenderProcess};

/// How a layer is composited over the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HelperLayer {
    /// How a pixel of the layer and one of the picture are combined.
    pub blend: HelperBlend,
    /// How much of the layer: 0 leaves the picture as it is, and 1 is all of it. Not above 1 where it multiplies.
    pub strength: f32,
    /// Where a pixel's part of the layer is looked up.
    pub reprojection: HelperReprojection,
    /// The format of the step's target: see [`PostStep`].
    pub format: Format,
}

/// How a pixel of a layer and one of the picture are combined. Where there is no layer, the picture stays as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HelperBlend {
    /// Light: it is added.
    #[default]
    Add,
    /// Occlusion: the picture is multiplied with it.
    Multiply,
}

/// Where a pixel's part of a layer is looked up, which is of an earlier frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HelperReprojection {
    /// At the pixel's own place: when the camera turns, the layer lags behind the picture.
    None,
    /// Where the pixel's surface was in the frame that the layer is of, by the target `depth`; where that frame did not show it, at the layer's
    /// nearest edge. Surfaces that moved themselves, and those that something else hid in that frame, have the layer of another surface.
    #[default]
    ByDepth,
    /// The same, but where that frame did not show the surface, at the pixel's own place.
    ByDepthOrSamePlace,
    /// The same, but where that frame did not show the surface, there is no layer.
    ByDepthOrNone,
}

impl Default for HelperLayer {
    /// Light that is added in full, reprojected, into [`Format::Rgba16Float`].
    fn default() -> Self {
        Self {
            blend: HelperBlend::default(),
            strength: 1.0,
            reprojection: HelperReprojection::default(),
            format: Format::Rgba16Float,
        }
    }
}

/// The step that composites the helper's layer.
pub(super) struct LayerStep {
    pub(super) helper: PostHelper,
    pub(super) settings: HelperLayer,
}

impl PostStep for LayerStep {
    fn process(&self, source: &str, target: &str) -> Arc<dyn RenderProcess> {
        let (source, target) = (source.to_owned(), target.to_owned());
        Arc::new(LayerProcess { helper: self.helper.clone(), settings: self.settings, source, target })
    }
}

struct LayerProcess {
    helper: PostHelper,
    settings: HelperLayer,
    source: String,
    target: String,
}

impl LayerProcess {
    fn is_reprojected(&self) -> bool {
        self.settings.reprojection != HelperReprojection::None
    }

    /// `Settings` in `layer.wgsl`.
    fn parameters(&self) -> Vec<u8> {
        let outside = match self.settings.reprojection {
            HelperReprojection::None | HelperReprojection::ByDepthOrSamePlace => 0,
            HelperReprojection::ByDepth => 1,
            HelperReprojection::ByDepthOrNone => 2,
        };
        let multiplies = u32::from(self.settings.blend == HelperBlend::Multiply);
        let words = [0, 0, 0, 0, self.settings.strength.to_bits(), multiplies, outside, 0];
        bytemuck::cast_slice(&words).to_vec()
    }
}

impl RenderProcess for LayerProcess {
    fn name(&self) -> &str {
        self.helper.name()
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples(&self.source);
        if self.is_reprojected() {
            declare.samples("depth");
        }
        declare.clears_color(&self.target, self.settings.format, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let resources = self.helper.resources();
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
    fn cpu_shader(&self) -> Option<crate::process::CpuShader> {
        let layers = self.helper.cpu_layers();
        Some(crate::process::CpuShader::full_screen(super::cpu_shader::LayerCpuShader {
            layers,
            settings: self.settings,
        }))
    }
}
