//! Counts the allocations of steady frames by the code that allocates: the crate, which must not allocate in its jobs,
//! or wgpu.
//!
//! The allocator of this binary counts for all threads, so there is only one test. Frames are static and repeat
//! exactly. Counting starts after a warm-up in which tables, pools and queues grow to their final size.
//!
//! `DRAWLOOM_SHOW_ALLOCATIONS=1 cargo test --test frame_memory -- --nocapture` prints every call site as well. The
//! owner of an allocation is read from its backtrace, so this needs a build with line tables, and Unix's unwinder.

#![cfg(unix)]

mod counting_allocator;
mod nodes;
mod report;
mod stack;

use std::env;
use std::process::Command;
use std::sync::Arc;

use drawloom::backend::{EncodingStrategy, RecordingStrategy, WgpuBackend, WgpuSubmission};
use drawloom::glam::DVec3;
use drawloom::process::Deferred;
use drawloom::scene::{Camera, Scene};
use drawloom::task::Scheduler;
use drawloom::{CpuNode, FrameInputs, Renderer};
use drawloom_testing::demo;
use drawloom_testing::hills::{self, GeneratedHills};
use drawloom_testing::{adapter, scenes};

use nodes::SeenObjects;
use report::Report;
use stack::{Owner, Phase};

const WARM_UP_FRAMES: usize = 30;
const COUNTED_FRAMES: usize = 20;
const MAX_ROUNDS: usize = 3;

/// With `RUST_BACKTRACE` wgpu captures backtraces itself: these allocate, and take a lock that the counting allocator
/// needs too. The standard library reads the variable once, so the test runs in a child process without it.
#[test]
#[cfg_attr(not(debug_assertions), ignore = "backtraces need line tables")]
fn jobs_of_steady_frames_do_not_allocate() {
    const VARIABLE: &str = "RUST_LIB_BACKTRACE";
    if env::var_os(VARIABLE).is_some_and(|value| value == "0") {
        return count_allocations();
    }
    let again = Command::new(env::current_exe().unwrap()).args(env::args_os().skip(1)).env(VARIABLE, "0").status();
    assert!(again.unwrap().success());
}

fn count_allocations() {
    let show = env::var_os("DRAWLOOM_SHOW_ALLOCATIONS").is_some_and(|value| value == "1");
    let hills = GeneratedHills::new();
    let with_nodes = hills::scene(hills.mesh().unwrap()).unwrap();
    let none: &[&dyn CpuNode] = &[];
    let (vertices, indices) = hills.nodes(0);
    let all: &[&dyn CpuNode] = &[&vertices, &indices, &SeenObjects::default()];
    let scenes = [
        ("colonnade", demo::colonnade().unwrap(), none),
        ("4 × 2,000 boxes", four_cameras(), none),
        ("hills that nodes make", with_nodes, all),
    ];
    for (name, scene, nodes) in &scenes {
        for workers in [1, 2] {
            let report = steady_frames(scene, nodes, workers);
            report.print(&format!("{name}, {workers} workers"), show);
            let own = own_allocations(&report);
            assert_eq!(own, 0, "{name}, {workers} workers: allocations of jobs in {COUNTED_FRAMES} frames");
            assert!(report.allocations_of(Owner::Wgpu, Phase::Jobs) > 0, "wgpu allocates in jobs, so counting works");
            let unknown = [Owner::Drawloom, Owner::Wgpu].map(|owner| report.allocations_of(owner, Phase::Unknown));
            assert_eq!(unknown, [0, 0], "every allocation of a frame has a known phase");
        }
    }
}

fn own_allocations(report: &Report) -> usize {
    report.allocations_of(Owner::Drawloom, Phase::Jobs)
}

/// The allocations of the first round of frames whose jobs do not allocate, or of the last one. A thread may allocate
/// when it does something for the first time, in any frame.
fn steady_frames(scene: &Scene, nodes: &[&dyn CpuNode], workers: usize) -> Report {
    let scheduler = Arc::new(Scheduler::new(workers).unwrap());
    let (device, queue) = adapter::noop_device().unwrap();
    // Fixed strategies, because a trial of the tuner allocates once.
    let backend = WgpuBackend::new(device, queue)
        .unwrap()
        .recording_strategy(RecordingStrategy::CachedBundles)
        .encoding_strategy(EncodingStrategy::PerPass);
    let backend = if workers > 1 { backend.transient_targets() } else { backend };
    let (mut renderer, submitter) =
        Renderer::builder(backend).pipeline(Deferred::to_picture()).build(scheduler).unwrap();
    let mut frame = |is_counted: bool| {
        counting_allocator::count(is_counted);
        let recorded = renderer.record_with(FrameInputs { nodes, ..FrameInputs::new(scene.as_scene_ref()) }).unwrap();
        let submission: WgpuSubmission = submitter.submit(recorded).unwrap().submission;
        counting_allocator::count(false);
        submission.wait().unwrap();
    };
    // Resolving a backtrace takes far longer than a frame. So some warm-up frames count, which resolves the backtraces,
    // and the others let the scheduler learn a frame's usual cost again.
    (0..WARM_UP_FRAMES).for_each(|index| frame(index % 3 == 2));
    let mut round = || {
        counting_allocator::reset();
        (0..COUNTED_FRAMES).for_each(|_| frame(true));
        Report::new(counting_allocator::take(), COUNTED_FRAMES)
    };
    let mut report = round();
    for _ in 1..MAX_ROUNDS {
        if own_allocations(&report) == 0 {
            break;
        }
        report = round();
    }
    report
}

/// Four cameras around a cloud of boxes; each sees nearly all of it.
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
