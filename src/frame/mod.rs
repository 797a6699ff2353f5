//! The frame: a scene goes in, recorded queues come out, and the device thread submits them.
//!
//! [`Renderer::record`] has the steps of a frame in order, and `stages.rs` lists the stages that its jobs run.

mod backend_maintenance;
mod blended_tracker;
mod borrowed_nodes;
mod budgeted_view;
mod builder;
mod change_check;
mod context;
mod cost_model;
mod cpu_node;
#[cfg(feature = "occlusion")]
mod culling;
mod encoders;
mod error;
mod fence_point;
mod frame_loop;
mod frame_node;
mod frame_outcome;
mod granularity;
mod light_maps;
mod list_inputs;
#[cfg(not(feature = "occlusion"))]
mod no_culling;
mod node_accesses;
mod node_context;
mod pass_mode;
mod pass_recording;
mod plan_cache;
mod record_with_nodes;
mod recorded_frame;
mod recorded_static_group;
mod renderer;
mod replace_backend;
mod resolved_view_filter;
mod scene_capacity;
mod scene_check;
mod shadow_views;
mod stage;
mod stage_clock;
mod stage_graph;
mod stage_graph_cache;
mod stage_tuning;
mod stages;
mod static_group_statistics;
mod static_groups;
mod statistics;
mod tables;
mod valid_lights;
mod view_budget;
mod view_cache;
mod view_cost;
mod view_levels;
mod view_queues;
mod view_static_groups;
mod view_times;
mod view_visibility;
mod views;
mod warm_up;
mod warnings;

#[cfg(not(feature = "occlusion"))]
use no_culling as culling;

pub use budgeted_view::{BudgetedView, QualityLevel, ViewVariant};
pub use builder::RendererBuilder;
pub use cpu_node::CpuNode;
pub use error::{BudgetError, BuildError, FrameError, SubmitError};
pub use fence_point::FencePoint;
pub use frame_loop::{Buffering, FinishedFrame, FrameLoop, FrameLoopError, FrameSlot, FrameTimes};
pub use granularity::Granularity;
pub use node_accesses::{FrameData, NodeAccesses, NodeResource};
pub use node_context::{NodeAccessError, NodeContext};
pub use recorded_frame::{RecordedFrame, SubmittedFrame, Submitter};
pub use renderer::Renderer;
pub use static_group_statistics::StaticGroupStatistics;
pub use statistics::{FrameStatistics, LevelStatistics, StageTimes, ViewStatistics};
pub use view_budget::ViewBudget;
pub use warm_up::WarmUp;
