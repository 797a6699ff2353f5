//! The wgpu backend.
//!
//! Vertices and indices lie in pages that many meshes share, all objects lie in one storage buffer, and state is set
//! once per run of batches that share it. Measurements chose this layout: recording it is cheap and scales with
//! threads.
//!
//! A pass can be recorded and encoded in several ways: see [`RecordingStrategy`] and [`EncodingStrategy`]. A wgpu
//! bundle is not a device object: wgpu replays and encodes it inside `CommandEncoder::finish`. So a bundle that is
//! replayed once costs more than recording straight into the pass, and a cached bundle costs a tenth of that. But only
//! bundles, or several encoders, let several workers record one pass. The cheapest strategy depends on the adapter and
//! the scene, so each pass tunes its own by measurement (`strategy`), unless the engine fixes it. All strategies draw
//! the same picture.
//!
//! Each frame in flight has buffers of its own. Its bind groups and bundles are cached with these
//! buffers from frame to frame. A cached object is reused only if everything that it was made from compares equal. An
//! error clears the caches that it may have left unusable.

mod backend;
mod backend_impl;
mod begin_frame;
mod error_scope;
mod frame;
#[cfg(test)]
mod noop_device;
mod pipeline_library;
mod pipelines;
mod read_back;
mod recording;
mod resources;
mod strategy;
mod streaming;
mod submission;
mod surface_error;
mod surface_formats;
mod timing;
mod window_surface;

pub use backend::{WgpuBackend, WgpuResources};
pub(crate) use frame::WgpuFrame;
pub use frame::WgpuPassStatistics;
pub use pipeline_library::PipelineLibrary;
pub use read_back::WgpuReadBack;
pub use strategy::{EncodingStrategy, RecordingStrategy};
pub use streaming::{StreamingBudget, StreamingStatistics};
pub use submission::WgpuSubmission;
pub use surface_error::SurfaceError;
pub use timing::{DeviceClock, DevicePassTime, DevicePassTimes};
pub use window_surface::{SurfaceFrame, WindowDevice, WindowSurface};
