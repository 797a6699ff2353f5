//! Work of the engine's own in the frame's graph.

use std::ops::Range;

use super::NodeFrame;
use crate::graph::NodeError;
use crate::task::Worker;

/// Work of the engine's own that is done by the jobs of a frame (S 9.5, L 5): animation before the objects are read, geometry, particles,
/// rays for a few pixels, a mix of sound. [`Renderer::record_with_nodes`](crate::Renderer::record_with_nodes) takes nodes for one frame, so
/// they borrow what they work on.
///
/// What a node reads and writes decides when it runs: before the stages of the frame, between them, after or beside them. It is in timelines,
/// reports and spans under its name, like every stage, and runs even if nobody reads what it writes.
///
/// ```
/// use std::ops::Range;
///
/// use drawloom::glam::DVec3;
/// use drawloom::graph::NodeError;
/// use drawloom::scene::NodeColumn;
/// use drawloom::task::Worker;
/// use drawloom::{CpuNode, FrameData, NodeAccesses, NodeFrame};
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
///     fn width(&self, _: &NodeFrame<'_>) -> usize {
///         self.positions.chunk_count()
///     }
///
///     fn run(&self, _: &NodeFrame<'_>, chunks: Range<usize>, _: &Worker) -> Result<(), NodeError> {
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
/// A panic in any of these methods fails the frame with an error that names the node. Where the program is built with `panic = "abort"`, it
/// ends the program instead.
pub trait CpuNode: Send + Sync {
    /// Its name, in timelines and errors. No other node of the frame may have it, and no stage.
    fn name(&self) -> &str;

    /// Declares what it reads and writes. Frames with equal declarations share a graph, and one with another declaration builds a new one, so
    /// it should depend on nothing that changes in every frame.
    fn declare(&self, accesses: &mut NodeAccesses);

    /// The number of items. It is called when everything that the node waits for is complete. A node of width 0 is complete at once.
    fn width(&self, frame: &NodeFrame<'_>) -> usize {
        let _ = frame;
        1
    }

    /// The number of items for each job; 0 counts as 1. If it is `None`, the measured cost of an item decides, or the renderer's
    /// [granularity](crate::Granularity), as for stages.
    fn items_per_job(&self) -> Option<usize> {
        None
    }

    /// Processes some items: those of one job. Jobs of one node run in any order and at the same time, and must not wait for each other.
    ///
    /// # Errors
    /// An error fails the frame, as [`FrameError::Failed`](crate::FrameError::Failed) with the name of the node. The next frame is not
    /// affected.
    fn run(&self, frame: &NodeFrame<'_>, items: Range<usize>, worker: &Worker) -> Result<(), NodeError>;
}

/// What the stages of a frame read and write.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum FrameData {
    /// The [columns](crate::scene::SceneRef::written) that nodes write and stage *objects* reads. It is there when the frame begins, so
    /// nodes may read it that no other node writes for.
    Transforms,
    /// The objects that each view sees. Stages write it, nodes read it.
    VisibleObjects,
    /// What each pass draws. Stages write it, nodes read it.
    DrawLists,
    /// Whatever the engine's own code reads while passes are recorded, such as [raw passes](crate::process::Draws::Raw). Nodes write it.
    PassInputs,
    /// The recorded passes. Stages write it; a node that reads it runs after all of them, and before the frame is handed over.
    RecordedPasses,
}

/// Something that nodes read and write: a part of the frame, or of the engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum NodeResource {
    /// What stages read or write.
    Frame(FrameData),
    /// Something of the engine's own, by name. Only nodes read and write it.
    Own(&'static str),
}

impl From<FrameData> for NodeResource {
    fn from(data: FrameData) -> Self {
        Self::Frame(data)
    }
}

impl From<&'static str> for NodeResource {
    fn from(name: &'static str) -> Self {
        Self::Own(name)
    }
}

/// What a node reads and writes, and so what it waits for, by the rules of a [`FrameGraph`](crate::graph::FrameGraph#order): the writers of a
/// resource come first, then its modifiers, then its readers. Two nodes that both write a resource, or both modify it, must be
/// [put in order](Self::after).
#[derive(Debug, Default)]
pub struct NodeAccesses {
    pub(super) accesses: Vec<NodeAccess>,
}

/// One declaration of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NodeAccess {
    Reads(NodeResource),
    Writes(NodeResource),
    Modifies(NodeResource),
    After(&'static str),
}

impl NodeAccesses {
    /// The node reads it.
    pub fn reads(&mut self, resource: impl Into<NodeResource>) -> &mut Self {
        self.add(NodeAccess::Reads(resource.into()))
    }

    /// The node writes it.
    pub fn writes(&mut self, resource: impl Into<NodeResource>) -> &mut Self {
        self.add(NodeAccess::Writes(resource.into()))
    }

    /// The node changes what others have written.
    pub fn modifies(&mut self, resource: impl Into<NodeResource>) -> &mut Self {
        self.add(NodeAccess::Modifies(resource.into()))
    }

    /// The node runs after another one, whatever they read and write.
    pub fn after(&mut self, node: &'static str) -> &mut Self {
        self.add(NodeAccess::After(node))
    }

    fn add(&mut self, access: NodeAccess) -> &mut Self {
        self.accesses.push(access);
        self
    }
}
