//! The geometry of lights on the device.

use std::ops::Range;

use super::arena::new_buffer;
use crate::backend::BackendError;
use crate::process::LightVolume;
use crate::scene::LightKind;

/// The corners of every kind of geometry that lights are drawn as, in one vertex buffer.
pub(super) struct LightMeshes {
    pub(super) corners: wgpu::Buffer,
    ranges: [Range<u32>; 3],
}

impl LightMeshes {
    const VOLUMES: [LightVolume; 3] = [LightVolume::Sphere, LightVolume::Cone, LightVolume::Screen];

    /// # Errors
    /// If the device has no room.
    pub(super) fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Self, BackendError> {
        let mut corners: Vec<[f32; 3]> = Vec::new();
        let ranges = Self::VOLUMES.map(|volume| {
            let first = corners.len() as u32;
            corners.extend(volume.corners());
            first..corners.len() as u32
        });
        let bytes: &[u8] = bytemuck::cast_slice(&corners);
        let usage = wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST;
        let buffer = new_buffer(device, "light volumes", bytes.len() as u64, usage)?;
        queue.write_buffer(&buffer, 0, bytes);
        Ok(Self { corners: buffer, ranges })
    }

    /// Which corners a light of this kind is drawn with.
    pub(super) fn range(&self, kind: LightKind) -> Range<u32> {
        let volume = LightVolume::of(kind);
        let place = Self::VOLUMES.iter().position(|other| *other == volume);
        place.map_or(0..0, |place| self.ranges[place].clone())
    }
}
