//! Why a scheduler could not be built.

use std::io;

use thiserror::Error;

use super::affinity::AffinityMask;
use super::sleep::MAX_WORKERS;
use crate::unwind::JobPanic;

/// A scheduler could not be built.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SchedulerError {
    /// 0 workers were requested.
    #[error("a scheduler needs at least 1 worker, which is the thread that calls it")]
    NoWorkers,
    /// More than [`Scheduler::MAX_WORKERS`](super::Scheduler::MAX_WORKERS) were requested.
    #[error("a scheduler has at most {MAX_WORKERS} workers, and {workers} were requested")]
    TooManyWorkers {
        /// How many were requested.
        workers: usize,
    },
    /// The system does not report how many threads can run at once.
    #[error("the number of threads that can run at once is unknown")]
    UnknownParallelism {
        /// The system's error.
        source: io::Error,
    },
    /// The name of a thread contains a null character.
    #[error("the thread of worker {worker} cannot be named {name:?}, which contains a null character")]
    Name {
        /// The [index](super::Worker::index) of the worker.
        worker: usize,
        /// The name.
        name: String,
    },
    /// The hook that names threads panicked.
    #[error("the hook that names the thread of worker {worker} failed: {}", panic.message)]
    NameHook {
        /// The [index](super::Worker::index) of the worker.
        worker: usize,
        /// The panic.
        panic: JobPanic,
    },
    /// The hook that chooses affinities panicked.
    #[error("the affinity hook of worker {worker} failed: {}", panic.message)]
    AffinityHook {
        /// The [index](super::Worker::index) of the worker.
        worker: usize,
        /// The panic.
        panic: JobPanic,
    },
    /// The system did not start a thread.
    #[error("the thread of worker {worker} could not be started")]
    Spawn {
        /// The [index](super::Worker::index) of the worker.
        worker: usize,
        /// The system's error.
        source: io::Error,
    },
    /// The system did not restrict a thread to its processors.
    #[error("the thread of worker {worker} could not be restricted to the processors {:?}", affinity.processors())]
    Affinity {
        /// The [index](super::Worker::index) of the worker.
        worker: usize,
        /// The processors.
        affinity: AffinityMask,
        /// The system's error.
        source: io::Error,
    },
    /// The hook that runs at the start of a thread panicked.
    #[error("the hook at the start of worker {worker}'s thread failed: {}", panic.message)]
    StartHook {
        /// The [index](super::Worker::index) of the worker.
        worker: usize,
        /// The panic.
        panic: JobPanic,
    },
}
