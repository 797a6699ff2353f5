//! A frame with work of the engine's own.

use super::{CpuNode, FrameError, RecordedFrame, Renderer};
use crate::backend::Backend;
use crate::scene::SceneRef;

impl<B: Backend> Renderer<B> {
    /// Records a frame as [`record`](Self::record) does, with work of the engine's own among its jobs: see [`CpuNode`].
    /// The nodes are lent as the scene is, until this returns.
    ///
    /// # Errors
    /// As [`record`](Self::record). If the nodes make no graph, because some wait for each other in a circle, one reads
    /// what nobody writes, two write the same without an order, or two have the same name; if a node fails or panics.
    /// The error names the node, and the next frame is not affected.
    pub fn record_with_nodes(
        &mut self,
        scene: SceneRef<'_>,
        nodes: &[&dyn CpuNode],
    ) -> Result<RecordedFrame<B>, FrameError> {
        self.record_part(&scene, nodes, true)
    }
}
