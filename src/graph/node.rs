//! What a node must be to be run.

use std::{fmt, ops::Range};

use crate::task::Worker;

use super::error::NodeError;

/// A node that can be run: a number of items, handed out in chunks to whoever is free.
///
/// `C` is what the engine lends every node for the length of a run: its world, borrowed.
///
/// A panic in any of these methods fails the run with an error that names the node, as an error does. Where the program
/// is built with `panic = "abort"` no panic can be caught, and it ends the program instead.
pub trait Node<C: ?Sized>: Send + Sync {
    /// How many items there are.
    ///
    /// It is asked once a run, when everything the node depends on is done, so it may depend on what that made. With 0
    /// the node is done at once.
    fn width(&self, context: &C) -> usize;

    /// How many items one call of [`run`](Self::run) is to take: 0 is treated as 1.
    ///
    /// It is asked right after [`width`](Self::width), unless that was 0. A width beyond half the range of `usize` is
    /// taken in chunks of 2 items at least.
    fn chunk(&self, context: &C) -> usize {
        let _ = context;
        1
    }

    /// Whether the node must run on the thread that called [`Schedule::run`](super::Schedule::run), all of it: its
    /// width is asked there, and its chunks run there one after another, first to last.
    fn pinned(&self) -> bool {
        false
    }

    /// Does the items of `range`, which starts at a multiple of the chunk and is one chunk long, the last one perhaps less.
    ///
    /// Every item is in one range exactly. Ranges run in any order, at the same time or one after another, each on the thread
    /// that `worker` stands for. One that waits for another may wait for ever, as one thread may have both
    /// ([`Schedule::always_parallel`](super::Schedule::always_parallel)).
    ///
    /// # Errors
    ///
    /// Whatever the node cannot do. It stops the run: no further chunk starts, nothing that depends on the node runs,
    /// and the run reports this error with the node's name.
    fn run(&self, context: &C, range: Range<usize>, worker: &Worker) -> Result<(), NodeError>;
}

impl<C: ?Sized, T: Node<C> + ?Sized> Node<C> for Box<T> {
    fn width(&self, context: &C) -> usize {
        (**self).width(context)
    }

    fn chunk(&self, context: &C) -> usize {
        (**self).chunk(context)
    }

    fn pinned(&self) -> bool {
        (**self).pinned()
    }

    fn run(&self, context: &C, range: Range<usize>, worker: &Worker) -> Result<(), NodeError> {
        (**self).run(context, range, worker)
    }
}

type Width<'a, C> = dyn Fn(&C) -> usize + Send + Sync + 'a;
type Body<'a, C> = dyn Fn(&C, Range<usize>, &Worker) -> Result<(), NodeError> + Send + Sync + 'a;

/// A [`Node`] made of closures: all of them are of one type, so a graph can hold them side by side.
///
/// It is one item in one chunk, and runs anywhere, unless it is told otherwise:
///
/// ```
/// use drawloom::graph::Closure;
///
/// struct World {
///     spheres: Vec<f32>,
/// }
///
/// let cull = Closure::new(|world: &World, range, _| {
///     let visible = world.spheres[range].iter().filter(|radius| **radius > 0.0).count();
///     println!("{visible} are visible");
///     Ok(())
/// })
/// .with_width(|world| world.spheres.len())
/// .with_chunk(256);
/// # let _ = cull;
/// ```
pub struct Closure<'a, C: ?Sized> {
    width: Option<Box<Width<'a, C>>>,
    chunk: usize,
    pinned: bool,
    body: Box<Body<'a, C>>,
}

impl<'a, C: ?Sized> Closure<'a, C> {
    /// A node that does its items with `body`.
    pub fn new(body: impl Fn(&C, Range<usize>, &Worker) -> Result<(), NodeError> + Send + Sync + 'a) -> Self {
        Self { width: None, chunk: 1, pinned: false, body: Box::new(body) }
    }

    /// Has as many items as `width` says, which is asked once a run.
    pub fn with_width(mut self, width: impl Fn(&C) -> usize + Send + Sync + 'a) -> Self {
        self.width = Some(Box::new(width));
        self
    }

    /// Does `chunk` items a call: 0 is treated as 1.
    pub fn with_chunk(mut self, chunk: usize) -> Self {
        self.chunk = chunk;
        self
    }

    /// Runs on the thread that called [`Schedule::run`](super::Schedule::run), and nowhere else.
    pub fn on_calling_thread(mut self) -> Self {
        self.pinned = true;
        self
    }
}

impl<C: ?Sized> Node<C> for Closure<'_, C> {
    fn width(&self, context: &C) -> usize {
        self.width.as_ref().map_or(1, |width| width(context))
    }

    fn chunk(&self, _context: &C) -> usize {
        self.chunk
    }

    fn pinned(&self) -> bool {
        self.pinned
    }

    fn run(&self, context: &C, range: Range<usize>, worker: &Worker) -> Result<(), NodeError> {
        (self.body)(context, range, worker)
    }
}

impl<C: ?Sized> fmt::Debug for Closure<'_, C> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter
            .debug_struct("Closure")
            .field("chunk", &self.chunk)
            .field("pinned", &self.pinned)
            .finish_non_exhaustive()
    }
}
