//! Streaming: meshes and textures come to the device by background jobs, within a budget (L 3.1, M 10.3).

mod allowance;
mod budget;
mod frame_use;
mod mesh_upload;
mod on_device;
mod placement;
mod refusals;
mod request;
mod statistics;
mod streamer;
mod texture_upload;
mod upload_jobs;
mod uses;
mod victims;

pub use budget::StreamingBudget;
pub(crate) use frame_use::FrameUse;
pub(crate) use on_device::OnDevice;
pub use statistics::StreamingStatistics;
pub(crate) use streamer::{StreamedResources, Streamer};
