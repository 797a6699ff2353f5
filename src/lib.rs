//! Drawloom.
#![warn(missing_docs)]

pub mod backend;
pub mod blocks;
pub mod command;
mod frame;
pub mod graph;
pub mod handle;
pub mod process;
pub mod queue;
pub mod scene;
mod sync;
pub mod task;
pub mod view;

pub use frame::{
    BuildError, FrameError, FrameStatistics, Granularity, Recorded, Renderer, RendererBuilder, StageTimes, SubmitError,
    Submitted, Submitter, ViewQueue, ViewStatistics,
};
pub use glam;
#[cfg(feature = "wgpu")]
pub use wgpu;
