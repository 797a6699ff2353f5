//! The cache of all pipelines, by plan.

use std::collections::HashMap;
use std::sync::{Arc, Weak};

use super::process_pipelines::ProcessPipelines;
use crate::backend::BackendError;
use crate::backend::wgpu::error_scope::with_error_scope;
use crate::backend::wgpu::resources::BindGroupLayouts;
use crate::process::{Draws, FramePlan};
use crate::quality::Quality;

/// Keeps the pipelines of all plans. Plans share pipelines where they can.
#[derive(Default)]
pub(crate) struct PipelineCache {
    /// By the plan's identity.
    plans: HashMap<u64, PlanPipelines>,
}

struct PlanPipelines {
    /// Alive as long as the plan is.
    plan: Weak<()>,
    /// One for each render process.
    processes: Arc<[Arc<ProcessPipelines>]>,
}

impl PipelineCache {
    /// The pipelines of every render process of a plan: cached ones, also of other plans, or new ones for a process whose
    /// draws changed, or for another quality.
    ///
    /// # Errors
    /// If the device refuses a shader.
    pub(crate) fn update(
        &mut self,
        device: &wgpu::Device,
        layouts: &BindGroupLayouts,
        plan: &FramePlan,
        draws: &[Draws<'_>],
        quality: &Quality,
    ) -> Result<Arc<[Arc<ProcessPipelines>]>, BackendError> {
        let cached = self.plans.get(&plan.identity()).map(|cached| &cached.processes);
        let all_fit = |cached: &&Arc<[Arc<ProcessPipelines>]>| {
            cached.iter().zip(draws).all(|(pipelines, draws)| pipelines.fits_draws(draws, quality))
        };
        if let Some(cached) = cached.filter(all_fit) {
            return Ok(Arc::clone(cached));
        }
        let mut processes = cached.map_or_else(Vec::new, |cached| cached.to_vec());
        for (index, (planned, draws)) in plan.processes().iter().zip(draws).enumerate() {
            if processes.get(index).is_some_and(|pipelines| pipelines.fits_draws(draws, quality)) {
                continue;
            }
            let mut all = self.plans.values().flat_map(|cached| cached.processes.iter());
            let fitting = all.find(|pipelines| pipelines.fits(plan, planned, draws, quality)).cloned();
            let pipelines = match fitting {
                Some(fitting) => fitting,
                None => {
                    let label = format!("the shader of {:?}", planned.name.as_str());
                    let create = || ProcessPipelines::new(device, layouts, plan, planned, draws, quality);
                    Arc::new(with_error_scope(device, &label, create)??)
                }
            };
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
        Ok(processes)
    }

    /// The number of pipelines.
    pub(crate) fn pipeline_count(&self) -> usize {
        let mut distinct: Vec<_> = self.plans.values().flat_map(|cached| cached.processes.iter()).collect();
        distinct.sort_by_key(|pipelines| Arc::as_ptr(pipelines));
        distinct.dedup_by_key(|pipelines| Arc::as_ptr(pipelines));
        distinct.into_iter().map(|pipelines| pipelines.by_state().len()).sum()
    }
}
