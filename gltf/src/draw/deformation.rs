//! Skins and morph targets on the device.

use std::sync::Arc;

use drawloom::process::{Declare, Deformation, ShaderResource};
use drawloom::scene::{LayerMask, VERTEX_INDEX};

use crate::attributes::{DEFORMED, JOINTS, POSE, TANGENT, WEIGHTS};

/// Morphs and skins objects in every process of the pipeline.
#[derive(Clone)]
pub(crate) struct SkinsAndMorphs {
    /// The joints of all objects, then the morph data.
    resources: [Arc<[u8]>; 2],
}

impl SkinsAndMorphs {
    pub(crate) fn new(palette: Arc<[u8]>, morphs: Arc<[u8]>) -> Self {
        Self { resources: [palette, morphs] }
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
        declare.reads_attribute(VERTEX_INDEX, 0);
        declare.reads_attribute(TANGENT, [0.0; 4]);
    }

    fn shader(&self) -> &str {
        include_str!("deformation.wgsl")
    }

    fn resources(&self) -> Vec<ShaderResource<'_>> {
        self.resources.iter().map(|bytes| ShaderResource::SharedBytes(Arc::clone(bytes))).collect()
    }
}
