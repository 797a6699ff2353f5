//! The plan of a frame: its processes in order, and the targets that they use.

mod attributes;
mod buffers;
mod chain;
mod columns;
mod error;
mod frame_passes;
mod frame_plan;
mod material_types;
mod mip_levels;
mod order;
mod pass;
mod planned_process;
mod planned_target;
mod process_graph;
mod resource_names;
mod sampled_views;
mod target_indices;
mod view_arrays;
mod view_group;

pub(crate) use chain::ChainSlot;
pub use error::{PlanError, ProcessError};
pub(crate) use frame_passes::FramePasses;
pub use frame_plan::FramePlan;
pub use pass::Pass;
pub use planned_process::PlannedProcess;
pub(crate) use planned_process::{ProcessId, TargetIndices};
pub use planned_target::{AttachmentExtent, PlannedTarget};
pub use sampled_views::SampledViews;
pub(crate) use view_arrays::ViewArray;
pub use view_group::{ViewGroup, ViewOrder};
