//! The frame's job graph: which phase waits for which.

use std::sync::Arc;

use super::FrameError;
use super::phase::{PassTable, Phase};
use crate::graph::{FrameGraph, Schedule};
use crate::process::{Draws, FramePlan, Pass};
use crate::queue::Selection;
use crate::scene::ViewKind;
use crate::view::RenderView;

/// What a frame's jobs are, for one plan and one list of views.
pub(super) struct FrameJobs {
    pub(super) schedule: Schedule<Phase>,
    /// In the order they are submitted: by process, then by view.
    pub(super) passes: Vec<Pass>,
    /// What the jobs were drawn up for.
    pub(super) plan: Arc<FramePlan>,
    views: Vec<(String, ViewKind)>,
    selections: Vec<Option<Selection>>,
}

impl FrameJobs {
    /// Draws up the jobs: each process in each view of its kind goes through its phases one after the other, and nothing
    /// else waits for anything. The order of passes concerns the device alone, so it binds submission, not recording.
    ///
    /// # Errors
    /// If a view is drawn by no process.
    pub(super) fn new(plan: &Arc<FramePlan>, draws: &[Draws<'_>], views: &[RenderView]) -> Result<Self, FrameError> {
        let passes = passes_of(plan, views);
        for (index, view) in views.iter().enumerate() {
            if !passes.iter().any(|pass| pass.view == index) {
                return Err(FrameError::NoProcess { view: view.name().to_owned(), kind: view.kind() });
            }
        }

        let mut graph = FrameGraph::new();
        let objects = graph.add("objects", Phase::Objects);
        let upload = graph.add("upload objects", Phase::Upload);
        graph.order(objects, upload);
        graph.keep(objects);
        graph.keep(upload);

        let mut compacted = vec![None; views.len()];
        for (index, pass) in passes.iter().enumerate() {
            let process = &plan.processes()[pass.process].process;
            let view = pass.view;
            let view_name = format!("view {view} {:?}", views[view].name());
            let mut add = |name: String, phase, after| {
                let id = graph.add(name, phase);
                graph.keep(id);
                if let Some(after) = after {
                    graph.order(after, id);
                }
                id
            };
            let mut previous = None;
            if draws[pass.process].selection().is_some() {
                let seen = *compacted[view].get_or_insert_with(|| {
                    let seen = add(format!("visibility, {view_name}"), Phase::Visibility { view }, Some(objects));
                    add(format!("compact, {view_name}"), Phase::Compact { view }, Some(seen))
                });
                previous = Some(seen);
                for (phase, name) in [
                    (Phase::Fill { pass: index }, "fill"),
                    (Phase::Split { pass: index }, "split"),
                    (Phase::Sort { pass: index }, "sort"),
                    (Phase::Instance { pass: index }, "instance"),
                    (Phase::Prepare { pass: index }, "prepare"),
                    (Phase::Record { pass: index }, "record"),
                ] {
                    previous = Some(add(format!("{}, {view_name}, {name}", process.name()), phase, previous));
                }
            }
            add(format!("{}, {view_name}, finish", process.name()), Phase::Finish { pass: index }, previous);
        }
        let schedule = graph.compile().map_err(|error| FrameError::Jobs(error.problem))?;
        let views = views.iter().map(|view| (view.name().to_owned(), view.kind())).collect();
        let selections = draws.iter().map(Draws::selection).collect();
        Ok(Self { schedule, passes, plan: Arc::clone(plan), views, selections })
    }

    /// Whether they are what this plan, these draws and these views need.
    pub(super) fn fit(&self, plan: &FramePlan, draws: &[Draws<'_>], views: &[RenderView]) -> bool {
        let names = self.views.iter().map(|(name, kind)| (name.as_str(), *kind));
        self.plan.identity() == plan.identity()
            && names.eq(views.iter().map(|view| (view.name(), view.kind())))
            && self.selections.iter().copied().eq(draws.iter().map(Draws::selection))
    }

    /// Makes `tables` one for each pass, with room for a frame of `objects` objects.
    pub(super) fn reset(&self, tables: &mut Vec<PassTable>, objects: usize) {
        tables.resize_with(self.passes.len(), PassTable::default);
        for (pass, table) in self.passes.iter().zip(tables) {
            table.reset(self.selections[pass.process], objects);
        }
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
    ) -> Result<&mut FrameJobs, FrameError> {
        let found = match self.latest_first.iter().position(|jobs| jobs.fit(plan, draws, views)) {
            Some(index) => self.latest_first.remove(index),
            None => FrameJobs::new(plan, draws, views)?,
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
        for (view, _) in views.iter().enumerate().filter(|(_, view)| view.kind() == planned.declaration.views) {
            passes.push(Pass { process, view });
        }
    }
    passes
}
