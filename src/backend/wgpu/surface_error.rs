//! What can go wrong with a window's surface.

use crate::process::Format;

/// Why a window has no device or no surface, or its surface no texture.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// Drawloom was built without a backend of wgpu.
    #[error("drawloom was built without a backend of wgpu: it needs the feature `vulkan`, `metal` or `dx12`")]
    NoBackend,
    /// wgpu makes no surface for the window.
    #[error("the window can have no surface: {0}")]
    Create(#[from] wgpu::CreateSurfaceError),
    /// No adapter presents in the window.
    #[error(
        "no graphics adapter presents in this window ({0}); on Debian, `apt install mesa-vulkan-drivers` provides one in software"
    )]
    NoAdapter(#[from] wgpu::RequestAdapterError),
    /// The adapter opens no device.
    #[error("the graphics adapter opens no device: {0}")]
    NoDevice(#[from] wgpu::RequestDeviceError),
    /// The device's adapter does not present in the window.
    #[error("the device does not present in this window")]
    CannotPresent,
    /// Pictures in windows are [`Format::Rgba8Srgb`] or [`Format::Bgra8Srgb`].
    #[error("pictures in windows are Rgba8Srgb or Bgra8Srgb, and not {0:?}")]
    PictureFormat(Format),
    /// The surface is lost again as soon as it is made.
    #[error("the window's surface stays lost")]
    StaysLost,
    /// The device of the surface is lost. The surface is of no use any more: the engine drops it, and opens another
    /// device and surface.
    #[error("the device of the window's surface was lost: {message}")]
    DeviceLost {
        /// What wgpu says.
        message: String,
    },
    /// The device refuses the surface's settings.
    #[error("the device refuses the window's surface: {reason}")]
    Refused {
        /// What wgpu says.
        reason: String,
    },
}
