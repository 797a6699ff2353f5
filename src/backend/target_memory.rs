//! The memory of a frame's targets.

/// The memory of a frame's targets, without those that the engine imports.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TargetMemory {
    /// The number of textures. One that several targets share counts once.
    pub textures: usize,
    /// The size of these textures in bytes.
    pub bytes: u64,
    /// What their size would be if no [transient targets](super::WgpuBackend::transient_targets) shared a texture.
    pub dedicated_bytes: u64,
}

#[cfg(feature = "wgpu")]
impl TargetMemory {
    /// Counts a texture of this size.
    pub(crate) fn add_texture(&mut self, bytes: u64) {
        self.textures += 1;
        self.bytes += bytes;
    }
}
