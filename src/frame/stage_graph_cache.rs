//! The stage graphs of recent frames.

use std::sync::Arc;

use super::FrameError;
use super::borrowed_nodes::BorrowedNodes;
use super::stage_graph::{FrameFeatures, StageGraph};
use crate::backend::Backend;
use crate::process::{Draws, FramePlan};
use crate::view::RenderView;

/// The graphs of recent frames, the latest first. A scene changes what it requires and changes back, and finds its
/// graph again.
pub(super) struct StageGraphCache<B: Backend> {
    latest_first: Vec<StageGraph<B>>,
}

impl<B: Backend> Default for StageGraphCache<B> {
    fn default() -> Self {
        Self { latest_first: Vec::new() }
    }
}

impl<B: Backend> StageGraphCache<B> {
    const CAPACITY: usize = 16;

    /// The graph of a frame, built if the cache does not have it.
    ///
    /// # Errors
    /// If no process draws in a view, views sample each other in a circle, or the nodes make no graph.
    pub(super) fn get(
        &mut self,
        plan: &Arc<FramePlan>,
        draws: &[Draws<'_>],
        views: &[RenderView],
        features: FrameFeatures,
        nodes: BorrowedNodes<'_>,
    ) -> Result<&mut StageGraph<B>, FrameError> {
        let found = self.latest_first.iter().position(|graph| graph.fits(plan, draws, views, features, nodes));
        match found {
            Some(index) => self.latest_first[..=index].rotate_right(1),
            None => {
                let mut graph = StageGraph::of_frame(plan, draws, views, features, nodes)?;
                if let Some(before) = self.latest_first.first() {
                    graph.inherit_measurements(before);
                }
                self.latest_first.truncate(Self::CAPACITY - 1);
                self.latest_first.insert(0, graph);
            }
        }
        let graph = &mut self.latest_first[0];
        graph.set_view_ids(views);
        Ok(graph)
    }

    /// Discards what was measured in a frame that failed.
    pub(super) fn discard_costs(&mut self) {
        if let Some(graph) = self.latest_first.first_mut() {
            graph.tuning.costs.discard_frame();
        }
    }

    /// The graph of the latest frame; `None` before the first one.
    pub(super) fn latest(&self) -> Option<&StageGraph<B>> {
        self.latest_first.first()
    }
}
