//! Textures on the device, in texture arrays by size. All arrays are bound at once, so no batch changes a binding.

use super::buffers::CountedQueue;
use super::residents::{AssetMemory, Residents};
use super::snapshot_lifetimes::SnapshotLifetimes;
use super::texture_layers::{TextureLayers, copy_layer, layer_bytes, new_array};
use crate::backend::BackendError;
use crate::backend::mip_generation::{ARRAY_SIDES, array_for};
use crate::scene::{Assets, Texture};
use crate::view::IssueReason;

/// The array and layer of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TextureLocation {
    pub(crate) array: u32,
    pub(crate) layer: u32,
}

impl TextureLocation {
    /// The location in a material without a texture.
    pub(crate) const NONE: Self = Self { array: ARRAY_SIDES.len() as u32, layer: 0 };
}

/// All texture arrays. An array that is full moves to a larger one, and the device copies its layers.
#[derive(Default)]
pub(crate) struct TextureArrays {
    pub(super) arrays: [TextureLayers; ARRAY_SIDES.len()],
    /// Counts how often an array was replaced. While it is the same, so are the views.
    pub(super) moves: u64,
}

/// The textures on the device. Like those of meshes, uploads never overwrite what a frame in flight may still read.
pub(crate) type ResidentTextures = Residents<TextureArrays>;

impl AssetMemory for TextureArrays {
    type Asset = Texture;
    type Location = TextureLocation;

    fn bytes(&self) -> u64 {
        let arrays = self.arrays.iter().zip(ARRAY_SIDES);
        arrays.map(|(array, side)| array.capacity() as u64 * layer_bytes(side)).sum()
    }

    fn vacate(&mut self, TextureLocation { array, layer }: TextureLocation) {
        self.arrays[array as usize].free(layer);
    }

    fn release_empty(
        &mut self,
        TextureLocation { array, .. }: TextureLocation,
        _: &SnapshotLifetimes<TextureLocation>,
    ) {
        let layers = &mut self.arrays[array as usize];
        if layers.capacity() > 0 && layers.free_count() == layers.capacity() {
            layers.release();
            self.moves += 1;
        }
    }

    fn clear(&mut self) {
        *self = Self { moves: self.moves + 1, ..Self::default() };
    }
}

impl ResidentTextures {
    /// Uploads the textures that are missing, and rejects those that exceed the device's layers. Adds the copies to
    /// what is submitted before anything that reads the textures.
    ///
    /// # Errors
    /// If the device has no room, or is lost. What is in the arrays is undefined then, so drop them.
    pub(super) fn upload_missing(
        &mut self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        assets: &Assets,
        rejected: &mut Vec<(IssueReason, usize)>,
    ) -> Result<(), BackendError> {
        self.release_unread(false);
        let missing: Vec<_> = self.missing(&assets.textures).collect();
        if missing.is_empty() {
            return Ok(());
        }
        for index in 0..ARRAY_SIDES.len() {
            let textures = missing.iter().filter(|(.., texture)| array_for(texture) == index);
            self.make_room(device, uploads, index, textures.count());
        }
        let label = Some("new and changed textures");
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label });
        for (handle, revision, texture) in missing {
            let index = array_for(texture);
            let array = &mut self.memory.arrays[index];
            match (array.take(), array.texture()) {
                (Some(layer), Some(on_device)) => {
                    copy_layer(device, &mut encoder, on_device, layer, texture)?;
                    uploads.count(layer_bytes(ARRAY_SIDES[index]));
                    self.add((handle, revision), TextureLocation { array: index as u32, layer });
                }
                _ => rejected.push((IssueReason::TextureLimit, handle.index() as usize)),
            }
        }
        uploads.add_commands([encoder.finish()]);
        Ok(())
    }

    /// A view of each array; an empty array is a single pixel.
    pub(crate) fn views(&self, device: &wgpu::Device) -> [wgpu::TextureView; ARRAY_SIDES.len()] {
        self.memory.arrays.each_ref().map(|array| {
            let texture = array.texture().cloned().unwrap_or_else(|| new_array(device, 1, 1));
            texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..wgpu::TextureViewDescriptor::default()
            })
        })
    }

    /// Makes room for `textures` further textures in an array, if the device allows that number of layers.
    fn make_room(&mut self, device: &wgpu::Device, uploads: &CountedQueue, index: usize, textures: usize) {
        let array = &self.memory.arrays[index];
        let max_layers = device.limits().max_texture_array_layers as usize;
        let has_retired = self.lifetimes.retired().any(|location| location.array == index as u32);
        if textures <= array.free_count() || (array.capacity() == max_layers && !has_retired) {
            return;
        }
        // Twice the layers, so that a texture that changes every frame does not move the others every frame.
        let layers = ((self.live_layers(index).count() + textures) * 2).max(array.capacity()).min(max_layers);
        self.move_array(device, uploads, index, layers as u32);
    }

    /// The layers of an array that textures are in.
    pub(super) fn live_layers(&self, index: usize) -> impl Iterator<Item = u32> {
        let locations = self.slots.iter().flatten().map(|texture| texture.location);
        locations.filter(move |location| location.array == index as u32).map(|location| location.layer)
    }

    /// Moves the textures of an array to the first layers of a new one, with this many layers, at least as many as
    /// textures.
    pub(super) fn move_array(&mut self, device: &wgpu::Device, uploads: &CountedQueue, index: usize, layers: u32) {
        let live: Vec<_> = self.live_layers(index).collect();
        self.memory.arrays[index].move_to(device, uploads, ARRAY_SIDES[index], layers, &live);
        let moved = self.slots.iter_mut().flatten().filter(|texture| texture.location.array == index as u32);
        for (texture, layer) in moved.zip(0..) {
            texture.location.layer = layer;
        }
        // Frames in flight read those of the array before.
        self.lifetimes.forget_retired(|location| location.array == index as u32);
        self.memory.moves += 1;
    }
}
