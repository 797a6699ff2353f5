//! What the CPU shaders of several processes share.

pub(in crate::process::deferred) mod illumination;
mod normal_encoding;
pub(in crate::process::deferred) mod light_batches;
pub(in crate::process::deferred) mod shadow;
pub(in crate::process::deferred) mod surface;
