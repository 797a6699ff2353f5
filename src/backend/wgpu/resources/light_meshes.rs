//! The meshes of light volumes on the device.

use std::ops::Range;

use super::buffers::{CountedQueue, filled_buffer};
use crate::backend::BackendError;
use crate::scene::{LightKind, LightVolume};

/// The vertices of all light volumes, in one vertex buffer.
pub(crate) struct LightMeshes {
    pub(crate) vertices: wgpu::Buffer,
    /// By [`LightKind`].
    ranges: [Range<u32>; LightKind::ALL.len()],
}

impl LightMeshes {
    /// # Errors
    /// If the device has no room.
    pub(crate) fn new(device: &wgpu::Device, uploads: &CountedQueue) -> Result<Self, BackendError> {
        let mut vertices: Vec<[f32; 3]> = Vec::new();
        let mut volumes: Vec<(LightVolume, Range<u32>)> = Vec::new();
        let ranges = LightKind::ALL.map(|kind| {
            let volume = kind.rules().volume;
            if let Some((_, range)) = volumes.iter().find(|(known, _)| *known == volume) {
                return range.clone();
            }
            let first = vertices.len() as u32;
            vertices.extend(volume.corners());
            let range = first..vertices.len() as u32;
            volumes.push((volume, range.clone()));
            range
        });
        let bytes = bytemuck::cast_slice(&vertices);
        let vertices = filled_buffer(device, uploads, "light volumes", bytes, wgpu::BufferUsages::VERTEX)?;
        Ok(Self { vertices, ranges })
    }

    /// The vertices of the volume of a light of this kind.
    pub(crate) fn range(&self, kind: LightKind) -> Range<u32> {
        self.ranges[kind as usize].clone()
    }
}
