//! Why a frame took as long as it did.

mod critical_path;
mod display;
mod queue_wait;
mod report;
mod run_spans;
mod share;
mod slack;
mod step;
mod what_if;
mod worker_report;
mod worker_spans;

pub use queue_wait::QueueWait;
pub use report::FrameReport;
pub use share::PathShare;
pub use slack::Slack;
pub use step::{HeldBy, Step};
pub use what_if::WhatIf;
pub use worker_report::WorkerReport;
