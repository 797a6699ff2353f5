//! Memory that CPU nodes fill in a frame, and that this frame draws.

use std::fmt;
use std::hint::black_box;
use std::marker::PhantomData;
use std::ops::{Deref, DerefMut, Range};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use bytemuck::Pod;
use bytemuck::allocation::try_zeroed_slice_box;
use parking_lot::{Mutex, RwLock, RwLockReadGuard, RwLockWriteGuard};

#[cfg(any(feature = "wgpu", feature = "software", test))]
use super::Topology;
use super::chunk_users::ChunkUsers;
use crate::leaked_guards::unlock;

/// Memory that [CPU nodes](crate::CpuNode) fill while a frame is recorded, and that this frame draws: particles, or the
/// vertices of a terrain (S 9.5). When the frame is submitted, its content goes to the device, ahead of all passes.
/// Each frame has a content of its own until then, so that frames in flight do not meet. A frame that does not fill a
/// buffer draws what the last submitted frame has filled, as long as what draws it stays on the device; a mesh that
/// comes later, and another device, begin without a content.
///
/// A [mesh](super::Mesh::generated) is drawn from it by the whole pipeline. One that a
/// [`StorageBuffer`](crate::process::StorageBuffer::generated) makes is read by shaders.
///
/// It is cut into chunks of equal length. Each is written by one job at a time:
///
/// ```
/// use std::ops::Range;
///
/// use drawloom::graph::NodeError;
/// use drawloom::scene::{GeneratedBuffer, Vertex};
/// use drawloom::task::Worker;
/// use drawloom::{CpuNode, NodeAccesses, NodeContext};
///
/// struct Sea {
///     vertices: GeneratedBuffer<Vertex>,
///     seconds: f32,
/// }
///
/// impl CpuNode for Sea {
///     fn name(&self) -> &str {
///         "sea"
///     }
///
///     fn declare(&self, accesses: &mut NodeAccesses) {
///         accesses.fills(&self.vertices);
///     }
///
///     fn width(&self, _: &NodeContext<'_>) -> usize {
///         self.vertices.chunk_count()
///     }
///
///     fn run(&self, frame: &NodeContext<'_>, chunks: Range<usize>, _: &Worker) -> Result<(), NodeError> {
///         for chunk in chunks {
///             let elements = self.vertices.chunk_range(chunk);
///             for (index, vertex) in elements.zip(&mut *frame.fill(&self.vertices, chunk)?) {
///                 let [x, z] = [index % 256, index / 256].map(|steps| steps as f32);
///                 *vertex = Vertex { position: [x, (x + self.seconds).sin(), z], normal: [0.0, 1.0, 0.0], uv: [0.0; 2] };
///             }
///         }
///         Ok(())
///     }
/// }
/// ```
pub struct GeneratedBuffer<T> {
    source: Arc<GeneratedSource>,
    /// Neither owns nor borrows a `T`.
    element: PhantomData<fn() -> T>,
}

impl<T: Pod> GeneratedBuffer<T> {
    /// What a chunk has, in bytes, unless the engine chooses another length.
    const CHUNK_BYTES: usize = 16 << 10;

    /// A buffer with room for this many elements. It takes no memory until a frame fills it: a frame to which the
    /// system refuses memory fails with [`FrameError::GeneratedMemory`](crate::FrameError::GeneratedMemory). A system
    /// that overcommits, as Linux does, may grant more than it has, and end the process when nodes fill the buffer.
    ///
    /// # Panics
    /// If it has none, or `T` has no bytes, a size that is not a multiple of 4 bytes, or an alignment of more than 16.
    pub fn new(name: &'static str, capacity: usize) -> Self {
        Self::with_chunk(name, capacity, (Self::CHUNK_BYTES / size_of::<T>().max(1)).max(1))
    }

    /// The same in chunks of this many elements; the last one may have fewer.
    ///
    /// # Panics
    /// As [`new`](Self::new), or if a chunk has none.
    pub fn with_chunk(name: &'static str, capacity: usize, chunk: usize) -> Self {
        Self { source: Arc::new(GeneratedSource::new::<T>((name, false), capacity, chunk)), element: PhantomData }
    }

    /// What a [`StorageBuffer`](crate::process::StorageBuffer) of that name and capacity is filled from.
    pub(crate) fn of_storage(name: &'static str, capacity: usize) -> Self {
        let chunk = (Self::CHUNK_BYTES / size_of::<T>()).max(1);
        Self { source: Arc::new(GeneratedSource::new::<T>((name, true), capacity, chunk)), element: PhantomData }
    }

    /// Its name in errors.
    pub fn name(&self) -> &'static str {
        self.source.layout.name
    }

    /// The number of elements that it has room for.
    pub fn capacity(&self) -> usize {
        self.source.layout.capacity
    }

    /// The number of chunks: the width of a node that fills it as a whole.
    pub fn chunk_count(&self) -> usize {
        self.source.layout.chunk_count()
    }

    /// The indices of the elements of a chunk: none if there is no such chunk.
    pub fn chunk_range(&self, chunk: usize) -> Range<usize> {
        self.source.layout.chunk_range(chunk)
    }

    pub(crate) fn source(&self) -> &Arc<GeneratedSource> {
        &self.source
    }
}

impl<T> Clone for GeneratedBuffer<T> {
    fn clone(&self) -> Self {
        Self { source: Arc::clone(&self.source), element: PhantomData }
    }
}

impl<T> fmt::Debug for GeneratedBuffer<T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_tuple("GeneratedBuffer").field(&self.source.layout).finish()
    }
}

/// What a [`GeneratedBuffer`] is, without the type of its elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GeneratedLayout {
    /// Its name.
    pub name: &'static str,
    /// Differs for every two buffers.
    pub identity: u64,
    /// Whether it fills the [`StorageBuffer`](crate::process::StorageBuffer) of that name.
    pub fills_storage: bool,
    /// The size of an element in bytes.
    pub stride: usize,
    /// The number of elements.
    pub capacity: usize,
    /// The number of elements in a chunk.
    pub chunk: usize,
}

impl GeneratedLayout {
    /// Its size in bytes; `usize::MAX` if that is no `usize`. No frame fills a buffer that is larger than the memory.
    pub fn bytes(&self) -> usize {
        self.stride.saturating_mul(self.capacity)
    }

    fn chunk_count(&self) -> usize {
        self.capacity.div_ceil(self.chunk)
    }

    fn chunk_range(&self, chunk: usize) -> Range<usize> {
        let start = chunk.saturating_mul(self.chunk).min(self.capacity);
        start..start.saturating_add(self.chunk).min(self.capacity)
    }
}

/// Free contents that are kept for frames to come: as many as were in flight at most, as a rule.
const MAX_FREE_CONTENTS: usize = 3;

/// Where the contents of a buffer come from: they are used again when the frames that had them are gone.
pub(crate) struct GeneratedSource {
    pub(crate) layout: GeneratedLayout,
    contents: Mutex<Vec<Arc<GeneratedContents>>>,
}

impl GeneratedSource {
    fn new<T: Pod>((name, fills_storage): (&'static str, bool), capacity: usize, chunk: usize) -> Self {
        static BUFFERS: AtomicU64 = AtomicU64::new(0);
        let stride = size_of::<T>();
        assert!(stride > 0 && stride.is_multiple_of(4), "an element has 4, 8, 12 ... bytes");
        assert!(align_of::<T>() <= align_of::<u128>(), "an element has an alignment of 16 bytes at most");
        assert!(capacity > 0 && chunk > 0, "a buffer and its chunks have elements");
        // Relaxed: the numbers only have to be unique.
        let identity = BUFFERS.fetch_add(1, Ordering::Relaxed);
        let layout = GeneratedLayout { name, identity, fills_storage, stride, capacity, chunk };
        Self { layout, contents: Mutex::default() }
    }

    /// The content of a frame that begins: one that no other frame has, with all elements and none of them filled.
    /// `None` if there is no memory for another one.
    pub(crate) fn begin_frame(&self) -> Option<Arc<GeneratedContents>> {
        let mut contents = self.contents.lock();
        let mut free_count = 0;
        contents.retain(|contents| {
            let is_free = Arc::strong_count(contents) == 1;
            free_count += usize::from(is_free);
            !is_free || free_count <= MAX_FREE_CONTENTS
        });
        for free in &mut *contents {
            if let Some(unused) = Arc::get_mut(free) {
                unused.reset();
                return Some(Arc::clone(free));
            }
        }
        let new = Arc::new(GeneratedContents::new(self.layout)?);
        contents.push(Arc::clone(&new));
        Some(new)
    }
}

impl PartialEq for GeneratedSource {
    fn eq(&self, other: &Self) -> bool {
        self.layout == other.layout
    }
}

impl fmt::Debug for GeneratedSource {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.layout.fmt(formatter)
    }
}

/// What nodes fill a [`GeneratedBuffer`] with in one frame.
pub struct GeneratedContents {
    layout: GeneratedLayout,
    chunks: Vec<RwLock<Chunk>>,
    /// By chunk.
    users: Vec<ChunkUsers>,
    count: Mutex<usize>,
}

#[derive(Default)]
struct Chunk {
    /// Aligned for every element.
    words: Box<[u128]>,
    is_filled: bool,
}

impl Chunk {
    fn bytes(&self, layout: &GeneratedLayout, elements: usize) -> &[u8] {
        &bytemuck::cast_slice(&self.words)[..elements * layout.stride]
    }
}

/// Why a chunk cannot be filled or read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ChunkError {
    Unknown,
    Held,
    Unfilled,
}

impl GeneratedContents {
    /// `None` if there is not enough memory.
    fn new(layout: GeneratedLayout) -> Option<Self> {
        let mut chunks = Vec::new();
        chunks.try_reserve_exact(layout.chunk_count()).ok()?;
        // A system that overcommits grants memory that it does not have, in small static groups, and ends the process
        // when the memory is written. As a rule it refuses one static group that is larger than its memory.
        let mut all = Vec::<u8>::new();
        all.try_reserve_exact(layout.bytes()).ok()?;
        // Otherwise the compiler may leave out memory that nobody uses.
        drop(black_box(all));
        let mut users = Vec::new();
        users.try_reserve_exact(layout.chunk_count()).ok()?;
        for index in 0..layout.chunk_count() {
            // No more than the bytes of all chunks, and the rest of a word.
            let words = (layout.chunk_range(index).len() * layout.stride).div_ceil(size_of::<u128>());
            // Another thread may have taken memory since.
            let words = try_zeroed_slice_box(words).ok()?;
            chunks.push(RwLock::new(Chunk { words, is_filled: false }));
            users.push(ChunkUsers::default());
        }
        Some(Self { layout, chunks, users, count: Mutex::new(layout.capacity) })
    }

    fn reset(&mut self) {
        *self.count.get_mut() = self.layout.capacity;
        for (chunk, users) in self.chunks.iter_mut().zip(&mut self.users) {
            unlock(chunk);
            chunk.get_mut().is_filled = false;
            users.clear();
        }
    }

    /// What the buffer is.
    pub fn layout(&self) -> &GeneratedLayout {
        &self.layout
    }

    /// The number of elements.
    pub fn count(&self) -> usize {
        *self.count.lock()
    }

    /// The size of its elements in bytes.
    pub fn byte_count(&self) -> usize {
        self.count() * self.layout.stride
    }

    /// Sets the number of elements. There are as many as fit if it is higher.
    pub(crate) fn set_count(&self, count: usize) {
        *self.count.lock() = count.min(self.layout.capacity);
    }

    /// A chunk to fill.
    ///
    /// # Errors
    /// If there is no such chunk, or nobody lets go of it.
    ///
    /// # Panics
    /// If the elements are not of this type.
    pub(crate) fn fill<T: Pod>(&self, chunk: usize) -> Result<impl DerefMut<Target = [T]> + use<'_, T>, ChunkError> {
        let elements = self.layout.chunk_range(chunk).len();
        let lock = self.chunks.get(chunk).ok_or(ChunkError::Unknown)?;
        let mut guard = self.users[chunk].wait(|time| lock.try_write_for(time)).ok_or(ChunkError::Held)?;
        guard.is_filled = true;
        let bytes = elements * self.layout.stride;
        Ok(RwLockWriteGuard::map(guard, move |chunk| {
            bytemuck::cast_slice_mut(&mut bytemuck::cast_slice_mut::<u128, u8>(&mut chunk.words)[..bytes])
        }))
    }

    /// The elements of a chunk that is filled, of those that count.
    ///
    /// # Errors
    /// If there is no such chunk, nobody has filled it in this frame, or nobody lets go of it.
    ///
    /// # Panics
    /// If the elements are not of this type.
    pub(crate) fn read<T: Pod>(&self, chunk: usize) -> Result<impl Deref<Target = [T]> + use<'_, T>, ChunkError> {
        let range = self.layout.chunk_range(chunk);
        let elements = range.end.min(self.count()).saturating_sub(range.start);
        let lock = self.chunks.get(chunk).ok_or(ChunkError::Unknown)?;
        let guard = self.users[chunk].wait(|time| lock.try_read_for(time)).ok_or(ChunkError::Held)?;
        if elements > 0 && !guard.is_filled {
            return Err(ChunkError::Unfilled);
        }
        Ok(RwLockReadGuard::map(guard, |chunk| bytemuck::cast_slice(chunk.bytes(&self.layout, elements))))
    }

    /// A chunk with elements that no node has filled; `None` if there is none.
    pub(crate) fn unfilled_chunk(&self) -> Option<usize> {
        let used = self.count().div_ceil(self.layout.chunk);
        // What is still held was leaked.
        self.chunks[..used].iter().position(|chunk| !chunk.try_read().is_some_and(|chunk| chunk.is_filled))
    }

    /// If its elements are indices: how many of those that count form whole triangles, and the last one of these.
    /// Further ones that are equal to it form triangles without area.
    #[cfg(any(feature = "wgpu", feature = "software", test))]
    pub(crate) fn whole_triangles(&self, topology: Topology) -> (usize, u32) {
        let count = match (topology, self.count()) {
            (_, 0..3) => 0,
            (Topology::TriangleList, count) => count - count % 3,
            (Topology::TriangleStrip, count) => count,
        };
        let Some(last) = count.checked_sub(1) else { return (0, 0) };
        let chunk = self.chunks[last / self.layout.chunk].read();
        let indices: &[u32] = bytemuck::cast_slice(&chunk.words);
        (count, indices[last % self.layout.chunk])
    }

    /// Calls `visit` with the bytes of consecutive elements and where they begin in the buffer, for all that there are.
    pub fn for_each_part(&self, mut visit: impl FnMut(usize, &[u8])) {
        let count = self.count();
        for (index, chunk) in self.chunks.iter().enumerate() {
            let Range { start, end } = self.layout.chunk_range(index);
            if start >= count {
                break;
            }
            visit(start * self.layout.stride, chunk.read().bytes(&self.layout, end.min(count) - start));
        }
    }

    /// All elements.
    ///
    /// # Panics
    /// If they are not of this type.
    pub fn elements<T: Pod>(&self) -> Vec<T> {
        let mut elements = Vec::with_capacity(self.count());
        self.for_each_part(|_, bytes| elements.extend_from_slice(bytemuck::cast_slice(bytes)));
        elements
    }
}

impl fmt::Debug for GeneratedContents {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("GeneratedContents").field("layout", &self.layout).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests;
