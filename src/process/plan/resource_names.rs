//! The names of targets and buffers in the graph of processes, and which of them are outputs.

use super::PlannedProcess;
use crate::process::{BufferAccess, Declaration};
use crate::scene::ViewKind;

/// A buffer's name in the graph.
pub(super) fn buffer_name(buffer: &str) -> String {
    format!("buffer {buffer}")
}

/// The names of the targets and buffers that one process writes and another then uses, for an edge's label.
pub(super) fn passed_on_resources(before: &Declaration, after: &Declaration) -> String {
    let mut names: Vec<_> = after
        .accesses
        .iter()
        .filter_map(|(target, access)| {
            let same_views = access.views(after.views) == before.views;
            (access.reads() && same_views && before.written().any(|written| written == target))
                .then_some(target.as_str())
        })
        .collect();
    let changed = before.buffers.iter().filter(|(_, access)| *access == BufferAccess::Change).map(|(buffer, _)| buffer);
    let used = changed.filter(|changed| after.buffers.iter().any(|(buffer, _)| buffer == *changed));
    names.extend(used.map(|buffer| buffer.name));
    // A process may test and sample the same target.
    names.sort_unstable();
    names.dedup();
    names.join(", ")
}

/// The kinds of views whose target of this name is an output: those in which processes write it that declare to draw
/// there. In further kinds of views they draw what others sample. Main views if there is none.
pub(super) fn views_of_output<'a>(processes: impl Iterator<Item = &'a PlannedProcess>, output: &str) -> Vec<ViewKind> {
    let writers = processes.filter(|planned| planned.is_output_writer(output));
    let kinds: Vec<_> = writers.map(|planned| planned.declaration.views).collect();
    if kinds.is_empty() { vec![ViewKind::Main] } else { kinds }
}

/// A target's name in the graph. Views of different kinds have different targets, even if their names are the same.
pub(super) fn resource_name(kind: ViewKind, target: &str) -> String {
    let rules = kind.rules();
    if rules.has_plain_names { target.to_owned() } else { format!("{}: {target}", rules.name) }
}
