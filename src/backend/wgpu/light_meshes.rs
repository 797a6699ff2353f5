//! The geometry of lights on the device.

use std::ops::Range;

use super::arena::filled_buffer;
use super::uploads::Uploads;
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
    pub(super) fn new(device: &wgpu::Device, uploads: &Uploads) -> Result<Self, BackendError> {
        let mut corners: Vec<[f32; 3]> = Vec::new();
        let ranges = Self::VOLUMES.map(|volume| {
            let first = corners.len() as u32;
            corners.extend(volume.corners());
            first..corners.len() as u32
        });
        let bytes = bytemuck::cast_slice(&corners);
        let corners = filled_buffer(device, uploads, "light volumes", bytes, wgpu::BufferUsages::VERTEX)?;
        Ok(Self { corners, ranges })
    }

    /// Which corners a light of this kind is drawn with.
    pub(super) fn range(&self, kind: LightKind) -> Range<u32> {
        let volume = LightVolume::of(kind);
        let place = Self::VOLUMES.iter().position(|other| *other == volume);
        place.map_or(0..0, |place| self.ranges[place].clone())
    }
}
