//! What one process draws in one view.

use std::ops::Range;

use crate::command::{DrawState, RenderCommand};

/// What one process draws in one view: sorted commands, the batches they merge into, and the objects of each batch.
#[derive(Clone, Debug, Default)]
pub struct DrawList {
    /// In the order they are drawn, part by part; behind the last part there may be memory for more.
    commands: Vec<Vec<RenderCommand>>,
    parts: usize,
    /// In the order they are drawn.
    pub batches: Vec<Batch>,
    /// The index of each command's object: the 4 bytes an object that a view uploads.
    pub objects: Vec<u32>,
    /// The corners of the triangles that remain of partial batches, three each.
    indices: Vec<u32>,
    /// The places of partial batches, ascending, and where their indices are.
    partial: Vec<(u32, Range<u32>)>,
}

/// A part of a draw list, on its way.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DrawPart {
    /// In the order they are drawn.
    pub commands: Vec<RenderCommand>,
    /// In the order they are drawn. Their objects are counted from the part's first.
    pub batches: Vec<Batch>,
    /// The index of each command's object.
    pub objects: Vec<u32>,
}

impl DrawList {
    /// Leaves nothing to draw, and keeps the memory.
    pub fn clear(&mut self) {
        self.parts = 0;
        self.batches.clear();
        self.objects.clear();
        self.indices.clear();
        self.partial.clear();
    }

    /// Joins a part on behind those that are there. What it held is this list's, and it has other memory instead.
    ///
    /// Where one part ends and the next begins in the middle of a run of equals, the two batches become one if their mesh's slot is one
    /// that `merges`: the list does not depend on where it was cut.
    pub fn append(&mut self, part: &mut DrawPart, merges: impl Fn(u32) -> bool) {
        if self.parts == self.commands.len() {
            self.commands.push(Vec::new());
        }
        std::mem::swap(&mut self.commands[self.parts], &mut part.commands);
        self.parts += 1;
        if self.objects.is_empty() {
            std::mem::swap(&mut self.batches, &mut part.batches);
            std::mem::swap(&mut self.objects, &mut part.objects);
            return;
        }
        let first = self.objects.len() as u32;
        let mut batches = part.batches.iter().map(|batch| Batch { first: first + batch.first, ..*batch }).peekable();
        if let Some(last) = self.batches.last_mut().filter(|last| merges(last.mesh))
            && let Some(same) = batches.next_if(|next| (next.state, next.mesh) == (last.state, last.mesh))
        {
            last.count += same.count;
        }
        self.batches.extend(batches);
        self.objects.extend_from_slice(&part.objects);
    }

    /// Makes the batch at a place, which draws one object, a partial one: of its triangles those remain whose indices `append` appends,
    /// three each. Batches come in order.
    pub(crate) fn make_partial(&mut self, batch: u32, append: impl FnOnce(&mut Vec<u32>)) {
        let first = self.indices.len() as u32;
        append(&mut self.indices);
        self.partial.push((batch, first..self.indices.len() as u32));
    }

    /// The corners of the triangles that remain of partial batches, three each: indices into their mesh's vertices.
    pub fn remaining_indices(&self) -> &[u32] {
        &self.indices
    }

    /// Where in [`DrawList::remaining_indices`] those of the batch at a place are; `None` where its mesh is drawn whole.
    pub fn remaining(&self, batch: usize) -> Option<Range<u32>> {
        let place = self.partial.binary_search_by_key(&(batch as u32), |(batch, _)| *batch).ok()?;
        Some(self.partial[place].1.clone())
    }

    /// Whether every batch draws its mesh whole.
    pub fn is_whole(&self) -> bool {
        self.partial.is_empty()
    }

    /// Whether every batch of a bundle draws its mesh whole.
    pub fn bundle_is_whole(&self, bundle: usize) -> bool {
        let first = (bundle * Self::BATCHES_PER_BUNDLE) as u32;
        let place = self.partial.partition_point(|(batch, _)| *batch < first);
        self.partial.get(place).is_none_or(|(batch, _)| *batch >= first + Self::BATCHES_PER_BUNDLE as u32)
    }

    /// The sorted commands.
    pub fn commands(&self) -> impl DoubleEndedIterator<Item = &RenderCommand> + Clone {
        self.commands[..self.parts].iter().flatten()
    }

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

impl PartialEq for DrawList {
    fn eq(&self, other: &Self) -> bool {
        self.batches == other.batches
            && self.objects == other.objects
            && (&self.indices, &self.partial) == (&other.indices, &other.partial)
            && self.commands().eq(other.commands())
    }
}

impl Eq for DrawList {}

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
