//! A work-stealing scheduler for engines that produce frames: one pool of threads for a frame's graph, for the engine's
//! own loops and scopes, and for background jobs that no frame waits for.
//!
//! The twelve types you need:
//!
//! | type | what it is |
//! | --- | --- |
//! | [`task::Scheduler`], [`task::SchedulerBuilder`] | the threads, and how many, where, with which stacks |
//! | [`task::Scope`], [`task::Worker`] | jobs that borrow from their caller; the thread that a job runs on |
//! | [`task::BackgroundJob`], [`task::JobPanic`] | the handle of a background job; the panic of a job, as an error |
//! | [`graph::FrameGraph`], [`graph::Node`], [`graph::Closure`] | nodes, what they read and write, and how many items each has |
//! | [`graph::Schedule`] | a compiled graph, which runs once a frame and allocates nothing |
//! | [`fence::Fence`] | orders work of threads, and of a device |
//! | [`timeline::Timeline`] | what ran when on which worker |
//!
//! With the feature `report` the module `report` explains a timeline: why a frame took as long as it did, how long it
//! would take on other numbers of workers, and all frames as an HTML page or as a trace for Perfetto. The feature
//! `affinity`, which is on by default, restricts threads to processors, on Linux and Android: see
//! [`SchedulerBuilder::affinity`](task::SchedulerBuilder::affinity).
//!
//! # Spans
//!
//! Spans and events go through `tracing`. The crate installs no subscriber.
//!
//! | target | what | level | fields |
//! | --- | --- | --- | --- |
//! | `drawloom::graph` | span `node`: one node of a [schedule](graph::Schedule) in one run | debug | `name`; if the node has [labels](timeline::Labels), `process`, `stage`, `view` |
//! | `drawloom::graph` | span `chunk`, inside its node's span: a range of the node's items, run by one worker | trace | `start`, `end` |
//! | `drawloom::graph` | event `taken`: a worker starts a ready node, in a parallel run | trace | `ready`: how many other nodes are ready; `queued`: the jobs in that worker's queues |
//!
//! Workers are threads of their own. A subscriber that is to hear of all of them is the global default, or is set on
//! each by [`SchedulerBuilder::on_start`](task::SchedulerBuilder::on_start). If it panics, the span or event is lost,
//! and nothing else.
//!
//! [`graph`] and [`task`] have examples to copy. The crate `drawloom`, a renderer on top of this one, re-exports all
//! modules.

// Each module uses only modules above it; `tests/architecture` of the workspace fails otherwise.
#[forbid(unsafe_code)]
mod sync;
#[forbid(unsafe_code)]
mod unwind;
#[forbid(unsafe_code)]
pub mod text;
#[forbid(unsafe_code)]
pub mod fence;
pub mod timeline;
#[forbid(unsafe_code)]
mod chunked_array;
#[forbid(unsafe_code)]
mod tuning;
pub mod task;
pub mod graph;
#[cfg(feature = "report")]
#[forbid(unsafe_code)]
pub mod report;

#[doc(hidden)]
#[forbid(unsafe_code)]
pub mod internal;

/// The README's Rust is compiled with the documentation's tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
