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

pub use self::{
    queue_wait::QueueWait,
    report::FrameReport,
    share::PathShare,
    slack::Slack,
    step::{HeldBy, Step},
    what_if::WhatIf,
    worker_report::WorkerReport,
};
