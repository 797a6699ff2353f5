//! The frame graph: orders nodes by the resources they read and write, and runs them.
//!
//! An engine adds nodes, declares which resources each of them reads and writes, and which resources are the outputs of
//! the frame. The graph is compiled once: this checks it, orders the nodes, and drops those that no output needs. The
//! resulting [`Schedule`] is run every frame, on all workers of a [`Scheduler`](crate::task::Scheduler).
//!
//! ```text
//!   FrameGraph                                  Schedule              a run: idle workers take the next chunks
//!
//!   geometry ──► (g-buffer) ──┐                 0 geometry ──┐        worker 0   geometry ▪▪▪▪  light ▪▪▪▪▪  post ▪
//!                             ▼     compile                  ▼        worker 1   shadow ▪▪▪▪▪▪  light ▪▪▪▪
//!   shadow ──► (shadow map) ► light  ────────►  1 shadow ─► 2 light
//!                             │                              │
//!   (image) ◄── post ◄── (lit)◄                              ▼
//!                                                          3 post
//!   debug lines ──► (overlay)                   dropped: debug lines
//! ```
//!
//! A parallel run starts the nodes of the critical path first, by the costs that earlier runs measured. A schedule with
//! so little work that parallel execution would cost more than it gains runs serially on the calling thread
//! ([`Schedule::run`]).
//!
//! The graph does not know what a node does. A node's payload can be anything if the graph is only ordered. To be run,
//! it must be a [`Node`]: a number of items that workers process in chunks. The number of items is only asked for when
//! all dependencies of the node are complete.
//!
//! In L 3.3 (Lorenzon & Clua), all work of a frame is *render processes*, which a manager assigns to free threads. In M
//! 10.4 (McAnlis), a fixed list of kinds of views defines their order. Here the order follows from what each node reads
//! and writes, so a mirror in a mirror is not a special case.
//!
//! # A graph of closures
//!
//! The nodes access the engine's data through the context, which is borrowed for the duration of a run:
//!
//! ```
//! use std::sync::atomic::{AtomicUsize, Ordering};
//!
//! use drawloom_jobs::graph::{Closure, FrameGraph};
//! use drawloom_jobs::task::Scheduler;
//!
//! struct World {
//!     heights: Vec<f32>,
//!     above_ground: AtomicUsize,
//! }
//!
//! let mut graph = FrameGraph::new();
//! let visible = graph.resource("visible");
//! let image = graph.resource("image");
//! graph.output(image);
//!
//! let cull = Closure::new(|world: &World, range, _worker| {
//!     let found = world.heights[range].iter().filter(|height| **height > 0.0).count();
//!     world.above_ground.fetch_add(found, Ordering::Relaxed);
//!     Ok(())
//! });
//! let cull = graph.add("cull", cull.with_width(|world| world.heights.len()).with_chunk(64));
//! graph.write(cull, visible);
//!
//! let draw = Closure::new(|world: &World, _range, _worker| {
//!     println!("drawing {} objects", world.above_ground.load(Ordering::Relaxed));
//!     Ok(())
//! });
//! let draw = graph.add("draw", draw.on_calling_thread());
//! graph.read(draw, visible);
//! graph.write(draw, image);
//!
//! let mut schedule = graph.compile()?;
//! let scheduler = Scheduler::new(2)?;
//! for frame in 1..=3 {
//!     let heights = (0..1000).map(|index| (index % (frame + 1)) as f32).collect();
//!     let world = World { heights, above_ground: AtomicUsize::new(0) };
//!     schedule.run(&scheduler, &world)?;
//!     assert!(world.above_ground.into_inner() > 0);
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! A context that borrows, such as `struct World<'frame> { heights: &'frame [f32] }`, has a different type in every
//! frame. The nodes of a schedule that is compiled once for all frames implement [`Node`] for every lifetime:
//!
//! ```
//! use std::ops::Range;
//!
//! use drawloom_jobs::graph::{FrameGraph, Node, NodeError};
//! use drawloom_jobs::task::{Scheduler, Worker};
//!
//! struct World<'frame> {
//!     heights: &'frame [f32],
//! }
//!
//! struct CheckHeights;
//!
//! impl Node<World<'_>> for CheckHeights {
//!     fn width(&self, world: &World<'_>) -> usize {
//!         world.heights.len()
//!     }
//!
//!     fn run(&self, world: &World<'_>, range: Range<usize>, _worker: &Worker) -> Result<(), NodeError> {
//!         let broken = world.heights[range].iter().find(|height| !height.is_finite());
//!         broken.map_or(Ok(()), |height| Err(format!("a height is {height}").into()))
//!     }
//! }
//!
//! type WorldNode = Box<dyn for<'frame> Node<World<'frame>>>;
//!
//! let mut graph = FrameGraph::<WorldNode>::new();
//! let check = graph.add("check heights", Box::new(CheckHeights));
//! graph.keep(check);
//! let mut schedule = graph.compile()?;
//! let scheduler = Scheduler::new(2)?;
//! let heights = vec![1.0, 2.0];
//! schedule.run(&scheduler, &World { heights: &heights })?;
//!
//! let heights = vec![1.0, f32::NAN];
//! let error = schedule.run(&scheduler, &World { heights: &heights }).unwrap_err();
//! assert_eq!(error.to_string(), "the node \"check heights\" failed: a height is NaN");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod active_instrument;
mod adjacency;
mod builder;
mod compile;
mod costs;
mod declarations;
mod dot;
mod edges;
mod error;
mod execute;
mod execution_policy;
mod flat_graph;
mod instrument;
mod node;
mod order;
mod parallel;
mod plan;
mod progress;
mod schedule;
mod serial;
mod shared_span;
mod token;
mod traversal;

#[cfg(all(test, drawloom_shuttle))]
mod shuttle_tests;

pub use builder::FrameGraph;
pub use compile::CompileError;
pub use declarations::{NodeId, ResourceId};
pub use error::{GraphProblem, NodeError, RunError};
pub use execution_policy::ModeChoice;
pub use node::{Closure, Node};
pub use schedule::Schedule;

#[cfg(feature = "report")]
pub(crate) use adjacency::RankedAdjacency;
#[cfg(feature = "report")]
pub(crate) use execution_policy::{ExecutionPolicy, RunMode};
