//! From processes to the graph of what they read and write, and the order constraints that reads and writes do not
//! imply.

use super::resource_names::{buffer_name, resource_name, views_of_output};
use super::unknown_targets::error_of_graph;
use super::{PlanError, PlannedProcess, PlannedTarget};
use crate::graph::{CompileError, FrameGraph, NodeId, Schedule};
use crate::process::{Access, BufferAccess, Declaration, InjectionPoint, previous_name};
use crate::scene::ViewKind;

/// Orders the processes by what they read and write, and drops those on which no output depends. `added` are the
/// processes in descending priority, each with its slot in the chain if it has one. The nodes of the schedule are their
/// indices. `absent` are those of views that the frame does not have, and `imported` the targets that are there without
/// a process that writes them.
///
/// What a process samples of other views is an output of those: which view that is, and the order of views, depends on
/// the scene. So targets that the remaining processes sample are outputs too, and so are those whose history they read.
///
/// # Errors
/// See [`PlanError`].
pub(super) fn compile(
    slot_names: &[String],
    added: &[(Option<usize>, PlannedProcess)],
    absent: &[PlannedProcess],
    imported: &[PlannedTarget],
    outputs: &[String],
) -> Result<Schedule<usize>, PlanError> {
    let graph = process_graph(slot_names, added, absent, imported, outputs)?;
    let schedule = graph.compile_with_outputs_of(|index| sampled_resources(added, &added[*index].1));
    schedule.map_err(|CompileError { graph, problem, .. }| {
        // What the outputs themselves lack is named before what the views lack that they sample.
        error_of_graph(added, graph.compile().map_or_else(|error| error.problem, |_| problem))
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
    absent: &[PlannedProcess],
    imported: &[PlannedTarget],
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
    // Readers of what an absent process changes find what a frame before left.
    for (buffer, _) in absent
        .iter()
        .flat_map(|planned| &planned.declaration.buffers)
        .filter(|(_, access)| *access == BufferAccess::Change)
    {
        let resource = graph.resource(buffer_name(buffer.name));
        graph.import(resource);
    }
    for target in imported {
        let resource = graph.resource(resource_name(target.views, &target.name));
        graph.import(resource);
    }
    for (before, after) in order_constraints(slot_names, absent, &nodes)? {
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

/// A process that was added to the graph.
pub(super) struct AddedProcess<'a> {
    /// Its slot in the chain, if it is in the chain.
    pub(super) chain_slot: Option<usize>,
    pub(super) name: &'a str,
    pub(super) id: NodeId,
    pub(super) declaration: &'a Declaration,
}

/// The pairs (before, after) that follow from the chain and from what processes declare with `after` and `before`.
/// Nothing is ordered by `absent` processes, those of views that the frame does not have.
///
/// # Errors
/// If a process names one that there is not.
pub(super) fn order_constraints(
    slot_names: &[String],
    absent: &[PlannedProcess],
    added: &[AddedProcess<'_>],
) -> Result<Vec<(NodeId, NodeId)>, PlanError> {
    let mut orders = Vec::new();
    for earlier in added {
        let follows = |later: &&AddedProcess<'_>| {
            later.chain_slot.is_some() && earlier.chain_slot.is_some() && later.chain_slot > earlier.chain_slot
        };
        for later in added.iter().filter(follows) {
            // Also what the later one only reads: so what is ordered after that comes after the earlier one, too.
            let is_used = |target: &str| later.declaration.accesses.iter().any(|(other, _)| other == target);
            if earlier.declaration.views == later.declaration.views && earlier.declaration.written().any(is_used) {
                orders.push((earlier.id, later.id));
            }
        }
    }
    let names = ProcessNames { slots: slot_names, absent, added };
    for own in added {
        for name in &own.declaration.after {
            let before = names.find(own, name, |empty, filled| filled <= empty)?;
            orders.extend(before.map(|before| (before, own.id)));
        }
        for name in &own.declaration.before {
            let after = names.find(own, name, |empty, filled| filled >= empty)?;
            orders.extend(after.map(|after| (own.id, after)));
        }
    }
    // Order is transitive through an empty slot too: what goes before it goes before what comes after it.
    let empty_slot = |name: &String| {
        let slot = slot_names.iter().position(|slot_name| slot_name == name)?;
        added.iter().all(|other| other.chain_slot != Some(slot) && other.name != name.as_str()).then_some(slot)
    };
    for earlier in added {
        let before: Vec<_> = earlier.declaration.before.iter().filter(|name| empty_slot(name).is_some()).collect();
        if before.is_empty() {
            continue;
        }
        for later in added.iter().filter(|later| later.id != earlier.id && is_for(added, earlier, later)) {
            // An empty slot of a place orders only processes that draw in views of one kind.
            let share_places = earlier.declaration.views == later.declaration.views;
            let slot = |name: &String| empty_slot(name).filter(|_| share_places || !InjectionPoint::is_slot(name));
            let Some(before) = before.iter().copied().filter_map(slot).min() else { continue };
            if later.declaration.after.iter().filter_map(slot).any(|after| before <= after) {
                orders.push((earlier.id, later.id));
            }
        }
    }
    Ok(orders)
}

/// What a process can name in `after` and `before`.
struct ProcessNames<'a> {
    slots: &'a [String],
    /// Processes of views that the frame does not have.
    absent: &'a [PlannedProcess],
    added: &'a [AddedProcess<'a>],
}

impl ProcessNames<'_> {
    /// The process of this name; if it is an empty slot of the chain, the process in the nearest filled slot for which
    /// `is_on_side(empty, filled)` holds. Of a process that draws in several kinds of views, the one that [`is_for`]
    /// `own`.
    ///
    /// # Errors
    /// If neither a process, drawn or absent, nor a slot has this name.
    fn find(
        &self,
        own: &AddedProcess<'_>,
        name: &str,
        is_on_side: impl Fn(usize, usize) -> bool,
    ) -> Result<Option<NodeId>, PlanError> {
        let mut named = self.added.iter().filter(|other| other.name == name).peekable();
        if named.peek().is_some() {
            return Ok(named.find(|other| is_for(self.added, own, other)).map(|found| found.id));
        }
        let Some(empty) = self.slots.iter().position(|slot| slot == name) else {
            let is_absent = self.absent.iter().any(|other| other.name == name);
            let unknown = || PlanError::UnknownProcess { process: own.name.to_owned(), other: name.to_owned() };
            return if is_absent { Ok(None) } else { Err(unknown()) };
        };
        let in_chain = self.added.iter().filter(|other| is_for(self.added, own, other));
        let in_chain = in_chain.filter_map(|other| other.chain_slot.map(|slot| (slot, other.id)));
        let on_side = in_chain.filter(|(slot, _)| is_on_side(empty, *slot));
        Ok(on_side.min_by_key(|(slot, _)| slot.abs_diff(empty)).map(|(_, id)| id))
    }
}

/// Whether `own` can refer to this process: not if one of the two also draws in the other one's views.
fn is_for(added: &[AddedProcess<'_>], own: &AddedProcess<'_>, other: &AddedProcess<'_>) -> bool {
    let draws_in_views_of = |process: &AddedProcess<'_>, views: ViewKind| {
        added.iter().any(|same| same.name == process.name && same.declaration.views == views)
    };
    let (own_views, other_views) = (own.declaration.views, other.declaration.views);
    own_views == other_views || !draws_in_views_of(other, own_views) && !draws_in_views_of(own, other_views)
}
