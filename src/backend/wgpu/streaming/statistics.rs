//! What streaming has done.

/// What streaming has done: see
/// [`WgpuBackend::streaming_statistics`](crate::backend::WgpuBackend::streaming_statistics).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StreamingStatistics {
    /// The pages of meshes on the device, in bytes.
    pub mesh_bytes: u64,
    /// The texture arrays on the device, in bytes.
    pub texture_bytes: u64,
    /// The meshes on the device.
    pub meshes: usize,
    /// The textures on the device.
    pub textures: usize,
    /// Meshes and textures that are used, and neither on the device nor on the way.
    pub requested: usize,
    /// Of these, the ones that the latest frame would have drawn.
    pub wanted: usize,
    /// Meshes and textures that background jobs are about to upload.
    pub in_flight: usize,
    /// The bytes that streaming has uploaded so far.
    pub uploaded_bytes: u64,
    /// The meshes and textures that have made room for others so far.
    pub evictions: u64,
    /// Of the wanted ones, those for which there is no room, because the latest frame draws everything that is on the
    /// device. If it is above 0 for long, what a frame draws exceeds the budget.
    pub over_budget: usize,
    /// Meshes and textures that are used and can never be on the device: larger than the budget of their kind, or than
    /// the device's largest buffer. They are not among the requested ones. Each is warned of once, by name.
    pub too_large: usize,
}

impl StreamingStatistics {
    /// All meshes and textures on the device, in bytes.
    pub fn resident_bytes(&self) -> u64 {
        self.mesh_bytes + self.texture_bytes
    }
}
