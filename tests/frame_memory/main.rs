//! How often a steady frame asks for memory, and whose code it is that asks: the crate's, which in its jobs never does, or
//! wgpu's.
//!
//! The allocator of this binary counts for all threads, so everything is in one test. Frames are static and repeat exactly;
//! only counted are those after a warm-up in which tables, pools and queues grow to their size.
//!
//! `DRAWLOOM_SHOW_REQUESTS=1 cargo test --test frame_memory -- --nocapture` prints every place as well. Who asks is read off
//! stacks, so this takes a build with line tables; and stacks are walked by what unwinds panics on Unix.

#![cfg(unix)]

mod report;
mod requests;
mod stack;

use std::env;
use std::process::Command;
use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::{EncodingStrategy, RecordingStrategy, WgpuBackend, WgpuSubmission};
use drawloom::demo;
use drawloom::glam::DVec3;
use drawloom::process::Deferred;
use drawloom::scene::{Camera, Scene};
use drawloom::task::Scheduler;
use drawloom_testing::{adapter, scenes};

use report::Report;
use stack::{Owner, Stage};

const WARMING: usize = 30;
const COUNTED: usize = 20;
const SPELLS: usize = 3;

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
    let scenes = [("colonnade", demo::colonnade().unwrap()), ("4 × 2,000 boxes", four_cameras())];
    for (name, scene) in &scenes {
        for workers in [1, 2] {
            let spells = steady_frames(scene, workers);
            // Whatever a thread does for the first time may take memory once, in any frame.
            let own = |report: &Report| report.requests_of(Owner::Drawloom, Stage::Jobs);
            let report = spells.into_iter().min_by_key(own).unwrap();
            report.print(&format!("{name}, {workers} workers"), show);
            assert_eq!(own(&report), 0, "{name}, {workers} workers: requests of jobs in {COUNTED} frames");
            assert!(report.requests_of(Owner::Wgpu, Stage::Jobs) > 0, "wgpu does take memory, so this would find it");
            let unknown = [Owner::Drawloom, Owner::Wgpu].map(|owner| report.requests_of(owner, Stage::Unknown));
            assert_eq!(unknown, [0, 0], "every request of a frame is of a stage");
        }
    }
}

/// What some spells of frames asked for.
fn steady_frames(scene: &Scene, workers: usize) -> Vec<Report> {
    let scheduler = Arc::new(Scheduler::new(workers).unwrap());
    let (device, queue) = adapter::noop_device().unwrap();
    // To try another way takes memory once.
    let backend = WgpuBackend::new(device, queue)
        .unwrap()
        .recording_strategy(RecordingStrategy::CachedBundles)
        .unwrap()
        .encoding_strategy(EncodingStrategy::PerPass);
    let (mut renderer, submitter) =
        Renderer::builder(backend).deferred(Deferred::to_picture()).build(scheduler).unwrap();
    let mut frame = |is_counted: bool| {
        requests::count(is_counted);
        let recorded = renderer.record(scene.as_scene_ref()).unwrap();
        let submission: WgpuSubmission = submitter.submit(recorded).unwrap().submission;
        requests::count(false);
        submission.wait().unwrap();
    };
    // Resolving a stack takes far longer than a frame. So the last of the warming frames meet those that there are, and the
    // scheduler then learns again what a frame costs.
    (0..WARMING).for_each(|index| frame(index % 3 == 2));
    let mut spell = || {
        requests::forget();
        (0..COUNTED).for_each(|_| frame(true));
        Report::new(requests::take(), COUNTED)
    };
    (0..SPELLS).map(|_| spell()).collect()
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
