//! What can be wrong with processes.

use super::Format;
use crate::graph::GraphProblem;

/// Why no frame can be made of these processes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// What they read and write does not fit together.
    #[error(transparent)]
    Graph(#[from] GraphProblem),
    /// A process wants to come after or before one that is not there.
    #[error("process {process:?} is to come after or before {other:?}, which is not in the graph")]
    UnknownProcess {
        /// The process.
        process: String,
        /// The one that is not there.
        other: String,
    },
    /// Two processes give a target two formats.
    #[error("target {target:?} is both {first:?} and {second:?}")]
    TwoFormats {
        /// The target.
        target: String,
        /// One format.
        first: Format,
        /// The other.
        second: Format,
    },
    /// A target is used as depth with a format that holds colour, or the other way round.
    #[error("process {process:?} uses target {target:?} as what its format {format:?} is not")]
    WrongFormat {
        /// The process.
        process: String,
        /// The target.
        target: String,
        /// Its format.
        format: Format,
    },
    /// A target is drawn as a layer of a texture array by one process, and used as a texture of its own by another.
    #[error("process {process:?} does not agree with others on whether the views share target {target:?} as layers")]
    Layers {
        /// The process.
        process: String,
        /// The target.
        target: String,
    },
    /// A process has two depth targets.
    #[error("process {process:?} has more than one depth target")]
    TwoDepths {
        /// The process.
        process: String,
    },
    /// Shadow maps that cannot be.
    #[error("shadow maps cannot have {problem}")]
    ShadowMaps {
        /// What is wrong with them.
        problem: &'static str,
    },
    /// A process is to be replaced or left out that the pipeline never has.
    #[error("there is no process {name:?} to replace or leave out, only: {known}")]
    NoSuchProcess {
        /// The name.
        name: String,
        /// Those that there may be.
        known: String,
    },
    /// A process could not say what it reads and writes.
    #[error(transparent)]
    Process(#[from] ProcessError),
    /// No process is left, because none leads to an output.
    #[error("no process leads to an output")]
    Empty,
}

/// What is wrong with what a process says of itself.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ProcessError {
    /// It panicked when it was asked.
    #[error("process {process:?} panicked when it was asked what it does: {message}")]
    Panicked {
        /// The process.
        process: String,
        /// What the panic said.
        message: String,
    },
    /// A raw pass declares that it draws into or samples a target, or another process that it writes, changes or reads one
    /// by commands of its own.
    #[error("process {process:?} does not use target {target:?} in the way that it declares")]
    Misdeclared {
        /// The process.
        process: String,
        /// The target.
        target: String,
    },
}
