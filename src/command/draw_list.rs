//! What one pass draws.

use std::ops::Range;

use super::{Batch, Bucket, RenderCommand};

/// What one pass draws: sorted commands, the batches they merge into, and the objects of each batch.
#[derive(Clone, Debug, Default)]
pub struct DrawList {
    /// The commands in draw order, bucket by bucket. Only the first `bucket_count` vectors are part of the list; the others
    /// keep their memory for later frames.
    commands: Vec<Vec<RenderCommand>>,
    bucket_count: usize,
    /// The batches in draw order.
    pub batches: Vec<Batch>,
    /// The object index of each command: the 4 bytes per object that a pass uploads.
    pub objects: Vec<u32>,
    /// The corners of the remaining triangles of partial batches, three per triangle.
    remaining_indices: Vec<u32>,
    /// The indices of partial batches, ascending, each with its range of `remaining_indices`.
    partial_batches: Vec<(u32, Range<u32>)>,
}

impl DrawList {
    /// The number of batches in a bundle. It is the same for every granularity: smaller bundles cost up to three times as
    /// much per draw, and bundle boundaries that moved with the granularity could change the picture.
    pub const BATCHES_PER_BUNDLE: usize = 256;

    /// Removes everything and keeps the memory.
    pub fn clear(&mut self) {
        self.bucket_count = 0;
        self.batches.clear();
        self.objects.clear();
        self.remaining_indices.clear();
        self.partial_batches.clear();
    }

    /// Appends a bucket. The list takes the bucket's vectors and leaves its own in exchange, so neither allocates.
    ///
    /// The bucket's first batch continues the list's last one where both have the same state and mesh, and `can_merge` holds
    /// for that mesh's slot: the list does not depend on where the buckets begin.
    pub fn append(&mut self, bucket: &mut Bucket, can_merge: impl Fn(u32) -> bool) {
        if self.bucket_count == self.commands.len() {
            self.commands.push(Vec::new());
        }
        std::mem::swap(&mut self.commands[self.bucket_count], &mut bucket.commands);
        self.bucket_count += 1;
        if self.objects.is_empty() {
            std::mem::swap(&mut self.batches, &mut bucket.batches);
            std::mem::swap(&mut self.objects, &mut bucket.objects);
            return;
        }
        let first = self.objects.len() as u32;
        let mut batches = bucket.batches.iter().map(|batch| Batch { first: first + batch.first, ..*batch }).peekable();
        if let Some(last) = self.batches.last_mut().filter(|last| can_merge(last.mesh))
            && let Some(same) = batches.next_if(|next| (next.state, next.mesh) == (last.state, last.mesh))
        {
            last.count += same.count;
        }
        self.batches.extend(batches);
        self.objects.extend_from_slice(&bucket.objects);
    }

    /// Makes a batch of one object partial: it draws only the triangles whose corners `append_indices` appends, three per
    /// triangle. Calls come in ascending order of `batch`.
    pub(crate) fn make_partial(&mut self, batch: u32, append_indices: impl FnOnce(&mut Vec<u32>)) {
        let first = self.remaining_indices.len() as u32;
        append_indices(&mut self.remaining_indices);
        self.partial_batches.push((batch, first..self.remaining_indices.len() as u32));
    }

    /// The corners of the remaining triangles of partial batches, three per triangle: indices into the mesh's vertices.
    pub fn remaining_indices(&self) -> &[u32] {
        &self.remaining_indices
    }

    /// The range of [`DrawList::remaining_indices`] that a batch draws; `None` where it draws its whole mesh.
    pub fn remaining(&self, batch: usize) -> Option<Range<u32>> {
        let found = self.partial_batches.binary_search_by_key(&(batch as u32), |(batch, _)| *batch).ok()?;
        Some(self.partial_batches[found].1.clone())
    }

    /// Whether every batch draws its whole mesh.
    pub fn is_whole(&self) -> bool {
        self.partial_batches.is_empty()
    }

    /// Whether every batch of a bundle draws its whole mesh.
    pub fn bundle_is_whole(&self, bundle: usize) -> bool {
        let first = (bundle * Self::BATCHES_PER_BUNDLE) as u32;
        let next_partial = self.partial_batches.partition_point(|(batch, _)| *batch < first);
        let end = first + Self::BATCHES_PER_BUNDLE as u32;
        self.partial_batches.get(next_partial).is_none_or(|(batch, _)| *batch >= end)
    }

    /// The sorted commands.
    pub fn commands(&self) -> impl DoubleEndedIterator<Item = &RenderCommand> + Clone {
        self.commands[..self.bucket_count].iter().flatten()
    }

    /// The number of bundles that the batches fill.
    pub fn bundle_count(&self) -> usize {
        self.batches.len().div_ceil(Self::BATCHES_PER_BUNDLE)
    }

    /// The batches of one bundle.
    ///
    /// # Panics
    /// If `index` is [`DrawList::bundle_count`] or more.
    pub fn bundle(&self, index: usize) -> &[Batch] {
        let start = index * Self::BATCHES_PER_BUNDLE;
        &self.batches[start..self.batches.len().min(start + Self::BATCHES_PER_BUNDLE)]
    }
}

impl PartialEq for DrawList {
    fn eq(&self, other: &Self) -> bool {
        self.batches == other.batches
            && self.objects == other.objects
            && (&self.remaining_indices, &self.partial_batches) == (&other.remaining_indices, &other.partial_batches)
            && self.commands().eq(other.commands())
    }
}

impl Eq for DrawList {}
