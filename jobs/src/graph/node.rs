//! Nodes that can be run.

use std::fmt;
use std::ops::Range;

use super::error::NodeError;
use crate::task::Worker;

/// A node that can be run: a number of items, which workers process in chunks.
///
/// `C` is the context: the engine's data, borrowed for the duration of a run.
///
/// A panic in any of these methods fails the run with an error that names the node. In a program that is built with
/// `panic = "abort"`, a panic ends the program instead.
pub trait Node<C: ?Sized>: Send + Sync {
    /// The number of items.
    ///
    /// It is called once per run, when all dependencies of the node are complete, so it may depend on their results. A
    /// node of width 0 is complete at once.
    fn width(&self, context: &C) -> usize;

    /// The number of items for each call of [`run`](Self::run). 0 counts as 1.
    ///
    /// It is called right after [`width`](Self::width), unless the width is 0. A width of more than half the range of
    /// `usize` is split into chunks of at least 2 items.
    fn chunk(&self, context: &C) -> usize {
        let _ = context;
        1
    }

    /// Whether the [chunk](Self::chunk) size follows from the cost of an item and the number of workers, by the rule of
    /// `Granularity::Adaptive`. Replays of the node cut it by that rule for other numbers of
    /// workers. Nodes with the same process and stage count as having items of the same cost.
    ///
    /// It is called for the first run that is recorded or traced, and holds for all later ones.
    fn chunked_by_cost(&self, context: &C) -> bool {
        let _ = context;
        false
    }

    /// Whether the node is pinned to the thread that called [`Schedule::run`](super::Schedule::run). All its calls are
    /// then made on that thread, and its chunks run one after another, from first to last.
    fn pinned(&self) -> bool {
        false
    }

    /// Processes the items of `range`: one chunk, which starts at a multiple of the chunk size. The last chunk may be
    /// shorter.
    ///
    /// Every item is in exactly one range. Ranges run in any order, at the same time or one after another, each on the
    /// thread of `worker`. A range must not wait for another one: the same thread may have to run both, which is a
    /// deadlock (but see [`Schedule::always_parallel`](super::Schedule::always_parallel)).
    ///
    /// # Errors
    /// An error stops the run: no further chunk starts, no dependent of the node runs, and the run returns the error
    /// with the node's name.
    fn run(&self, context: &C, range: Range<usize>, worker: &Worker) -> Result<(), NodeError>;
}

impl<C: ?Sized, T: Node<C> + ?Sized> Node<C> for Box<T> {
    fn width(&self, context: &C) -> usize {
        (**self).width(context)
    }

    fn chunk(&self, context: &C) -> usize {
        (**self).chunk(context)
    }

    fn chunked_by_cost(&self, context: &C) -> bool {
        (**self).chunked_by_cost(context)
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

/// A [`Node`] made of closures. All of them have the same type, so a graph can contain different ones.
///
/// By default, it has one item and runs on any worker:
///
/// ```
/// use drawloom_jobs::graph::Closure;
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
    /// A node that processes its items with `body`.
    pub fn new(body: impl Fn(&C, Range<usize>, &Worker) -> Result<(), NodeError> + Send + Sync + 'a) -> Self {
        Self { width: None, chunk: 1, pinned: false, body: Box::new(body) }
    }

    /// Sets the number of items, which is determined once per run.
    pub fn with_width(mut self, width: impl Fn(&C) -> usize + Send + Sync + 'a) -> Self {
        self.width = Some(Box::new(width));
        self
    }

    /// Sets the number of items for each call. 0 counts as 1.
    pub fn with_chunk(mut self, chunk: usize) -> Self {
        self.chunk = chunk;
        self
    }

    /// Pins the node to the thread that calls [`Schedule::run`](super::Schedule::run).
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
