//! What a stage is: one step of the frame's pipeline, and a node of the frame's stage graph.

use std::ops::Range;

use super::context::FrameContext;
use super::culling::CullingNeeds;
use super::granularity::Granularity;
use super::stage_clock::StageGroup;
use crate::backend::{Backend, BackendError};
use crate::graph::{Node, NodeError};
use crate::task::Worker;

/// One step of the frame's pipeline: of the whole frame, of one view, or of one pass. [`stages`](super::stages) lists
/// all of them.
pub(super) trait Stage<B: Backend>: Send + Sync {
    /// What does not depend on the frame.
    fn info(&self) -> &'static StageInfo;

    /// Whether a frame with these needs has the stage.
    fn is_needed(&self, needs: &StageNeeds) -> bool {
        needs.draws_commands
    }

    /// The number of items. It is asked when the stage that this one waits for is complete.
    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        let _ = frame;
        1
    }

    /// The number of items that a job over `items` counts as in the cost model. `None` where the cost model does not
    /// estimate the stage.
    fn measured_items(&self, frame: &FrameContext<'_, B>, items: Range<usize>) -> Option<usize> {
        let _ = frame;
        (self.info().chunking != Chunking::PerItem).then(|| items.len())
    }

    /// Does the work of one job.
    ///
    /// # Errors
    /// If the backend fails.
    fn run(&self, frame: &FrameContext<'_, B>, job: StageJob<'_>) -> Result<(), BackendError>;
}

/// What is fixed about a stage.
#[derive(Debug)]
pub(super) struct StageInfo {
    /// The name in timelines.
    pub(super) name: &'static str,
    /// The name of the stage that this one waits for, and alternatives for frames without it, in order of preference:
    /// the stage waits for the first that the pass, its view or the frame has.
    pub(super) after: &'static [&'static str],
    /// Which of the [`StageTimes`](super::StageTimes) its time is part of.
    pub(super) group: StageGroup,
    /// How its items are divided into jobs.
    pub(super) chunking: Chunking,
    /// Stages of one process with equal cost kinds share an estimate of what an item costs.
    pub(super) cost_kind: &'static str,
    /// Whether it takes longer or shorter where the view tests for occlusion.
    pub(super) depends_on_occlusion: bool,
}

/// How a stage's items are divided into jobs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Chunking {
    /// One item per job.
    PerItem,
    /// By measured cost, since no draws exist yet. With [`Granularity::PerCamera`], one job a view.
    ByCost,
    /// As many items per job as the [`Granularity`] says.
    ByDraws {
        /// The most draws in one item.
        draws_per_item: usize,
    },
}

/// What decides which stages a frame has.
#[derive(Clone, Copy, Debug)]
pub(super) struct StageNeeds {
    /// Whether the pass draws commands, or any pass of the view.
    pub(super) draws_commands: bool,
    /// Whether the pass orders its objects by bin, and so sorts no commands.
    pub(super) orders_by_bin: bool,
    #[cfg_attr(not(feature = "occlusion"), expect(dead_code, reason = "only stages of culling ask"))]
    pub(super) culling: CullingNeeds,
    /// Whether views choose levels of detail.
    pub(super) chooses_levels: bool,
    /// Whether the scene has static groups.
    pub(super) has_static_groups: bool,
}

impl StageNeeds {
    /// Whether the pass makes commands of its objects, and sorts them.
    pub(super) fn sorts_commands(&self) -> bool {
        self.draws_commands && !self.orders_by_bin
    }
}

/// A job of a stage.
#[derive(Debug)]
pub(super) struct StageJob<'a> {
    /// The items to work on.
    pub(super) items: Range<usize>,
    /// The worker that runs the job.
    pub(super) worker: &'a Worker,
    /// The index of the node in the cost model.
    pub(super) node: usize,
}

/// A stage as a node of the frame's stage graph.
pub(super) struct StageNode<B> {
    pub(super) stage: Box<dyn Stage<B>>,
    /// Its index in the cost model.
    pub(super) node: usize,
    /// The view that it works for, by index; `None` for a stage of the frame.
    pub(super) view: Option<usize>,
    /// The view whose occlusion tuner counts the node's time, by index.
    pub(super) tuned_view: Option<usize>,
}

impl<B: Backend> Node<FrameContext<'_, B>> for StageNode<B> {
    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        self.stage.width(frame)
    }

    fn chunk(&self, frame: &FrameContext<'_, B>) -> usize {
        match self.stage.info().chunking {
            Chunking::PerItem => 1,
            _ if self.chunked_by_cost(frame) => frame.items_per_job_by_cost(self.node, self.stage.width(frame)),
            Chunking::ByCost => usize::MAX,
            Chunking::ByDraws { draws_per_item } => {
                frame.granularity.items_per_job_by_draws(draws_per_item).unwrap_or(usize::MAX)
            }
        }
    }

    fn chunked_by_cost(&self, frame: &FrameContext<'_, B>) -> bool {
        match self.stage.info().chunking {
            Chunking::PerItem => false,
            Chunking::ByCost => frame.granularity != Granularity::PerCamera || self.view.is_none(),
            Chunking::ByDraws { .. } => frame.granularity == Granularity::Adaptive,
        }
    }

    fn run(&self, frame: &FrameContext<'_, B>, items: Range<usize>, worker: &Worker) -> Result<(), NodeError> {
        let job = StageJob { items: items.clone(), worker, node: self.node };
        let (result, took) = frame.clock.measure(self.stage.info().group, || self.stage.run(frame, job));
        if let Some(view) = self.view {
            frame.tables.view_times.add(view, took);
        }
        if let Some(view) = self.tuned_view {
            frame.tables.culling.add_time(view, took);
        }
        if (frame.granularity == Granularity::Adaptive || self.chunked_by_cost(frame))
            && let Some(measured) = self.stage.measured_items(frame, items)
        {
            frame.costs.add_sample(self.node, measured, took);
        }
        Ok(result?)
    }
}
