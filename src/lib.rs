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
//! The twenty types you need:
//!
//! | type | what it is |
//! | --- | --- |
//! | [`Renderer`], [`RendererBuilder`] | records frames, on all workers; how one is made |
//! | [`Submitter`], [`FrameLoop`] | submits them; a device thread with one, two or three frames in flight |
//! | `WgpuBackend` in [`backend`] | what frames are recorded for |
//! | [`scene::SceneRef`], [`scene::Scene`] | what a frame reads: slices that an engine lends; arrays for an engine without its own |
//! | [`scene::Camera`], [`scene::Light`] | each camera is a view: mirrors, shadow maps, tiles |
//! | [`scene::Mesh`], [`scene::Material`], [`scene::Texture`] | what objects are made of |
//! | [`scene::Changes`] | which objects differ from the frame before |
//! | [`process::Deferred`] | the shipped [pipeline](process::Pipeline), with shadows, lights, transparency and tone mapping |
//! | [`process::RenderProcess`], [`process::Declare`], [`process::Draws`] | what an engine adds to a frame: its shaders, what they read and write, and what they draw |
//! | [`CpuNode`] | an engine's own work among the jobs of a frame |
//! | [`quality::Quality`] | what trades accuracy for speed |
//! | [`task::Scheduler`], [`FrameStatistics`] | the threads; what a frame drew and left out |
//!
//! The `guide` (feature `wgpu`) leads from a plain wgpu renderer to Drawloom in eight steps. [`timeline`] tells what
//! ran where and when, and `report`, behind its feature, why a frame took its time. The modules [`task`], [`graph`],
//! [`fence`], [`timeline`] and `report` are those of `drawloom-jobs`, a crate without wgpu.
//!
//! Beside it: `drawloom-obj` and `drawloom-gltf` load files, `drawloom-async-post` computes post-processing on idle
//! workers, `drawloom-egui` inspects a running renderer, and `drawloom-tracy` shows frames in Tracy.
//!
//! The ideas are from three papers, cited as **M** (McAnlis, "Camera-Centric Engine Design for Multithreaded
//! Rendering"), **L** (Lorenzon and Clua, "A Novel Multithreaded Rendering System based on a Deferred Approach",
//! SBGames 2009) and **S** (Schertenleib, "A Multithreaded 3D Renderer").
//!
//! # Features
//!
//! By default the crate is what an engine needs in order to draw with wgpu. Each feature adds one part:
//!
//! - `wgpu` (default): the wgpu backend, and `drawloom::wgpu` itself. Without it, frames are prepared down to draw
//!   lists, and [`NullBackend`](backend::NullBackend) counts and checks them. It needs a backend of wgpu to open a
//!   device:
//! - `vulkan`, `metal`, `dx12` (default): backends of wgpu. Each brings `wgpu`. An engine for one system names its own:
//!   `default-features = false, features = ["vulkan", "affinity"]`.
//! - `noop`: wgpu's device without a graphics card, which draws nothing, for tests and for measuring the CPU's work.
//! - `affinity` (default): [`SchedulerBuilder::affinity`](task::SchedulerBuilder::affinity), and it
//!   keeps workers off the processor of their caller, on Linux and Android. Without it, an affinity is an error.
//! - `software`: `backend::SoftwareBackend`, which draws on the CPU, and the CPU shaders that it runs in place of WGSL.
//!   A process supplies one with `RenderProcess::cpu_shader`.
//! - `occlusion`: culling of hidden objects, with `Quality::occlusion`, and of triangles, with
//!   `Mesh::with_triangle_culling`, for an engine whose device is the limit. Off by default: in no measured scene do
//!   they save CPU time.
//! - `report`: the module `report`: frame reports, the replay on any number of workers, and timelines as an HTML page
//!   or a Chrome trace.
//! - `meshopt`: `scene::Mesh::with_simplified_levels`, which makes levels of detail with meshoptimizer, a library in
//!   C++.
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
mod bit_set;
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
    BudgetError, BudgetedView, Buffering, BuildError, CpuNode, FencePoint, FinishedFrame, FrameData, FrameError,
    FrameInputs, FrameLoop, FrameLoopError, FrameSlot, FrameStatistics, FrameTimes, Granularity, LevelStatistics,
    NodeAccessError, NodeAccesses, NodeContext, NodeResource, QualityLevel, RecordedFrame, Renderer, RendererBuilder,
    StageTimes, StaticGroupStatistics, SubmitError, SubmittedFrame, Submitter, ViewBudget, ViewStatistics, ViewVariant,
    WarmUp,
};
pub use glam;
#[cfg(feature = "wgpu")]
pub use wgpu;

/// The README's Rust is compiled with the documentation's tests.
#[cfg(all(doctest, feature = "wgpu"))]
#[doc = include_str!("../README.md")]
pub struct Readme;
