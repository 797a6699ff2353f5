//! A frame in flight: its buffers, its passes, and what they cache for later frames.

mod allotment;
mod bundle_cache;
mod commands;
mod frame_buffers;
mod generated_uploads;
mod material_buffer;
mod object_buffers;
mod object_lists;
mod pass_state;
mod pass_statistics;
mod pending_uploads;
mod resource_bytes;
mod wgpu_frame;

pub(crate) use bundle_cache::BundleKey;
pub(crate) use commands::{PassCommands, RecordedPart};
pub(crate) use frame_buffers::{BufferPool, PassResources};
pub(crate) use generated_uploads::GeneratedUploads;
pub(crate) use pass_state::WgpuPassState;
pub(crate) use pending_uploads::PendingUploads;

pub use commands::{WgpuCommands, WgpuPart};
pub use pass_statistics::WgpuPassStatistics;
pub use wgpu_frame::WgpuFrame;
