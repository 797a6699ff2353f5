//! The meshes of light volumes on the device.

use std::ops::Range;

use super::buffers::{CountedQueue, filled_buffer};
use crate::backend::BackendError;
use crate::scene::{LightKind, LightVolume};

/// The vertices of all light volumes, in one vertex buffer.
pub(crate) struct LightMeshes {
    pub(crate) vertices: wgpu::Buffer,
    ranges: [Range<u32>; 3],
}

impl LightMeshes {
    const VOLUMES: [LightVolume; 3] = [LightVolume::Sphere, LightVolume::Cone, LightVolume::Screen];

    /// # Errors
    /// If the device has no room.
    pub(crate) fn new(device: &wgpu::Device, uploads: &CountedQueue) -> Result<Self, BackendError> {
        let mut vertices: Vec<[f32; 3]> = Vec::new();
        let ranges = Self::VOLUMES.map(|volume| {
            let first = vertices.len() as u32;
            vertices.extend(volume.corners());
            first..vertices.len() as u32
        });
        let bytes = bytemuck::cast_slice(&vertices);
        let vertices = filled_buffer(device, uploads, "light volumes", bytes, wgpu::BufferUsages::VERTEX)?;
        Ok(Self { vertices, ranges })
    }

    /// The vertices of the volume of a light of this kind.
    pub(crate) fn range(&self, kind: LightKind) -> Range<u32> {
        let index = Self::VOLUMES.iter().position(|volume| *volume == kind.rules().volume);
        index.map_or(0..0, |index| self.ranges[index].clone())
    }
}
