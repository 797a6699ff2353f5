//! Frames up to their submission, on the null backend, which draws nothing and checks the rules.

#[cfg(feature = "wgpu")]
mod absent_features;
#[cfg(feature = "wgpu")]
mod backend_layers;
mod backward_reach;
mod bad_input;
mod camera_matrices;
mod changes;
mod changing_processes;
#[cfg(feature = "wgpu")]
mod declared_resources;
mod declaring;
mod deferred;
mod determinism;
mod failing_process;
mod granularity;
#[cfg(feature = "wgpu")]
mod items;
mod left_out;
mod layers;
mod levels_of_detail;
mod loading;
mod mip_levels;
mod null_backend;
mod view_filter;
mod object_table;
mod occlusion;
mod order;
mod plan;
mod static_groups;
#[cfg(feature = "wgpu")]
mod pipeline_library;
mod quality;
mod redraw;
mod requirements;
mod retained;
mod sampled_histories;
mod sampled_layers;
mod sampled_views;
mod shadow_interval;
#[cfg(feature = "wgpu")]
mod shared_pipelines;
#[cfg(feature = "wgpu")]
mod streaming;
mod target_names;
mod targets;
#[cfg(feature = "wgpu")]
mod textures;
mod timeline;
mod triangles;
mod tuning;
#[cfg(feature = "wgpu")]
mod uploads;
mod view_budget;
mod views;
mod warm_up;

use std::sync::{Arc, LazyLock, Mutex};

use drawloom::backend::NullBackend;
use drawloom::process::Deferred;
use drawloom::task::Scheduler;
use drawloom::{Granularity, Renderer, Submitter};
use tracing::Dispatch;
use tracing::subscriber::NoSubscriber;

/// The shipped processes on the null backend.
fn renderer(workers: usize, granularity: Granularity) -> (Renderer<NullBackend>, Submitter<NullBackend>) {
    let scheduler = Arc::new(Scheduler::new(workers).unwrap());
    Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).granularity(granularity).build(scheduler).unwrap()
}

/// What this thread reports through `tracing` during a call, as text.
fn reported(call: impl FnOnce()) -> String {
    /// While there is only one subscriber, the thread that is first to reach an event decides for all threads whether a
    /// subscriber wants it, and it may have none. So there is a second one.
    static SECOND: LazyLock<Dispatch> = LazyLock::new(|| Dispatch::new(NoSubscriber::default()));
    LazyLock::force(&SECOND);
    let written = Arc::new(Mutex::new(Vec::new()));
    let writer = {
        let written = Arc::clone(&written);
        move || Written(Arc::clone(&written))
    };
    let subscriber = tracing_subscriber::fmt().with_writer(writer).with_ansi(false).finish();
    tracing::subscriber::with_default(subscriber, call);
    let bytes = written.lock().unwrap().clone();
    String::from_utf8(bytes).unwrap()
}

/// What a subscriber writes.
struct Written(Arc<Mutex<Vec<u8>>>);

impl std::io::Write for Written {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}
