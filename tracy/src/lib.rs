//! Shows [Drawloom](https://docs.rs/drawloom)'s frames in [Tracy](https://github.com/wolfpld/tracy): the work of each
//! worker, on one timeline.
//!
//! An engine with a `tracing` subscriber adds [`layer`] to it; an engine without one calls [`install`]. Then a viewer
//! can connect. It shows a zone for each node that a worker runs, the number of ready nodes, and the number of queued
//! jobs. [`name_worker`] and [`mark_frame`] make the timeline easier to read:
//!
//! ```
//! use drawloom::task::Scheduler;
//! use drawloom_tracy::Zones;
//!
//! drawloom_tracy::install(Zones::Nodes)?;
//! let scheduler = Scheduler::builder().on_start(drawloom_tracy::name_worker).build()?;
//! for _frame in 0..3 {
//!     scheduler.scope(|_scope| { /* Record and submit. */ });
//!     drawloom_tracy::mark_frame();
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Until a viewer on the same machine connects, nothing is sent and hardly anything is stored.

mod plots;
mod spans;

use thiserror::Error;
use tracing::level_filters::LevelFilter;
use tracing::subscriber::set_global_default;
use tracing::{Metadata, Subscriber};
use tracing_subscriber::filter::FilterFn;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::registry::LookupSpan;
use tracing_subscriber::{Layer, Registry};
use tracing_tracy::TracyLayer;
use tracing_tracy::client::Client;

use crate::plots::Plots;
use crate::spans::{NameOnly, NodeZones, is_chunk, is_node};

/// The target of Drawloom's spans and events of runs.
const RUNS: &str = "drawloom::graph";

/// The spans of a run that are zones in Tracy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Zones {
    /// Nodes: one zone for each worker that runs a part of the node.
    #[default]
    Nodes,
    /// Nodes and their chunks. This makes about a hundred times as many zones, at a hundred times the cost.
    Chunks,
}

/// A layer for an engine's own subscriber, which must be a [`Registry`] with layers.
///
/// Each node is a zone with the node's name. All other spans up to [`DEBUG`](tracing::Level::DEBUG), Drawloom's or not,
/// are zones with the span's name, and events are messages. Fields are not part of a zone's name, because Tracy is
/// limited to about 32,000 different names. To show fewer zones, add a [filter](Layer::with_filter) to the layer.
///
/// The plots use an event of level [`TRACE`](tracing::Level::TRACE), so a level filter on the whole subscriber removes
/// them.
pub fn layer<S>(zones: Zones) -> impl Layer<S> + Send + Sync
where
    S: Subscriber + for<'span> LookupSpan<'span>,
{
    let client = Client::start();
    let is_wanted = move |metadata: &Metadata<'_>| {
        let is_zone = *metadata.level() <= LevelFilter::DEBUG || (zones == Zones::Chunks && is_chunk(metadata));
        is_zone && !is_node(metadata)
    };
    let others = TracyLayer::new(NameOnly::default()).with_filter(FilterFn::new(is_wanted));
    let nodes = NodeZones::new(client.clone()).with_filter(FilterFn::new(is_node));
    let plots = Plots::new(client).with_filter(FilterFn::new(plots::is_counters));
    others.and_then(nodes).and_then(plots)
}

/// Makes the [layer] the global subscriber, in a program that has none.
///
/// # Errors
/// Returns [`InstallError`] if the program already has a global subscriber. Add the [layer] to that one instead.
pub fn install(zones: Zones) -> Result<(), InstallError> {
    set_global_default(Registry::default().with(layer(zones))).map_err(|_| InstallError)
}

/// The program already has a global subscriber.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("the program already has a subscriber: add drawloom_tracy::layer to that one")]
pub struct InstallError;

/// Names the calling thread after a worker. Use it as the hook of `SchedulerBuilder::on_start`. Worker 0 is the thread
/// that calls the scheduler; it can be named by calling this with 0.
pub fn name_worker(index: usize) {
    let name = if index == 0 { "caller".to_owned() } else { format!("worker {index}") };
    Client::start().set_thread_name(&name);
}

/// Marks the end of a frame. Does nothing before the [layer] is created.
pub fn mark_frame() {
    if let Some(client) = Client::running() {
        client.frame_mark();
    }
}

/// Whether a viewer is connected.
pub fn is_connected() -> bool {
    Client::is_connected()
}

/// The README's Rust is compiled with the documentation's tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
