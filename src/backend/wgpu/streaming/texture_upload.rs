//! The upload of a texture, in portions.

use std::borrow::Cow;

use super::upload_budget::UploadBudget;
use crate::backend::BackendError;
use crate::backend::mip_generation::mip_chain;
use crate::backend::wgpu::resources::{CountedQueue, InFlight, TextureLocation, copy_rows};
use crate::scene::Texture;

/// A texture on its way to the device.
pub(crate) struct TextureUpload {
    pub(crate) in_flight: InFlight<Texture>,
    pub(crate) texture: Texture,
    pub(crate) array: wgpu::Texture,
    pub(crate) location: TextureLocation,
    /// What is left of the mip levels, the last one first, and how many rows of the last one are written.
    levels: Vec<Vec<u8>>,
    rows: u32,
}

impl TextureUpload {
    pub(crate) fn new(
        in_flight: InFlight<Texture>,
        texture: Texture,
        array: wgpu::Texture,
        location: TextureLocation,
    ) -> Self {
        Self { in_flight, texture, array, location, levels: Vec::new(), rows: 0 }
    }

    /// All that it uploads.
    pub(super) fn bytes(&self) -> u64 {
        self.texture.class().bytes()
    }

    /// Makes mip levels, and uploads as much as is allowed. Returns whether all of it is uploaded, once the device has
    /// executed the commands.
    ///
    /// # Errors
    /// If the device has no room.
    pub(super) fn advance(
        &mut self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        upload_budget: &mut UploadBudget,
    ) -> Result<(bool, wgpu::CommandBuffer), BackendError> {
        if self.levels.is_empty() {
            self.levels = mip_chain(&self.texture).into_iter().map(Cow::into_owned).rev().collect();
        }
        let label = Some("a streamed texture");
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label });
        while let Some(level) = self.levels.last() {
            let number = self.array.mip_level_count() - self.levels.len() as u32;
            let class = self.texture.class();
            let row_bytes = u64::from(class.level_rows(number).1);
            let first = u64::from(self.rows) * row_bytes;
            let length = upload_budget.take(level.len() as u64 - first, row_bytes);
            if length == 0 {
                break;
            }
            let bytes = &level[first as usize..(first + length) as usize];
            copy_rows(device, &mut encoder, (&self.array, class), (self.location.layer, number), self.rows, bytes)?;
            uploads.count(length);
            self.rows += (length / row_bytes) as u32;
            if first + length == level.len() as u64 {
                self.levels.pop();
                self.rows = 0;
            }
        }
        Ok((self.levels.is_empty(), encoder.finish()))
    }
}
