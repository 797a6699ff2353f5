//! How often a steady frame asks for memory, in which phase, and whose code it is that asks: the crate's or wgpu's.
//!
//! The allocator of this binary counts for all threads, so everything is in one test. Frames are static and repeat exactly;
//! only counted are those after a warm-up in which tables, pools and queues grow to their size.
//!
//! `DRAWLOOM_SHOW_REQUESTS=1 cargo test --test frame_memory -- --nocapture` prints every place as well. Stages are read off
//! stacks, so this takes a build with line tables; and stacks are walked by what unwinds panics on Unix.

#![cfg(unix)]

#[cfg(feature = "wgpu")]
#[path = "../../examples/frame/adapter.rs"]
#[expect(dead_code, reason = "the other half is for the frame example")]
mod adapter;
mod report;
mod requests;
#[path = "../scenes/mod.rs"]
mod scenes;
mod stack;

use std::env;
use std::process::Command;
use std::sync::Arc;

use drawloom::backend::{Backend, NullBackend};
use drawloom::glam::DVec3;
use drawloom::process::Deferred;
use drawloom::scene::{Camera, Scene, sample};
use drawloom::task::Scheduler;
use drawloom::{Granularity, Renderer};

use report::Report;
use stack::{Owner, UNKNOWN};

const WARMING: usize = 30;
const COUNTED: usize = 20;

/// wgpu walks stacks itself where `RUST_BACKTRACE` asks for it, which is memory that it otherwise does not take, and a lock
/// that what counts here needs too. The standard library reads that variable once, so another process is started without.
#[test]
#[cfg_attr(not(debug_assertions), ignore = "without line tables nobody knows where a request comes from")]
fn requests_for_memory_in_steady_frames() {
    const VARIABLE: &str = "RUST_LIB_BACKTRACE";
    if env::var_os(VARIABLE).is_some_and(|value| value == "0") {
        return count_requests();
    }
    let again = Command::new(env::current_exe().unwrap()).args(env::args_os().skip(1)).env(VARIABLE, "0").status();
    assert!(again.unwrap().success());
}

fn count_requests() {
    let show = env::var_os("DRAWLOOM_SHOW_REQUESTS").is_some_and(|value| value == "1");
    let scenes = [("colonnade", sample::colonnade().unwrap()), ("4 × 2,000 boxes", four_cameras())];
    for (name, scene) in &scenes {
        for workers in [1, 2] {
            let report = steady_frames(NullBackend, scene, workers, |_| ());
            report.print(&format!("{name}, null, {workers} workers"), show);
            assert_eq!(report.requests_of(Owner::Wgpu), 0, "nothing of wgpu is called");
            check(&report);
        }
        #[cfg(feature = "wgpu")]
        for workers in [1, 2] {
            let (device, queue) = adapter::noop_device().unwrap();
            let backend = drawloom::backend::WgpuBackend::new(device, queue).unwrap();
            let report = steady_frames(backend, scene, workers, |submission| submission.wait().unwrap());
            report.print(&format!("{name}, noop, {workers} workers"), show);
            assert!(report.requests_of(Owner::Wgpu) > 0, "wgpu does take memory, so this would find it");
            check(&report);
        }
    }
}

/// What holds on every backend. Workers that steal for the first time may take memory in any frame, once.
fn check(report: &Report) {
    assert_eq!(report.requests_in(&[UNKNOWN]), 0, "every request of a frame is of a stage");
    let commands =
        report.requests_in(&["job Objects", "job Visibility", "job Compact", "job Fill", "job Sort", "job Instance"]);
    assert!(commands < COUNTED, "{commands} requests from visibility to batches in {COUNTED} frames");
}

/// What the counted frames asked for. `wait` is for the device to be idle before the next frame; it is not counted.
fn steady_frames<B: Backend>(backend: B, scene: &Scene, workers: usize, wait: impl Fn(&B::Submission)) -> Report {
    let scheduler = Arc::new(Scheduler::new(workers).unwrap());
    let builder = Renderer::builder(backend).deferred(Deferred::to_picture()).granularity(Granularity::Chunk(256));
    let (mut renderer, submitter) = builder.build(scheduler).unwrap();
    let mut frame = |is_counted: bool| {
        let scene = scene.as_scene_ref();
        requests::count(is_counted);
        let recorded = renderer.record(scene).unwrap();
        let submitted = submitter.submit(recorded).unwrap();
        requests::count(false);
        wait(&submitted.submission);
    };
    // Resolving a stack takes far longer than a frame. So the last of the warming frames meet those that there are, and the
    // scheduler then learns again what a frame costs.
    (0..WARMING).for_each(|index| frame(index % 3 == 2));
    requests::forget();
    (0..COUNTED).for_each(|_| frame(true));
    Report::new(requests::take(), COUNTED)
}

/// Four cameras around one cloud of boxes: each sees nearly all of it.
fn four_cameras() -> Scene {
    let mut scene = scenes::field(2_000);
    let around = [DVec3::X, DVec3::NEG_X, DVec3::Z, DVec3::NEG_Z];
    scene.cameras = around
        .into_iter()
        .enumerate()
        .map(|(index, direction)| Camera::looking_at(format!("camera {index}"), direction * 60.0, DVec3::ZERO))
        .collect();
    scene
}
