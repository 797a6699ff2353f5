//! What one process draws in one view.

use crate::command::{DrawState, RenderCommand};

/// What one process draws in one view: sorted commands, the batches they merge into, and the objects of each batch.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DrawList {
    /// In the order they are drawn.
    pub commands: Vec<RenderCommand>,
    /// In the order they are drawn.
    pub batches: Vec<Batch>,
    /// The index of each command's object: the 4 bytes an object that a view uploads.
    pub objects: Vec<u32>,
}

impl DrawList {
    /// Batches in a bundle, whatever the granularity: fewer cost up to three times the price a draw, and boundaries that
    /// never move make the same picture from every granularity.
    pub const BATCHES_PER_BUNDLE: usize = 256;

    /// The number of bundles that the batches fill.
    pub fn bundle_count(&self) -> usize {
        self.batches.len().div_ceil(Self::BATCHES_PER_BUNDLE)
    }

    /// The batches of one bundle.
    ///
    /// # Panics
    /// If there is no such bundle.
    pub fn bundle(&self, index: usize) -> &[Batch] {
        let start = index * Self::BATCHES_PER_BUNDLE;
        &self.batches[start..self.batches.len().min(start + Self::BATCHES_PER_BUNDLE)]
    }
}

/// One instanced draw: a run of commands with the same mesh and state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Batch {
    /// The mesh's slot.
    pub mesh: u32,
    /// The fixed-function state.
    pub state: DrawState,
    /// The first of its objects in [`DrawList::objects`].
    pub first: u32,
    /// How many objects.
    pub count: u32,
}
