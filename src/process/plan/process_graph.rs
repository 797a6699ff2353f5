//! From processes to the graph of what they read and write.

use super::order::{AddedProcess, order_constraints};
use super::resource_names::{buffer_name, resource_name, views_of_output};
use super::{PlanError, PlannedProcess, PlannedTarget};
use crate::graph::{CompileError, FrameGraph, Schedule};
use crate::process::{Access, BufferAccess, previous_name};
use crate::scene::ViewKind;

/// Orders the processes by what they read and write, and drops those on which no output depends. `added` are the
/// processes in descending priority, each with its slot in the chain if it has one. The nodes of the schedule are their
/// indices.
///
/// What a process samples of other views is an output of those: which view that is, and the order of views, depends on
/// the scene. So targets that the remaining processes sample are outputs too, and so are those whose history they read.
///
/// # Errors
/// See [`PlanError`].
pub(super) fn compile(
    slot_names: &[String],
    added: &[(Option<usize>, PlannedProcess)],
    imported: Option<&PlannedTarget>,
    outputs: &[String],
) -> Result<Schedule<usize>, PlanError> {
    let graph = process_graph(slot_names, added, imported, outputs)?;
    let schedule = graph.compile_with_outputs_of(|index| sampled_resources(added, &added[*index].1));
    schedule.map_err(|CompileError { graph, problem, .. }| {
        // What the outputs themselves lack is named before what the views lack that they sample.
        PlanError::Graph(graph.compile().map_or_else(|error| error.problem, |_| problem))
    })
}

/// The names of the resources that a process samples in other views, or as they were in the frame before.
fn sampled_resources(added: &[(Option<usize>, PlannedProcess)], planned: &PlannedProcess) -> Vec<String> {
    let mut resources = Vec::new();
    for (target, access) in &planned.declaration.accesses {
        let (views, is_history) = match *access {
            Access::SampleView(views, _) => (views, false),
            Access::SampleViewPrevious(views, _) => (views, true),
            Access::SamplePrevious => (planned.declaration.views, true),
            _ => continue,
        };
        let of_views = added.iter().filter(|(_, other)| other.declaration.views == views);
        let mut written = of_views.flat_map(|(_, other)| other.declaration.written());
        let is_sampled =
            |written: &&str| if is_history { previous_name(written) == *target } else { written == target };
        resources.extend(written.find(is_sampled).map(|written| resource_name(views, written)));
    }
    resources
}

fn process_graph(
    slot_names: &[String],
    added: &[(Option<usize>, PlannedProcess)],
    imported: Option<&PlannedTarget>,
    outputs: &[String],
) -> Result<FrameGraph<usize>, PlanError> {
    let mut graph = FrameGraph::new();
    let mut nodes: Vec<AddedProcess<'_>> = Vec::new();
    for (index, (chain_slot, planned)) in added.iter().enumerate() {
        let PlannedProcess { name, declaration, .. } = planned;
        let id = graph.add(node_name(added, planned), index);
        for (target, access) in &declaration.accesses {
            if access.is_previous() {
                continue;
            }
            let resource = graph.resource(resource_name(access.views(declaration.views), target));
            if access.reads() {
                graph.read(id, resource);
            }
            if access.writes() {
                graph.write(id, resource);
            }
        }
        for (buffer, access) in &declaration.buffers {
            let resource = graph.resource(buffer_name(buffer.name));
            graph.read(id, resource);
            if *access == BufferAccess::Change {
                graph.write(id, resource);
            }
            if *access == BufferAccess::Change || buffer.is_filled_by_nodes {
                // The first to change it finds what the frame before left, or what nodes have filled it with.
                graph.import(resource);
            }
        }
        if declaration.keep {
            graph.keep(id);
        }
        nodes.push(AddedProcess { chain_slot: *chain_slot, name, id, declaration });
    }
    if let Some(target) = imported {
        let resource = graph.resource(resource_name(target.views, &target.name));
        graph.import(resource);
    }
    for (before, after) in order_constraints(slot_names, &nodes)? {
        graph.order(before, after);
    }
    for output in outputs {
        for kind in views_of_output(added.iter().map(|(_, planned)| planned), output) {
            let resource = graph.resource(resource_name(kind, output));
            graph.output(resource);
        }
    }
    Ok(graph)
}

/// The name of a process, with the kind of view if it draws in main views too. Two processes of the same name and kind
/// keep it, so that the graph reports it.
pub(super) fn node_name(added: &[(Option<usize>, PlannedProcess)], planned: &PlannedProcess) -> String {
    let views = planned.declaration.views;
    let named =
        || added.iter().filter(|(_, other)| other.name == planned.name).map(|(_, other)| other.declaration.views);
    let has_plain_names = |kind: ViewKind| kind.rules().has_plain_names;
    if has_plain_names(views) || named().filter(|kind| *kind == views).count() > 1 || !named().any(has_plain_names) {
        return planned.name.clone();
    }
    format!("{} in {} views", planned.name, views.name())
}
