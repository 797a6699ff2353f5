//! Errors of targets that no process writes.

use super::planned_target::check_declared_targets;
use super::resource_names::{buffer_name, resource_name};
use super::{PlanError, PlannedProcess, PlannedTarget};
use crate::graph::GraphProblem;
use crate::process::{Access, list_names, source_of_previous};
use crate::scene::ViewKind;

/// The processes of a plan, each with its slot in the chain if it has one.
type Added = [(Option<usize>, PlannedProcess)];

/// The error of a graph in which a problem was found: one that lists the targets if nothing writes a target.
pub(super) fn error_of_graph(added: &Added, problem: GraphProblem) -> PlanError {
    match problem {
        GraphProblem::MissingProducer { resource: target, readers, .. } if !is_buffer(added, &target) => {
            let known = targets_of(added, |_| true);
            match &readers[..] {
                [] => PlanError::UnknownOutput { target, known },
                _ => {
                    let processes = list_names(readers.iter().map(String::as_str));
                    PlanError::UnknownTarget { target, processes, known }
                }
            }
        }
        problem => PlanError::Graph(problem),
    }
}

/// Checks the processes for which `is_checked` holds, by index: those of the engine's that are left out because no
/// output depends on them. The graph only checks what is not left out, and the error of a misspelt target is worth more
/// than the warning that nothing depends on the process. `absent` are the processes of views that the frame does not
/// have, and `imported` the targets that are there without a process that writes them.
///
/// # Errors
/// If one of them names a target that no process creates.
pub(super) fn check_left_out(
    added: &Added,
    is_checked: impl Fn(usize) -> bool,
    absent: &[PlannedProcess],
    imported: &[PlannedTarget],
) -> Result<(), PlanError> {
    for (_, (_, planned)) in added.iter().enumerate().filter(|(index, _)| is_checked(*index)) {
        check_declared_targets(planned)?;
        for (target, access) in &planned.declaration.accesses {
            check_access(added, planned, (target, *access), absent, imported)?;
        }
    }
    Ok(())
}

/// # Errors
/// If a process uses a target that no process creates.
fn check_access(
    added: &Added,
    planned: &PlannedProcess,
    (declared, access): (&String, Access),
    absent: &[PlannedProcess],
    imported: &[PlannedTarget],
) -> Result<(), PlanError> {
    let views = access.views(planned.declaration.views);
    let target = if access.is_previous() { source_of_previous(declared).unwrap_or(declared) } else { declared };
    let sampled_view = match access {
        Access::SampleView(_, index) | Access::SampleViewPrevious(_, index) => {
            Some(planned.declaration.sampled_views[index].name.clone())
        }
        _ => None,
    };
    // Where no process draws such views, what is sampled of them is a pixel in the format of the same target elsewhere.
    let is_anywhere = sampled_view.is_some() && added.iter().all(|(_, other)| other.declaration.views != views);
    let is_created = created_targets(added).any(|(of, name)| name == target && (of == views || is_anywhere));
    let is_absent = absent.iter().flat_map(created_by).any(|(of, name)| name == target && of == views);
    let is_imported = imported.iter().any(|imported| imported.name == *target && imported.views == views);
    if is_created || is_absent || is_imported {
        return Ok(());
    }
    let (process, known) = (planned.name.clone(), targets_of(added, |of| of == views || is_anywhere));
    Err(match sampled_view {
        Some(view) => PlanError::UnknownSampledTarget { process, view, target: target.to_owned(), known },
        None if access.is_previous() => PlanError::NoHistory { process, target: declared.clone(), known },
        None => {
            let (target, processes) = (resource_name(views, target), list_names([process.as_str()].into_iter()));
            PlanError::UnknownTarget { target, processes, known }
        }
    })
}

/// The targets that processes create, each with the kind of its views.
fn created_targets(added: &Added) -> impl Iterator<Item = (ViewKind, &str)> {
    added.iter().flat_map(|(_, planned)| created_by(planned))
}

/// The targets that a process creates.
fn created_by(PlannedProcess { declaration, .. }: &PlannedProcess) -> impl Iterator<Item = (ViewKind, &str)> {
    let created = declaration.accesses.iter().filter(|(_, access)| access.format().is_some());
    created.map(|(target, _)| (declaration.views, target.as_str()))
}

/// The names of the targets that processes create in these kinds of views.
fn targets_of(added: &Added, is_of: impl Fn(ViewKind) -> bool) -> String {
    let names: Vec<_> = created_targets(added)
        .filter(|(views, _)| is_of(*views))
        .map(|(views, target)| resource_name(views, target))
        .collect();
    list_names(names.iter().map(String::as_str))
}

fn is_buffer(added: &Added, resource: &str) -> bool {
    let mut buffers = added.iter().flat_map(|(_, planned)| &planned.declaration.buffers);
    buffers.any(|(buffer, _)| buffer_name(buffer.name) == resource)
}
