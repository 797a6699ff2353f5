//! Frames that are submitted leave no memory behind in the driver: lavapipe of Mesa 22.3 keeps shaders that it compiles
//! anew for each pass (`src/view/gpu_view.rs`). Frames that are dropped leave none behind in wgpu. These cases have a
//! binary of their own, and run one after the other, so that they can measure the process.
//!
//! They take long, and are ignored without `DRAWLOOM_SLOW_CASES=1`, without an adapter, or on a system that does not
//! tell how much memory a process has. With `DRAWLOOM_REQUIRE_ADAPTER=1` a missing adapter fails them.

use std::env;
use std::error::Error;
use std::fs;
use std::process::ExitCode;
use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::WgpuBackend;
use drawloom::process::Deferred;
use drawloom::scene::{Material, RenderObject, Texture};
use drawloom::task::Scheduler;
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::field;
use drawloom_testing::{adapter, slow_cases};
use libtest_mimic::{Arguments, Failed, Trial};

const WARM_UP_FRAMES: usize = 12;
/// The growth is the median of this many periods: what each frame leaves behind adds up in every period, while the
/// allocator takes some MiB from the system in one period and in another none.
const PERIODS: usize = 7;
const FRAMES_IN_A_PERIOD: usize = 4;
/// Enough to exceed the bound if each leaves a sixth of its uploads.
const DROPPED_FRAMES_IN_A_PERIOD: usize = 25;
/// A shader that the driver compiles and keeps is some 100 KiB or more. Where it keeps those of each pass, four frames
/// leave 52 MiB behind.
const MAX_GROWTH_KIB: usize = 2 * 1024;

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let required = env::var_os("DRAWLOOM_REQUIRE_ADAPTER").is_some_and(|value| value == "1");
    let can_measure = slow_cases::are_enabled() && resident_kib().is_some();
    let can_draw = can_measure && (required || adapter::device().is_ok());
    let submitted = Trial::test("submitted_frames_leave_no_memory_behind", || {
        draw_and_measure().map_err(|error| Failed::from(error.to_string()))
    });
    let dropped = Trial::test("frames_that_are_recorded_and_dropped_leave_no_memory_behind", || {
        drop_and_measure().map_err(|error| Failed::from(error.to_string()))
    });
    let trials = vec![submitted.with_ignored_flag(!can_draw), dropped.with_ignored_flag(!can_measure)];
    // Each measures the whole process.
    libtest_mimic::run(&Arguments { test_threads: Some(1), ..arguments }, trials).exit_code()
}

/// Records frames that upload every object anew, half a MiB each, and drops them.
fn drop_and_measure() -> Result<(), Box<dyn Error>> {
    let (device, queue) = adapter::noop_device()?;
    let builder = Renderer::builder(WgpuBackend::new(device, queue)?).pipeline(Deferred::to_picture());
    let (mut renderer, _submitter) = builder.build(Arc::new(Scheduler::new(2)?))?;
    let scene = field(5_000);
    expect_steady_memory(DROPPED_FRAMES_IN_A_PERIOD, |_| {
        drop(renderer.record(scene.as_scene_ref())?);
        Ok(())
    })
}

/// Draws a scene that requires every process and has a texture, from a camera that moves.
fn draw_and_measure() -> Result<(), Box<dyn Error>> {
    let (device, queue) = adapter::device()?;
    let scheduler = Arc::new(Scheduler::new(2)?);
    let (mut renderer, submitter) = Renderer::builder(WgpuBackend::new(device, queue)?)
        .pipeline(Deferred::to_picture().depth_pre_pass(true))
        .build(scheduler)?;
    let mut scene = everything();
    let pixels = (0..64 * 64 * 4).map(|byte| (byte * 37 % 251) as u8).collect();
    let texture = Some(scene.add(Texture::new("speckled", 64, 64, pixels)?)?);
    let first = scene.objects().next().ok_or("the scene is empty")?;
    let material = scene.add(Material { texture, ..Material::default() })?;
    scene.replace_object(first, RenderObject { material, ..scene.object(first)? })?;
    expect_steady_memory(FRAMES_IN_A_PERIOD, |frame| {
        scene.cameras[0].position.x = 0.01 * frame as f64;
        submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission.wait()?;
        Ok(())
    })
}

/// Calls `draw` with the number of each frame, and measures how the process grows in periods of this number of frames.
fn expect_steady_memory(
    frames_in_a_period: usize,
    mut draw: impl FnMut(usize) -> Result<(), Box<dyn Error>>,
) -> Result<(), Box<dyn Error>> {
    (0..WARM_UP_FRAMES).try_for_each(&mut draw)?;
    let mut growths = Vec::new();
    for period in 0..PERIODS {
        let before = resident_kib().ok_or("the process's memory is unknown")?;
        let first = WARM_UP_FRAMES + period * frames_in_a_period;
        (first..first + frames_in_a_period).try_for_each(&mut draw)?;
        growths.push(resident_kib().ok_or("the process's memory is unknown")?.saturating_sub(before));
    }
    growths.sort_unstable();
    if growths[PERIODS / 2] > MAX_GROWTH_KIB {
        return Err(format!("each {frames_in_a_period} frames left this behind, in KiB: {growths:?}").into());
    }
    Ok(())
}

/// The memory of this process that is in RAM, in KiB; `None` where the system does not tell.
fn resident_kib() -> Option<usize> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    status.lines().find_map(|line| line.strip_prefix("VmRSS:"))?.split_whitespace().next()?.parse().ok()
}
