//! Textures that are streamed: they come to the device by background jobs, and make room for others.

use std::sync::Arc;

use super::mesh_streaming::Room;
use super::texture_arrays::{ResidentTexture, TextureArrays, TextureLocation};
use super::texture_layers::layer_bytes;
use super::upload_queue::UploadQueue;
use crate::backend::mip_generation::{ARRAY_SIDES, array_for};
use crate::handle::Handle;
use crate::scene::{Assets, Texture};

impl TextureArrays {
    /// Begins a frame with textures that are streamed. One that was replaced stays until the new one arrives.
    pub(crate) fn begin_streamed_frame(&mut self, assets: &Assets) {
        self.free_unread();
        if self.revision != Some(assets.textures.revision()) || self.identity != assets.textures.identity() {
            self.retire_changed(assets, |texture| assets.get(texture.handle).is_err());
            self.revision = Some(assets.textures.revision());
        }
    }

    /// Whether a texture is neither on the device, in this revision, nor on its way.
    pub(crate) fn is_missing(&self, handle: Handle<Texture>, revision: u64) -> bool {
        let slot = handle.index();
        let resident = self.textures.get(slot as usize).copied().flatten();
        !self.in_flight.contains(&slot) && resident.is_none_or(|texture| texture.revision != revision)
    }

    /// Finds a layer for a texture, or moves an array to a larger one if the budget allows.
    pub(crate) fn find_layer(
        &mut self,
        device: &wgpu::Device,
        uploads: &UploadQueue,
        texture: &Texture,
        budget: u64,
    ) -> Room<(TextureLocation, wgpu::Texture)> {
        let index = array_for(texture);
        if self.arrays[index].free_count() == 0 && !self.grow(device, uploads, index, budget) {
            let is_awaited = !self.in_flight.is_empty() || self.lifetimes.retired().next().is_some();
            return if is_awaited { Room::Awaited } else { Room::Missing(layer_bytes(ARRAY_SIDES[index])) };
        }
        let array = &mut self.arrays[index];
        match (array.take(), array.texture()) {
            (Some(layer), Some(on_device)) => {
                Room::Found((TextureLocation { array: index as u32, layer }, on_device.clone()))
            }
            _ => Room::Awaited,
        }
    }

    /// Moves an array to a larger one within the budget; the other arrays give up what they do not use. Returns whether there is a free layer.
    fn grow(&mut self, device: &wgpu::Device, uploads: &UploadQueue, index: usize, budget: u64) -> bool {
        // What jobs upload stays where it is.
        if !self.in_flight.is_empty() {
            return false;
        }
        let (side, capacity) = (layer_bytes(ARRAY_SIDES[index]), self.arrays[index].capacity() as u64);
        let max_layers = u64::from(device.limits().max_texture_array_layers);
        if self.resident_bytes() + side > budget {
            for other in (0..ARRAY_SIDES.len()).filter(|other| *other != index) {
                if self.arrays[other].free_count() > 0 {
                    let live = self.live_layers(other).count();
                    self.move_array(device, uploads.queue(), other, live as u32);
                }
            }
        }
        let affordable = capacity + budget.saturating_sub(self.resident_bytes()) / side;
        let layers = (capacity * 2).max(MIN_LAYERS).min(affordable).min(max_layers);
        if layers <= capacity {
            return false;
        }
        self.move_array(device, uploads.queue(), index, layers as u32);
        true
    }

    /// The slots of the textures on the device, with their bytes.
    pub(crate) fn resident(&self) -> impl Iterator<Item = (u32, u64)> {
        let textures = (0..).zip(&self.textures);
        textures.filter_map(|(slot, texture)| {
            let array = texture.as_ref()?.location.array;
            Some((slot, layer_bytes(ARRAY_SIDES[array as usize])))
        })
    }

    /// Takes a texture off the device.
    pub(crate) fn evict(&mut self, slot: u32) {
        if let Some(texture) = self.textures.get_mut(slot as usize).and_then(Option::take) {
            self.lifetimes.retire(texture.location);
            self.changes += 1;
        }
    }

    /// A job is about to upload a texture.
    pub(crate) fn begin_upload(&mut self, handle: Handle<Texture>) -> Arc<()> {
        self.in_flight.insert(handle.index());
        Arc::clone(&self.epoch)
    }

    /// A job has uploaded a texture, or could not. Nothing is drawn with it if it is gone meanwhile. Returns whether it is on the device.
    pub(crate) fn end_upload(
        &mut self,
        epoch: &Arc<()>,
        (handle, revision): (Handle<Texture>, u64),
        location: TextureLocation,
        (assets, is_complete): (&Assets, bool),
    ) -> bool {
        if !Arc::ptr_eq(epoch, &self.epoch) {
            return false;
        }
        self.in_flight.remove(&handle.index());
        let is_needed = is_complete && assets.get(handle).is_ok();
        if is_needed {
            let new = ResidentTexture { handle, revision, location };
            if let Some(before) = self.textures[handle.index() as usize].replace(new) {
                self.lifetimes.retire(before.location);
            }
            self.changes += 1;
        } else {
            // No snapshot refers to it.
            self.free_layer(location);
        }
        is_needed
    }

    /// Counts how often what is on the device, or where it is, changed.
    pub(crate) fn changes(&self) -> u64 {
        self.changes
    }

    /// The number of textures on the way.
    pub(crate) fn in_flight(&self) -> usize {
        self.in_flight.len()
    }
}

/// The layers of a new array, if the budget allows.
const MIN_LAYERS: u64 = 8;
