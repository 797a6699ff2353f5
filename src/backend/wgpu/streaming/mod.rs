//! Streaming: meshes and textures come to the device by background jobs, within a budget (L 3.1, M 10.3).

mod upload_budget;
mod budget;
mod frame_use;
mod mesh_upload;
mod residency;
mod placement;
mod backoff;
mod request;
mod statistics;
mod streamer;
mod texture_upload;
mod upload_jobs;
mod usage;
mod eviction_order;

pub use budget::StreamingBudget;
pub(crate) use frame_use::FrameUse;
pub(crate) use residency::{FrameAssets, Residency};
pub use statistics::StreamingStatistics;
pub(crate) use streamer::Streamer;
