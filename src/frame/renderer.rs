//! The renderer: from a scene to recorded queues.

use std::sync::Arc;

use parking_lot::RwLockReadGuard;

use super::encoders::{FrameEncoders, PassRecording, reset_recordings};
use super::nodes::borrowed_nodes::NodeDeclarations;
use super::plan_cache::PlanCache;
use super::reconfigure::BackendMaintenance;
use super::recorded_frame::{FrameFences, RecordedFrame, view_queues};
use super::scene_check::{ChangeCheck, SceneCapacity, check_scene, find_items};
use super::stages::context::FrameContext;
use super::stages::culling::CullingOptions;
use super::stages::granularity::{StageClock, StageGroup};
use super::stages::stage_graph::FrameFeatures;
use super::stages::stage_graph::StageGraphCache;
use super::stages::statistics::Warnings;
use super::stages::tables::FrameTables;
use super::views::view_cache::ViewCache;
use super::views::view_visibility::count_unknown_objects;
use super::views::{FrameViews, MapSettings, ValidLights};
use super::{CpuNode, FrameError, FrameStatistics, Granularity};
use crate::backend::{Backend, CallPanic, FrameRequest, GuardedBackend};
use crate::command::DrawList;
use crate::process::{Draws, FramePlan, Items, Pass, Requirements, SceneContents};
use crate::quality::Quality;
use crate::scene::SceneRef;
use crate::task::{BackgroundJob, JobPanic, Scheduler, catch};
use crate::timeline::TuningChoice;
use crate::unwind::CaughtSpan;
use crate::view::{RenderView, SceneIssues, ViewRegistry, possible_draw_states};

/// What an engine lends for one frame: see [`Renderer::record_with`].
#[derive(Clone, Copy)]
pub struct FrameInputs<'a> {
    /// The scene.
    pub scene: SceneRef<'a>,
    /// Work of the engine's own among the jobs of the frame.
    pub nodes: &'a [&'a dyn CpuNode],
    /// Draws of the engine's own: the items of each process that [draws items](Draws::Items), in any order.
    pub items: &'a [Items<'a>],
}

impl<'a> FrameInputs<'a> {
    /// A scene, and nothing else.
    pub fn new(scene: SceneRef<'a>) -> Self {
        Self { scene, nodes: &[], items: &[] }
    }
}

/// What a frame draws of its inputs.
#[derive(Clone, Copy)]
pub(super) struct FrameScope {
    /// Whether objects that [need transparency](Requirements::needs_transparency) are drawn.
    pub(super) transparency: bool,
    /// Whether a process whose items are not lent draws none.
    pub(super) lacks_items: bool,
}

impl FrameScope {
    const WHOLE: Self = Self { transparency: true, lacks_items: false };
}

/// Produces frames: records a scene on all workers. The scene is borrowed until recording is complete.
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
/// let (mut renderer, submitter) = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).build(scheduler)?;
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
    pub(super) backend: GuardedBackend<B>,
    pub(super) plans: PlanCache,
    granularity: Granularity,
    instancing: bool,
    pub(super) quality: Quality,
    /// Whether the pipeline has that quality; otherwise it has settings of its own.
    pub(super) pipeline_has_quality: bool,
    scheduler: Arc<Scheduler>,
    pub(super) graphs: StageGraphCache<B>,
    view_registry: ViewRegistry,
    pub(super) tables: FrameTables,
    pub(super) capacity: SceneCapacity,
    pub(super) view_cache: ViewCache,
    /// One for each pass of the latest frame.
    pub(super) recordings: Vec<PassRecording<B>>,
    encoders: FrameEncoders,
    /// What the engine chose for the next frame.
    choices: Vec<TuningChoice>,
    node_declarations: NodeDeclarations,
    warnings: Warnings,
    change_check: ChangeCheck,
    pub(super) backend_maintenance: BackendMaintenance,
    /// Whether the histories of the next frame are empty.
    forgets_histories: bool,
}

impl<B: Backend> Renderer<B> {
    /// The most plans that are kept. Of more, the one that was used longest ago is dropped, and compiled again when a
    /// scene requires it.
    pub const MAX_PLANS: usize = PlanCache::MAX_PLANS;

    pub(super) fn new(
        backend: GuardedBackend<B>,
        plans: PlanCache,
        granularity: Granularity,
        instancing: bool,
        quality: Option<Quality>,
        scheduler: Arc<Scheduler>,
    ) -> Self {
        Self {
            backend,
            plans,
            granularity,
            instancing,
            quality: quality.unwrap_or_default(),
            pipeline_has_quality: quality.is_some(),
            scheduler,
            graphs: StageGraphCache::default(),
            view_registry: ViewRegistry::default(),
            tables: FrameTables::default(),
            capacity: SceneCapacity::default(),
            view_cache: ViewCache::default(),
            recordings: Vec::new(),
            encoders: FrameEncoders::default(),
            choices: Vec::new(),
            node_declarations: NodeDeclarations::default(),
            warnings: Warnings::default(),
            change_check: ChangeCheck::default(),
            backend_maintenance: BackendMaintenance::default(),
            forgets_histories: false,
        }
    }

    /// Records a frame: everything up to submission. The calling thread works too.
    ///
    /// What is derived from an object is kept for the next frame. [`SceneRef::changes`] says which objects changed
    /// since the last call.
    ///
    /// What cannot be drawn, or [has no room](Backend::limits), is left out, counted and named in the
    /// [statistics](FrameStatistics::scene_issues), and warned of when its number changes; everything else is drawn. A
    /// process that declares what its [raw pass](crate::process::RawPassResources) never asks for is warned of once.
    ///
    /// # Errors
    /// If the scene cannot be drawn as a whole: no camera or an invalid one, slices of different lengths, an invalid
    /// ambient light or background; if the processes make no frame of it; if the device refuses
    /// something; if a process fails or panics: see [`FrameError`]. The next frame is not affected.
    pub fn record(&mut self, scene: SceneRef<'_>) -> Result<RecordedFrame<B>, FrameError> {
        self.record_part(&FrameInputs::new(scene), FrameScope::WHOLE)
    }

    /// Records a frame as [`record`](Self::record) does, with work and draws of the engine's own.
    ///
    /// # Errors
    /// As [`record`](Self::record). If the nodes make no graph, because some wait for each other in a circle, one reads
    /// what nobody writes, two write the same without an order, or two have the same name; if a node fails or panics.
    /// If the items do not fit the processes that draw them, or code that records them fails or panics. The error names
    /// the node or the process, and the next frame is not affected.
    pub fn record_with(&mut self, inputs: FrameInputs<'_>) -> Result<RecordedFrame<B>, FrameError> {
        self.record_part(&inputs, FrameScope::WHOLE)
    }

    /// Records a frame of these inputs, or what a warm-up draws of it.
    ///
    /// # Errors
    /// As [`record_with`](Self::record_with).
    pub(super) fn record_part(
        &mut self,
        inputs: &FrameInputs<'_>,
        scope: FrameScope,
    ) -> Result<RecordedFrame<B>, FrameError> {
        let choices = std::mem::take(&mut self.choices);
        // Calls of the engine's code have errors that name them. Should one have been forgotten, the frame is abandoned
        // all the same.
        let recorded = catch(|| {
            let recorded = self.record_frame(inputs, choices, scope)?;
            self.backend_maintenance.start(&self.backend, &self.scheduler)?;
            Ok(recorded)
        });
        let recorded = recorded.unwrap_or_else(|JobPanic { message, .. }| {
            Err(FrameError::Panicked { stage: String::from("the recording of the frame"), message })
        });
        match recorded {
            Ok(recorded) => {
                self.view_registry.end_frame();
                self.tables.end_frame();
                Ok(recorded)
            }
            Err(error) => Err(self.abandon_frame(error)),
        }
    }

    /// Ends a frame that failed, at whatever point: the next one relies on nothing that this one was told or has
    /// derived.
    fn abandon_frame(&mut self, error: FrameError) -> FrameError {
        self.tables.abandon_frame();
        self.graphs.discard_costs();
        self.recordings.iter_mut().for_each(PassRecording::clear);
        match self.backend.discard_frame() {
            Ok(()) => error,
            Err(CallPanic { message, .. }) => FrameError::DiscardPanicked { error: Box::new(error), message },
        }
    }

    /// Makes the next frame be drawn as if it were the first: [histories](crate::process::Declare::samples_previous)
    /// are empty, every view is drawn, and levels of detail are chosen without hysteresis. For a cut of the camera, or
    /// another world. Buffers that processes change keep what they hold.
    pub fn forget_previous_frames(&mut self) {
        self.view_cache = ViewCache::default();
        self.tables.levels.clear();
        self.forgets_histories = true;
    }

    /// Adds choices that the engine made by measured cost for the next frame, such as those of a
    /// [`ViewBudget`](crate::ViewBudget), to what that frame [reports](FrameStatistics::tuning).
    pub fn add_choices(&mut self, choices: impl IntoIterator<Item = TuningChoice>) {
        self.choices.extend(choices);
    }

    /// Compiles the shaders of frames of this scene, and of all that may follow when lights, blended objects and
    /// reflections come and go, and makes their pipelines for this scene's meshes and materials. Without this call that
    /// happens in the first frames that need them, as it still does for mirrored objects and for meshes in the engine's
    /// own buffers. Call it while the world is loaded, on any thread: it also finds what is wrong with the engine's
    /// processes. What drivers compile when something is first drawn is left to a [`WarmUp`](super::WarmUp).
    ///
    /// # Errors
    /// If a process panics, its draws do not fit its declaration, or its shader does not compile: the same errors as
    /// those of the first frame.
    pub fn prepare_pipelines(&mut self, scene: SceneRef<'_>) -> Result<(), FrameError> {
        self.preparation(&scene)?()
    }

    /// Does what [`prepare_pipelines`](Self::prepare_pipelines) does as a [background job](Scheduler::background),
    /// while frames go on: before a light is switched on, or glass comes into sight. Frames do not wait for it; one
    /// that needs a pipeline which is not there yet makes it itself. On a scheduler of one worker nobody is there to
    /// help: then the pipelines are made by this call.
    ///
    /// ```
    /// # use drawloom::{FrameError, Renderer, backend::Backend, scene::SceneRef};
    /// # fn load<B: Backend>(renderer: &mut Renderer<B>, next_room: SceneRef<'_>) -> Result<(), Box<dyn std::error::Error>> {
    /// let preparation = renderer.prepare_pipelines_in_background(next_room)?;
    /// // Some frames later:
    /// if preparation.is_finished() {
    ///     preparation.wait()??;
    /// }
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// If a process panics, or its draws do not fit its declaration. A shader that does not compile is an error of the
    /// job.
    pub fn prepare_pipelines_in_background(
        &mut self,
        scene: SceneRef<'_>,
    ) -> Result<BackgroundJob<Result<(), FrameError>>, FrameError> {
        let preparation = self.preparation(&scene)?;
        let job = self.scheduler.background(preparation);
        if self.scheduler.workers() == 1 {
            // Nobody may ever run it: the job and all that it owns would stay in the queue of the scheduler, which it
            // may own as well.
            job.run();
        }
        Ok(job)
    }

    /// A closure that makes the pipelines of this scene, and of those that may follow. It owns all that it needs, so
    /// that it can run in the background.
    fn preparation(
        &mut self,
        scene: &SceneRef<'_>,
    ) -> Result<impl FnOnce() -> Result<(), FrameError> + Send + use<B>, FrameError> {
        let transparency = Requirements::any_needs_transparency(scene);
        // The frames of the scene count what is left out.
        let ValidLights { lights, .. } = ValidLights::new(scene, &SceneIssues::default(), self.quality.light_cut_off);
        let contents = SceneContents { lights: &lights, transparency, cameras: scene.cameras };
        let plans = self.plans.plans_to_prepare(&contents)?;
        let mut states_of_plans = Vec::new();
        for plan in &plans {
            let states_of = |draws: &Draws<'_>| {
                draws.selection().map_or_else(Vec::new, |selection| possible_draw_states(selection, scene.assets))
            };
            states_of_plans.push(plan.draws()?.iter().map(states_of).collect::<Vec<_>>());
        }
        let (backend, quality) = (self.backend.clone(), self.quality);
        Ok(move || {
            for (plan, states) in plans.iter().zip(&states_of_plans) {
                let draws = plan.draws()?;
                backend.prepare_pipelines(plan, &draws, states, &quality)??;
            }
            Ok(())
        })
    }

    fn record_frame(
        &mut self,
        &FrameInputs { ref scene, nodes, items }: &FrameInputs<'_>,
        mut choices: Vec<TuningChoice>,
        scope: FrameScope,
    ) -> Result<RecordedFrame<B>, FrameError> {
        let frame_number = self.scheduler.timeline().begin_frame();
        let _timeline_span = self.scheduler.timeline().span_of(frame_number, "record");
        let objects = scene.object_count();
        let _span = CaughtSpan::new(|| tracing::debug_span!(target: "drawloom", "record", objects)).enter();
        if self.forgets_histories {
            self.backend.forget_histories()?;
            self.forgets_histories = false;
        }
        check_scene(scene)?;

        // Scene → views: one for each camera, and one for each shadow map.
        let limits = self.backend.limits()?;
        self.tables.objects.configure(self.quality.culling);
        self.capacity.begin_frame(&self.backend, limits, scene, &mut self.tables.objects, self.quality.vertices)?;
        count_unknown_objects(scene, self.tables.objects.scene_issues());
        let valid_lights = ValidLights::new(scene, self.tables.objects.scene_issues(), self.quality.light_cut_off);
        let transparency = self.tables.blended_object.update(scene, &self.tables.objects) && scope.transparency;
        let contents = SceneContents { lights: &valid_lights.lights, transparency, cameras: scene.cameras };
        let plan = self.plans.select(&contents)?;
        self.capacity.set_columns(plan.columns(), scene, &mut self.tables.objects);
        self.tables.blended_object.count_half_floats(scene, self.plans.lacks_float_blending(), &self.tables.objects);
        let interval = self.quality.shadows.interval;
        let maps = self.plans.shadow_maps().map(|maps| MapSettings { maps, interval, limits });
        let mut requested = FrameViews::new(scene, valid_lights, maps, &plan, self.tables.objects.scene_issues())?;
        self.view_registry.begin_frame(&mut requested.views);
        let is_imported = |view: &str| self.backend.imports_targets_of(view);
        let frame_views = Arc::new(self.view_cache.resolve(&plan, requested, is_imported)?);
        let FrameViews { views, lights, .. } = &*frame_views;

        // Views → the job graph of their stages, and what all its jobs share.
        let draws = plan.draws()?;
        plan.check_scene(&draws, scene, self.tables.objects.material_types())?;
        self.tables.culling.update(scene.assets, self.tables.objects.used_meshes());
        self.tables.mesh_levels.update(scene.assets, self.tables.objects.used_meshes());
        let culling = CullingOptions::new(&self.quality, &self.tables.culling);
        let features = FrameFeatures {
            culling,
            chooses_levels: self.quality.level_of_detail > 0.0 && !self.tables.mesh_levels.is_empty(),
            opaque_order: self.quality.opaque_order,
            has_static_groups: !scene.static_groups.is_empty(),
        };
        let nodes = self.node_declarations.lend(nodes)?;
        let graph = self.graphs.get(&plan, &draws, views, features, nodes)?;
        let (of_plan, of_views) = ((&*plan, &*draws), (&*graph.passes, &**views));
        find_items((items, scope.lacks_items), of_plan, of_views, &mut self.tables.items_of_passes)?;
        let workers = self.scheduler.workers();
        graph.begin_frame(&mut self.tables, scene, (views, &draws), &self.quality, workers, self.granularity)?;
        self.tables.begin_items(items, of_plan, of_views, self.quality.culling)?;
        let clock = StageClock::new(self.scheduler.timeline());
        let separate_shadowed_lights = self.plans.separates_shadowed_lights();
        let fill_lights = || self.tables.fill_lights(&frame_views, separate_shadowed_lights, limits);
        clock.measure(StageGroup::Visibility, fill_lights);
        let request = FrameRequest {
            plan: &plan,
            draws: &draws,
            views,
            lights,
            light_tables: &self.tables.lights,
            passes: &graph.passes,
            sampled_views: &graph.sampled_views,
            scene,
            items,
            items_of_passes: &self.tables.items_of_passes,
            objects: &self.tables.objects,
            list_capacity: self.tables.objects.len() + self.tables.static_groups.listed_objects(),
            generated: &nodes.declarations.generated,
            records_bundles: self.granularity.draws_per_job().is_some(),
            workers: self.scheduler.workers(),
            quality: &self.quality,
            limits,
            scene_issues: self.tables.objects.scene_issues(),
        };
        let uploaded_before = self.backend.uploaded_bytes()?;
        let frame = clock.measure(StageGroup::Record, || self.backend.begin(&request)).0??;
        reset_recordings(&mut self.recordings, request.passes.len());
        let shares_encoder = |pass| self.backend.shares_encoder(&frame, pass);
        self.encoders.begin_frame(request.passes.len(), shares_encoder)?;

        // Objects → visibility → fill → sort → instance → record, on all workers: `stages/mod.rs` lists them.
        let context = FrameContext {
            request: &request,
            tables: &self.tables,
            granularity: self.granularity,
            instancing: self.instancing,
            backend: &**self.backend.unguarded(),
            backend_frame: &frame,
            recordings: &self.recordings,
            encoders: &self.encoders,
            nodes,
            clock: &clock,
            costs: &graph.tuning.costs,
            occlusion: &graph.tuning.occlusion,
            culls_triangles: culling.culls_triangles(),
            workers,
            binning_passes: self.tables.passes.iter().filter(|table| table.mode.orders_by_bin).count(),
            sorted_before: self.tables.sorted_before(),
        };
        graph.schedule.always_parallel(self.granularity != Granularity::Adaptive);
        graph
            .schedule
            .run(&self.scheduler, &context)
            .map_err(|error| FrameError::of_run(error, |pass| graph.node_name("finish", pass, views)))?;
        if cfg!(debug_assertions) {
            self.change_check.check(&request)?;
        }
        let mut tuning = graph.tuning.update(graph.schedule.run_mode(), &self.tables, &self.backend, &frame)?;
        choices.append(&mut tuning.choices);
        tuning.choices = choices;
        self.scheduler.timeline().add_tuning(frame_number, &tuning);

        nodes.declarations.check_filled()?;
        // Record → per-camera queues, for the submitter.
        let queues = view_queues(&request, &mut self.recordings)?;
        let uploaded = self.backend.uploaded_bytes()?.saturating_sub(uploaded_before);
        self.scheduler.timeline().count("bytes uploaded", uploaded as f64);
        self.backend.counters(&mut |name, value| self.scheduler.timeline().count(name, value))?;
        let memory = (uploaded, self.backend.target_memory(&frame)?);
        let lights = frame_views.light_count();
        let statistics = FrameStatistics::new(&request, lights, &self.tables, memory, clock.times(), tuning);
        statistics.count_static_groups(self.scheduler.timeline());
        self.warnings.report(&statistics.scene_issues, views.iter().any(RenderView::is_cached));
        #[cfg(feature = "wgpu")]
        self.warnings.report_unrequested(&plan, &draws);
        let in_flight = self.view_cache.store(&plan, &frame_views);
        Ok(RecordedFrame {
            queues,
            submission_order: graph.passes.to_vec(),
            plan,
            frame,
            statistics,
            backend: self.backend.clone(),
            frame_number,
            in_flight,
            views: frame_views,
            fences: FrameFences::default(),
        })
    }

    /// The quality of frames. Before it is set, a pipeline may have settings of its own that differ.
    pub fn quality(&self) -> &Quality {
        &self.quality
    }

    /// Whether the pipeline has the settings of the [quality](Self::quality): false until a quality is set,
    /// and after [`set_pipeline`](Self::set_pipeline).
    pub fn pipeline_has_quality(&self) -> bool {
        self.pipeline_has_quality
    }

    /// What one process drew in one view, by index, in the latest frame that had stages; empty if one of them failed.
    /// `None` where the process draws neither commands nor items in that view, or the view was [cached](crate::scene::Redraw).
    pub fn draw_list(&self, process: &str, view: usize) -> Option<RwLockReadGuard<'_, DrawList>> {
        let graph = self.graphs.latest()?;
        let name = |pass: &Pass| graph.plan.processes()[pass.process_index].name.as_str();
        let is_wanted = |pass: &Pass| pass.view_index == view && name(pass) == process;
        let table = self.tables.passes.get(graph.passes.iter().position(is_wanted)?)?;
        table.mode.has_list().then(|| table.list.read())
    }

    /// The plan of the latest frame; before the first one, that of an empty scene.
    pub fn plan(&self) -> &FramePlan {
        self.plans.current()
    }

    /// The number of plans that are kept: one for each set of requirements that scenes have had lately, at most
    /// [`MAX_PLANS`](Self::MAX_PLANS).
    pub fn plan_count(&self) -> usize {
        self.plans.count()
    }

    /// The stage graph of the latest frame in the DOT language; `None` before the first frame.
    pub fn stage_graph_to_dot(&self) -> Option<String> {
        self.graphs.latest().map(|graph| graph.schedule.to_dot())
    }

    /// The scheduler whose workers record, and whose [timeline](Scheduler::timeline) shows them.
    pub fn scheduler(&self) -> &Arc<Scheduler> {
        &self.scheduler
    }

    /// The backend, which its submitters and frames share.
    pub fn backend(&self) -> &Arc<B> {
        self.backend.unguarded()
    }
}
