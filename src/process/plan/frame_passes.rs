//! The passes of a frame, in the order in which they are submitted, and the views that they sample.

use std::collections::{HashMap, HashSet};
use std::fmt::{self, Display, Formatter};

use super::{Pass, PlannedProcess, SampledViews};
use crate::graph::{FrameGraph, GraphProblem, NodeId};
use crate::scene::ViewKind;
use crate::view::RenderView;

/// The passes of a frame, in the order in which they are submitted, and the views that they sample.
#[derive(Debug, Default)]
pub(crate) struct FramePasses {
    /// In submission order.
    pub(crate) passes: Vec<Pass>,
    pub(crate) sampled_views: SampledViews,
}

impl FramePasses {
    /// Orders parts, which are submitted as a whole, by what their passes sample of other views, and by the
    /// `dependencies` between processes. Those whose order is open stay in theirs.
    ///
    /// # Errors
    /// If views sample each other in a circle, or views of a part that is submitted process by process sample each
    /// other.
    pub(super) fn new(
        processes: &[PlannedProcess],
        dependencies: &[(usize, usize)],
        views: &[RenderView],
        parts: Vec<Vec<Pass>>,
    ) -> Result<Self, GraphProblem> {
        let sampled_views = SampledViews::new(processes, views, parts.iter().flatten());
        if sampled_views.is_unordered() {
            return Ok(Self { passes: parts.concat(), sampled_views });
        }
        let mut graph = FrameGraph::new();
        let mut nodes = Vec::new();
        let mut nodes_of_view: HashMap<usize, Vec<NodeId>> = HashMap::new();
        let mut nodes_of_process: HashMap<ProcessClass, Vec<NodeId>> = HashMap::new();
        for (index, part) in parts.iter().enumerate() {
            let node = graph.add(part_name(part, processes, views), Some(index));
            graph.keep(node);
            nodes.push(node);
            for pass in part {
                for listed in [
                    nodes_of_view.entry(pass.view_index).or_default(),
                    nodes_of_process.entry(ProcessClass::of(&processes[pass.process_index])).or_default(),
                ] {
                    if listed.last() != Some(&node) {
                        listed.push(node);
                    }
                }
            }
        }
        for (part, node) in parts.iter().zip(&nodes) {
            let sampled = part.iter().flat_map(|pass| sampled_views.views_before(*pass));
            // A view that is cached has no part, as it is complete.
            for before in sampled.filter_map(|view| nodes_of_view.get(&view)).flatten() {
                graph.order(*before, *node);
            }
        }
        let class_of = |process: usize| ProcessClass::of(&processes[process]);
        let mut classes: Vec<_> =
            dependencies.iter().map(|&(before, after)| [class_of(before), class_of(after)]).collect();
        classes.sort_unstable();
        classes.dedup();
        for [before, after] in classes.into_iter().filter(|[before, after]| before != after) {
            let of_class = |class| nodes_of_process.get(&class).map_or(&[][..], Vec::as_slice);
            // A part that is submitted process by process may be on both sides.
            let (before_nodes, after_nodes) = (of_class(before), of_class(after));
            let [is_before, is_after] = [before_nodes, after_nodes].map(|nodes| nodes.iter().collect::<HashSet<_>>());
            // One node in between, instead of an order for each pair.
            let between = graph.add(format!("{before} before {after}"), None);
            graph.keep(between);
            for node in before_nodes.iter().filter(|node| !is_after.contains(node)) {
                graph.order(*node, between);
            }
            for node in after_nodes.iter().filter(|node| !is_before.contains(node)) {
                graph.order(between, *node);
            }
        }
        let schedule = graph.compile().map_err(|error| error.problem)?;
        let ordered = schedule.nodes().filter_map(|(_, index)| *index);
        Ok(Self { passes: ordered.flat_map(|index| parts[index].iter().copied()).collect(), sampled_views })
    }
}

/// What decides which parts a dependency between two processes orders.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
struct ProcessClass {
    views: ViewKind,
    once_a_frame: bool,
}

impl ProcessClass {
    fn of(planned: &PlannedProcess) -> Self {
        Self { views: planned.declaration.views, once_a_frame: planned.declaration.once_a_frame }
    }
}

impl Display for ProcessClass {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let often = if self.once_a_frame { "once a frame in " } else { "" };
        write!(formatter, "{often}{} views", self.views.name())
    }
}

/// The name of a part in errors.
fn part_name(part: &[Pass], processes: &[PlannedProcess], views: &[RenderView]) -> String {
    let mut indices: Vec<_> = part.iter().map(|pass| pass.view_index).collect();
    indices.sort_unstable();
    indices.dedup();
    let named: Vec<_> = indices.iter().map(|view| format!("view {view} {:?}", views[*view].name())).collect();
    let name = named.join(" and ");
    match part.first() {
        Some(pass) if named.len() == 1 && processes[pass.process_index].declaration.once_a_frame => {
            format!("what is drawn once a frame in {name}")
        }
        _ if named.len() > 1 => format!("{name}, process by process"),
        _ => name,
    }
}
