//! Skins and morph targets on the device.

use std::sync::Arc;

use drawloom::process::{Declare, Deformation, ShaderResource};
use drawloom::scene::LayerMask;

use crate::attributes::{DEFORMED, JOINTS, NUMBER, POSE, TANGENT, WEIGHTS};

/// Morphs and skins objects in every process of the pipeline.
#[derive(Clone)]
pub(crate) struct SkinsAndMorphs {
    shader: Arc<str>,
    /// The joints of all objects, then the morph data.
    resources: [Arc<[u8]>; 2],
}

impl SkinsAndMorphs {
    /// For processes whose shader has this number of bindings of materials between the columns and the resources.
    pub(crate) fn new(palette: Arc<[u8]>, morphs: Arc<[u8]>, material_bindings: u32) -> Self {
        let shader = include_str!("deformation.wgsl");
        let shader = shader.replace("PALETTE", &(1 + material_bindings).to_string());
        let shader = shader.replace("MORPHS", &(2 + material_bindings).to_string());
        Self { shader: shader.into(), resources: [palette, morphs] }
    }
}

impl Deformation for SkinsAndMorphs {
    fn name(&self) -> &str {
        "skins and morphs"
    }

    fn layers(&self) -> LayerMask {
        DEFORMED
    }

    fn declare(&self, declare: &mut Declare) {
        declare.reads_column(POSE);
        declare.reads_attribute(JOINTS, [0; 4]);
        declare.reads_attribute(WEIGHTS, [1.0, 0.0, 0.0, 0.0]);
        declare.reads_attribute(NUMBER, 0);
        declare.reads_attribute(TANGENT, [0.0; 4]);
    }

    fn shader(&self) -> &str {
        &self.shader
    }

    fn resources(&self) -> Vec<ShaderResource<'_>> {
        self.resources.iter().map(|bytes| ShaderResource::SharedBytes(Arc::clone(bytes))).collect()
    }
}
