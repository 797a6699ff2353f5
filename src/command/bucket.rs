//! A bucket of a pass's commands, and the batches they merge into.

use super::{DrawState, RenderCommand};

/// The commands of a pass whose keys lie in one range. One job sorts and instances them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Bucket {
    /// The commands in draw order.
    pub commands: Vec<RenderCommand>,
    /// The batches in draw order. [`Batch::first`] counts from the bucket's first object.
    pub batches: Vec<Batch>,
    /// The object index of each command.
    pub objects: Vec<u32>,
}

/// One instanced draw: consecutive commands with the same mesh and state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Batch {
    /// The mesh's slot.
    pub mesh: u32,
    /// The fixed-function state.
    pub state: DrawState,
    /// The index of its first object in [`DrawList::objects`](super::DrawList::objects).
    pub first: u32,
    /// The number of objects.
    pub count: u32,
}
