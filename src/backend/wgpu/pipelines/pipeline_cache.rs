//! The cache of all pipelines, by plan.

use std::collections::{HashMap, HashSet};
use std::sync::{Arc, Weak};

use super::compile_shader::shader_label;
use super::pipeline_key::PipelineKey;
use super::process_pipelines::ProcessPipelines;
use super::shared_pipelines::{SharedPipelines, SharedRenderPipeline};
use crate::backend::BackendError;
use crate::backend::wgpu::error_scope::with_error_scope;
use crate::backend::wgpu::resources::BindGroupLayouts;
use crate::process::{Draws, FramePlan, PlannedProcess, RenderProcess};
use crate::quality::Quality;
use crate::unwind::emit_unlocked;

/// Keeps the pipelines of all plans. Plans share pipelines where they can.
#[derive(Default)]
pub(crate) struct PipelineCache {
    /// By the plan's identity.
    plans: HashMap<u64, PlanPipelines>,
    /// Whether a process whose new shader does not compile keeps the pipelines that it had.
    keeps_working_shaders: bool,
    /// The latest pipelines of each process by its name, if processes keep them, and the process that they are of.
    working: HashMap<String, (Weak<dyn RenderProcess>, Arc<ProcessPipelines>)>,
    /// What was [prepared](Self::add_prepared) and no plan uses yet, each with the plan that it was made for.
    prepared: Vec<(Weak<()>, Arc<ProcessPipelines>)>,
    /// The latest shader of each process that did not compile, and why.
    failed: HashMap<String, (PipelineKey<'static>, BackendError)>,
}

struct PlanPipelines {
    /// Alive as long as the plan is.
    plan: Weak<()>,
    /// One for each render process.
    processes: Arc<[Arc<ProcessPipelines>]>,
}

impl PipelineCache {
    pub(crate) fn new(keeps_working_shaders: bool) -> Self {
        Self { keeps_working_shaders, ..Self::default() }
    }

    /// The errors of processes that are still drawn with the shader before, in any order.
    pub(crate) fn shader_errors(&self) -> Vec<String> {
        self.failed.values().map(|(_, error)| error.to_string()).collect()
    }

    /// The pipelines of every render process of a plan: cached ones, also of other plans, or new ones for a process
    /// whose draws changed, or for another quality.
    ///
    /// # Errors
    /// If the device refuses a shader.
    pub(crate) fn update(
        &mut self,
        device: &wgpu::Device,
        (shared, layouts): (&SharedPipelines, &BindGroupLayouts),
        plan: &FramePlan,
        draws: &[Draws<'_>],
        quality: &Quality,
    ) -> Result<Arc<[Arc<ProcessPipelines>]>, BackendError> {
        let cached = self.plans.get(&plan.identity()).map(|cached| &cached.processes);
        let all_fit = |cached: &&Arc<[Arc<ProcessPipelines>]>| {
            cached.iter().zip(draws).all(|(pipelines, draws)| pipelines.inputs.fit_draws(draws, quality))
        };
        if let Some(cached) = cached.filter(all_fit) {
            let cached = Arc::clone(cached);
            self.failed.retain(|name, _| plan.processes().iter().all(|planned| planned.name != *name));
            self.forget_removed();
            return Ok(cached);
        }
        let mut processes = cached.map_or_else(Vec::new, |cached| cached.to_vec());
        for (index, (planned, draws)) in plan.processes().iter().zip(draws).enumerate() {
            if processes.get(index).is_some_and(|pipelines| pipelines.inputs.fit_draws(draws, quality)) {
                self.failed.remove(&planned.name);
                continue;
            }
            let fitting = self.find(plan, planned, draws, quality).cloned();
            let pipelines = match fitting {
                Some(fitting) => fitting,
                None => {
                    let label = shader_label(&planned.name);
                    let working = self.working.get(&planned.name).map(|(_, pipelines)| Arc::clone(pipelines));
                    let working = working.filter(|old| old.inputs.differ_in_text_only(plan, planned, draws, quality));
                    let create = || {
                        let created = ProcessPipelines::new(device, (shared, layouts), plan, planned, draws, quality)?;
                        if let Some(working) = &working {
                            // Only a pipeline shows that a shader lacks an entry point, or reads what there is not.
                            created.insert(created.create_missing(
                                device,
                                &label,
                                working.variants().keys().cloned(),
                            )?);
                        }
                        Ok(created)
                    };
                    let has_failed = |failed: &HashMap<String, (PipelineKey<'static>, BackendError)>| {
                        failed.get(&planned.name).is_some_and(|(key, _)| *key == PipelineKey::new(draws, quality))
                    };
                    match &working {
                        Some(working) if has_failed(&self.failed) => Arc::clone(working),
                        _ => match (with_error_scope(device, &label, create).flatten(), &working) {
                            (Ok(created), _) => {
                                self.failed.remove(&planned.name);
                                Arc::new(created)
                            }
                            (Err(error), Some(working)) => {
                                let message = error.to_string();
                                emit_unlocked(move || {
                                    tracing::error!(target: "drawloom", error = message, "a shader does not compile; the one before it stays in use");
                                });
                                let key = PipelineKey::new(draws, quality).into_owned();
                                self.failed.insert(planned.name.clone(), (key, error));
                                Arc::clone(working)
                            }
                            (Err(error), None) => return Err(error),
                        },
                    }
                }
            };
            if self.keeps_working_shaders {
                let working = (Arc::downgrade(&planned.process), Arc::clone(&pipelines));
                self.working.insert(planned.name.clone(), working);
            }
            // The loop visits processes in order, so this either replaces an entry or appends one.
            match processes.get_mut(index) {
                Some(old) => *old = pipelines,
                None => processes.push(pipelines),
            }
        }
        // Only now, because this plan may reuse pipelines of dropped plans.
        self.plans.retain(|_, cached| cached.plan.strong_count() > 0);
        let processes: Arc<[_]> = processes.into();
        let cached = PlanPipelines { plan: plan.alive(), processes: Arc::clone(&processes) };
        self.plans.insert(plan.identity(), cached);
        self.prepared.retain(|(plan, pipelines)| {
            plan.strong_count() > 0 && processes.iter().all(|used| !Arc::ptr_eq(used, pipelines))
        });
        self.forget_removed();
        Ok(processes)
    }

    /// Forgets the shaders of processes that there are no more, neither themselves nor others of their names in plans.
    fn forget_removed(&mut self) {
        let plans = &self.plans;
        let is_planned = |name: &str| {
            let mut alive = plans.values().filter(|cached| cached.plan.strong_count() > 0);
            alive.any(|cached| cached.processes.iter().any(|pipelines| pipelines.name() == name))
        };
        self.working.retain(|name, (process, _)| process.strong_count() > 0 || is_planned(name));
        let working = &self.working;
        self.failed.retain(|name, _| working.contains_key(name));
    }

    /// Pipelines that a process can use, of whatever plan.
    pub(crate) fn find(
        &self,
        plan: &FramePlan,
        planned: &PlannedProcess,
        draws: &Draws<'_>,
        quality: &Quality,
    ) -> Option<&Arc<ProcessPipelines>> {
        self.all().find(|pipelines| pipelines.inputs.fit(plan, planned, draws, quality))
    }

    /// Adds complete pipelines that were made for a process of a plan without a lock on the cache, unless a frame has
    /// made them meanwhile. They take the place of those that were prepared for it before.
    pub(crate) fn add_prepared(
        &mut self,
        plan: &FramePlan,
        planned: &PlannedProcess,
        draws: &Draws<'_>,
        quality: &Quality,
        pipelines: ProcessPipelines,
    ) {
        let of_plan = plan.alive();
        let is_replaced = |before: &(Weak<()>, Arc<ProcessPipelines>)| {
            before.0.ptr_eq(&of_plan) && before.1.inputs.fit_declaration(plan, planned)
        };
        if self.find(plan, planned, draws, quality).is_none() {
            self.prepared.retain(|before| !is_replaced(before));
            self.prepared.push((of_plan, Arc::new(pipelines)));
        }
    }

    /// The pipelines of all processes, to [count](pipeline_count) them without a lock on the cache.
    pub(crate) fn processes(&self) -> Vec<Arc<ProcessPipelines>> {
        self.all().cloned().collect()
    }

    /// The pipelines of the processes of all plans, and those that no plan uses yet.
    fn all(&self) -> impl Iterator<Item = &Arc<ProcessPipelines>> {
        let of_plans = self.plans.values().flat_map(|cached| cached.processes.iter());
        of_plans.chain(self.prepared.iter().map(|(_, pipelines)| pipelines))
    }
}

/// The number of render pipelines of these processes, each once, however many processes share it.
pub(crate) fn pipeline_count(processes: &[Arc<ProcessPipelines>]) -> usize {
    let mut distinct = HashSet::new();
    for pipelines in processes {
        distinct.extend(pipelines.variants().values().map(SharedRenderPipeline::identity));
    }
    distinct.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::wgpu::noop_device::noop_device;
    use crate::process::{GeometryBuffer, GeometryFormats};

    #[test]
    fn pipelines_that_are_prepared_twice_or_for_another_quality_are_there_once() {
        let (device, _) = noop_device();
        let process = Arc::new(GeometryBuffer::new(GeometryFormats::default()));
        let plan = FramePlan::new(vec![process], &["diffuse".to_owned()]).unwrap();
        let (planned, draws) = (&plan.processes()[0], plan.draws().unwrap());
        let (layouts, shared) = (BindGroupLayouts::new(&device), SharedPipelines::new(false));
        let mut cache = PipelineCache::new(false);
        let prepare = |cache: &mut PipelineCache, quality: &Quality| {
            let made = ProcessPipelines::new(&device, (&shared, &layouts), &plan, planned, &draws[0], quality).unwrap();
            cache.add_prepared(&plan, planned, &draws[0], quality, made);
        };
        let [other, quality] = [Quality::exact(), Quality::fast()];
        assert!(PipelineKey::new(&draws[0], &other) != PipelineKey::new(&draws[0], &quality));
        for quality in [&other, &quality, &quality] {
            prepare(&mut cache, quality);
            assert_eq!(cache.prepared.len(), 1);
        }
        // A frame takes what is prepared, and what comes late is dropped.
        let prepared = Arc::clone(&cache.prepared[0].1);
        let used = cache.update(&device, (&shared, &layouts), &plan, &draws, &quality).unwrap();
        assert!(Arc::ptr_eq(&used[0], &prepared) && cache.prepared.is_empty());
        prepare(&mut cache, &quality);
        assert!(cache.prepared.is_empty());
        // What is prepared for another quality does not change what frames use.
        prepare(&mut cache, &other);
        let used = cache.update(&device, (&shared, &layouts), &plan, &draws, &quality).unwrap();
        assert!(Arc::ptr_eq(&used[0], &prepared));
    }
}
