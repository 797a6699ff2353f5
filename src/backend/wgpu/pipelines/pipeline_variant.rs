//! What distinguishes the pipelines of a process.

use std::sync::Arc;

use crate::backend::wgpu::resources::{MeshSnapshot, VertexStreamLayouts};
use crate::command::{Batch, DrawState};

/// What distinguishes the pipelines of a process: the draw state, and where vertices are.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct PipelineVariant {
    pub(crate) state: DrawState,
    /// `None` for meshes in the crate's pages.
    pub(crate) layout: Option<Arc<VertexStreamLayouts>>,
    /// Whether it draws what is in front of the near plane as if it were on it.
    pub(crate) clamps_depth: bool,
}

impl PipelineVariant {
    /// That of a state, for meshes in the crate's pages.
    pub(crate) fn of_pages(state: DrawState) -> Self {
        Self { state: state.pipeline_state(), layout: None, clamps_depth: false }
    }

    /// The same for a view that clamps depth, or not.
    pub(crate) fn clamping(self, clamps_depth: bool) -> Self {
        Self { clamps_depth, ..self }
    }

    /// The one that draws a batch.
    pub(crate) fn of_batch(meshes: &MeshSnapshot, batch: &Batch) -> Self {
        let layout = meshes.imported_meshes.get(batch.mesh).map(|mesh| Arc::clone(&mesh.layout));
        Self { layout, ..Self::of_pages(batch.state) }
    }
}
