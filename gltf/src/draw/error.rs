//! Why a world cannot be drawn.

use drawloom::wgpu;

/// Why a device cannot draw a world, or there is none.
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
    /// A texture array has more layers, or larger ones, than the device allows.
    #[error("the device cannot have {layers} textures of {width}x{height} pixels")]
    TextureArray {
        /// The number of layers.
        layers: u32,
        /// In pixels.
        width: u32,
        /// In pixels.
        height: u32,
    },
    /// The device refuses the textures: it has not the memory for them, as a rule.
    #[error("the device cannot have the textures: {0}")]
    Textures(#[source] wgpu::Error),
}
