//! The plan cache: one compiled plan for each set of requirements.

use std::collections::HashMap;
use std::sync::Arc;

use crate::process::{Deferred, FramePlan, PlanError, ProcessId, RenderProcess, Requirements};
use crate::quality::Quality;
use crate::scene::{Camera, Light, ViewKind};
use crate::task::{JobPanic, catch};
use crate::view::ShadowMaps;

/// A renderer's processes, and a plan for each set of requirements that scenes have had so far.
pub(super) struct PlanCache {
    deferred: Option<Deferred>,
    /// What every plan has, whatever the scene requires; `None` until the next plan if the backend changed.
    kept: Option<Requirements>,
    processes: Vec<Arc<dyn RenderProcess>>,
    outputs: Vec<String>,
    shadow_maps: ShadowMaps,
    compiled: HashMap<Requirements, Arc<FramePlan>>,
    current: Arc<FramePlan>,
    process_ids: ProcessIds,
}

/// The ids of processes, by kind of views and name: those of this cache's plans, and of the cache before.
type ProcessIds = HashMap<(ViewKind, String), ProcessId>;

impl PlanCache {
    /// A cache with the plan of an empty scene. Processes that are known have these ids in all plans.
    ///
    /// # Errors
    /// If the processes make no frame, either for an empty scene or for one that requires everything, on this backend
    /// or on one that replaces it.
    pub(super) fn new(
        deferred: Option<Deferred>,
        processes: Vec<Arc<dyn RenderProcess>>,
        outputs: Vec<String>,
        shadow_maps: ShadowMaps,
        mut process_ids: ProcessIds,
    ) -> Result<Self, PlanError> {
        if let Some(problem) = shadow_maps.problem() {
            return Err(PlanError::ShadowMaps { problem });
        }
        let all = Requirements::all();
        if let Some(deferred) = &deferred {
            catch_panics(|| deferred.check())?;
            compile(Some(deferred), &processes, &outputs, &all)?.check_left_out()?;
            let replaced = deferred.clone().with_float_blending(!deferred.blends_floats());
            compile(Some(&replaced), &processes, &outputs, &all)?;
        }
        let kept = kept_requirements(deferred.as_ref())?;
        let nothing = Requirements::default().union(kept);
        let mut current = compile(deferred.as_ref(), &processes, &outputs, &nothing)?;
        if deferred.is_none() {
            current.check_left_out()?;
        }
        current.share_process_ids(&mut process_ids);
        let current = Arc::new(current);
        let compiled = HashMap::from([(nothing, Arc::clone(&current))]);
        Ok(Self { deferred, kept: Some(kept), processes, outputs, shadow_maps, compiled, current, process_ids })
    }

    /// A cache with another deferred pipeline.
    ///
    /// # Errors
    /// As [`PlanCache::new`].
    pub(super) fn with_deferred(&self, deferred: Deferred) -> Result<Self, PlanError> {
        let Self { processes, outputs, shadow_maps, compiled, current, .. } = self;
        let planned = compiled.values().chain([current]).flat_map(|plan| plan.processes());
        // Those of caches before this one are not needed, and would become ever more.
        let ids = planned.map(|planned| ((planned.declaration.views, planned.name.clone()), planned.id)).collect();
        Self::new(Some(deferred), processes.clone(), outputs.clone(), *shadow_maps, ids)
    }

    /// The deferred pipeline, if there is one.
    pub(super) fn deferred(&self) -> Option<&Deferred> {
        self.deferred.as_ref()
    }

    /// Sets whether the backend can blend floats. If that changes, plans are compiled anew, and what they keep is
    /// determined anew.
    pub(super) fn set_float_blending(&mut self, blends_floats: bool) {
        if let Some(deferred) = self.deferred.take() {
            if deferred.blends_floats() != blends_floats {
                self.compiled.clear();
                self.kept = None;
            }
            self.deferred = Some(deferred.with_float_blending(blends_floats));
        }
    }

    /// The plan of the latest frame; before the first one, that of an empty scene.
    pub(super) fn current(&self) -> &Arc<FramePlan> {
        &self.current
    }

    /// The plan for a scene with these valid lights, and with objects that need transparency if `transparency` is true,
    /// compiled if the cache does not have it. It becomes the current plan.
    ///
    /// # Errors
    /// If the processes make no frame.
    pub(super) fn select(
        &mut self,
        lights: &[Light],
        transparency: bool,
        cameras: &[Camera],
    ) -> Result<Arc<FramePlan>, PlanError> {
        let requirements =
            Requirements::of(lights, transparency, self.separates_shadowed_lights()).with_cameras(cameras);
        self.current = self.plan_for(requirements)?;
        Ok(Arc::clone(&self.current))
    }

    /// Plans for scenes like this one and for others, which together have every pipeline that a plan may have. They are
    /// compiled if the cache does not have them. The current plan does not change.
    ///
    /// # Errors
    /// If the processes make no frame.
    pub(super) fn plans_to_prepare(
        &mut self,
        lights: &[Light],
        transparency: bool,
        cameras: &[Camera],
    ) -> Result<Vec<Arc<FramePlan>>, PlanError> {
        let requirements =
            Requirements::of(lights, transparency, self.separates_shadowed_lights()).with_cameras(cameras);
        let all = [requirements].into_iter().chain(Requirements::with_every_shader());
        let mut plans: Vec<Arc<FramePlan>> = Vec::new();
        for requirements in all {
            let plan = self.plan_for(requirements)?;
            if plans.iter().all(|other| other.identity() != plan.identity()) {
                plans.push(plan);
            }
        }
        Ok(plans)
    }

    /// The plan for these requirements, compiled if the cache does not have it.
    ///
    /// # Errors
    /// If the processes make no frame.
    fn plan_for(&mut self, requirements: Requirements) -> Result<Arc<FramePlan>, PlanError> {
        let Some(deferred) = &self.deferred else { return Ok(Arc::clone(&self.current)) };
        let kept = match self.kept {
            Some(kept) => kept,
            None => *self.kept.insert(kept_requirements(Some(deferred))?),
        };
        let requirements = requirements.union(kept);
        if let Some(plan) = self.compiled.get(&requirements) {
            return Ok(Arc::clone(plan));
        }
        let mut plan = compile(Some(deferred), &self.processes, &self.outputs, &requirements)?;
        plan.share_process_ids(&mut self.process_ids);
        let plan = Arc::new(plan);
        self.compiled.insert(requirements, Arc::clone(&plan));
        Ok(plan)
    }

    /// The settings of shadow maps; `None` where the current plan draws none.
    pub(super) fn shadow_maps(&self) -> Option<&ShadowMaps> {
        let maps = self.deferred.as_ref().and_then(Deferred::maps).unwrap_or(&self.shadow_maps);
        self.current.draws_views(ViewKind::Shadow).then_some(maps)
    }

    /// Whether processes of their own draw the lights that cast shadows.
    pub(super) fn separates_shadowed_lights(&self) -> bool {
        match &self.deferred {
            Some(deferred) => deferred.maps().is_some(),
            None => self.current.draws_views(ViewKind::Shadow),
        }
    }

    /// The number of plans in the cache.
    pub(super) fn count(&self) -> usize {
        self.compiled.len()
    }
}

/// What every plan has, whatever the scene requires.
fn kept_requirements(deferred: Option<&Deferred>) -> Result<Requirements, PlanError> {
    catch_panics(|| Ok(deferred.map_or_else(Requirements::default, Deferred::kept_requirements)))
}

fn compile(
    deferred: Option<&Deferred>,
    processes: &[Arc<dyn RenderProcess>],
    outputs: &[String],
    requirements: &Requirements,
) -> Result<FramePlan, PlanError> {
    catch_panics(|| {
        let chain = deferred.map_or_else(Vec::new, |deferred| deferred.chain(requirements));
        let own = deferred.map(|deferred| deferred.output().to_owned());
        let outputs: Vec<_> = outputs.iter().cloned().chain(own).collect();
        // Without a pipeline there is one plan for all scenes.
        let is_present = |kind| deferred.is_none() || requirements.has_views(kind);
        FramePlan::for_views(chain, processes.to_vec(), &outputs, is_present)
    })
}

/// Applies a quality to a pipeline and its steps of post-processing.
///
/// # Errors
/// If a step panics.
pub(super) fn with_quality(deferred: Deferred, quality: &Quality) -> Result<Deferred, PlanError> {
    catch_panics(|| Ok(deferred.quality(quality)))
}

/// Calls code of processes and steps of the engine, and turns its panic into an error.
fn catch_panics<R>(call: impl FnOnce() -> Result<R, PlanError>) -> Result<R, PlanError> {
    catch(call).unwrap_or_else(|JobPanic { message, .. }| Err(PlanError::Panicked { message }))
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;

    use glam::{DVec3, Vec3};

    use super::*;

    /// The processes of a plan by name and kind of views, each with its id.
    fn ids_of(plan: &FramePlan) -> HashMap<(String, ViewKind), ProcessId> {
        let named = plan.processes().iter().map(|planned| (planned.name.clone(), planned.declaration.views));
        named.zip(plan.processes().iter().map(|planned| planned.id)).collect()
    }

    #[test]
    fn a_process_has_the_same_id_in_all_plans() {
        let mut cache =
            PlanCache::new(Some(Deferred::to_picture()), Vec::new(), Vec::new(), ShadowMaps::default(), HashMap::new())
                .unwrap();
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
        check(&cache.select(&[lamp], false, &[]).unwrap());
        check(&cache.select(&[lamp, sun], true, &[]).unwrap());
        check(&cache.select(&[sun], true, std::slice::from_ref(&mirror)).unwrap());
        let mut replaced = cache.with_deferred(Deferred::to_picture()).unwrap();
        check(replaced.current());
        check(&replaced.select(&[], false, &[]).unwrap());
        check(&replaced.select(&[lamp, sun], true, &[mirror]).unwrap());
    }
}
