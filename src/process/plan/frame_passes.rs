//! The passes of a frame, in the order in which they are submitted, and the views that they sample.

use std::collections::HashMap;

use super::{Pass, PlannedProcess};
use crate::graph::{FrameGraph, GraphProblem};
use crate::process::Access;
use crate::scene::{ViewKind, child_name};
use crate::view::RenderView;

/// The passes of a frame, in the order in which they are submitted, and the views that they sample.
#[derive(Debug, Default)]
pub(crate) struct FramePasses {
    /// In submission order.
    pub(crate) passes: Vec<Pass>,
    pub(crate) sampled_views: SampledViews,
}

/// The views that passes sample: those with a process that [samples other views](crate::process::Declare::samples_view).
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SampledViews {
    /// Of each such pass, by its process's [sampled views](crate::process::Declaration::sampled_views): the view's index.
    of_pass: HashMap<Pass, Vec<Option<usize>>>,
}

impl FramePasses {
    /// Orders parts, which are submitted as a whole, by what their passes sample of other views. Those whose order is open stay in theirs.
    ///
    /// # Errors
    /// If views sample each other in a circle.
    pub(super) fn new(
        processes: &[PlannedProcess],
        views: &[RenderView],
        parts: Vec<Vec<Pass>>,
    ) -> Result<Self, GraphProblem> {
        let sampled_views = SampledViews::new(processes, views, parts.iter().flatten());
        if sampled_views.of_pass.is_empty() {
            return Ok(Self { passes: parts.concat(), sampled_views });
        }
        let mut graph = FrameGraph::new();
        let mut part_of_view = HashMap::new();
        let mut nodes = Vec::new();
        for (index, part) in parts.iter().enumerate() {
            let Some(view) = part.first().map(|pass| pass.view_index) else { continue };
            let node = graph.add(format!("view {view} {:?}", views[view].name()), index);
            graph.keep(node);
            nodes.push((node, index));
            part_of_view.extend(part.iter().map(|pass| (pass.view_index, node)));
        }
        for (node, index) in nodes {
            let sampled = parts[index].iter().filter_map(|pass| sampled_views.of_pass.get(pass)).flatten().flatten();
            // A view that is cached has no part, as it is complete.
            for before in sampled.filter_map(|view| part_of_view.get(view)) {
                graph.order(*before, node);
            }
        }
        let schedule = graph.compile().map_err(|error| error.problem)?;
        let passes = schedule.nodes().flat_map(|(_, index)| parts[*index].iter().copied()).collect();
        Ok(Self { passes, sampled_views })
    }
}

impl SampledViews {
    fn new<'a>(processes: &[PlannedProcess], views: &[RenderView], passes: impl Iterator<Item = &'a Pass>) -> Self {
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
            let reader = views[pass.view_index].name();
            let sampled: Vec<_> = declaration
                .accesses
                .iter()
                .filter_map(|(_, access)| {
                    let Access::SampleView(kind, index) = *access else { return None };
                    let view = declaration.sampled_views[index].as_str();
                    let child = child_name(reader, view);
                    let found = by_name.get(&(kind, child.as_str())).or_else(|| by_name.get(&(kind, view))).copied();
                    // A view has no picture of itself yet.
                    Some(found.filter(|found| *found != pass.view_index))
                })
                .collect();
            if !sampled.is_empty() {
                of_pass.insert(*pass, sampled);
            }
        }
        Self { of_pass }
    }

    /// The index of the view that a pass samples, by its index among the process's
    /// [sampled views](crate::process::Declaration::sampled_views); `None` if the frame does not have it.
    pub fn find(&self, pass: Pass, index: usize) -> Option<usize> {
        self.of_pass.get(&pass).and_then(|views| views.get(index).copied().flatten())
    }
}
