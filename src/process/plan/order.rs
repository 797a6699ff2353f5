//! The order constraints between processes that reads and writes do not imply.

use super::PlanError;
use crate::graph::NodeId;
use crate::process::{Declaration, InjectionPoint};
use crate::scene::ViewKind;

/// A process that was added to the graph.
pub(super) struct AddedProcess<'a> {
    /// Its slot in the chain, if it is in the chain.
    pub(super) chain_slot: Option<usize>,
    pub(super) name: &'a str,
    pub(super) id: NodeId,
    pub(super) declaration: &'a Declaration,
}

/// The pairs (before, after) that follow from the chain and from what processes declare with `after` and `before`.
///
/// # Errors
/// If a process names one that there is not.
pub(super) fn order_constraints(
    slot_names: &[String],
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
    for own in added {
        for before in &own.declaration.after {
            let known = find(slot_names, added, (own, before), |empty, filled| filled <= empty);
            orders.extend(known.map_err(|error| error.in_process(own, before))?.map(|before| (before, own.id)));
        }
        for after in &own.declaration.before {
            let known = find(slot_names, added, (own, after), |empty, filled| filled >= empty);
            orders.extend(known.map_err(|error| error.in_process(own, after))?.map(|after| (own.id, after)));
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

/// The process of this name; if it is an empty slot of the chain, the process in the nearest filled slot for which
/// `is_on_side(empty, filled)` holds. Of a process that draws in several kinds of views, the one that [`is_for`] `own`.
///
/// # Errors
/// If neither a process nor a slot has this name.
fn find(
    slot_names: &[String],
    added: &[AddedProcess<'_>],
    (own, name): (&AddedProcess<'_>, &str),
    is_on_side: impl Fn(usize, usize) -> bool,
) -> Result<Option<NodeId>, UnknownName> {
    if added.iter().any(|other| other.name == name) {
        let found = added.iter().find(|other| other.name == name && is_for(added, own, other));
        return Ok(found.map(|found| found.id));
    }
    let empty = slot_names.iter().position(|slot_name| slot_name == name).ok_or(UnknownName)?;
    let in_chain = added.iter().filter(|other| is_for(added, own, other));
    let in_chain = in_chain.filter_map(|other| other.chain_slot.map(|slot| (slot, other.id)));
    let nearest = in_chain.filter(|(slot, _)| is_on_side(empty, *slot)).min_by_key(|(slot, _)| slot.abs_diff(empty));
    Ok(nearest.map(|(_, id)| id))
}

/// Whether `own` can refer to this process: not if one of the two also draws in the other one's views.
fn is_for(added: &[AddedProcess<'_>], own: &AddedProcess<'_>, other: &AddedProcess<'_>) -> bool {
    let draws_in_views_of = |process: &AddedProcess<'_>, views: ViewKind| {
        added.iter().any(|same| same.name == process.name && same.declaration.views == views)
    };
    let (own_views, other_views) = (own.declaration.views, other.declaration.views);
    own_views == other_views || !draws_in_views_of(other, own_views) && !draws_in_views_of(own, other_views)
}

/// Neither a process nor a slot has a name.
struct UnknownName;

impl UnknownName {
    fn in_process(self, process: &AddedProcess<'_>, other: &str) -> PlanError {
        PlanError::UnknownProcess { process: process.name.to_owned(), other: other.to_owned() }
    }
}
