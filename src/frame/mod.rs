//! The frame: a scene goes in, recorded queues come out, and the device thread submits them.
//!
//! [`Renderer::record`] has the steps of a frame in order, and `stages/mod.rs` lists the stages that its jobs run.

mod builder;
mod nodes;
mod encoders;
mod error;
mod frame_loop;
mod plan_cache;
mod recorded_frame;
mod renderer;
mod reconfigure;
mod scene_check;
mod stages;
mod static_groups;
mod views;
mod warm_up;

pub use builder::RendererBuilder;
pub use error::{BudgetError, BuildError, FrameError, SubmitError};
pub use frame_loop::{Buffering, FinishedFrame, FrameLoop, FrameLoopError, FrameSlot, FrameTimes};
pub use nodes::{CpuNode, FrameData, NodeAccessError, NodeAccesses, NodeContext, NodeResource};
pub use recorded_frame::{FencePoint, RecordedFrame, SubmittedFrame, Submitter};
pub use renderer::{FrameInputs, Renderer};
pub use stages::granularity::Granularity;
pub use stages::statistics::{FrameStatistics, LevelStatistics, StageTimes, ViewStatistics};
pub use static_groups::StaticGroupStatistics;
pub use views::budgeted_view::{BudgetedView, QualityLevel, ViewVariant};
pub use views::view_budget::ViewBudget;
pub use warm_up::WarmUp;
