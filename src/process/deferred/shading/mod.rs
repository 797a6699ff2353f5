//! What the shaders of several processes share, in WGSL and in Rust: surfaces, normals, illumination and shadows.

pub(super) mod illumination;
mod normal_encoding;
pub(super) mod shadow;
pub(super) mod surface;
