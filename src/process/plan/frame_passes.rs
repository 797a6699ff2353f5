//! The passes of a frame and the views that they sample, in the order in which a frame's views are submitted.

use std::collections::{HashMap, HashSet};
use std::fmt::{self, Display, Formatter};

use super::{Pass, PlannedProcess, SampledViews};
use crate::graph::{FrameGraph, GraphProblem, NodeId};
use crate::process::Access;
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

/// The views of some kinds, and the order in which their passes are submitted. A plan has its groups in submission
/// order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ViewGroup {
    /// The kinds of the views, ascending.
    pub kinds: Vec<ViewKind>,
    /// The order of the passes.
    pub order: ViewOrder,
}

/// The order in which the passes of several views are submitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewOrder {
    /// One view after the other, each with its whole queue (M listing 10.7).
    ViewByView,
    /// One process after the other, each in all views: the exception, for views that depend on each other.
    ProcessByProcess,
}

impl ViewGroup {
    /// The passes of the group's views in submission order, in parts that nothing is submitted between: for each kind
    /// what draws once a frame, then a part for each view; or one part for all if they are submitted process by
    /// process. A view whose picture is cached has none.
    pub(super) fn parts(&self, processes: &[PlannedProcess], views: &[RenderView]) -> Vec<Vec<Pass>> {
        let (mut parts, mut is_begun): (Vec<Vec<Pass>>, _) = (Vec::new(), [false; ViewKind::COUNT]);
        let drawn = |(_, view): &(usize, &RenderView)| self.kinds.contains(&view.kind()) && !view.is_cached();
        for (view_index, kind) in views.iter().enumerate().filter(drawn).map(|(index, view)| (index, view.kind())) {
            let is_first = !std::mem::replace(&mut is_begun[kind as usize], true);
            let mut passes_of = |once_a_frame: bool| {
                let of_kind = |(_, planned): &(usize, &PlannedProcess)| {
                    planned.declaration.views == kind && planned.declaration.once_a_frame == once_a_frame
                };
                let of_kind = processes.iter().enumerate().filter(of_kind);
                let passes: Vec<_> = of_kind.map(|(process_index, _)| Pass { process_index, view_index }).collect();
                parts.extend((!passes.is_empty()).then_some(passes));
            };
            if is_first {
                passes_of(true);
            }
            passes_of(false);
        }
        if self.order == ViewOrder::ProcessByProcess {
            let mut passes: Vec<Pass> = parts.concat();
            passes.sort_unstable_by_key(|pass| (pass.process_index, pass.view_index));
            parts = if passes.is_empty() { Vec::new() } else { vec![passes] };
        }
        parts
    }
}

/// Groups the kinds of views that a plan draws. `edges` are the dependencies between processes, by index.
///
/// A kind is submitted after the kinds that it depends on. Kinds that depend on each other are one group, process by
/// process; so is a kind whose views read the layers of all views of that kind, or that has a process which draws once
/// a frame, after one that draws in each view.
pub(super) fn view_groups(processes: &[PlannedProcess], edges: &[(usize, usize)]) -> Vec<ViewGroup> {
    let kind_of = |process: usize| processes[process].declaration.views;
    let mut kinds: Vec<_> = processes.iter().map(|planned| planned.declaration.views).collect();
    kinds.sort_unstable();
    kinds.dedup();

    // Whether a kind must precede another, directly or through a third.
    let mut precedes = [[false; ViewKind::COUNT]; ViewKind::COUNT];
    for &(before, after) in edges.iter().filter(|(before, after)| kind_of(*before) != kind_of(*after)) {
        precedes[kind_of(before) as usize][kind_of(after) as usize] = true;
    }
    for &(before, after) in edges.iter().filter(|(before, after)| kind_of(*before) == kind_of(*after)) {
        let [before, after] = [before, after].map(|process| &processes[process].declaration);
        precedes[after.views as usize][after.views as usize] |= after.once_a_frame && !before.once_a_frame;
    }
    for planned in processes {
        let kind = planned.declaration.views;
        let reads_own_layers = |(_, access): &(String, Access)| *access == Access::SampleLayers(kind);
        precedes[kind as usize][kind as usize] |= planned.declaration.accesses.iter().any(reads_own_layers);
    }
    for middle in 0..ViewKind::COUNT {
        for before in 0..ViewKind::COUNT {
            for after in 0..ViewKind::COUNT {
                precedes[before][after] |= precedes[before][middle] && precedes[middle][after];
            }
        }
    }

    let mut groups = Vec::new();
    while let Some(next) = kinds.iter().copied().find(|kind| {
        let must_come_after =
            |other: &ViewKind| precedes[*other as usize][*kind as usize] && !precedes[*kind as usize][*other as usize];
        !kinds.iter().any(must_come_after)
    }) {
        let is_mutual =
            |kind: &ViewKind| precedes[*kind as usize][next as usize] && precedes[next as usize][*kind as usize];
        let order = if is_mutual(&next) { ViewOrder::ProcessByProcess } else { ViewOrder::ViewByView };
        let (group, rest) = kinds.into_iter().partition(|kind| *kind == next || is_mutual(kind));
        kinds = rest;
        groups.push(ViewGroup { kinds: group, order });
    }
    groups
}
