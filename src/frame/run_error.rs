//! The error of a frame's run.

use super::pass_runs::PassFailure;
use super::stage_graph::StageGraph;
use crate::backend::Backend;
use crate::graph::RunError;
use crate::view::RenderView;

/// The error of a run. If the job of another pass met it, it names the pass that failed.
pub(super) fn error_of_pass<B: Backend>(
    error: RunError,
    graph: &StageGraph<B>,
    failures: &[PassFailure],
    views: &[RenderView],
) -> RunError {
    let name_of = |pass| graph.node_name("finish", pass, views);
    let name_failed = |node: String| {
        let failure = failures.iter().find(|failure| name_of(failure.job_of) == node);
        failure.map_or(node, |failure| name_of(failure.failed))
    };
    match error {
        RunError::Failed { node, source } => RunError::Failed { node: name_failed(node), source },
        RunError::Panicked { node, message } => RunError::Panicked { node: name_failed(node), message },
        other => other,
    }
}
