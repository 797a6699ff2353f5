//! The plan cache: one compiled plan for each set of requirements.

use std::collections::HashMap;
use std::sync::Arc;

use crate::process::{
    Contained, DeviceSupport, FramePlan, Pipeline, PipelineProcesses, PlanError, ProcessId, RenderProcess,
    Requirements, SceneContents, list_names,
};
use crate::quality::Quality;
use crate::scene::ViewKind;
use crate::task::{JobPanic, catch};
use crate::view::ShadowMaps;

/// What the plans of a renderer are made of.
#[derive(Clone, Default)]
pub(super) struct PlanSources {
    pub(super) pipeline: Option<Contained<Arc<dyn Pipeline>>>,
    processes: Vec<AddedProcess>,
    outputs: Vec<String>,
    /// The engine's settings, for a pipeline without shadow maps.
    pub(super) shadow_maps: ShadowMaps,
}

/// A process that the engine added.
#[derive(Clone)]
struct AddedProcess {
    name: String,
    process: Arc<dyn RenderProcess>,
    is_enabled: bool,
}

impl PlanSources {
    /// Adds a process of the engine's.
    ///
    /// # Errors
    /// If the process panics when it is asked for its name.
    pub(super) fn add_process(&mut self, process: Arc<dyn RenderProcess>) -> Result<(), PlanError> {
        let name = catch_panics(|| Ok(process.name().to_owned()))?;
        self.processes.push(AddedProcess { name, process, is_enabled: true });
        Ok(())
    }

    /// # Errors
    /// If the engine has added no process of this name.
    pub(super) fn remove_process(&mut self, name: &str) -> Result<(), PlanError> {
        self.check_added(name)?;
        self.processes.retain(|added| added.name != name);
        Ok(())
    }

    /// # Errors
    /// If the engine has added no process of this name.
    pub(super) fn set_process_enabled(&mut self, name: &str, is_enabled: bool) -> Result<(), PlanError> {
        self.check_added(name)?;
        self.processes.iter_mut().filter(|added| added.name == name).for_each(|added| added.is_enabled = is_enabled);
        Ok(())
    }

    /// Whether the processes of this name that the engine added are all on, or all off.
    pub(super) fn are_enabled(&self, name: &str, is_enabled: bool) -> bool {
        let mut named = self.processes.iter().filter(|added| added.name == name).peekable();
        named.peek().is_some() && named.all(|added| added.is_enabled == is_enabled)
    }

    /// Whether the engine has named an output.
    pub(super) fn has_output(&self, target: &str) -> bool {
        self.outputs.iter().any(|output| output == target)
    }

    fn check_added(&self, name: &str) -> Result<(), PlanError> {
        check_known(name, "process", self.processes.iter().map(|added| added.name.as_str()))
    }

    /// Adds an output, unless there is one of that name.
    pub(super) fn add_output(&mut self, target: String) {
        if !self.has_output(&target) {
            self.outputs.push(target);
        }
    }

    /// # Errors
    /// If the engine has added no output of this name.
    pub(super) fn remove_output(&mut self, target: &str) -> Result<(), PlanError> {
        check_known(target, "output", self.outputs.iter().map(String::as_str))?;
        self.outputs.retain(|output| output != target);
        Ok(())
    }

    /// Gives the pipeline a quality. Returns whether that makes another one of it.
    ///
    /// # Errors
    /// If the pipeline panics.
    pub(super) fn set_quality(&mut self, quality: &Quality) -> Result<bool, PlanError> {
        let Some(pipeline) = &self.pipeline else { return Ok(false) };
        let other = call("with_quality", || Ok(pipeline.with_quality(quality)))?;
        let has_other = other.is_some();
        if let Some(other) = other {
            self.pipeline = Some(Contained::new(other));
        }
        Ok(has_other)
    }

    fn compile(&self, requirements: &Requirements, device: DeviceSupport) -> Result<FramePlan, PlanError> {
        let mut built = PipelineProcesses::default();
        if let Some(pipeline) = &self.pipeline {
            call("build", || pipeline.build(requirements, device, &mut built))?;
        }
        let enabled = self.processes.iter().filter(|added| added.is_enabled);
        let processes = enabled.map(|added| Arc::clone(&added.process)).collect();
        catch_panics(|| FramePlan::of_pipeline(built, processes, &self.outputs, |kind| requirements.has_views(kind)))
    }
}

/// # Errors
/// If there is none of this name.
fn check_known<'a>(
    name: &str,
    what: &'static str,
    all: impl Iterator<Item = &'a str> + Clone,
) -> Result<(), PlanError> {
    match all.clone().any(|other| other == name) {
        true => Ok(()),
        false => Err(PlanError::NotAdded { what, name: name.to_owned(), known: list_names(all) }),
    }
}

/// A renderer's processes, and a plan for each of the sets of requirements that scenes have had lately.
pub(super) struct PlanCache {
    sources: PlanSources,
    /// How the pipeline draws shadow maps.
    pipeline_maps: Option<ShadowMaps>,
    device: DeviceSupport,
    /// `None` until the next plan if the device changed.
    of_device: Option<OfDevice>,
    /// Whether all scenes have the same plan: there is no pipeline, and every scene has the views that processes draw
    /// in.
    has_one_plan: bool,
    compiled: HashMap<Requirements, CachedPlan>,
    /// How often a plan was chosen.
    uses: u64,
    current: Arc<FramePlan>,
    process_ids: ProcessIds,
}

/// What a pipeline says of a device.
#[derive(Clone, Copy, Default)]
struct OfDevice {
    /// What every plan has, whatever the scene requires.
    kept: Requirements,
    lacks_float_blending: bool,
}

impl OfDevice {
    /// # Errors
    /// If the pipeline panics.
    fn new(sources: &PlanSources, device: DeviceSupport) -> Result<Self, PlanError> {
        let Some(pipeline) = &sources.pipeline else { return Ok(Self::default()) };
        Ok(Self {
            kept: call("kept", || Ok(pipeline.kept(device)))?,
            lacks_float_blending: call("lacks_float_blending", || Ok(pipeline.lacks_float_blending(device)))?,
        })
    }
}

struct CachedPlan {
    plan: Arc<FramePlan>,
    /// [`PlanCache::uses`] when it was chosen last.
    last_use: u64,
}

/// The ids of processes, by kind of views and name: those of this cache's plans, and of the cache before.
type ProcessIds = HashMap<(ViewKind, String), ProcessId>;

impl PlanCache {
    /// The most plans in the cache. Of more, that which was used longest ago is dropped.
    pub(super) const MAX_PLANS: usize = 128;

    /// A cache with the plan of an empty scene.
    ///
    /// # Errors
    /// If the processes make no frame, either for an empty scene or for one that requires everything, on this device
    /// or on one that replaces it.
    pub(super) fn new(sources: PlanSources, device: DeviceSupport) -> Result<Self, PlanError> {
        Self::with_ids(sources, device, HashMap::new())
    }

    /// A cache in which processes that are known have these ids in all plans.
    fn with_ids(sources: PlanSources, device: DeviceSupport, mut process_ids: ProcessIds) -> Result<Self, PlanError> {
        let (mut pipeline_maps, mut nothing, mut everything) = (None, Requirements::default(), None);
        if let Some(pipeline) = &sources.pipeline {
            call("check", || pipeline.check())?;
            pipeline_maps = call("shadow_maps", || Ok(pipeline.shadow_maps()))?;
            nothing = call("requirements", || Ok(pipeline.requirements(&SceneContents::EMPTY)))?;
            everything = call("to_prepare", || Ok(pipeline.to_prepare()))?.first().copied();
        }
        if let Some(problem) = [Some(sources.shadow_maps), pipeline_maps].iter().flatten().find_map(ShadowMaps::problem)
        {
            return Err(PlanError::ShadowMaps { problem });
        }
        let of_device = OfDevice::new(&sources, device)?;
        let nothing = nothing.union(of_device.kept);
        let everything = everything.unwrap_or_else(Requirements::all).union(of_device.kept).with_all_views();
        if sources.pipeline.is_some() {
            sources.compile(&everything, device)?.check_left_out()?;
            sources.compile(&everything, DeviceSupport::new(!device.float_blending))?;
        }
        let mut current = sources.compile(&nothing, device)?;
        // Without a pipeline, plans differ by kinds of views alone.
        let has_one_plan = sources.pipeline.is_none() && current.has_all_views();
        if has_one_plan {
            current.check_left_out()?;
        } else if sources.pipeline.is_none() {
            sources.compile(&everything, device)?.check_left_out()?;
        }
        current.share_process_ids(&mut process_ids);
        let current = Arc::new(current);
        let compiled = HashMap::from([(nothing, CachedPlan { plan: Arc::clone(&current), last_use: 0 })]);
        let of_device = Some(of_device);
        Ok(Self { sources, pipeline_maps, device, of_device, has_one_plan, compiled, uses: 0, current, process_ids })
    }

    /// What the plans are made of.
    pub(super) fn sources(&self) -> &PlanSources {
        &self.sources
    }

    /// A cache with other processes. Those that stay keep their ids.
    ///
    /// # Errors
    /// If `change` fails, or as [`PlanCache::new`].
    pub(super) fn changed(
        &self,
        change: impl FnOnce(&mut PlanSources) -> Result<(), PlanError>,
    ) -> Result<Self, PlanError> {
        let mut sources = self.sources.clone();
        change(&mut sources)?;
        Self::with_ids(sources, self.device, self.ids_of_plans())
    }

    /// A cache whose pipeline has a quality; `None` if it stays as it is.
    ///
    /// # Errors
    /// As [`PlanCache::changed`].
    pub(super) fn with_quality(&self, quality: &Quality) -> Result<Option<Self>, PlanError> {
        let mut sources = self.sources.clone();
        match sources.set_quality(quality)? {
            true => Self::with_ids(sources, self.device, self.ids_of_plans()).map(Some),
            false => Ok(None),
        }
    }

    /// The ids of the processes in the plans of this cache. Those of earlier plans are not needed, and would become
    /// ever more.
    fn ids_of_plans(&self) -> ProcessIds {
        let plans = self.compiled.values().map(|cached| &cached.plan).chain([&self.current]);
        let planned = plans.flat_map(|plan| plan.processes());
        planned.map(|planned| ((planned.declaration.views, planned.name.clone()), planned.id)).collect()
    }

    /// Sets what the backend supports. If that changes, plans are compiled anew, and what they keep is determined anew.
    pub(super) fn set_device(&mut self, device: DeviceSupport) {
        if self.device != device {
            self.device = device;
            self.compiled.clear();
            self.of_device = None;
        }
    }

    /// The plan of the latest frame; before the first one, that of an empty scene.
    pub(super) fn current(&self) -> &Arc<FramePlan> {
        &self.current
    }

    /// The plan for a scene with these contents, compiled if the cache does not have it. It becomes the current plan.
    ///
    /// # Errors
    /// If the processes make no frame.
    pub(super) fn select(&mut self, scene: &SceneContents<'_>) -> Result<Arc<FramePlan>, PlanError> {
        let requirements = self.requirements(scene)?;
        self.current = self.plan_for(requirements)?;
        Ok(Arc::clone(&self.current))
    }

    /// Plans for scenes like this one and for others, which together have every pipeline that a plan may have. They are
    /// compiled if the cache does not have them. The current plan does not change.
    ///
    /// # Errors
    /// If the processes make no frame.
    pub(super) fn plans_to_prepare(&mut self, scene: &SceneContents<'_>) -> Result<Vec<Arc<FramePlan>>, PlanError> {
        let others = match &self.sources.pipeline {
            Some(pipeline) => call("to_prepare", || Ok(pipeline.to_prepare()))?,
            None => vec![Requirements::all()],
        };
        let mut plans: Vec<Arc<FramePlan>> = Vec::new();
        let others = others.into_iter().map(Requirements::with_all_views);
        for requirements in [self.requirements(scene)?].into_iter().chain(others) {
            let plan = self.plan_for(requirements)?;
            if plans.iter().all(|other| other.identity() != plan.identity()) {
                plans.push(plan);
            }
        }
        Ok(plans)
    }

    /// What a frame of this scene requires.
    ///
    /// # Errors
    /// If the pipeline panics.
    fn requirements(&self, scene: &SceneContents<'_>) -> Result<Requirements, PlanError> {
        let own = match &self.sources.pipeline {
            Some(pipeline) => call("requirements", || Ok(pipeline.requirements(scene)))?,
            None => Requirements::default(),
        };
        Ok(own.with_cameras(scene.cameras))
    }

    /// The plan for these requirements, compiled if the cache does not have it.
    ///
    /// # Errors
    /// If the processes make no frame.
    fn plan_for(&mut self, requirements: Requirements) -> Result<Arc<FramePlan>, PlanError> {
        if self.has_one_plan {
            return Ok(Arc::clone(&self.current));
        }
        let of_device = match self.of_device {
            Some(of_device) => of_device,
            None => *self.of_device.insert(OfDevice::new(&self.sources, self.device)?),
        };
        let requirements = requirements.union(of_device.kept);
        self.uses += 1;
        if let Some(cached) = self.compiled.get_mut(&requirements) {
            cached.last_use = self.uses;
            return Ok(Arc::clone(&cached.plan));
        }
        let mut plan = self.sources.compile(&requirements, self.device)?;
        plan.share_process_ids(&mut self.process_ids);
        let plan = Arc::new(plan);
        let cached = CachedPlan { plan: Arc::clone(&plan), last_use: self.uses };
        self.compiled.insert(requirements, cached);
        if self.compiled.len() > Self::MAX_PLANS {
            let oldest = self.compiled.iter().min_by_key(|(_, cached)| cached.last_use);
            let oldest = oldest.map(|(requirements, _)| *requirements);
            oldest.and_then(|oldest| self.compiled.remove(&oldest));
            self.process_ids = self.ids_of_plans();
        }
        Ok(plan)
    }

    /// The settings of shadow maps; `None` where the current plan draws none.
    pub(super) fn shadow_maps(&self) -> Option<&ShadowMaps> {
        let maps = self.pipeline_maps.as_ref().unwrap_or(&self.sources.shadow_maps);
        self.current.draws_views(ViewKind::Shadow).then_some(maps)
    }

    /// Whether processes of their own draw the lights that cast shadows.
    pub(super) fn separates_shadowed_lights(&self) -> bool {
        match &self.sources.pipeline {
            Some(_) => self.pipeline_maps.is_some(),
            None => self.current.draws_views(ViewKind::Shadow),
        }
    }

    /// Whether blended objects are drawn in half floats only because the backend cannot blend floats.
    pub(super) fn lacks_float_blending(&self) -> bool {
        self.of_device.is_some_and(|of_device| of_device.lacks_float_blending)
    }

    /// The number of plans in the cache.
    pub(super) fn count(&self) -> usize {
        self.compiled.len()
    }
}

/// Calls code of the pipeline, and turns its panic into an error.
fn call<R>(call: &'static str, code: impl FnOnce() -> Result<R, PlanError>) -> Result<R, PlanError> {
    catch(code).unwrap_or_else(|JobPanic { message, .. }| Err(PlanError::PipelinePanicked { call, message }))
}

/// Calls code of processes of the engine, and turns its panic into an error.
fn catch_panics<R>(call: impl FnOnce() -> Result<R, PlanError>) -> Result<R, PlanError> {
    catch(call).unwrap_or_else(|JobPanic { message, .. }| Err(PlanError::Panicked { message }))
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use glam::{DVec3, Vec3};

    use super::*;
    use crate::process::Deferred;
    use crate::scene::{Camera, Light};

    fn deferred() -> PlanSources {
        let pipeline = Contained::new(Arc::new(Deferred::to_picture()) as Arc<dyn Pipeline>);
        PlanSources { pipeline: Some(pipeline), ..PlanSources::default() }
    }

    fn contents<'a>(lights: &'a [Light], transparency: bool, cameras: &'a [Camera]) -> SceneContents<'a> {
        SceneContents { lights, transparency, cameras }
    }

    /// The processes of a plan by name and kind of views, each with its id.
    fn ids_of(plan: &FramePlan) -> HashMap<(String, ViewKind), ProcessId> {
        let named = plan.processes().iter().map(|planned| (planned.name.clone(), planned.declaration.views));
        named.zip(plan.processes().iter().map(|planned| planned.id)).collect()
    }

    #[test]
    fn a_process_has_the_same_id_in_all_plans() {
        let mut cache = PlanCache::new(deferred(), DeviceSupport::new(true)).unwrap();
        let sun = Light::Directional { direction: Vec3::NEG_Y, illuminance: Vec3::ONE, casts_shadow: true };
        let lamp = Light::Point { position: DVec3::ZERO, intensity: Vec3::ONE, range: 1.0, casts_shadow: false };
        let mirror = Camera { kind: ViewKind::Reflection, ..Camera::looking_at("mirror", DVec3::Z, DVec3::ZERO) };
        let mut known = ids_of(cache.current());
        let mut check = |plan: &FramePlan| {
            for (process, id) in ids_of(plan) {
                assert_eq!(*known.entry(process).or_insert(id), id);
            }
            assert_eq!(known.values().collect::<HashSet<_>>().len(), known.len(), "{known:?}");
        };
        check(&cache.select(&contents(&[lamp], false, &[])).unwrap());
        check(&cache.select(&contents(&[lamp, sun], true, &[])).unwrap());
        check(&cache.select(&contents(&[sun], true, std::slice::from_ref(&mirror))).unwrap());
        let mut replaced = cache
            .changed(|sources| {
                sources.pipeline = deferred().pipeline;
                Ok(())
            })
            .unwrap();
        check(replaced.current());
        check(&replaced.select(&contents(&[], false, &[])).unwrap());
        check(&replaced.select(&contents(&[lamp, sun], true, &[mirror])).unwrap());
    }

    #[test]
    fn without_a_pipeline_a_scene_has_the_same_plan_whatever_the_frames_before_had() {
        use crate::process::{ClearColor, Declare, Draws, Format, FullScreen, RenderProcess};

        struct Picture;

        impl RenderProcess for Picture {
            fn name(&self) -> &str {
                "picture"
            }

            fn declare(&self, declare: &mut Declare) {
                declare.also_views(ViewKind::Reflection);
                declare.clears_color("picture", Format::Rgba8Unorm, ClearColor::Background);
                declare.keep();
            }

            fn draws(&self) -> Draws<'_> {
                Draws::FullScreen(FullScreen::default())
            }
        }

        let mut sources = PlanSources::default();
        sources.add_process(Arc::new(Picture)).unwrap();
        let mut cache = PlanCache::new(sources, DeviceSupport::new(true)).unwrap();
        let main = Camera::looking_at("main", DVec3::Z, DVec3::ZERO);
        let cameras = [main.clone(), Camera { kind: ViewKind::Reflection, ..main }];
        let mut kinds = |cameras: &[Camera]| {
            let plan = cache.select(&contents(&[], false, cameras)).unwrap();
            plan.processes().iter().map(|planned| planned.declaration.views).collect::<Vec<_>>()
        };
        let plans = [&cameras[..1], &cameras[..], &cameras[..1]].map(&mut kinds);
        assert_eq!(plans[1].len(), 2);
        assert_eq!([&plans[0], &plans[2]], [&[ViewKind::Main], &[ViewKind::Main]]);
    }
}
