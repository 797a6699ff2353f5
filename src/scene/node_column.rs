//! Columns of a scene that CPU nodes write while the frame is recorded.

use std::fmt;
use std::ops::{Deref, DerefMut, Range};
use std::sync::OnceLock;

use glam::{DVec3, Quat, Vec3};
use parking_lot::{Mutex, MutexGuard};

use super::Bounds;
use super::chunk_users::ChunkUsers;

/// A column of a scene that [CPU nodes](crate::CpuNode) write while the frame is recorded, before the stages read it:
/// positions that an animation moves, or a simulation. The engine lends its own storage, so nothing is copied, and has
/// it back when [`record_with`](crate::Renderer::record_with) returns.
///
/// It is cut into chunks of [`NodeColumn::CHUNK`] objects. Nodes write a chunk as often as they like, each after those
/// that it is ordered after, until its first read; after that, a write is an error. So an engine makes a column for
/// each recording. Chunks that no node writes keep what the engine has put there.
///
/// ```
/// use drawloom::glam::DVec3;
/// use drawloom::scene::NodeColumn;
///
/// let mut positions = vec![DVec3::ZERO; 1_000];
/// let column = NodeColumn::new(&mut positions);
/// assert_eq!((column.len(), column.chunk_count()), (1_000, 4));
/// // In a node, for each of its items:
/// for (object, position) in column.write(3)?.objects() {
///     position.x = object as f64;
/// }
/// drop(column);
/// assert_eq!(positions[999].x, 999.0);
/// # Ok::<(), drawloom::scene::ChunkInUse>(())
/// ```
pub struct NodeColumn<'a, T> {
    chunks: Vec<Chunk<'a, T>>,
    length: usize,
}

/// A chunk: lent for writing until it is read for the first time.
struct Chunk<'a, T> {
    writable: Mutex<Option<&'a mut [T]>>,
    users: ChunkUsers,
    readable: OnceLock<&'a [T]>,
}

impl<'a, T> NodeColumn<'a, T> {
    /// The number of objects in a chunk; the last one may have fewer.
    pub const CHUNK: usize = 256;

    /// A column with these values.
    pub fn new(values: &'a mut [T]) -> Self {
        let length = values.len();
        let chunk = |values| Chunk {
            writable: Mutex::new(Some(values)),
            users: ChunkUsers::default(),
            readable: OnceLock::new(),
        };
        Self { chunks: values.chunks_mut(Self::CHUNK).map(chunk).collect(), length }
    }

    /// The number of objects.
    pub fn len(&self) -> usize {
        self.length
    }

    /// Whether there are no objects.
    pub fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// The number of chunks: the width of a node that writes the whole column.
    pub fn chunk_count(&self) -> usize {
        self.chunks.len()
    }

    /// A chunk to write, by index. Other jobs that access the chunk wait while it is held, as long as the job that
    /// holds it works, so hold one at a time.
    ///
    /// # Errors
    /// If it has been read in this frame, because the node does not declare that it writes
    /// [`FrameData::Transforms`](crate::FrameData::Transforms); or if nobody lets go of it: this job holds it, or one
    /// that waits for another chunk, or one that has leaked it, or any for a minute.
    ///
    /// # Panics
    /// If there is no such chunk.
    pub fn write(&self, chunk: usize) -> Result<ColumnChunk<'_, 'a, T>, ChunkInUse> {
        let Chunk { writable, users, .. } = &self.chunks[chunk];
        let values = users.wait(|time| writable.try_lock_for(time)).filter(|values| values.is_some());
        let values = values.ok_or(ChunkInUse { chunk })?;
        Ok(ColumnChunk { values, first: chunk * Self::CHUNK })
    }

    /// The values of a chunk, by index. Nobody writes it from now on.
    ///
    /// # Panics
    /// If there is no such chunk, or nobody lets go of it: see [`write`](Self::write).
    pub fn read(&self, chunk: usize) -> &[T] {
        let Chunk { writable, users, readable } = &self.chunks[chunk];
        let freeze = || {
            let mut writable =
                users.wait(|time| writable.try_lock_for(time)).expect("a job holds a chunk that is read");
            writable.take().map_or(&[][..], |values| values)
        };
        readable.get_or_init(freeze)
    }
}

impl<T> fmt::Debug for NodeColumn<'_, T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("NodeColumn").field("length", &self.length).finish_non_exhaustive()
    }
}

/// A chunk of a [`NodeColumn`] that is being written: the values of its objects.
pub struct ColumnChunk<'c, 'a, T> {
    /// Not `None`.
    values: MutexGuard<'c, Option<&'a mut [T]>>,
    first: usize,
}

impl<T> ColumnChunk<'_, '_, T> {
    /// The index of the first object.
    pub fn first(&self) -> usize {
        self.first
    }

    /// The indices of its objects.
    pub fn range(&self) -> Range<usize> {
        self.first..self.first + self.len()
    }

    /// The index and the value of each object.
    pub fn objects(&mut self) -> impl Iterator<Item = (usize, &mut T)> {
        (self.first..).zip(&mut **self)
    }
}

impl<T> Deref for ColumnChunk<'_, '_, T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        self.values.as_deref().unwrap_or_default()
    }
}

impl<T> DerefMut for ColumnChunk<'_, '_, T> {
    fn deref_mut(&mut self) -> &mut [T] {
        self.values.as_deref_mut().unwrap_or_default()
    }
}

impl<T> fmt::Debug for ColumnChunk<'_, '_, T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("ColumnChunk").field("objects", &self.range()).finish_non_exhaustive()
    }
}

/// A chunk of a [`NodeColumn`] cannot be written: it has been read, or is held by a job that does not let go of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "chunk {chunk} of the column has been read in this frame already, so the node must declare that it writes the transforms, or a job holds it"
)]
pub struct ChunkInUse {
    /// The chunk.
    pub chunk: usize,
}

/// A [`NodeColumn`] as a scene lends it.
pub trait WrittenColumn<T>: fmt::Debug + Sync + sealed::Sealed {
    /// The number of objects.
    fn count(&self) -> usize;

    /// The values of a chunk of [`NodeColumn::CHUNK`] objects.
    fn chunk(&self, chunk: usize) -> &[T];
}

mod sealed {
    pub trait Sealed {}

    impl<T> Sealed for super::NodeColumn<'_, T> {}
}

impl<T: Send + Sync> WrittenColumn<T> for NodeColumn<'_, T> {
    fn count(&self) -> usize {
        self.len()
    }

    fn chunk(&self, chunk: usize) -> &[T] {
        self.read(chunk)
    }
}

/// The columns of a scene that [CPU nodes](crate::CpuNode) write while it is recorded. Each that is there takes the
/// place of the slice of the same name, which is then not read, and may be empty.
/// [`SceneRef::changes`](super::SceneRef::changes) are about them too: they name every object that a node may change.
///
/// A node that writes one of them declares that it writes [`FrameData::Transforms`](crate::FrameData::Transforms).
#[derive(Clone, Copy, Debug, Default)]
pub struct WrittenColumns<'a> {
    /// In the place of [`SceneRef::positions`](super::SceneRef::positions).
    pub positions: Option<&'a dyn WrittenColumn<DVec3>>,
    /// In the place of [`SceneRef::orientations`](super::SceneRef::orientations).
    pub orientations: Option<&'a dyn WrittenColumn<Quat>>,
    /// In the place of [`SceneRef::scales`](super::SceneRef::scales).
    pub scales: Option<&'a dyn WrittenColumn<Vec3>>,
    /// In the place of [`SceneRef::bounds`](super::SceneRef::bounds).
    pub bounds: Option<&'a dyn WrittenColumn<Bounds>>,
}

/// A column of a scene, wherever it is.
#[derive(Clone, Copy)]
pub(crate) struct Column<'a, T> {
    slice: &'a [T],
    written: Option<&'a dyn WrittenColumn<T>>,
}

impl<'a, T: Copy> Column<'a, T> {
    pub(super) fn new(slice: &'a [T], written: Option<&'a dyn WrittenColumn<T>>) -> Self {
        Self { slice, written }
    }

    /// The number of objects.
    pub(crate) fn len(self) -> usize {
        self.written.map_or(self.slice.len(), |column| column.count())
    }

    /// The value of an object.
    #[inline(always)]
    pub(crate) fn get(self, object: usize) -> T {
        match self.written {
            None => self.slice[object],
            Some(column) => column.chunk(object / CHUNK)[object % CHUNK],
        }
    }

    /// The values from `first` on: at least up to the next multiple of [`NodeColumn::CHUNK`], or to the last object.
    #[inline(always)]
    pub(crate) fn from(self, first: usize) -> &'a [T] {
        match self.written {
            None => &self.slice[first..],
            Some(column) => &column.chunk(first / CHUNK)[first % CHUNK..],
        }
    }
}

const CHUNK: usize = NodeColumn::<()>::CHUNK;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chunk_is_written_until_it_is_read_and_the_engine_has_what_was_written() {
        let mut values: Vec<u32> = (0..600).collect();
        let column = NodeColumn::new(&mut values);
        assert_eq!((column.len(), column.is_empty(), column.chunk_count()), (600, false, 3));
        for _ in 0..2 {
            column.write(1).unwrap().objects().for_each(|(_, value)| *value += 1_000);
        }
        assert_eq!(column.write(2).unwrap().range(), 512..600);
        assert_eq!(column.read(1)[3], 256 + 3 + 2_000);
        assert_eq!(column.write(1).map(drop), Err(ChunkInUse { chunk: 1 }));
        column.write(0).unwrap()[7] = 5;
        let read = Column::new(&[], Some(&column));
        assert_eq!((read.len(), read.get(7), read.get(259)), (600, 5, 2_259));
        assert_eq!((read.from(250).len(), read.from(598)), (6, &[598, 599][..]));
        drop(column);
        assert_eq!((values[7], values[256], values[599]), (5, 2_256, 599));
    }

    #[test]
    fn a_column_without_objects_has_no_chunks() {
        let column = NodeColumn::<u8>::new(&mut []);
        assert_eq!((column.len(), column.is_empty(), column.chunk_count()), (0, true, 0));
    }
}
