//! Whether a log is one that a timeline can have recorded: whether all that it speaks of is there.

use std::fmt::Display;

use crate::timeline::{Log, Run};

/// # Errors
///
/// What is wrong with one of its runs or spans, in words.
pub(super) fn check_log(log: &Log) -> Result<(), String> {
    for (index, run) in log.runs.iter().enumerate() {
        check_run(run, format_args!("run {index}"), log.workers.len())?;
    }
    match log.spans.iter().find(|span| span.thread >= log.threads.len()) {
        Some(span) => Err(format!("there is a span of thread {} of {}", span.thread, log.threads.len())),
        None => Ok(()),
    }
}

/// # Errors
///
/// What is wrong with a run of that name on so many workers, in words.
pub(super) fn check_run(run: &Run, name: impl Display, workers: usize) -> Result<(), String> {
    let processes = run.graph.processes.len();
    for chunk in run.chunks.iter().chain(&run.empty) {
        if chunk.process >= processes {
            return Err(format!("{name} has a chunk of process {} of {processes}", chunk.process));
        }
        if chunk.worker >= workers {
            return Err(format!("{name} has a chunk of worker {} of {workers}", chunk.worker));
        }
    }
    for (index, process) in run.graph.processes.iter().enumerate() {
        match process.dependencies.iter().find(|&&other| other >= index) {
            Some(other) if *other < processes => {
                return Err(format!("process {index} of {name} waits for process {other}, which is not before it"));
            }
            Some(other) => return Err(format!("process {index} of {name} waits for process {other} of {processes}")),
            None => {}
        }
    }
    Ok(())
}
