//! Buffers on the device that processes share.

use std::marker::PhantomData;

use bytemuck::Pod;

use crate::scene::GeneratedBuffer;

/// A buffer on the device that processes of a renderer share: particles, palettes, arguments of indirect draws. Make it
/// once, as a constant: processes [declare](super::Declare::changes_buffer) that they change or read it, and that
/// orders them.
///
/// There is one for all views. It is all zeros until a shader writes it, a [raw pass](super::RawPassResources::buffer)
/// fills it, or [CPU nodes](StorageBuffer::generated) do, and keeps its content from frame to frame, in the order in
/// which frames are submitted.
///
/// `T` has the layout of an element of the array in WGSL, padding included: `array<vec3<f32>>` has 16 bytes an element.
pub struct StorageBuffer<T> {
    layout: BufferLayout,
    /// Neither owns nor borrows a `T`.
    element: PhantomData<fn() -> T>,
}

impl<T: Pod> StorageBuffer<T> {
    /// A buffer of this name with this many elements. Two buffers of one name are the same buffer.
    ///
    /// # Panics
    /// If its size is 0 or no `u64`, or that of `T` not a multiple of 4 bytes, which no storage buffer can have. For a
    /// constant, that is an error of the compiler.
    pub const fn new(name: &'static str, count: u32) -> Self {
        assert!(size_of::<T>() > 0 && size_of::<T>().is_multiple_of(4), "an element has 4, 8, 12 ... bytes");
        assert!(count > 0, "a buffer has elements");
        let bytes = bytes_of::<T>(count);
        let layout = BufferLayout { name, bytes, is_filled_by_nodes: false };
        Self { layout, element: PhantomData }
    }

    /// The same buffer, which [CPU nodes](crate::CpuNode) fill before all processes: see
    /// [`generated`](Self::generated). Processes may then read it even if no process writes it.
    pub const fn filled_by_nodes(mut self) -> Self {
        self.layout.is_filled_by_nodes = true;
        self
    }

    /// Its size in bytes.
    pub const fn bytes(self) -> u64 {
        self.layout.bytes
    }

    /// Its name and size.
    pub(crate) const fn layout(self) -> BufferLayout {
        self.layout
    }

    /// What [CPU nodes](crate::CpuNode) fill, so that processes which declare to read this buffer draw it in the same
    /// frame: particles, or the arguments of an indirect draw, by which a node says how many there are. A frame whose
    /// nodes fill it has that content from its beginning on, before all processes.
    ///
    /// ```
    /// use drawloom::process::StorageBuffer;
    /// use drawloom::scene::GeneratedBuffer;
    ///
    /// const SPARKS: StorageBuffer<[f32; 4]> = StorageBuffer::new("sparks", 10_000).filled_by_nodes();
    ///
    /// let sparks: GeneratedBuffer<[f32; 4]> = SPARKS.generated();
    /// assert_eq!(sparks.capacity(), 10_000);
    /// ```
    ///
    /// The engine makes it once and keeps it. Of two that fill one buffer in the same frame, one is lost.
    ///
    /// # Panics
    /// If the buffer is not [filled by nodes](Self::filled_by_nodes): processes would not read what nodes fill.
    pub fn generated(self) -> GeneratedBuffer<T> {
        assert!(self.layout.is_filled_by_nodes, "call `filled_by_nodes` where {:?} is made", self.layout.name);
        GeneratedBuffer::of_storage(self.layout.name, self.layout.bytes as usize / size_of::<T>())
    }

    /// The place of an element: of the arguments of an indirect draw or dispatch. A frame that draws by it is refused
    /// if the buffer has no such element.
    ///
    /// # Panics
    /// If its offset in bytes is no `u64`.
    pub const fn at(self, index: u32) -> BufferOffset {
        BufferOffset { buffer: self.layout, bytes: bytes_of::<T>(index) }
    }
}

/// The size of `count` elements.
///
/// # Panics
/// If it is no `u64`.
const fn bytes_of<T>(count: u32) -> u64 {
    match (size_of::<T>() as u64).checked_mul(count as u64) {
        Some(bytes) => bytes,
        None => panic!("the elements have more bytes than a `u64`"),
    }
}

// Derived implementations would require them of `T`.
impl<T> Clone for StorageBuffer<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for StorageBuffer<T> {}

impl<T> std::fmt::Debug for StorageBuffer<T> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_tuple("StorageBuffer").field(&self.layout.name).field(&self.layout.bytes).finish()
    }
}

/// A [`StorageBuffer`] without the type of its elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BufferLayout {
    /// Its name.
    pub name: &'static str,
    /// Its size in bytes.
    pub bytes: u64,
    /// Whether [CPU nodes](StorageBuffer::filled_by_nodes) fill it.
    pub is_filled_by_nodes: bool,
}

/// A place in a [`StorageBuffer`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BufferOffset {
    /// The buffer.
    pub(crate) buffer: BufferLayout,
    /// The offset from its beginning, in bytes.
    pub bytes: u64,
}

/// How a process uses a [`StorageBuffer`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BufferAccess {
    /// Its shader reads it.
    Read,
    /// Its shader reads and writes it.
    Change,
    /// It holds the arguments of its indirect draw or dispatch.
    Arguments,
}
