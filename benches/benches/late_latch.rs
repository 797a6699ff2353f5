//! What late latching costs: the objects that a view keeps more, and the time to replace its camera.
//!
//!     cargo bench -p drawloom-benches --bench late_latch
//!     cargo bench -p drawloom-benches --bench late_latch -- --quick
//!
//! A city of 10,000 boxes on wgpu's `noop` device, on one worker, seen from its cameras, each turned to 24 directions. What late latching
//! adds is compared with the same cameras that cannot be replaced, with and without the occlusion tests that late latching gives up.
//! `target/drawloom/late_latch.json` has the same.

use std::error::Error;
use std::f32::consts::{PI, TAU};
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use drawloom::Renderer;
use drawloom::backend::WgpuBackend;
use drawloom::glam::{DVec3, Quat};
use drawloom::process::Deferred;
use drawloom::quality::Quality;
use drawloom::scene::{Camera, CameraMotion, Changes, Scene, SceneRef};
use drawloom::task::Scheduler;
use drawloom_benches::arguments::ExtentArguments;
use drawloom_benches::city;
use drawloom_benches::results;
use drawloom_benches::statistics::median;
use drawloom_benches::table::Table;
use drawloom_testing::adapter;
use serde::Serialize;

const DIRECTIONS: u32 = 24;

/// A motion that a camera is allowed.
struct Allowance {
    name: &'static str,
    motion: Option<CameraMotion>,
    occlusion: Option<u32>,
}

#[derive(Serialize)]
struct Row {
    allowance: &'static str,
    /// The mean over all cameras and directions.
    objects: f64,
    record_microseconds: f64,
    /// Of the call of `replace_camera`, as far as the camera allows it.
    replace_microseconds: Option<f64>,
}

fn main() -> ExitCode {
    drawloom_output::exit_code(run())
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments: ExtentArguments = drawloom_output::parse_arguments();
    let (boxes, rounds) = if arguments.is_quick() { (500, 1) } else { (10_000, 15) };
    let scene = city::new(boxes, [960, 540])?;
    let of = |metres: f32, degrees: f32, milliseconds: u64| {
        Some(CameraMotion::from_speeds(metres, degrees.to_radians(), Duration::from_millis(milliseconds)))
    };
    let allowances = [
        Allowance { name: "none, with occlusion tests", motion: None, occlusion: Some(16) },
        Allowance { name: "none", motion: None, occlusion: None },
        Allowance { name: "0", motion: of(0.0, 0.0, 0), occlusion: None },
        Allowance { name: "5 m/s, 180°/s, 16 ms", motion: of(5.0, 180.0, 16), occlusion: None },
        Allowance { name: "5 m/s, 180°/s, 33 ms", motion: of(5.0, 180.0, 33), occlusion: None },
        Allowance { name: "30 m/s, 360°/s, 33 ms", motion: of(30.0, 360.0, 33), occlusion: None },
    ];
    let rows = allowances.iter().map(|allowance| measure(&scene, allowance, rounds)).collect::<Result<Vec<_>, _>>()?;

    let mut table = Table::new(&["motion", "objects", "share of none", "record, µs", "replace_camera, µs"]);
    for Row { allowance, objects, record_microseconds, replace_microseconds } in &rows {
        let replace = replace_microseconds.map_or_else(String::new, |time| format!("{time:.2}"));
        let share = format!("{:.3}", objects / rows[1].objects);
        table.row([
            (*allowance).to_owned(),
            format!("{objects:.0}"),
            share,
            format!("{record_microseconds:.0}"),
            replace,
        ]);
    }
    table.print();
    if !arguments.is_quick() {
        results::write_json("late_latch.json", &rows)?;
    }
    Ok(())
}

fn measure(scene: &Scene, allowance: &Allowance, rounds: usize) -> Result<Row, Box<dyn Error>> {
    let (device, queue) = adapter::noop_device()?;
    let quality = Quality { occlusion: allowance.occlusion, ..Quality::balanced() };
    let builder = Renderer::builder(WgpuBackend::new(device, queue)?).deferred(Deferred::to_picture()).quality(quality);
    let (mut renderer, submitter) = builder.build(Arc::new(Scheduler::new(1)?))?;
    let (mut objects, mut record_times, mut replace_times) = (Vec::new(), Vec::new(), Vec::new());
    for round in 0..=rounds {
        for camera in &scene.cameras {
            for direction in 0..DIRECTIONS {
                let turn = Quat::from_rotation_y(direction as f32 / DIRECTIONS as f32 * TAU);
                let orientation = (turn * camera.orientation).normalize();
                let camera = Camera { orientation, late_latch: allowance.motion, ..camera.clone() };
                let is_first = record_times.is_empty() && objects.is_empty();
                let changes = if is_first { Changes::Unknown } else { Changes::NONE };
                let cameras = [camera.clone()];
                let start = Instant::now();
                let mut recorded = renderer.record(SceneRef { cameras: &cameras, changes, ..scene.as_scene_ref() })?;
                let record = start.elapsed();
                objects.push(recorded.statistics().views[0].visible as f64);
                // The first round warms up.
                if round > 0 {
                    record_times.push(record.as_secs_f64() * 1e6);
                }
                if let Some(motion) = allowance.motion {
                    let newer = at_the_bounds(&camera, motion);
                    let start = Instant::now();
                    recorded.replace_camera(0, &newer)?;
                    replace_times.push(start.elapsed().as_secs_f64() * 1e6);
                }
                submitter.submit(recorded)?;
            }
        }
    }
    Ok(Row {
        allowance: allowance.name,
        objects: objects.iter().sum::<f64>() / objects.len() as f64,
        record_microseconds: median(record_times),
        replace_microseconds: allowance.motion.map(|_| median(replace_times)),
    })
}

/// The camera that has moved and turned as far as it may.
fn at_the_bounds(camera: &Camera, motion: CameraMotion) -> Camera {
    let turn = Quat::from_rotation_y(motion.angle.min(PI));
    let position = camera.position + DVec3::X * f64::from(motion.distance);
    Camera { position, orientation: (turn * camera.orientation).normalize(), ..camera.clone() }
}
