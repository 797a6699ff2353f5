//! Random vertices all over the world, and how far their f32 positions in a picture are from those in f64.

pub mod cases;
pub mod measure;
pub mod vertex;
