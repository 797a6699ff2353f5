//! Compiles a graph to a schedule.

use std::fmt;

use thiserror::Error;

use super::builder::FrameGraph;
use super::error::GraphProblem;
use super::flat_graph::{FlatGraph, in_order};
use super::plan::plan;
use super::schedule::Schedule;

/// A graph that does not compile, and why.
#[derive(Error)]
#[error("{problem}")]
#[non_exhaustive]
pub struct CompileError<P> {
    /// The unchanged graph, so that it can be corrected and compiled again.
    pub graph: Box<FrameGraph<P>>,
    /// The first problem, in the order of [`GraphProblem`]'s variants.
    pub problem: GraphProblem,
}

impl<P> fmt::Debug for CompileError<P> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("CompileError").field("problem", &self.problem).field("graph", &self.graph).finish()
    }
}

impl<P> FrameGraph<P> {
    /// Orders the nodes, drops those that lead to no output, and checks the rest.
    ///
    /// # Errors
    /// Returns [`CompileError`] with the graph and its first [`GraphProblem`], in the order of the variants. Names and
    /// cycles are checked in the whole graph. A missing producer and unordered writers are only reported if the nodes
    /// concerned are kept.
    pub fn compile(self) -> Result<Schedule<P>, CompileError<P>> {
        self.compile_with_outputs_of(|_| Vec::new())
    }

    /// Compiles the graph, where each node that is not dropped makes more resources outputs: those that `outputs_of`
    /// names for its payload.
    ///
    /// # Errors
    /// As [`compile`](Self::compile).
    #[doc(hidden)]
    pub fn compile_with_outputs_of(
        mut self,
        outputs_of: impl Fn(&P) -> Vec<String>,
    ) -> Result<Schedule<P>, CompileError<P>> {
        match plan(&mut self.declarations, &|node| outputs_of(&self.payloads[node])) {
            Ok(plan) => {
                Ok(Schedule::new(FlatGraph::new(self.declarations, &plan), in_order(self.payloads, &plan.order)))
            }
            Err(problem) => Err(CompileError { graph: Box::new(self), problem }),
        }
    }
}
