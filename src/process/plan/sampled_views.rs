//! The targets of other views that processes sample.

use std::collections::HashMap;

use super::planned_target::{accesses, created_target};
use super::target_indices::sampled_target;
use super::{Pass, PlanError, PlannedProcess, PlannedTarget};
use crate::process::{Access, SampledShape, SampledView, list_names, source_of_previous};
use crate::scene::{Camera, ViewKind, child_name};
use crate::view::RenderView;

/// The views that passes sample: those with a process that [samples other
/// views](crate::process::Declare::samples_view).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SampledViews {
    /// Of each such pass, by its process's [sampled views](crate::process::Declaration::sampled_views).
    of_pass: HashMap<Pass, Vec<FoundViews>>,
}

/// What a pass finds by one name.
#[derive(Clone, Debug, PartialEq, Eq)]
struct FoundViews {
    /// The index of the view, one for each layer.
    views: Vec<Option<usize>>,
    /// Whether the pass samples what they held in the frame before.
    is_previous: bool,
}

impl SampledViews {
    pub(super) fn new<'a>(
        processes: &[PlannedProcess],
        views: &[RenderView],
        passes: impl Iterator<Item = &'a Pass>,
    ) -> Self {
        let mut of_pass = HashMap::new();
        if processes.iter().all(|planned| planned.declaration.sampled_views.is_empty()) {
            return Self { of_pass };
        }
        let mut by_name: HashMap<(ViewKind, &str), usize> = HashMap::new();
        for (index, view) in views.iter().enumerate() {
            by_name.entry((view.kind(), view.name())).or_insert(index);
        }
        for pass in passes {
            let declaration = &processes[pass.process_index].declaration;
            let Camera { name: reader, samples_views, .. } = &views[pass.view_index].camera;
            let sampled: Vec<_> = declaration
                .accesses
                .iter()
                .filter_map(|(_, access)| {
                    let (kind, index, is_previous) = match *access {
                        Access::SampleView(kind, index) => (kind, index, false),
                        Access::SampleViewPrevious(kind, index) => (kind, index, true),
                        _ => return None,
                    };
                    let SampledView { name, shape } = &declaration.sampled_views[index];
                    let found_as = |name: &str| -> Vec<Option<usize>> {
                        let find = |name: &str| by_name.get(&(kind, name)).copied();
                        match shape {
                            SampledShape::Picture => vec![find(name)],
                            _ => (0..shape.view_count()).map(|layer| find(&layer_name(name, layer))).collect(),
                        }
                    };
                    let mut found = found_as(&child_name(reader, name));
                    if found.iter().all(Option::is_none) {
                        found = found_as(name);
                    }
                    // A view has no picture of itself yet.
                    if !is_previous && (!samples_views || found.contains(&Some(pass.view_index))) {
                        found.fill(None);
                    }
                    Some(FoundViews { views: found, is_previous })
                })
                .collect();
            if !sampled.is_empty() {
                of_pass.insert(*pass, sampled);
            }
        }
        Self { of_pass }
    }

    /// Whether no pass has to come after other views of the frame.
    pub(super) fn is_unordered(&self) -> bool {
        let samples_none = |found: &FoundViews| found.is_previous || found.views.iter().all(Option::is_none);
        self.of_pass.values().flatten().all(samples_none)
    }

    /// The indices of all views that a pass comes after, because it samples what they draw in the same frame.
    pub(super) fn views_before(&self, pass: Pass) -> impl Iterator<Item = usize> {
        let found = self.of_pass.get(&pass).into_iter().flatten().filter(|found| !found.is_previous);
        found.flat_map(|found| &found.views).flatten().copied()
    }

    /// The indices of the views that a pass samples, one for each layer, by their index among the process's
    /// [sampled views](crate::process::Declaration::sampled_views); `None` for a view that the frame does not have.
    pub fn find(&self, pass: Pass, index: usize) -> &[Option<usize>] {
        self.of_pass.get(&pass).and_then(|found| found.get(index)).map_or(&[], |found| &found.views)
    }
}

/// The name of the view that is a layer of what is sampled as `view`.
pub(super) fn layer_name(view: &str, layer: u32) -> String {
    child_name(view, &layer.to_string())
}

/// # Errors
/// If a process samples a target of other views that no process writes in any view, or that cannot be a layer of an
/// array, or if it samples more layers than a texture has.
pub(super) fn check_sampled_views(processes: &[PlannedProcess], targets: &[PlannedTarget]) -> Result<(), PlanError> {
    for planned in processes {
        for (target, access) in &planned.declaration.accesses {
            let (Access::SampleView(views, index) | Access::SampleViewPrevious(views, index)) = *access else {
                continue;
            };
            let draws_views = processes.iter().any(|other| other.declaration.views == views);
            let found = sampled_target(targets, views, target).map(|index| &targets[index]);
            let found = found.filter(|found| found.views == views || !draws_views);
            let found = found.filter(|found| access.is_previous() || found.name == *target);
            let SampledView { name: view, shape } = planned.declaration.sampled_views[index].clone();
            let process = planned.name.clone();
            let target = source_of_previous(target).filter(|_| access.is_previous()).unwrap_or(target).to_owned();
            let Some(found) = found else {
                let known = targets.iter().filter(|known| known.copy_of.is_none());
                let known = known.filter(|known| known.views == views || !draws_views);
                let known = list_names(known.map(|known| known.name.as_str()));
                return Err(PlanError::UnknownSampledTarget { process, view, target, known });
            };
            let problem = match shape {
                SampledShape::Picture => continue,
                _ if found.multisampled => "it is multisampled",
                _ if has_raw_access(processes, found) => "a raw pass uses it as a texture of its own",
                _ if found.layered => "it is a layer of an array already",
                SampledShape::Layers(0) => "no layer is asked for",
                SampledShape::Layers(count) if count > SampledShape::MAX_LAYERS => "a texture has at most 256 layers",
                _ => continue,
            };
            return Err(PlanError::SampledLayers { process, view, target, problem });
        }
    }
    Ok(())
}

/// The targets that processes sample of kinds of views that the frame does not have, unless a target of the same name
/// in other views has the same format: what samples them finds a pixel of zeros. `absent` are the processes of those
/// kinds.
pub(super) fn absent_targets(
    processes: &[PlannedProcess],
    absent: &[PlannedProcess],
    targets: &[PlannedTarget],
) -> Vec<PlannedTarget> {
    let mut added: Vec<PlannedTarget> = Vec::new();
    for (_, name, access) in accesses(processes) {
        let (Access::SampleView(views, _) | Access::SampleViewPrevious(views, _)) = access else { continue };
        let name = source_of_previous(name).filter(|_| access.is_previous()).unwrap_or(name);
        let mut created =
            accesses(absent).filter(|(planned, other, _)| planned.declaration.views == views && *other == name);
        let Some(created) = created.find_map(|(planned, name, access)| created_target(planned, name, access)) else {
            continue;
        };
        let is_alike = |known: &PlannedTarget| {
            (known.format, known.multisampled, known.layered) == (created.format, created.multisampled, created.layered)
        };
        let found = sampled_target(targets, views, name).map(|index| &targets[index]);
        let is_added = added.iter().any(|known| (known.views, known.name.as_str()) == (views, name));
        if !is_added && !found.is_some_and(is_alike) {
            added.push(created);
        }
    }
    added
}

/// See [`FramePlan::has_raw_access`](super::FramePlan::has_raw_access).
pub(super) fn has_raw_access(processes: &[PlannedProcess], target: &PlannedTarget) -> bool {
    let of_kind = processes.iter().filter(|planned| planned.declaration.views == target.views);
    let mut accesses = of_kind.flat_map(|planned| &planned.declaration.accesses);
    accesses.any(|(name, access)| *name == target.name && access.is_raw())
}
