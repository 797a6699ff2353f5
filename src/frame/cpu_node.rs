//! Work of the engine's own in the frame's graph.

use std::ops::Range;

use super::{NodeAccesses, NodeContext};
use crate::graph::NodeError;
use crate::task::Worker;

/// Work of the engine's own that is done by the jobs of a frame (S 9.5, L 5): animation before the objects are read,
/// geometry, particles, rays for a few pixels, a mix of sound.
/// [`Renderer::record_with_nodes`](crate::Renderer::record_with_nodes) takes nodes for one frame, so they borrow what
/// they work on.
///
/// What a node reads and writes decides when it runs: before the stages of the frame, between them, after or beside
/// them. It is in timelines, reports and spans under its name, like every stage, and runs even if nobody reads what it
/// writes.
///
/// ```
/// use std::ops::Range;
///
/// use drawloom::glam::DVec3;
/// use drawloom::graph::NodeError;
/// use drawloom::scene::NodeColumn;
/// use drawloom::task::Worker;
/// use drawloom::{CpuNode, FrameData, NodeAccesses, NodeContext};
///
/// /// Lets objects rise and fall, before the frame reads where they are.
/// struct Waves<'a> {
///     positions: &'a NodeColumn<'a, DVec3>,
///     seconds: f64,
/// }
///
/// impl CpuNode for Waves<'_> {
///     fn name(&self) -> &str {
///         "waves"
///     }
///
///     fn declare(&self, accesses: &mut NodeAccesses) {
///         accesses.writes(FrameData::Transforms);
///     }
///
///     fn width(&self, _: &NodeContext<'_>) -> usize {
///         self.positions.chunk_count()
///     }
///
///     fn run(&self, _: &NodeContext<'_>, chunks: Range<usize>, _: &Worker) -> Result<(), NodeError> {
///         for chunk in chunks {
///             for (_, position) in self.positions.write(chunk)?.objects() {
///                 position.y = (position.x + self.seconds).sin();
///             }
///         }
///         Ok(())
///     }
/// }
/// ```
///
/// A panic in any of these methods fails the frame with an error that names the node. Where the program is built with
/// `panic = "abort"`, it ends the program instead.
pub trait CpuNode: Send + Sync {
    /// Its name, in timelines and errors. No other node of the frame may have it, and no stage.
    fn name(&self) -> &str;

    /// Declares what it reads and writes. Frames with equal declarations share a graph, and one with another
    /// declaration builds a new one, so it should depend on nothing that changes in every frame.
    fn declare(&self, accesses: &mut NodeAccesses);

    /// The number of items. It is called when everything that the node waits for is complete. A node of width 0 is
    /// complete at once.
    fn width(&self, frame: &NodeContext<'_>) -> usize {
        let _ = frame;
        1
    }

    /// The number of items for each job; 0 counts as 1. If it is `None`, the measured cost of an item decides.
    fn items_per_job(&self) -> Option<usize> {
        None
    }

    /// Processes some items: those of one job. Jobs of one node run in any order and at the same time, and must not
    /// wait for each other.
    ///
    /// # Errors
    /// An error fails the frame, as [`FrameError::Failed`](crate::FrameError::Failed) with the name of the node. The
    /// next frame is not affected.
    fn run(&self, frame: &NodeContext<'_>, items: Range<usize>, worker: &Worker) -> Result<(), NodeError>;
}
