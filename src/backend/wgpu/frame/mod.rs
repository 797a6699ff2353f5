//! A frame in flight: its buffers, its passes, and what they cache for later frames.

mod allotment;
mod frame_buffers;
mod item_data;
mod material_buffer;
mod object_buffers;
mod pass_state;
mod previous_objects;
mod resource_bytes;
mod wgpu_frame;

pub(crate) use frame_buffers::{BufferPool, PassResources};
pub(crate) use object_buffers::shares_memory;
pub(crate) use pass_state::{BundleKey, WgpuPassState};
pub(crate) use wgpu_frame::{GeneratedUploads, PassCommands, PendingUploads, RecordedPart};

pub use pass_state::WgpuPassStatistics;
pub use wgpu_frame::{WgpuCommands, WgpuFrame, WgpuPart};
