//! Budgets of streaming: "no limit" streams everything.

use std::thread;
use std::time::{Duration, Instant};

use drawloom::backend::{PipelineLibrary, StreamingBudget, StreamingStatistics, WgpuBackend};
use drawloom::process::Deferred;
use drawloom_testing::adapter::noop_device;
use libtest_mimic::Failed;

use super::NumberCase;
use crate::fixture::{DURATIONS, Fixture, LONG, ensure, noop_backend, refused, scene};

pub const CASES: &[NumberCase] = &[
    NumberCase {
        name: "streaming_without_limits_streams_everything",
        numbers: &[
            "backend::StreamingBudget::mesh_bytes",
            "backend::StreamingBudget::texture_bytes",
            "backend::StreamingBudget::upload_bytes_per_frame",
            "backend::StreamingBudget::upload_time_per_frame",
        ],
        check: budgets,
    },
    NumberCase { name: "streaming_budgets_that_are_too_small_are_named", numbers: &[], check: too_small },
    NumberCase {
        name: "priorities_of_any_height",
        numbers: &["scene::Assets::set_priority", "scene::Scene::set_priority"],
        check: priorities,
    },
];

/// Values that mean no limit, or overflow if they are doubled or added to.
const NO_LIMITS: [u64; 3] = [u64::MAX, 1 << 63, u64::MAX / 2 + 2];

fn budgets() -> Result<(), Failed> {
    let usual = StreamingBudget::default();
    let mut all = vec![StreamingBudget {
        mesh_bytes: u64::MAX,
        texture_bytes: u64::MAX,
        upload_bytes_per_frame: u64::MAX,
        upload_time_per_frame: Duration::MAX,
    }];
    for bytes in NO_LIMITS {
        all.push(StreamingBudget { mesh_bytes: bytes, ..usual });
        all.push(StreamingBudget { texture_bytes: bytes, ..usual });
        all.push(StreamingBudget { upload_bytes_per_frame: bytes, ..usual });
    }
    let times = DURATIONS.into_iter().filter(|time| !time.is_zero());
    all.extend(times.map(|upload_time_per_frame| StreamingBudget { upload_time_per_frame, ..usual }));
    all.push(StreamingBudget {
        mesh_bytes: StreamingBudget::MIN_BYTES,
        texture_bytes: StreamingBudget::MIN_BYTES,
        upload_bytes_per_frame: StreamingBudget::MIN_UPLOAD_BYTES,
        upload_time_per_frame: Duration::from_nanos(1),
    });
    let (device, queue) = noop_device()?;
    let library = PipelineLibrary::new(device, queue);
    for budget in all {
        for workers in [1, 2] {
            expect_streamed(library.backend()?, budget, workers)?;
        }
    }
    Ok(())
}

/// Fails unless the mesh and the texture of the usual scene arrive.
fn expect_streamed(backend: WgpuBackend, budget: StreamingBudget, workers: usize) -> Result<(), Failed> {
    let mut fixture = Fixture::new(backend.stream_resources(budget)?, workers, Deferred::to_picture())?;
    let (start, scene) = (Instant::now(), scene());
    loop {
        let submitted = fixture.draw(&scene)?;
        let statistics = fixture.renderer.backend().streaming_statistics().ok_or("it streams")?;
        let StreamingStatistics { meshes: 1, textures: 1, .. } = statistics else {
            let what = format!("{budget:?} on {workers} workers: {statistics:?}");
            ensure(start.elapsed() < LONG, what)?;
            thread::sleep(Duration::from_micros(200));
            continue;
        };
        return ensure(submitted.statistics.scene_issues.is_empty(), "everything is drawn");
    }
}

fn too_small() -> Result<(), Failed> {
    let usual = StreamingBudget::default();
    for (budget, field) in [
        (StreamingBudget { mesh_bytes: 0, ..usual }, "mesh_bytes = 0"),
        (StreamingBudget { mesh_bytes: StreamingBudget::MIN_BYTES - 1, ..usual }, "mesh_bytes = 1048575"),
        (StreamingBudget { texture_bytes: 0, ..usual }, "texture_bytes = 0"),
        (StreamingBudget { upload_bytes_per_frame: 0, ..usual }, "upload_bytes_per_frame = 0"),
        (StreamingBudget { upload_time_per_frame: Duration::ZERO, ..usual }, "upload_time_per_frame = 0"),
    ] {
        refused(budget.check(), field)?;
        refused(noop_backend()?.stream_resources(budget), field)?;
    }
    // As nanoseconds they are a multiple of 2⁶⁴, which is not 0.
    let time = Duration::from_nanos(u64::MAX) + Duration::from_nanos(1);
    Ok(StreamingBudget { upload_time_per_frame: time, ..usual }.check()?)
}

fn priorities() -> Result<(), Failed> {
    for priority in [i32::MIN, -1, 0, i32::MAX] {
        let mut fixture =
            Fixture::new(noop_backend()?.stream_resources(StreamingBudget::default())?, 1, Deferred::to_picture())?;
        let mut scene = scene();
        let meshes: Vec<_> = scene.assets().iter::<drawloom::scene::Mesh>().map(|(handle, _)| handle).collect();
        for mesh in meshes {
            scene.set_priority(mesh, priority)?;
        }
        let start = Instant::now();
        while fixture.renderer.backend().streaming_statistics().is_none_or(|statistics| statistics.meshes < 1) {
            fixture.draw(&scene)?;
            ensure(start.elapsed() < LONG, format_args!("nothing arrives with priority {priority}"))?;
        }
    }
    Ok(())
}
