//! What the shaders of several processes share: surfaces, normals, illumination and shadows. In WGSL, and the same in
//! Rust in `cpu_shader`.

#[cfg(feature = "software")]
pub(super) mod cpu_shader;
mod normal_encoding;
mod shadow;

pub(super) use shadow::shadow_shader;
