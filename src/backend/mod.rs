//! Backends: they turn batches into recorded passes, and submit them (M 10.3, "Submitting a RenderCommand to the API").

mod backend_layer;
mod backend_trait;
mod error;
mod guarded_backend;
#[cfg(any(feature = "wgpu", feature = "software"))]
mod mip_generation;
#[cfg(any(feature = "wgpu", feature = "software"))]
mod mip_schedule;
mod null;
mod picture;
mod requests;
#[cfg(feature = "software")]
mod software;
#[cfg(any(feature = "wgpu", feature = "software"))]
mod subdivision_cache;
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
pub use backend_trait::{Backend, BackendExtras, FrameRecorder, NoExtras, ReadBack};
pub use error::BackendError;
pub(crate) use guarded_backend::{CallPanic, GuardedBackend};
pub use null::NullBackend;
pub use picture::Picture;
#[cfg(feature = "software")]
pub(crate) use requests::ViewRequest;
pub use requests::{FrameFence, FrameRequest, PassRequest, SceneLimits, TargetMemory, ViewQueue};
#[cfg(feature = "software")]
pub use software::{SoftwareBackend, SoftwareSubmission};

/// For the tests of this repository. No part of the interface.
#[doc(hidden)]
pub mod internal {
    pub use super::null::{NullPass, NullSubmission};
    pub use super::requests::ViewRequest;
}
