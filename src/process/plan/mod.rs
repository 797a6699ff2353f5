//! The plan of a frame: its processes in order, and the targets that they use.

mod error;
mod frame_passes;
mod frame_plan;
mod mip_levels;
mod planned_process;
mod planned_target;
mod process_graph;
mod resource_names;
mod sampled_views;
mod shared_declarations;
mod target_indices;
#[cfg(test)]
mod test_process;
mod unknown_targets;
mod view_arrays;

pub use error::PlanError;
pub(crate) use frame_passes::FramePasses;
pub use frame_passes::{ViewGroup, ViewOrder};
pub use frame_plan::FramePlan;
pub use planned_process::{Pass, PlannedProcess};
pub(crate) use planned_process::{ProcessId, TargetIndices};
pub use planned_target::{AttachmentExtent, PlannedTarget};
pub use sampled_views::SampledViews;
pub(crate) use view_arrays::ViewArray;
