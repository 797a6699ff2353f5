//! The frame's job graph: which phase waits for which.

use super::FrameError;
use super::phase::{PassTable, Phase};
use crate::graph::{FrameGraph, Schedule};
use crate::process::{Draws, FramePlan, Pass};
use crate::queue::Selection;
use crate::scene::ViewKind;
use crate::view::RenderView;

/// What a frame's jobs are, for one list of views. It stays the same until views come or go.
pub(super) struct FrameJobs {
    pub(super) schedule: Schedule<Phase>,
    /// In the order they are submitted: by process, then by view.
    pub(super) passes: Vec<Pass>,
    /// What the jobs were drawn up for.
    views: Vec<(String, ViewKind)>,
    selections: Vec<Option<Selection>>,
}

impl FrameJobs {
    /// Draws up the jobs: each process in each view of its kind goes through its phases one after the other, and nothing
    /// else waits for anything. The order of passes concerns the device alone, so it binds submission, not recording.
    ///
    /// # Errors
    /// If a view is drawn by no process.
    pub(super) fn new(plan: &FramePlan, draws: &[Draws<'_>], views: &[RenderView]) -> Result<Self, FrameError> {
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
            if selection_of(&draws[pass.process]).is_some() {
                let seen = *compacted[view].get_or_insert_with(|| {
                    let seen = add(format!("visibility, {view_name}"), Phase::Visibility { view }, Some(objects));
                    add(format!("compact, {view_name}"), Phase::Compact { view }, Some(seen))
                });
                previous = Some(seen);
                for (phase, name) in [
                    (Phase::Fill { pass: index }, "fill"),
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
        Ok(Self { schedule, passes, views, selections: draws.iter().map(selection_of).collect() })
    }

    /// Whether they still are what these draws and views need.
    pub(super) fn fit(&self, draws: &[Draws<'_>], views: &[RenderView]) -> bool {
        let names = self.views.iter().map(|(name, kind)| (name.as_str(), *kind));
        names.eq(views.iter().map(|view| (view.name(), view.kind())))
            && self.selections.iter().copied().eq(draws.iter().map(selection_of))
    }

    /// Empty tables for the passes.
    pub(super) fn pass_tables(&self) -> Vec<PassTable> {
        let table = |pass: &Pass| PassTable { selection: self.selections[pass.process], ..PassTable::default() };
        self.passes.iter().map(table).collect()
    }
}

/// Which objects a process draws; `None` for one that draws no objects.
fn selection_of(draws: &Draws<'_>) -> Option<Selection> {
    match draws {
        Draws::Commands(commands) => Some(commands.selection),
        _ => None,
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
