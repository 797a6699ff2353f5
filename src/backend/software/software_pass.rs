//! A pass of a frame.

use std::ops::Range;
use std::sync::Arc;

use super::attachments::Attachments;
use super::precision::Precision;
use super::targets::SoftwareTarget;
use crate::process::{DeclaredAttribute, FaceCulling, FullScreenCpuShader, LightCpuShader, ObjectCpuShader, Pass};
use crate::scene::Blend;
use crate::unwind::Contained;

/// A pass of a frame: one process in one view.
pub(super) struct SoftwarePass<R: Precision> {
    pub(super) pass: Pass,
    /// The process's name.
    pub(super) process: String,
    pub(super) draws: SoftwareDraws<R>,
    pub(super) attachments: Attachments<R>,
    /// The targets whose mip levels the pass leaves out of date.
    pub(super) outdated_mip_levels: Vec<SoftwareTarget<R>>,
}

/// What a pass draws.
pub(super) enum SoftwareDraws<R: Precision> {
    Objects {
        shader: Contained<Arc<dyn ObjectCpuShader<R>>>,
        face_culling: FaceCulling,
        depth: DepthWrites,
        attributes: Vec<DeclaredAttribute>,
    },
    FullScreen {
        shader: Contained<Arc<dyn FullScreenCpuShader<R>>>,
        blend: Blend,
    },
    Lights {
        shader: Contained<Arc<dyn LightCpuShader<R>>>,
        lights: Range<usize>,
    },
}

/// Which objects write depth, so that they occlude what is behind them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum DepthWrites {
    Never,
    /// Those whose materials do not blend.
    WhereOpaque,
    Always,
}
