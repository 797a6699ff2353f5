//! Shows [Drawloom](https://docs.rs/drawloom)'s frames in [Tracy](https://github.com/wolfpld/tracy): what each worker did,
//! on one timeline.
//!
//! An engine that has a subscriber adds [`layer`] to it, and one that has none calls [`install`]. From then on a viewer can
//! connect, and sees a zone for each process that a worker takes part in, how many processes were ready, and how many jobs
//! were queued. [`name_worker`] and [`mark_frame`] make that easier to read:
//!
//! ```
//! use drawloom::task::Scheduler;
//! use drawloom_tracy::Zones;
//!
//! drawloom_tracy::install(Zones::Processes)?;
//! let scheduler = Scheduler::builder().on_start(drawloom_tracy::name_worker).build()?;
//! for _frame in 0..3 {
//!     scheduler.scope(|_scope| { /* Record and submit. */ });
//!     drawloom_tracy::mark_frame();
//! }
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Nothing is sent, and next to nothing kept, until a viewer on the same machine connects.

mod plots;
mod spans;

use thiserror::Error;
use tracing::{Metadata, Subscriber, level_filters::LevelFilter, subscriber::set_global_default};
use tracing_subscriber::{Layer, Registry, filter::FilterFn, layer::SubscriberExt, registry::LookupSpan};
use tracing_tracy::{TracyLayer, client::Client};

use crate::{
    plots::Plots,
    spans::{ByName, Processes, is_chunk, is_process},
};

/// Where Drawloom tells of its runs.
const RUNS: &str = "drawloom::graph";

/// What gets a zone in Tracy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Zones {
    /// Each process, once a run and worker that takes part in it.
    #[default]
    Processes,
    /// Each chunk of a process, too: some hundred times as many zones, and as much more that they cost.
    Chunks,
}

/// A layer for an engine's own subscriber, which is to be a [`Registry`] with layers.
///
/// A process of Drawloom is a zone by the name of the process alone. All other spans down to
/// [`DEBUG`](tracing::Level::DEBUG), Drawloom's or not, are zones by the name of the span, and events are messages. No field
/// gets into a zone's name, as Tracy has room for some 32,000 different ones. An engine that wants less puts a
/// [filter](Layer::with_filter) around it.
///
/// The plots are fed by an event that Drawloom tells at [`TRACE`](tracing::Level::TRACE), so a filter by level for the whole
/// subscriber leaves them out.
pub fn layer<S>(zones: Zones) -> impl Layer<S> + Send + Sync
where
    S: Subscriber + for<'span> LookupSpan<'span>,
{
    let client = Client::start();
    let is_wanted = move |metadata: &Metadata<'_>| {
        let is_zone = *metadata.level() <= LevelFilter::DEBUG || (zones == Zones::Chunks && is_chunk(metadata));
        is_zone && !is_process(metadata)
    };
    let others = TracyLayer::new(ByName::default()).with_filter(FilterFn::new(is_wanted));
    let processes = Processes::new(client.clone()).with_filter(FilterFn::new(is_process));
    let plots = Plots::new(client).with_filter(FilterFn::new(plots::is_count));
    others.and_then(processes).and_then(plots)
}

/// Makes the [layer] the whole program's subscriber, for a program that has no other.
///
/// # Errors
/// If it has one already: then add the [layer] to that.
pub fn install(zones: Zones) -> Result<(), InstallError> {
    set_global_default(Registry::default().with(layer(zones))).map_err(|_| InstallError)
}

/// There is a subscriber already.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("the program has a subscriber of spans already: add drawloom_tracy::layer to that one")]
pub struct InstallError;

/// Names the calling thread in Tracy after a worker. It is a hook for `SchedulerBuilder::on_start`. Worker 0 is whichever
/// thread calls the scheduler, which may be named by this too.
pub fn name_worker(index: usize) {
    let name = if index == 0 { "caller".to_owned() } else { format!("worker {index}") };
    Client::start().set_thread_name(&name);
}

/// Ends a frame in Tracy, and begins the next. Does nothing before the [layer] is there.
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
