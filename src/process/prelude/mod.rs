//! The WGSL prelude of every shader, and the light volume meshes.

#[cfg(feature = "wgpu")]
mod light_volume;
mod shader_prelude;

pub use shader_prelude::SHADER_PRELUDE;
#[cfg(feature = "wgpu")]
pub(crate) use shader_prelude::{FIRST_OWN_LOCATION, prelude_with};
