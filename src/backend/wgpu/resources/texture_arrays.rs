//! Textures on the device, in texture arrays by size. All arrays are bound at once, so no batch changes a binding.

use std::sync::Arc;

use super::snapshot_lifetimes::{SnapshotLifetimes, SnapshotToken};
use super::texture_layers::{TextureLayers, layer_bytes, new_array, write_layer};
use super::upload_queue::UploadQueue;
use crate::backend::mip_generation::{ARRAY_SIDES, array_for};
use crate::scene::Assets;
use crate::view::RejectionReason;

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

/// All texture arrays. Like pages of meshes, they never overwrite a layer that a frame in flight may still read. An array that is full
/// moves to a larger one, and the device copies its layers.
#[derive(Default)]
pub(crate) struct TextureArrays {
    arrays: [TextureLayers; ARRAY_SIDES.len()],
    /// By slot.
    textures: Vec<Option<ResidentTexture>>,
    lifetimes: SnapshotLifetimes<TextureLocation>,
    identity: u64,
    /// Counts how often an array was replaced.
    moves: u64,
}

/// A texture on the device.
#[derive(Clone, Copy)]
struct ResidentTexture {
    /// In the assets.
    revision: u64,
    location: TextureLocation,
}

impl TextureArrays {
    /// Uploads new and changed textures, and rejects those that exceed the device's layers.
    pub(crate) fn update(
        &mut self,
        device: &wgpu::Device,
        uploads: &UploadQueue,
        assets: &Assets,
        rejected: &mut Vec<(RejectionReason, usize)>,
    ) {
        self.retire_changed(assets);
        self.free_unread();
        let missing = |(handle, revision, texture)| {
            let (slot, index): (u32, _) = (crate::handle::Handle::index(handle), array_for(texture));
            self.textures[slot as usize].is_none().then_some((slot, revision, texture, index))
        };
        let missing: Vec<_> = assets.textures.iter_with_revision().filter_map(missing).collect();
        for index in 0..ARRAY_SIDES.len() {
            self.make_room(
                device,
                uploads.queue(),
                index,
                missing.iter().filter(|(.., other)| *other == index).count(),
            );
        }
        for (slot, revision, texture, index) in missing {
            let array = &mut self.arrays[index];
            match (array.take(), array.texture()) {
                (Some(layer), Some(on_device)) => {
                    write_layer(uploads, on_device, layer, texture);
                    let location = TextureLocation { array: index as u32, layer };
                    self.textures[slot as usize] = Some(ResidentTexture { revision, location });
                }
                _ => rejected.push((RejectionReason::TextureLimit, slot as usize)),
            }
        }
    }

    /// Makes a snapshot of the textures as they are.
    pub(crate) fn begin_snapshot(&mut self) -> Arc<SnapshotToken> {
        self.lifetimes.begin_snapshot()
    }

    /// The location of the texture in a slot; `None` if it is not on the device.
    pub(crate) fn location(&self, slot: u32) -> Option<TextureLocation> {
        self.textures.get(slot as usize).copied().flatten().map(|texture| texture.location)
    }

    /// Counts how often an array was replaced. While it is the same, so are the views.
    pub(crate) fn moves(&self) -> u64 {
        self.moves
    }

    /// A view of each array; an empty array is a single pixel.
    pub(crate) fn views(&self, device: &wgpu::Device) -> [wgpu::TextureView; ARRAY_SIDES.len()] {
        self.arrays.each_ref().map(|array| {
            let texture = array.texture().cloned().unwrap_or_else(|| new_array(device, 1, 1));
            texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..wgpu::TextureViewDescriptor::default()
            })
        })
    }

    /// The size of all arrays in bytes.
    pub(crate) fn resident_bytes(&self) -> u64 {
        let arrays = self.arrays.iter().zip(ARRAY_SIDES);
        arrays.map(|(array, side)| array.capacity() as u64 * layer_bytes(side)).sum()
    }

    /// Retires textures that changed, or were removed, since they were uploaded.
    fn retire_changed(&mut self, assets: &Assets) {
        if self.identity != assets.textures.identity() {
            *self = Self {
                identity: assets.textures.identity(),
                lifetimes: SnapshotLifetimes::following(&self.lifetimes),
                moves: self.moves + 1,
                ..Self::default()
            };
        }
        self.textures.resize(assets.textures.slot_count().max(self.textures.len()), None);
        for (slot, entry) in (0..).zip(&mut self.textures) {
            let Some(texture) = entry else { continue };
            let current = assets.textures.get_with_revision(slot).map(|(revision, _)| revision);
            if current != Some(texture.revision) {
                self.lifetimes.retire(texture.location);
                *entry = None;
            }
        }
    }

    /// Frees the layers of textures that are gone, as soon as no frame in flight may read them, and releases empty arrays.
    fn free_unread(&mut self) {
        for TextureLocation { array, layer } in self.lifetimes.reclaim() {
            let layers = &mut self.arrays[array as usize];
            layers.free(layer);
            if layers.free_count() == layers.capacity() {
                layers.release();
                self.moves += 1;
            }
        }
    }

    /// Makes room for so many further textures in an array, if the device allows as many layers.
    fn make_room(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, index: usize, textures: usize) {
        let array = &mut self.arrays[index];
        let is_in_array = |location: &TextureLocation| location.array == index as u32;
        let live = self.textures.iter().flatten().map(|texture| texture.location).filter(is_in_array);
        let max_layers = device.limits().max_texture_array_layers as usize;
        let has_retired = self.lifetimes.retired().any(is_in_array);
        if textures <= array.free_count() || (array.capacity() == max_layers && !has_retired) {
            return;
        }
        // Twice the layers, so that a texture that changes every frame does not move the others every frame.
        let layers = ((live.clone().count() + textures) * 2).max(array.capacity()).min(max_layers);
        array.move_to(device, queue, ARRAY_SIDES[index], layers as u32, live.map(|location| location.layer));
        // Frames in flight read those of the array before.
        self.lifetimes.forget_retired(is_in_array);
        self.moves += 1;
    }
}
