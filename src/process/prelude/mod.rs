//! What every shader begins with, in WGSL, and the geometry that its vertex shader for lights is drawn with.

#[cfg(feature = "wgpu")]
mod light_volume;
mod shader_prelude;

#[cfg(feature = "wgpu")]
pub(crate) use light_volume::LightVolume;
pub use shader_prelude::SHADER_PRELUDE;
