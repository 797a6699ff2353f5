//! The targets of other views that processes sample.

use super::{PlanError, PlannedProcess, PlannedTarget};
use crate::process::Access;
use crate::scene::ViewKind;

/// # Errors
/// If a process samples a target of other views that no process writes in any view.
pub(super) fn check_sampled_views(processes: &[PlannedProcess], targets: &[PlannedTarget]) -> Result<(), PlanError> {
    for planned in processes {
        for (target, access) in &planned.declaration.accesses {
            let Access::SampleView(views, index) = *access else { continue };
            let draws_views = processes.iter().any(|other| other.declaration.views == views);
            let found = sampled_target(targets, views, target).filter(|found| found.views == views || !draws_views);
            if found.is_none() {
                let view = planned.declaration.sampled_views[index].clone();
                return Err(PlanError::UnknownSampledTarget {
                    process: planned.name.clone(),
                    view,
                    target: target.clone(),
                });
            }
        }
    }
    Ok(())
}

/// See [`FramePlan::sampled_target`](super::FramePlan::sampled_target).
pub(super) fn sampled_target<'a>(
    targets: &'a [PlannedTarget],
    views: ViewKind,
    name: &str,
) -> Option<&'a PlannedTarget> {
    let named = || targets.iter().filter(|target| target.name == name);
    named().find(|target| target.views == views).or_else(|| named().next())
}
