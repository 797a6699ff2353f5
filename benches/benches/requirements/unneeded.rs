//! What a frame costs whose pipeline keeps every process, beside one that has only what the scene requires.

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{WgpuBackend, WgpuSubmission};
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::Deferred;
use drawloom::scene::{Camera, ClipPlane, LayerMask, Material, Mesh, RenderObject, Scene, SceneError, ViewKind};
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter};
use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::{Harness, Rounds, WARM_UP};
use drawloom_benches::mirror::{self, Mirror};
use drawloom_benches::statistics::median_duration;
use drawloom_benches::stopwatch::timed_frame;
use drawloom_benches::table::Table;
use drawloom_testing::scenes::sized;
use indicatif::ProgressBar;
use serde::Serialize;

/// The frames of one scene and pipeline.
#[derive(Serialize)]
pub struct Row {
    backend: BackendName,
    scene: &'static str,
    /// Whether the pipeline keeps what the scene does not require.
    keeps_all: bool,
    views: usize,
    passes: usize,
    pipelines: usize,
    targets: usize,
    mebibytes: f64,
    /// The median time until the device is idle; on noop that of the processor.
    milliseconds: f64,
}

/// Measures frames of a scene without lights, unchanged, and with a mirror, each with both pipelines in turn.
pub fn measure(
    backend: BackendName,
    scene: impl Fn() -> Result<Scene, SceneError>,
    rounds: usize,
    size: [u32; 2],
    progress: &ProgressBar,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let mut rows = Vec::new();
    // One for all, because the workers of others would wait beside it.
    let scheduler = Arc::new(Scheduler::new(2)?);
    for (name, scene) in variants([scene()?, scene()?, scene()?], size)? {
        let runners = [true, false].map(|keeps_all| Runner::new((backend, &scheduler), &scene, keeps_all));
        let mut runners = runners.into_iter().collect::<Result<Vec<_>, _>>()?;
        let mut times = Harness::new(Rounds { warm_up: WARM_UP, measured: rounds }, progress)
            .measure(&mut runners, |runner, _| runner.frame(&scene))?
            .into_iter();
        for runner in &mut runners {
            let times = times.next().unwrap_or_default();
            rows.push(runner.row((backend, name), &scene, &times)?);
        }
    }
    Ok(rows)
}

/// Prints the rows.
pub fn print(rows: &[Row]) {
    let mut table =
        Table::new(&["backend", "scene", "processes", "views", "passes", "pipelines", "targets", "MiB", "ms"]);
    for row in rows {
        table.row([
            row.backend.name().to_owned(),
            row.scene.to_owned(),
            if row.keeps_all { "all" } else { "required" }.to_owned(),
            row.views.to_string(),
            row.passes.to_string(),
            row.pipelines.to_string(),
            row.targets.to_string(),
            format!("{:.1}", row.mebibytes),
            format!("{:.3}", row.milliseconds),
        ]);
    }
    table.print();
}

fn variants(
    [mut bare, mut whole, mut mirrored]: [Scene; 3],
    size: [u32; 2],
) -> Result<[(&'static str, Scene); 3], Box<dyn Error>> {
    for scene in [&mut bare, &mut whole, &mut mirrored] {
        let camera = scene.cameras.first().cloned().ok_or("the scene has no camera")?;
        scene.cameras = vec![sized(camera, size)];
    }
    bare.lights.clear();
    let plane = ClipPlane { point: DVec3::Y * 0.06, normal: Vec3::Y };
    let reflected = mirrored.cameras[0].reflected(mirror::VIEW, plane);
    mirrored.cameras.push(Camera { kind: ViewKind::Reflection, layers: LayerMask::layer(0), ..reflected });
    let (mesh, material) = (mirrored.add(Mesh::cuboid("water", Vec3::ONE)?)?, mirrored.add(Material::default())?);
    let water = RenderObject::new(mesh, material, plane.point);
    mirrored.add_object(RenderObject { layers: mirror::LAYER, scale: Vec3::new(4.0, 0.01, 4.0), ..water })?;
    Ok([("without lights", bare), ("as it is", whole), ("with a mirror", mirrored)])
}

struct Runner {
    keeps_all: bool,
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    waits: bool,
}

impl Runner {
    fn new(
        (backend, scheduler): (BackendName, &Arc<Scheduler>),
        scene: &Scene,
        keeps_all: bool,
    ) -> Result<Self, Box<dyn Error>> {
        let mut deferred = Deferred::to_picture();
        if keeps_all {
            deferred = deferred.names().into_iter().fold(deferred, Deferred::keep);
        }
        let mut builder = Renderer::builder(backend.open()?.transient_targets()).pipeline(deferred);
        if scene.cameras.iter().any(|camera| camera.kind == ViewKind::Reflection) {
            builder = builder.process(Mirror);
        }
        let (renderer, submitter) = builder.build(Arc::clone(scheduler))?;
        Ok(Self { keeps_all, renderer, submitter, waits: backend == BackendName::Adapter })
    }

    fn frame(&mut self, scene: &Scene) -> Result<Duration, Box<dyn Error>> {
        let waits = self.waits;
        let wait = |submission: &WgpuSubmission| if waits { submission.wait() } else { Ok(()) };
        let (_, time) = timed_frame(&mut self.renderer, &self.submitter, scene.as_scene_ref(), wait)?;
        Ok(if waits { time.borrowed + time.device } else { time.cpu })
    }

    fn row(
        &mut self,
        (backend, name): (BackendName, &'static str),
        scene: &Scene,
        times: &[Duration],
    ) -> Result<Row, Box<dyn Error>> {
        let recorded = self.renderer.record(scene.as_scene_ref())?;
        let passes = recorded.queues().iter().map(|queue| queue.passes.len()).sum();
        let views = recorded.statistics().views.len();
        self.submitter.submit(recorded)?;
        let resources = self.renderer.backend().resources();
        Ok(Row {
            backend,
            scene: name,
            keeps_all: self.keeps_all,
            views,
            passes,
            pipelines: resources.pipelines,
            targets: resources.targets,
            mebibytes: resources.target_bytes as f64 / f64::from(1 << 20),
            milliseconds: median_duration(times.iter().copied()).as_secs_f64() * 1e3,
        })
    }
}
