//! A node of the frame's stage graph: a stage, or work of the engine's own.

use std::ops::Range;

use super::borrowed_nodes::BorrowedNodes;
use super::context::FrameContext;
use super::stage::StageNode;
use super::stage_clock::StageGroup;
use super::{CpuNode, NodeContext};
use crate::backend::Backend;
use crate::graph::{Node, NodeError};
use crate::scene::run_node_job;
use crate::task::Worker;

/// A node of the frame's stage graph.
pub(super) enum FrameNode<B: Backend> {
    Stage(StageNode<B>),
    Cpu(CpuNodeIndex),
}

/// A CPU node, by indices.
#[derive(Clone, Copy, Debug)]
pub(super) struct CpuNodeIndex {
    /// Among those that are lent.
    pub(super) lent: usize,
    /// In the cost model.
    pub(super) node: usize,
}

impl CpuNodeIndex {
    fn get<'a, B: Backend>(self, frame: &FrameContext<'a, B>) -> (&'a dyn CpuNode, NodeContext<'a>) {
        let BorrowedNodes { nodes, declarations } = frame.nodes;
        let accesses = declarations.of_node(self.lent);
        (nodes[self.lent], NodeContext { request: frame.request, tables: frame.tables, accesses })
    }
}

impl<B: Backend> Node<FrameContext<'_, B>> for FrameNode<B> {
    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        match self {
            Self::Stage(stage) => stage.width(frame),
            Self::Cpu(index) => {
                let (node, frame) = index.get(frame);
                node.width(&frame)
            }
        }
    }

    fn chunk(&self, frame: &FrameContext<'_, B>) -> usize {
        match self {
            Self::Stage(stage) => stage.chunk(frame),
            Self::Cpu(index) => {
                let (node, node_frame) = index.get(frame);
                let by_cost = || frame.items_per_job_by_cost(index.node, node.width(&node_frame));
                node.items_per_job().unwrap_or_else(by_cost)
            }
        }
    }

    fn chunked_by_cost(&self, frame: &FrameContext<'_, B>) -> bool {
        match self {
            Self::Stage(stage) => stage.chunked_by_cost(frame),
            Self::Cpu(index) => index.get(frame).0.items_per_job().is_none(),
        }
    }

    fn run(&self, frame: &FrameContext<'_, B>, items: Range<usize>, worker: &Worker) -> Result<(), NodeError> {
        match self {
            Self::Stage(stage) => stage.run(frame, items, worker),
            Self::Cpu(index) => {
                let (node, node_frame) = index.get(frame);
                let count = items.len();
                let (result, took) =
                    frame.clock.measure(StageGroup::Nodes, || run_node_job(|| node.run(&node_frame, items, worker)));
                if node.items_per_job().is_none() {
                    frame.costs.add_sample(index.node, count, took);
                }
                result
            }
        }
    }
}
