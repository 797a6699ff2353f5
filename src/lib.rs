//! Drawloom produces an engine's frames on every core.
//!
//! An engine hands over its scene; Drawloom splits the frame into jobs, records it for wgpu on all workers, and hands
//! the device thread one ordered queue per camera to submit. What matters here, in this order: it does what the
//! engine's author expects; it is right at the extremes; it is fast; it is pleasant to read; it is small.
//!
//! ```text
//!  scene (read-only while a frame is recorded)                                        scene
//!    │  views        one per camera: "everything is a camera"                         view
//!    ▼
//!  objects           those that changed: checked, described,  parallel over objects   view
//!    │               and uploaded
//!    ▼
//!  visibility        per view: which objects it sees          parallel over objects   view
//!    ▼
//!  bin               per pass: opaque objects by state and    parallel over objects   command
//!    │               mesh; each bin is one draw
//!  fill → sort →     or, where depth orders them, a command   parallel over objects   view
//!  instance          for each; equal ones become one draw     and buckets             command
//!    ▼
//!  record            batches into passes, or bundles first    parallel over parts     backend
//!    ▼
//!  view queues       finished passes in order, one per view
//!    ▼
//!  submit            the device thread alone
//! ```
//!
//! Where to begin:
//!
//! - `guide`, with the feature `wgpu`: from a plain wgpu renderer to Drawloom in seven steps, and what it is not for.
//! - [`Renderer`] records frames, [`Submitter`] submits them; `examples/engine_loop.rs` shows both in an engine's loop.
//!   [`FrameLoop`] is a device thread with one, two or three frames in flight.
//! - [`process`] is what an engine adds to a frame: its own shaders over Drawloom's commands, or passes of its own.
//! - [`scene::SceneRef`] is what a frame reads: slices that an engine lends.
//! - [`CpuNode`] is work of an engine's own among the jobs of a frame, and [`scene::GeneratedBuffer`] what the same
//!   frame draws of it.
//! - [`timeline`] tells what ran where and when; `report`, behind its feature, why a frame took as long as it did.
//! - [`task::Scheduler`] and [`graph::FrameGraph`] are of `drawloom-jobs`, a crate that stands on its own, for an
//!   engine's other work.
//!
//! The ideas are from three papers, cited as **M** (McAnlis, "Camera-Centric Engine Design for Multithreaded
//! Rendering"), **L** (Lorenzon and Clua, "A Novel Multithreaded Rendering System based on a Deferred Approach",
//! SBGames 2009) and **S** (Schertenleib, "A Multithreaded 3D Renderer").
//!
//! # Features
//!
//! By default the crate is what an engine needs in order to draw with wgpu. Each feature adds one part:
//!
//! - `wgpu` (default): the wgpu backend, and `drawloom::wgpu` itself. Without it everything down to the draw list is
//!   there, and [`NullBackend`](backend::NullBackend), which counts and checks.
//! - `vulkan`, `metal`, `dx12` (default): what wgpu draws with. An engine for one system names its own:
//!   `default-features = false, features = ["vulkan", "affinity"]`.
//! - `noop`: wgpu's device without a graphics card, which draws nothing, for tests and for measuring the CPU's work.
//! - `affinity` (default): [`SchedulerBuilder::affinity`](task::SchedulerBuilder::affinity), and workers that stay off
//!   the processor of their caller. Linux and Android alone have it.
//! - `software`: `backend::SoftwareBackend`, which draws on the CPU, and the CPU shaders that it runs in place of WGSL.
//!   A process supplies one with `RenderProcess::cpu_shader`.
//! - `occlusion`: culling of hidden objects, with `Quality::occlusion`, and of triangles, with
//!   `Mesh::with_triangle_culling`, for an engine whose device is the limit. Off, because in no scene that was measured
//!   does either save the CPU's time.
//! - `report`: the module `report`: frame reports, the replay on any number of workers, and timelines as an HTML page
//!   or a Chrome trace.
//! - `meshopt`: `scene::Mesh::with_simplified_levels`, which makes levels of detail with meshoptimizer, a library in
//!   C++.
//!
//! The crate `drawloom-obj` reads OBJ files into a [`Scene`](scene::Scene).
//!
//! # Spans
//!
//! Spans and events go through `tracing`. The crate installs no subscriber. These targets, names, levels and fields
//! stay the same; more may come.
//!
//! | target | what | level | fields |
//! | --- | --- | --- | --- |
//! | `drawloom` | span `record`, as long as [`Renderer::record`] takes | debug | `objects` |
//! | `drawloom` | span `submit`, as long as [`Submitter::submit`] takes | debug | |
//! | `drawloom` | an event for each reason why something is not drawn as requested | warn | `count`, `first`, `message` |
//! | `drawloom::graph` | span `node`: one node of a [schedule](graph::Schedule) in one run | debug | `name`; if the node has [labels](timeline::Labels), `process`, `stage`, `view` |
//! | `drawloom::graph` | span `chunk`, inside its node's span: a range of the node's items, run by one worker | trace | `start`, `end` |
//! | `drawloom::graph` | event `taken`: a worker starts a ready node, in a parallel run | trace | `ready`: how many other nodes are ready; `queued`: the jobs in that worker's queues |
//!
//! A node has one span per run. Its parent is the span that was current when the run was started: `record`, in a frame.
//! Each worker that runs chunks of the node enters the span and exits it before the node counts as done. The span
//! closes before any dependent of the node begins. It is exited after an error or a panic, too.
//!
//! Workers are threads of their own. A subscriber that is to hear of all of them is the global default, or is set on
//! each by [`SchedulerBuilder::on_start`](task::SchedulerBuilder::on_start). If it panics, the span or event is lost,
//! and nothing else.

#![forbid(unsafe_code)]

// Each module uses only modules above it; `tests/architecture` fails otherwise.
mod unwind;
mod leaked_guards;
pub mod quality;
pub mod handle;
pub mod scene;
pub mod raster;
pub mod command;
pub mod view;
pub mod process;
pub mod backend;
mod frame;
#[cfg(feature = "wgpu")]
pub mod guide;

pub use backend::ViewQueue;
pub use bytemuck;
#[cfg(feature = "report")]
pub use drawloom_jobs::report;
pub use drawloom_jobs::{fence, graph, task, text, timeline};
pub use frame::{
    BudgetError, BudgetedView, Buffering, BuildError, CpuNode, FinishedFrame, FrameData, FrameError, FrameLoop,
    FrameLoopError, FramePlace, FrameSlot, FrameStatistics, FrameTimes, Granularity, LevelStatistics, NodeAccessError,
    NodeAccesses, NodeFrame, NodeResource, PieceStatistics, Recorded, Renderer, RendererBuilder, Rung, StageTimes,
    SubmitError, Submitted, Submitter, ViewBudget, ViewForm, ViewStatistics, WarmUp,
};
pub use glam;
#[cfg(feature = "wgpu")]
pub use wgpu;

/// The README's Rust is compiled with the documentation's tests.
#[cfg(all(doctest, feature = "wgpu"))]
#[doc = include_str!("../README.md")]
pub struct Readme;
