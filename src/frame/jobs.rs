//! The frame's job graph: which phase waits for which.

use std::mem::{Discriminant, discriminant};
use std::sync::Arc;

use super::FrameError;
use super::cost_model::CostModel;
use super::occlusion::{Payoff, occluders};
use super::phase::{FrameNode, PassTable, Phase};
use crate::command::Selection;
use crate::graph::{FrameGraph, NodeId, Schedule};
use crate::process::{Draws, FramePlan, Pass};
use crate::scene::ViewKind;
use crate::timeline::Labels;
use crate::view::RenderView;

/// What a frame's jobs are, for one plan and one list of views.
pub(super) struct FrameJobs {
    pub(super) schedule: Schedule<FrameNode>,
    /// What they cost.
    pub(super) costs: CostModel,
    /// In the order they are submitted: by process, then by view.
    pub(super) passes: Vec<Pass>,
    /// What the jobs were drawn up for.
    pub(super) plan: Arc<FramePlan>,
    /// Name and kind of each, and whether it is kept.
    views: Vec<(String, ViewKind, bool)>,
    selections: Vec<Option<Selection>>,
    /// Whether what each process draws hides what is behind it.
    hides: Vec<bool>,
    /// In what squares what is hidden is looked for.
    occlusion: Option<u32>,
    /// Whether triangles are looked at.
    culls_triangles: bool,
    /// For each view, which objects hide others; `None` where that is not looked for.
    pub(super) occluders: Vec<Option<Vec<Selection>>>,
    /// For each view, whether it pays.
    pub(super) payoffs: Vec<Payoff>,
}

impl FrameJobs {
    /// Draws up the jobs: each process in each view of its kind that is not kept goes through its phases one after the other,
    /// and nothing else waits for anything. The order of passes concerns the device alone, so it binds submission, not
    /// recording. If `occlusion`, what is hidden is looked for where it can be; if `culls_triangles`, triangles are looked at.
    ///
    /// # Errors
    /// If a view is drawn by no process.
    pub(super) fn new(
        plan: &Arc<FramePlan>,
        draws: &[Draws<'_>],
        views: &[RenderView],
        occlusion: Option<u32>,
        culls_triangles: bool,
    ) -> Result<Self, FrameError> {
        let passes = passes_of(plan, views);
        for (index, view) in views.iter().enumerate() {
            if !view.is_cached && !passes.iter().any(|pass| pass.view == index) {
                return Err(FrameError::NoProcess { view: view.name().to_owned(), kind: view.kind() });
            }
        }

        let of_view = |view| occlusion.and_then(|_| occluders(plan, draws, &passes, view));
        let occluders: Vec<_> = views.iter().enumerate().map(of_view).collect();
        let mut nodes = Nodes::default();
        let objects = nodes.add("objects".to_owned(), Phase::Objects, None, Labels::default(), None);
        nodes.add("upload objects".to_owned(), Phase::Upload, None, Labels::default(), Some(objects));

        let mut compacted = vec![None; views.len()];
        for (index, pass) in passes.iter().enumerate() {
            let process = &plan.processes()[pass.process].process;
            let view = pass.view;
            let view_name = format!("view {view} {:?}", views[view].name());
            let of_view = Labels { view: Some(views[view].name().to_owned()), ..Labels::default() };
            let of_pass = Labels { process: Some(process.name().to_owned()), ..of_view.clone() };
            let mut previous = None;
            if draws[pass.process].selection().is_some() {
                let seen = *compacted[view].get_or_insert_with(|| {
                    let name = format!("visibility, {view_name}");
                    let mut seen = nodes.add(name, Phase::Visibility { view }, None, of_view.clone(), Some(objects));
                    let phases = [Phase::Occluders { view }, Phase::CoarseDepth { view }, Phase::Occlusion { view }];
                    for phase in phases.into_iter().filter(|_| occluders[view].is_some()) {
                        let name = format!("{}, {view_name}", phase.name());
                        seen = nodes.add(name, phase, None, of_view.clone(), Some(seen));
                    }
                    let name = format!("compact, {view_name}");
                    nodes.add(name, Phase::Compact { view }, None, of_view.clone(), Some(seen))
                });
                previous = Some(seen);
                let looks_on =
                    |phase: &Phase| culls_triangles || !matches!(phase, Phase::Join { .. } | Phase::Triangles { .. });
                let phases = [
                    Phase::Fill { pass: index },
                    Phase::Split { pass: index },
                    Phase::Sort { pass: index },
                    Phase::Instance { pass: index },
                    Phase::Join { pass: index },
                    Phase::Triangles { pass: index },
                    Phase::Prepare { pass: index },
                    Phase::Record { pass: index },
                ];
                for phase in phases.into_iter().filter(looks_on) {
                    let name = format!("{}, {view_name}, {}", process.name(), phase.name());
                    previous = Some(nodes.add(name, phase, Some(pass.process), of_pass.clone(), previous));
                }
            }
            let name = format!("{}, {view_name}, finish", process.name());
            nodes.add(name, Phase::Finish { pass: index }, Some(pass.process), of_pass, previous);
        }
        let Nodes { graph, kinds, count } = nodes;
        let costs = CostModel::new(kinds.len(), count);
        let schedule = graph.compile().map_err(|error| FrameError::Jobs(error.problem))?;
        let views = views.iter().map(|view| (view.name().to_owned(), view.kind(), view.is_cached)).collect();
        let selections = draws.iter().map(Draws::selection).collect();
        let hides = draws.iter().map(Draws::hides).collect();
        let payoffs = vec![Payoff::default(); occluders.len()];
        let plan = Arc::clone(plan);
        Ok(Self {
            schedule,
            costs,
            passes,
            plan,
            views,
            selections,
            hides,
            occlusion,
            culls_triangles,
            occluders,
            payoffs,
        })
    }

    /// Whether they are what this plan, these draws and these views need.
    pub(super) fn fit(
        &self,
        plan: &FramePlan,
        draws: &[Draws<'_>],
        views: &[RenderView],
        occlusion: Option<u32>,
        culls_triangles: bool,
    ) -> bool {
        let names = self.views.iter().map(|(name, kind, is_cached)| (name.as_str(), *kind, *is_cached));
        self.plan.identity() == plan.identity()
            && self.occlusion == occlusion
            && self.culls_triangles == culls_triangles
            && self.hides.iter().copied().eq(draws.iter().map(Draws::hides))
            && names.eq(views.iter().map(|view| (view.name(), view.kind(), view.is_cached)))
            && self.selections.iter().copied().eq(draws.iter().map(Draws::selection))
    }

    /// Makes `tables` one for each pass, with room for a frame of `objects` objects.
    pub(super) fn reset(&self, tables: &mut Vec<PassTable>, objects: usize) {
        tables.resize_with(self.passes.len(), PassTable::default);
        for (pass, table) in self.passes.iter().zip(tables) {
            table.reset(self.selections[pass.process], objects, self.culls_triangles);
        }
    }
}

/// The nodes of a frame's job graph, as they come.
#[derive(Default)]
struct Nodes {
    graph: FrameGraph<FrameNode>,
    /// A phase of a process is of one kind in all its views. Each is told by any of its nodes.
    kinds: Vec<(Discriminant<Phase>, Option<usize>)>,
    count: usize,
}

impl Nodes {
    /// Adds a phase, of a process if it is of one, which comes after another. The labels lack the phase. To split is to
    /// decide how large the jobs are that sort, so the two are of one kind.
    fn add(
        &mut self,
        name: String,
        phase: Phase,
        process: Option<usize>,
        labels: Labels,
        after: Option<NodeId>,
    ) -> NodeId {
        let known_as = match phase {
            Phase::Sort { pass } => Phase::Split { pass },
            other => other,
        };
        let kind = (discriminant(&known_as), process);
        let place = self.kinds.iter().position(|known| *known == kind);
        let place = place.unwrap_or_else(|| {
            self.kinds.push(kind);
            self.kinds.len() - 1
        });
        let id = self.graph.add(name, FrameNode { phase, node: self.count, kind: place });
        self.count += 1;
        self.graph.label(id, Labels { stage: Some(phase.name().to_owned()), ..labels });
        self.graph.keep(id);
        if let Some(after) = after {
            self.graph.order(after, id);
        }
        id
    }
}

/// The jobs that were drawn up so far, the latest first. Scenes change what they require and change back, and then the jobs
/// are there already; those that were not needed for longest are dropped.
#[derive(Default)]
pub(super) struct JobsCache {
    latest_first: Vec<FrameJobs>,
}

impl JobsCache {
    const MOST: usize = 16;

    /// The jobs of a frame.
    ///
    /// # Errors
    /// As [`FrameJobs::new`].
    pub(super) fn find(
        &mut self,
        plan: &Arc<FramePlan>,
        draws: &[Draws<'_>],
        views: &[RenderView],
        occlusion: Option<u32>,
        culls_triangles: bool,
    ) -> Result<&mut FrameJobs, FrameError> {
        let found =
            match self.latest_first.iter().position(|jobs| jobs.fit(plan, draws, views, occlusion, culls_triangles)) {
                Some(index) => self.latest_first.remove(index),
                None => FrameJobs::new(plan, draws, views, occlusion, culls_triangles)?,
            };
        self.latest_first.truncate(Self::MOST - 1);
        self.latest_first.insert(0, found);
        Ok(&mut self.latest_first[0])
    }

    /// Those of the last frame; `None` before the first one.
    pub(super) fn latest(&self) -> Option<&FrameJobs> {
        self.latest_first.first()
    }
}

fn passes_of(plan: &FramePlan, views: &[RenderView]) -> Vec<Pass> {
    let mut passes = Vec::new();
    for (process, planned) in plan.processes().iter().enumerate() {
        let is_drawn = |view: &RenderView| view.kind() == planned.declaration.views && !view.is_cached;
        for (view, _) in views.iter().enumerate().filter(|(_, view)| is_drawn(view)) {
            passes.push(Pass { process, view });
        }
    }
    passes
}
