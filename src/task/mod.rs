//! The job system.

mod job;
mod latch;
mod parallel_for;
mod scheduler;
mod scope;
mod sleep;
mod worker;

pub use job::{JobPanic, catch};
pub use scheduler::{Scheduler, SchedulerError};
pub use scope::Scope;
pub use worker::Worker;
