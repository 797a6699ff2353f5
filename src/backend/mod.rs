//! Backends: they turn batches into recorded passes, and submit them (M 10.3, "Submitting a RenderCommand to the API").

mod backend_layer;
mod backend_trait;
mod error;
mod frame_fence;
mod guarded_backend;
#[cfg(any(feature = "wgpu", feature = "software"))]
mod mip_generation;
#[cfg(any(feature = "wgpu", feature = "software"))]
mod mip_schedule;
mod null;
mod picture;
mod read_back;
mod requests;
mod scene_limits;
#[cfg(feature = "software")]
mod software;
#[cfg(any(feature = "wgpu", feature = "software"))]
mod subdivision_cache;
mod target_memory;
mod view_queue;
#[cfg(feature = "wgpu")]
mod wgpu;

#[cfg(feature = "wgpu")]
pub(crate) use self::wgpu::WgpuFrame;
#[cfg(feature = "wgpu")]
pub use self::wgpu::{
    DeviceClock, DevicePassTime, DevicePassTimes, EncodingStrategy, PipelineLibrary, RecordingStrategy,
    StreamingBudget, StreamingStatistics, SurfaceError, SurfaceFrame, WgpuBackend, WgpuPassStatistics, WgpuReadBack,
    WgpuResources, WgpuSubmission, WindowDevice, WindowSurface,
};
pub use backend_layer::BackendLayer;
pub use backend_trait::{Backend, BackendExtras, FrameRecorder, NoExtras};
pub use error::BackendError;
pub use frame_fence::FrameFence;
pub(crate) use guarded_backend::{CallPanic, GuardedBackend};
pub use null::NullBackend;
pub use picture::Picture;
pub use read_back::ReadBack;
#[cfg(feature = "software")]
pub(crate) use requests::ViewRequest;
pub use requests::{FrameRequest, PassRequest};
pub use scene_limits::SceneLimits;
#[cfg(feature = "software")]
pub use software::{SoftwareBackend, SoftwareSubmission};
pub use target_memory::TargetMemory;
pub use view_queue::ViewQueue;

/// For the tests of this repository. No part of the interface.
#[doc(hidden)]
pub mod internal {
    pub use super::null::{NullPass, NullSubmission};
    pub use super::requests::ViewRequest;
}
