//! Recording: from a scene to queues that are ready to submit.

use std::sync::Arc;

use parking_lot::RwLockReadGuard;

use super::jobs::JobsCache;
use super::kept_maps::KeptMaps;
use super::phase::{FrameContext, FrameTables, Recording};
use super::plans::Plans;
use super::recorded::{Recorded, ViewQueue};
use super::statistics::{Stage, StageClock};
use super::views::{ValidLights, views_of};
use super::{BuildError, FrameError, FrameStatistics, Granularity, RendererBuilder, ViewStatistics};
use crate::backend::{Backend, BackendError, FrameRequest};
use crate::command::DrawList;
use crate::process::{Deferred, FramePlan, Pass};
use crate::quality::{Quality, TransformPrecision};
use crate::raster::CulledTriangles;
use crate::scene::{SceneError, SceneRef};
use crate::task::Scheduler;
use crate::view::{Rejection, RejectionReason, RenderView};

/// Produces frames: records a scene on all workers, and gives it back when that is done.
///
/// ```
/// use std::sync::Arc;
///
/// use drawloom::backend::NullBackend;
/// use drawloom::glam::DVec3;
/// use drawloom::process::Deferred;
/// use drawloom::scene::{Camera, Material, Mesh, RenderObject, Scene, Topology, Vertex};
/// use drawloom::task::Scheduler;
/// use drawloom::Renderer;
///
/// let scheduler = Arc::new(Scheduler::new(2)?);
/// let (mut renderer, submitter) = Renderer::builder(NullBackend).deferred(Deferred::to_picture()).build(scheduler)?;
///
/// let mut scene = Scene::new();
/// let corner = |x, y| Vertex { position: [x, y, 0.0], normal: [0.0, 0.0, 1.0], uv: [0.0; 2] };
/// let corners = vec![corner(-1.0, -1.0), corner(1.0, -1.0), corner(0.0, 1.0)];
/// let mesh = scene.add(Mesh::new("triangle", Topology::TriangleList, corners, vec![0, 1, 2])?)?;
/// let material = scene.add(Material::default())?;
/// scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO))?;
/// scene.cameras.push(Camera::looking_at("main", DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO));
///
/// let recorded = renderer.record(scene.as_scene_ref())?;
/// // From here on the scene may change again.
/// let submitted = submitter.submit(recorded)?;
/// assert!(submitted.statistics.views[0].visible > 0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Renderer<B: Backend> {
    backend: Arc<B>,
    plans: Plans,
    granularity: Granularity,
    merges: bool,
    quality: Quality,
    /// Whether the pipeline was told that quality.
    pipeline_knows_quality: bool,
    scheduler: Arc<Scheduler>,
    jobs: JobsCache,
    tables: FrameTables,
    kept_maps: KeptMaps,
    /// One for each pass of the latest frame.
    recordings: Vec<Recording<B>>,
    /// What the last warnings were about.
    told: Vec<Rejection>,
}

impl<B: Backend> Renderer<B> {
    /// Starts to put a renderer together.
    pub fn builder(backend: B) -> RendererBuilder<B> {
        RendererBuilder::new(backend)
    }

    pub(super) fn new(
        backend: Arc<B>,
        plans: Plans,
        granularity: Granularity,
        merges: bool,
        quality: Option<Quality>,
        scheduler: Arc<Scheduler>,
    ) -> Self {
        let (jobs, tables) = (JobsCache::default(), FrameTables::default());
        let (quality, pipeline_knows_quality) = (quality.unwrap_or_default(), quality.is_some());
        let (kept_maps, recordings, told) = (KeptMaps::default(), Vec::new(), Vec::new());
        Self {
            backend,
            plans,
            granularity,
            merges,
            quality,
            pipeline_knows_quality,
            scheduler,
            jobs,
            tables,
            kept_maps,
            recordings,
            told,
        }
    }

    /// Records a frame: everything up to submission. The calling thread works too.
    ///
    /// Objects, lights and textures that cannot be drawn are left out, counted in the statistics, and warned of through
    /// `tracing` when their number changes.
    ///
    /// # Errors
    /// If the scene has no camera, a camera that cannot be, or slices of different lengths; if the device refuses
    /// something; if a process fails or panics. The next frame is not affected.
    pub fn record(&mut self, scene: SceneRef<'_>) -> Result<Recorded<B>, FrameError> {
        let frame_number = self.scheduler.timeline().begin_frame();
        let _span_of_timeline = self.scheduler.timeline().span_of(frame_number, "record");
        let span = tracing::debug_span!(target: "drawloom", "record", objects = scene.object_count());
        let _entered = span.enter();
        check(&scene)?;
        self.tables.objects.configure(self.quality.culling);
        self.tables.objects.reset(scene.object_count());
        let mut lights = ValidLights::new(&scene, self.tables.objects.rejections(), self.quality.light_cut_off);
        let plan = self.plans.follow(&SceneRef { lights: &lights.lights, ..scene })?;
        let mut views = views_of(&scene, &lights, self.plans.shadow_maps(), &plan)?;
        let interval = self.quality.shadows.interval;
        let maps = self.kept_maps.follow(interval, &plan, &mut views, &mut lights.lights);
        let scene = SceneRef { lights: &lights.lights, ..scene };
        let draws = plan.draws()?;
        self.tables.asking.follow(scene.assets);
        // What is told of places relative to the camera is not so of absolute ones.
        let culls_triangles = self.tables.asking.any() && self.quality.transforms == TransformPrecision::CameraRelative;
        let jobs = self.jobs.find(&plan, &draws, &views, self.quality.occlusion, culls_triangles)?;
        jobs.reset(&mut self.tables.passes, scene.object_count());
        self.tables.reset(views.len(), self.scheduler.workers());
        self.tables.reset_occlusion(&scene, &views, jobs, self.quality.occlusion);
        let clock = StageClock::default();
        clock.measure(Stage::Visibility, || {
            let shadows = self.plans.tells_shadowed_apart();
            for (view, lights) in views.iter().zip(&mut self.tables.lights) {
                lights.fill(view, scene.lights, &views, shadows);
            }
        });
        let request = FrameRequest {
            plan: &plan,
            draws: &draws,
            views: &views,
            lights: &self.tables.lights,
            passes: &jobs.passes,
            scene: &scene,
            quality: &self.quality,
            rejections: self.tables.objects.rejections(),
        };

        let uploaded_before = self.backend.uploaded_bytes();
        let frame = clock.measure(Stage::Record, || self.backend.begin(&request)).0?;
        self.recordings.resize_with(request.passes.len(), Recording::default);
        self.recordings.iter_mut().for_each(|recording| drop(recording.take()));
        let context = FrameContext {
            request: &request,
            tables: &self.tables,
            granularity: self.granularity,
            merges: self.merges,
            backend: &*self.backend,
            frame: &frame,
            recordings: &self.recordings,
            clock: &clock,
            costs: &jobs.costs,
            occluders: &jobs.occluders,
            culls_triangles,
            workers: self.scheduler.workers(),
        };
        let outcome = jobs.schedule.run(&self.scheduler, &context);
        match outcome {
            Ok(()) => {
                jobs.costs.learn();
                self.tables.learn_payoffs(&jobs.occluders, &mut jobs.payoffs);
            }
            Err(_) => jobs.costs.forget_frame(),
        }
        outcome?;

        let queues = queues_of(&request, &mut self.recordings)?;
        let uploaded = self.backend.uploaded_bytes().saturating_sub(uploaded_before);
        self.scheduler.timeline().count("bytes uploaded", uploaded as f64);
        let statistics = statistics_of(&request, &self.tables, uploaded, &clock);
        let keeps_maps = views.iter().any(|view| view.is_cached);
        warn_of_changes(&statistics.rejections, keeps_maps, &mut self.told);
        let on_its_way = self.kept_maps.keep(maps);
        Ok(Recorded { queues, frame, statistics, backend: Arc::clone(&self.backend), frame_number, on_its_way })
    }

    /// Draws with another deferred pipeline from the next frame on: with other settings, or other steps. Pipelines that both
    /// have in common are kept.
    ///
    /// # Errors
    /// If the processes do not make a frame; then nothing changes.
    pub fn set_deferred(&mut self, deferred: Deferred) -> Result<(), BuildError> {
        self.plans = self.plans.with_deferred(deferred)?;
        self.pipeline_knows_quality = false;
        self.kept_maps.forget();
        Ok(())
    }

    /// Draws with another quality from the next frame on; that of the deferred pipeline is another as well.
    ///
    /// # Errors
    /// If there can be no frames of that quality; then nothing changes.
    pub fn set_quality(&mut self, quality: Quality) -> Result<(), BuildError> {
        quality.check()?;
        if quality == self.quality && self.pipeline_knows_quality {
            return Ok(());
        }
        if let Some(deferred) = self.plans.deferred() {
            self.plans = self.plans.with_deferred(deferred.clone().quality(&quality))?;
        }
        (self.quality, self.pipeline_knows_quality) = (quality, true);
        self.kept_maps.forget();
        Ok(())
    }

    /// How accurate frames are. Where nobody has said, a deferred pipeline may differ from it in what it was told itself.
    pub fn quality(&self) -> &Quality {
        &self.quality
    }

    /// What the last frame drew in one view by one process, which may be nothing if it failed; `None` where that process draws
    /// no commands there, or did not because the view was kept.
    pub fn draw_list(&self, process: &str, view: usize) -> Option<RwLockReadGuard<'_, DrawList>> {
        let jobs = self.jobs.latest()?;
        let name = |pass: &Pass| jobs.plan.processes()[pass.process].process.name();
        let is_wanted = |pass: &Pass| pass.view == view && name(pass) == process;
        let table = self.tables.passes.get(jobs.passes.iter().position(is_wanted)?)?;
        table.selection.map(|_| table.list.read())
    }

    /// The processes of the last frame and their targets; before the first one, those of an empty scene.
    pub fn plan(&self) -> &FramePlan {
        self.plans.current()
    }

    /// For how many different requirements of scenes plans are kept.
    pub fn plan_count(&self) -> usize {
        self.plans.count()
    }

    /// The last frame's jobs as a graph in the DOT language; `None` before the first frame.
    pub fn jobs_to_dot(&self) -> Option<String> {
        self.jobs.latest().map(|jobs| jobs.schedule.to_dot())
    }

    /// The scheduler whose workers record, and whose [timeline](Scheduler::timeline) records them.
    pub fn scheduler(&self) -> &Arc<Scheduler> {
        &self.scheduler
    }

    /// What draws.
    pub fn backend(&self) -> &B {
        &self.backend
    }
}

/// One queue for each view, its passes in the order of the plan.
fn queues_of<B: Backend>(
    request: &FrameRequest<'_>,
    recordings: &mut [Recording<B>],
) -> Result<Vec<ViewQueue<B::Commands>>, FrameError> {
    // A process is in a view once at most.
    let queue = |view| ViewQueue { view, passes: Vec::with_capacity(request.plan.processes().len()) };
    let mut queues: Vec<_> = (0..request.views.len()).map(queue).collect();
    for (&pass, recording) in request.passes.iter().zip(recordings) {
        let lost = || BackendError::BrokenRule { rule: "every pass is finished before its frame is".to_owned() };
        queues[pass.view].passes.push((pass, recording.take().ok_or_else(lost)?));
    }
    Ok(queues)
}

fn statistics_of(
    request: &FrameRequest<'_>,
    tables: &FrameTables,
    uploaded: u64,
    clock: &StageClock,
) -> FrameStatistics {
    let of_view = |(index, view): (usize, &RenderView)| {
        let mut statistics = ViewStatistics {
            name: view.name().to_owned(),
            kind: view.kind(),
            visible: tables.visible[index].count(),
            occluded: tables.occlusion[index].hidden(),
            lights: request.lights[index].gpu_lights().len(),
            commands: 0,
            batches: 0,
            bundles: 0,
            culled_triangles: CulledTriangles::default(),
        };
        for (table, _) in tables.passes.iter().zip(request.passes).filter(|(_, pass)| pass.view == index) {
            let list = table.list.read();
            statistics.commands += list.objects.len();
            statistics.batches += list.batches.len();
            statistics.bundles += list.bundle_count();
            statistics.culled_triangles += table.triangles.read().culled();
        }
        statistics
    };
    FrameStatistics {
        objects: request.scene.object_count(),
        lights: request.scene.lights.len(),
        views: request.views.iter().enumerate().map(of_view).collect(),
        uploaded,
        stages: clock.times(),
        rejections: request.rejections.list(),
    }
}

/// Warns of what is left out or cannot be drawn as asked, once and not in every frame. What only shadow maps find out is not
/// forgotten by a frame that keeps those there are.
fn warn_of_changes(rejections: &[Rejection], keeps_maps: bool, told: &mut Vec<Rejection>) {
    // A light that is switched off is nothing to warn of.
    let is_news = |rejection: &&Rejection| rejection.reason != RejectionReason::DarkLight && !told.contains(rejection);
    for rejection in rejections.iter().filter(is_news) {
        let (reason, count, first) = (rejection.reason.name(), rejection.count, rejection.first);
        tracing::warn!(target: "drawloom", count, first, "not drawn as asked: {reason}");
    }
    told.retain(|old| keeps_maps && old.reason == RejectionReason::CoarseEdges);
    told.extend(
        rejections.iter().filter(|rejection| !(keeps_maps && rejection.reason == RejectionReason::CoarseEdges)),
    );
}

/// What must hold of a scene as a whole. Single objects and lights are left out instead.
fn check(scene: &SceneRef<'_>) -> Result<(), FrameError> {
    scene.check_lengths()?;
    let objects = scene.object_count();
    if u32::try_from(objects).is_err() {
        return Err(FrameError::TooManyObjects { objects });
    }
    if scene.cameras.is_empty() {
        return Err(FrameError::NoView);
    }
    for camera in scene.cameras {
        let [width, height] = camera.size;
        if width == 0 || height == 0 {
            return Err(FrameError::EmptyTarget { view: camera.name.clone(), width, height });
        }
        camera.check()?;
    }
    for (name, color) in [("ambient", scene.ambient), ("background", scene.background)] {
        if !color.is_finite() || color.min_element() < 0.0 {
            return Err(SceneError::InvalidColor { name }.into());
        }
    }
    Ok(())
}
