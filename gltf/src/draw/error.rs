//! Why there is no device.

use drawloom::wgpu;

/// Why there is no device that draws worlds.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DrawError {
    /// There is no graphics adapter, or Drawloom was built without a backend of wgpu, such as the feature `vulkan`.
    #[error(
        "no graphics adapter found; on Debian, `apt install mesa-vulkan-drivers` provides one in software, and the \
         feature `vulkan` of drawloom finds it"
    )]
    NoAdapter,
    /// The adapter has no device with what is needed.
    #[error(transparent)]
    Device(#[from] wgpu::RequestDeviceError),
}
