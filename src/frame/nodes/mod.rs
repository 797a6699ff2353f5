//! Work of the engine's own in the frame's graph: what a CPU node is, what it declares, and what it sees when it runs.

pub(super) mod borrowed_nodes;

use std::ops::{Deref, DerefMut, Range};
use std::sync::Arc;

use bytemuck::Pod;
use parking_lot::RwLockReadGuard;

use super::stages::tables::FrameTables;
use crate::backend::FrameRequest;
use crate::bit_set::{BITS_PER_WORD, BitWord};
use crate::command::DrawList;
use crate::graph::NodeError;
use crate::scene::{ChunkError, GeneratedBuffer, GeneratedContents, GeneratedSource};
use crate::task::Worker;
use crate::view::RenderView;

/// Work of the engine's own that is done by the jobs of a frame (S 9.5, L 5): animation before the objects are read,
/// geometry, particles, rays for a few pixels, a mix of sound.
/// [`Renderer::record_with`](crate::Renderer::record_with) takes nodes for one frame, so they borrow what
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

/// What the stages of a frame read and write.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum FrameData {
    /// The [columns](crate::scene::SceneRef::written) that nodes write and stage *objects* reads. It is there when the
    /// frame begins, so nodes may read it that no other node writes for.
    Transforms,
    /// The objects that each view sees. Stages write it, nodes read it.
    VisibleObjects,
    /// What each pass draws. Stages write it, nodes read it.
    DrawLists,
    /// Whatever the engine's own code reads while passes are recorded, such as [raw
    /// passes](crate::process::Draws::Raw). Nodes write it.
    PassInputs,
    /// The recorded passes. Stages write it; a node that reads it runs after all of them, and before the frame is
    /// handed over.
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
    /// A [`GeneratedBuffer`]. Nodes [fill](NodeAccesses::fills) and read it.
    Buffer {
        /// Its name.
        name: &'static str,
        /// Differs for every two buffers.
        identity: u64,
    },
}

impl From<FrameData> for NodeResource {
    fn from(data: FrameData) -> Self {
        Self::Frame(data)
    }
}

impl<T: bytemuck::Pod> From<&GeneratedBuffer<T>> for NodeResource {
    fn from(buffer: &GeneratedBuffer<T>) -> Self {
        Self::Buffer { name: buffer.name(), identity: buffer.source().layout.identity }
    }
}

impl From<&'static str> for NodeResource {
    fn from(name: &'static str) -> Self {
        Self::Own(name)
    }
}

/// What a node reads and writes, and so what it waits for, by the rules of a
/// [`FrameGraph`](crate::graph::FrameGraph#order): the writers of a resource come first, then its modifiers, then its
/// readers. Two nodes that both write a resource, or both modify it, must be [put in order](Self::after).
#[derive(Debug, Default)]
pub struct NodeAccesses {
    pub(super) accesses: Vec<NodeAccess>,
    /// The buffers that nodes fill.
    pub(super) filled: Vec<Arc<GeneratedSource>>,
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

    /// The node fills a buffer that this frame draws: see [`NodeContext::fill`](super::NodeContext::fill).
    pub fn fills<T: bytemuck::Pod>(&mut self, buffer: &GeneratedBuffer<T>) -> &mut Self {
        if !self.filled.iter().any(|known| Arc::ptr_eq(known, buffer.source())) {
            self.filled.push(Arc::clone(buffer.source()));
        }
        self.writes(buffer)
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

/// What a [`CpuNode`] sees of the frame while it runs: what it declares to read of it.
#[derive(Clone, Copy)]
pub struct NodeContext<'a> {
    pub(super) request: &'a FrameRequest<'a>,
    pub(super) tables: &'a FrameTables,
    /// What the node declares.
    pub(super) accesses: &'a [NodeAccess],
}

impl<'a> NodeContext<'a> {
    /// The views of the frame: those of cameras, in their order, and then shadow maps.
    pub fn views(&self) -> &'a [RenderView] {
        self.request.views
    }

    /// The objects that a view sees, by its index, in ascending order: of a [static group](crate::scene::StaticGroup)
    /// that it executes, all that are drawn. There are none in a view that does not exist or draws no object.
    ///
    /// # Errors
    /// If the node does not declare that it reads [`FrameData::VisibleObjects`].
    pub fn visible_objects(&self, view: usize) -> Result<impl Iterator<Item = usize> + use<'a>, NodeAccessError> {
        self.check(FrameData::VisibleObjects)?;
        let static_groups = &self.tables.static_groups;
        let seen = self.tables.visibility.get(view).map(|visibility| {
            (0..visibility.set.word_count()).flat_map(move |word| {
                let is_executed = |object: &usize| {
                    static_groups.owner(*object).is_some_and(|owner| visibility.static_groups.executes(owner))
                };
                // What is excluded from the view's tests lies outside, or is executed.
                let excluded = BitWord::new(word, visibility.static_groups.excluded(word));
                let executed = excluded.indices().filter(is_executed);
                let mask =
                    executed.fold(visibility.set.word(word), |mask, object| mask | 1 << (object % BITS_PER_WORD));
                BitWord::new(word, mask).indices()
            })
        });
        Ok(seen.into_iter().flatten())
    }

    /// What a process draws in a view, by its index: the [batches](DrawList::batches) of the list. `None` where it
    /// draws no commands.
    ///
    /// # Errors
    /// If the node does not declare that it reads [`FrameData::DrawLists`].
    pub fn draw_list(
        &self,
        process: &str,
        view: usize,
    ) -> Result<Option<RwLockReadGuard<'a, DrawList>>, NodeAccessError> {
        self.check(FrameData::DrawLists)?;
        let FrameRequest { plan, passes, .. } = self.request;
        let name = |index: usize| plan.processes()[index].name.as_str();
        let pass = passes.iter().position(|pass| pass.view_index == view && name(pass.process_index) == process);
        let table = pass.map(|pass| &self.tables.passes[pass]);
        Ok(table.filter(|table| table.selection.is_some()).map(|table| table.list.read()))
    }

    /// A chunk of a buffer to fill: what it holds before is anything that earlier frames have left. All chunks with
    /// elements that [count](Self::set_count) must be filled in each frame.
    ///
    /// Other jobs that access the chunk wait while it is held, as long as the job that holds it works, so hold one at a
    /// time.
    ///
    /// # Errors
    /// If the node does not declare that it [fills](super::NodeAccesses::fills) the buffer, if there is no such chunk,
    /// or if nobody lets go of it: this job holds it, or one that waits for another chunk, or one that has leaked it,
    /// or any for a minute.
    pub fn fill<T: Pod>(
        &self,
        buffer: &GeneratedBuffer<T>,
        chunk: usize,
    ) -> Result<impl DerefMut<Target = [T]> + use<'a, T>, NodeAccessError> {
        let contents = self.contents(buffer, Access::Write)?;
        contents.fill(chunk).map_err(|error| NodeAccessError::new(error, buffer.into(), chunk))
    }

    /// A chunk of a buffer that other nodes have filled in this frame: its elements that [count](Self::set_count).
    ///
    /// # Errors
    /// If the node does not declare that it reads the buffer, if no node of the frame fills it, or not this chunk, if
    /// there is no such chunk, or if nobody lets go of it.
    pub fn filled<T: Pod>(
        &self,
        buffer: &GeneratedBuffer<T>,
        chunk: usize,
    ) -> Result<impl Deref<Target = [T]> + use<'a, T>, NodeAccessError> {
        let contents = self.contents(buffer, Access::Read)?;
        contents.read(chunk).map_err(|error| NodeAccessError::new(error, buffer.into(), chunk))
    }

    /// How many elements of a buffer count in this frame.
    ///
    /// # Errors
    /// If the node does not declare that it reads the buffer, or no node of the frame fills it.
    pub fn count<T: Pod>(&self, buffer: &GeneratedBuffer<T>) -> Result<usize, NodeAccessError> {
        Ok(self.contents(buffer, Access::Read)?.count())
    }

    /// Sets how many elements of a buffer count in this frame, from the first one on: at most its capacity. Without it
    /// all do. A node that may have no items calls it in [`width`](super::CpuNode::width), as it is then not run.
    ///
    /// # Errors
    /// If the node does not declare that it fills the buffer.
    pub fn set_count<T: Pod>(&self, buffer: &GeneratedBuffer<T>, count: usize) -> Result<(), NodeAccessError> {
        self.contents(buffer, Access::Write)?.set_count(count);
        Ok(())
    }

    /// What the frame's nodes fill a buffer with, if this one may access it.
    fn contents<T: Pod>(
        &self,
        buffer: &GeneratedBuffer<T>,
        access: Access,
    ) -> Result<&'a GeneratedContents, NodeAccessError> {
        let resource = NodeResource::from(buffer);
        let is_declared = self.accesses.iter().any(|declared| match declared {
            // Who fills a buffer may also look at what it has filled.
            NodeAccess::Writes(declared) | NodeAccess::Modifies(declared) => *declared == resource,
            NodeAccess::Reads(declared) => access == Access::Read && *declared == resource,
            NodeAccess::After(_) => false,
        });
        if !is_declared {
            return Err(NodeAccessError::Undeclared { resource, access: access.name() });
        }
        let identity = buffer.source().layout.identity;
        let is_it = |contents: &&Arc<GeneratedContents>| contents.layout().identity == identity;
        // A node that only declares to write a buffer, and not to fill it, fills none.
        self.request
            .generated
            .iter()
            .find(is_it)
            .map(|contents| &**contents)
            .ok_or(NodeAccessError::NeverFilled { resource })
    }

    fn check(&self, data: FrameData) -> Result<(), NodeAccessError> {
        let resource = NodeResource::Frame(data);
        let is_declared = self.accesses.contains(&NodeAccess::Reads(resource));
        is_declared.then_some(()).ok_or(NodeAccessError::Undeclared { resource, access: "reads" })
    }
}

/// How a node accesses a buffer.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Access {
    Read,
    Write,
}

impl Access {
    fn name(self) -> &'static str {
        match self {
            Self::Read => "reads",
            Self::Write => "fills",
        }
    }
}

/// Why a node does not get what it asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum NodeAccessError {
    /// The node does not declare it, so that it may not be there yet.
    #[error("the node does not declare that it {access} {resource:?}")]
    Undeclared {
        /// What it asks for.
        resource: NodeResource,
        /// What it does with that: "reads" or "fills".
        access: &'static str,
    },
    /// No node of the frame declares that it fills the buffer.
    #[error("no node of the frame declares that it fills {resource:?}")]
    NeverFilled {
        /// The buffer.
        resource: NodeResource,
    },
    /// The buffer has no such chunk.
    #[error("{resource:?} has no chunk {chunk}")]
    UnknownChunk {
        /// The buffer.
        resource: NodeResource,
        /// The chunk.
        chunk: usize,
    },
    /// No node has filled the chunk in this frame.
    #[error("no node has filled chunk {chunk} of {resource:?} in this frame")]
    UnfilledChunk {
        /// The buffer.
        resource: NodeResource,
        /// The chunk.
        chunk: usize,
    },
    /// Nobody lets go of the chunk: the same job holds it, or one that waits for another chunk, or one that has leaked
    /// it.
    #[error("chunk {chunk} of {resource:?} is held by a job that does not let go of it")]
    HeldChunk {
        /// The buffer.
        resource: NodeResource,
        /// The chunk.
        chunk: usize,
    },
}

impl NodeAccessError {
    fn new(error: ChunkError, resource: NodeResource, chunk: usize) -> Self {
        match error {
            ChunkError::Unknown => Self::UnknownChunk { resource, chunk },
            ChunkError::Held => Self::HeldChunk { resource, chunk },
            ChunkError::Unfilled => Self::UnfilledChunk { resource, chunk },
        }
    }
}
