//! What a stage is: one step of the frame's pipeline, and a node of the frame's stage graph.

use std::ops::Range;

use super::context::FrameContext;
use super::granularity::{Granularity, StageGroup};
use super::tables::PassMode;
use crate::backend::Backend;
use crate::graph::{Node, NodeError};
use crate::task::Worker;

/// One step of the frame's pipeline. [`Stage::ALL`] lists all of them.
pub(in crate::frame) struct Stage<B: Backend> {
    /// The name in timelines.
    pub(in crate::frame) name: &'static str,
    pub(in crate::frame) of: StageOwner,
    /// The name of the stage that this one waits for, and alternatives for frames without it, in order of preference:
    /// the stage waits for the first that the pass, its view or the frame has.
    pub(in crate::frame) after: &'static [&'static str],
    /// Whether a pass of this mode has the stage, or its view, or the frame.
    pub(in crate::frame) is_needed: fn(PassMode) -> bool,
    /// The number of items, for the view or pass of this index. It is asked when the stage that this one waits for is
    /// complete.
    pub(in crate::frame) width: fn(&FrameContext<'_, B>, usize) -> usize,
    pub(in crate::frame) chunking: Chunking,
    /// Which of the [`StageTimes`](crate::frame::StageTimes) its time is part of.
    pub(in crate::frame) group: StageGroup,
    /// Stages of one process with equal cost kinds share an estimate of what an item costs.
    pub(in crate::frame) cost_kind: &'static str,
    /// Does the work of one job.
    pub(in crate::frame) run: fn(&FrameContext<'_, B>, StageJob<'_>) -> Result<(), NodeError>,
}

/// What has a node of its own for a stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::frame) enum StageOwner {
    Frame,
    /// Each view of which a pass draws objects.
    View,
    /// Each pass.
    Pass,
}

/// How a stage's items are divided into jobs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::frame) enum Chunking {
    /// One item per job.
    PerItem,
    /// One bucket of commands per job, which counts as its share of the visible objects: the cost model estimates an
    /// object.
    PerBucket,
    /// By measured cost, since no draws exist yet. With [`Granularity::PerCamera`], one job a view.
    ByCost,
    /// As many items per job as the [`Granularity`] says.
    ByDraws {
        /// The most draws in one item.
        draws_per_item: usize,
    },
}

/// A job of a stage.
#[derive(Debug)]
pub(in crate::frame) struct StageJob<'a> {
    /// The index of the view or pass.
    pub(in crate::frame) of: usize,
    /// The items to work on.
    pub(in crate::frame) items: Range<usize>,
    /// The worker that runs the job.
    pub(in crate::frame) worker: &'a Worker,
    /// The index of the node in the cost model.
    pub(in crate::frame) node: usize,
}

/// A stage as a node of the frame's stage graph.
pub(in crate::frame) struct StageNode<B: Backend> {
    pub(in crate::frame) stage: &'static Stage<B>,
    /// The index of the view or pass that it works for; 0 for a stage of the frame.
    pub(in crate::frame) of: usize,
    /// Its index in the cost model.
    pub(in crate::frame) node: usize,
    /// The view that it works for, or that its pass draws, by index; `None` for a stage of the frame.
    pub(in crate::frame) view: Option<usize>,
    /// The view whose occlusion tuner counts the node's time, by index.
    pub(in crate::frame) tuned_view: Option<usize>,
}

impl<B: Backend> StageNode<B> {
    /// The number of items that a job over `items` counts as in the cost model. `None` where the cost model does not
    /// estimate the stage.
    fn measured_items(&self, frame: &FrameContext<'_, B>, items: Range<usize>) -> Option<usize> {
        match self.stage.chunking {
            Chunking::PerItem => None,
            // Drawn or not: the split knows only the number of visible objects.
            Chunking::PerBucket => Some(frame.visible_count(self.of) * items.len() / frame.bucket_count(self.of)),
            Chunking::ByCost | Chunking::ByDraws { .. } => Some(items.len()),
        }
    }
}

impl<B: Backend> Node<FrameContext<'_, B>> for StageNode<B> {
    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        (self.stage.width)(frame, self.of)
    }

    fn chunk(&self, frame: &FrameContext<'_, B>) -> usize {
        match self.stage.chunking {
            Chunking::PerItem | Chunking::PerBucket => 1,
            _ if self.chunked_by_cost(frame) => frame.items_per_job_by_cost(self.node, self.width(frame)),
            Chunking::ByCost => usize::MAX,
            Chunking::ByDraws { draws_per_item } => {
                frame.granularity.items_per_job_by_draws(draws_per_item).unwrap_or(usize::MAX)
            }
        }
    }

    fn chunked_by_cost(&self, frame: &FrameContext<'_, B>) -> bool {
        match self.stage.chunking {
            Chunking::PerItem | Chunking::PerBucket => false,
            Chunking::ByCost => frame.granularity != Granularity::PerCamera || self.view.is_none(),
            Chunking::ByDraws { .. } => frame.granularity == Granularity::Adaptive,
        }
    }

    fn run(&self, frame: &FrameContext<'_, B>, items: Range<usize>, worker: &Worker) -> Result<(), NodeError> {
        let job = StageJob { of: self.of, items: items.clone(), worker, node: self.node };
        let (result, took) = frame.clock.measure(self.stage.group, || (self.stage.run)(frame, job));
        if let Some(view) = self.view {
            frame.tables.view_times.add(view, took);
        }
        if let Some(view) = self.tuned_view {
            frame.tables.culling.add_time(view, took);
        }
        if (frame.granularity == Granularity::Adaptive || self.chunked_by_cost(frame))
            && let Some(measured) = self.measured_items(frame, items)
        {
            frame.costs.add_sample(self.node, measured, took);
        }
        result
    }
}
