//! What a CPU node declares.

use std::sync::Arc;

use crate::scene::{GeneratedBuffer, GeneratedSource};

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
