//! Random vertices all over the world, and how far their f32 positions in a picture are from those in f64.

pub mod cases;
#[cfg(feature = "wgpu")]
pub mod device;
pub mod measure;
pub mod vertex;
