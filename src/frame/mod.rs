//! The frame: a scene goes in, recorded queues come out, and the device thread submits them.
//!
//! [`Renderer::record`] has the steps of a frame in order, and `stages.rs` lists the stages that its jobs run.

mod blended_object_witness;
mod budgeted_view;
mod builder;
mod column_check;
mod context;
mod cost_model;
mod cpu_node;
mod error;
mod frame_loop;
mod frame_place;
mod granularity;
mod job_size;
mod latched_views;
mod lent_nodes;
mod light_maps;
mod list_inputs;
mod node_frame;
mod occluders;
mod occlusion_control;
mod pass_recording;
mod pass_runs;
mod plan_cache;
mod recorded;
mod renderer;
mod replace_backend;
mod scene_check;
mod stage;
mod stage_clock;
mod stage_graph;
mod stage_tuning;
mod stages;
mod statistics;
mod table_keys;
mod tables;
mod triangle_culling;
mod valid_lights;
mod view_budget;
mod view_cache;
mod view_cost;
mod view_filter;
mod view_levels;
mod view_occlusion;
mod view_queues;
mod view_times;
mod view_visibility;
mod views;
mod warm_up;
mod warnings;

pub use budgeted_view::{BudgetedView, Rung, ViewForm};
pub use builder::RendererBuilder;
pub use cpu_node::{CpuNode, FrameData, NodeAccesses, NodeResource};
pub use error::{BudgetError, BuildError, FrameError, LatchError, SubmitError};
pub use frame_loop::{Buffering, FinishedFrame, FrameLoop, FrameLoopError, FrameSlot, FrameTimes};
pub use frame_place::FramePlace;
pub use granularity::Granularity;
#[cfg(feature = "report")]
pub(crate) use job_size::job_size;
pub use node_frame::{NodeFrame, UndeclaredRead};
pub use recorded::{Recorded, Submitted, Submitter};
pub use renderer::Renderer;
pub use statistics::{FrameStatistics, LevelStatistics, StageTimes, ViewStatistics};
pub use view_budget::ViewBudget;
pub use warm_up::WarmUp;
