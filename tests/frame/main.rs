//! Frames up to their submission, on the null backend, which draws nothing and checks the rules.

mod bad_input;
mod changes;
mod deferred;
mod determinism;
mod failing_process;
mod layers;
mod null_backend;
mod object_table;
mod occlusion;
mod order;
mod quality;
mod requirements;
mod retained;
mod shadow_interval;
mod targets;
mod timeline;
mod triangles;
mod tuning;
#[cfg(feature = "wgpu")]
mod uploads;
mod views;

use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::process::Deferred;
use drawloom::task::Scheduler;
use drawloom::{Granularity, Renderer, Submitter};

/// The shipped processes on the null backend.
fn renderer(workers: usize, granularity: Granularity) -> (Renderer<NullBackend>, Submitter<NullBackend>) {
    let scheduler = Arc::new(Scheduler::new(workers).unwrap());
    Renderer::builder(NullBackend).deferred(Deferred::to_picture()).granularity(granularity).build(scheduler).unwrap()
}
