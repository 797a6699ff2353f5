//! Textures on the device, in texture arrays by size. All arrays are bound at once, so no batch changes a binding.

use std::collections::{BTreeSet, HashMap};
use std::sync::Arc;

use super::buffers::CountedQueue;
use super::snapshot_lifetimes::{SnapshotLifetimes, SnapshotToken};
use super::texture_layers::{TextureLayers, copy_layer, layer_bytes, new_array};
use crate::backend::BackendError;
use crate::backend::mip_generation::{ARRAY_SIDES, array_for};
use crate::handle::Handle;
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

/// All texture arrays. Like pages of meshes, they never overwrite a layer that a frame in flight may still read. An
/// array that is full moves to a larger one, and the device copies its layers.
#[derive(Default)]
pub(crate) struct TextureArrays {
    pub(super) arrays: [TextureLayers; ARRAY_SIDES.len()],
    /// By slot.
    pub(super) textures: Vec<Option<ResidentTexture>>,
    pub(super) lifetimes: SnapshotLifetimes<TextureLocation>,
    pub(super) identity: u64,
    /// Of the assets' textures, when it was last looked for those that are gone; `None` before.
    pub(super) revision: Option<u64>,
    /// Counts how often an array was replaced.
    moves: u64,
    /// Counts how often what is on the device, or where it is, changed.
    pub(super) changes: u64,
    /// Identifies the arrays: another one after all textures were dropped.
    pub(super) epoch: Arc<()>,
    /// The slots of the textures that jobs are uploading, each with its array.
    pub(super) in_flight: HashMap<u32, u32>,
    /// The slots of the textures that are to be streamed, and not on their way.
    pub(super) missing: BTreeSet<u32>,
}

/// A texture on the device.
#[derive(Clone, Copy)]
pub(super) struct ResidentTexture {
    pub(super) handle: Handle<Texture>,
    /// In the assets.
    pub(super) revision: u64,
    pub(super) location: TextureLocation,
}

impl TextureArrays {
    /// Uploads new and changed textures, and rejects those that exceed the device's layers. Adds the copies to what is
    /// submitted before anything that reads the textures.
    ///
    /// # Errors
    /// If the device has no room, or is lost. What is in the arrays is undefined then, so drop them.
    pub(crate) fn update(
        &mut self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        assets: &Assets,
        rejected: &mut Vec<(IssueReason, usize)>,
    ) -> Result<(), BackendError> {
        let current = |slot| assets.textures.get_with_revision(slot).map(|(revision, _)| revision);
        self.retire_changed(assets, |texture| current(texture.handle.index()) != Some(texture.revision));
        self.free_unread();
        let missing = |(handle, revision, texture): (Handle<Texture>, _, _)| {
            let is_missing = self.textures[handle.index() as usize].is_none();
            is_missing.then(|| (handle, revision, texture, array_for(texture)))
        };
        let missing: Vec<_> = assets.textures.iter_with_revision().filter_map(missing).collect();
        if missing.is_empty() {
            return Ok(());
        }
        for index in 0..ARRAY_SIDES.len() {
            self.make_room(device, uploads, index, missing.iter().filter(|(.., other)| *other == index).count());
        }
        let label = Some("new and changed textures");
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label });
        for (handle, revision, texture, index) in missing {
            let slot = handle.index() as usize;
            let array = &mut self.arrays[index];
            match (array.take(), array.texture()) {
                (Some(layer), Some(on_device)) => {
                    copy_layer(device, &mut encoder, on_device, layer, texture)?;
                    uploads.count(layer_bytes(ARRAY_SIDES[index]));
                    let location = TextureLocation { array: index as u32, layer };
                    self.textures[slot] = Some(ResidentTexture { handle, revision, location });
                }
                _ => rejected.push((IssueReason::TextureLimit, slot)),
            }
        }
        uploads.add_commands([encoder.finish()]);
        Ok(())
    }

    /// Makes a snapshot of the present textures.
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

    /// Retires textures that are out of date.
    fn retire_changed(&mut self, assets: &Assets, is_outdated: impl Fn(&ResidentTexture) -> bool) {
        self.begin_assets(assets);
        for entry in &mut self.textures {
            if let Some(texture) = entry.take_if(|texture| is_outdated(texture)) {
                self.lifetimes.retire(texture.location);
                self.changes += 1;
            }
        }
    }

    /// Has room for all slots of the assets. Drops everything if they are others.
    pub(super) fn begin_assets(&mut self, assets: &Assets) {
        if self.identity != assets.textures.identity() {
            *self = Self {
                identity: assets.textures.identity(),
                lifetimes: SnapshotLifetimes::following(&self.lifetimes),
                moves: self.moves + 1,
                changes: self.changes + 1,
                ..Self::default()
            };
        }
        self.textures.resize(assets.textures.slot_count().max(self.textures.len()), None);
    }

    /// Frees the layers of textures that are gone, as soon as no frame in flight may read them, and releases empty
    /// arrays.
    fn free_unread(&mut self) {
        for location in self.lifetimes.reclaim() {
            self.free_layer(location);
        }
    }

    /// Frees a layer, and releases its array if nothing else is in it.
    pub(super) fn free_layer(&mut self, TextureLocation { array, layer }: TextureLocation) {
        self.arrays[array as usize].free(layer);
        self.release_if_empty(array as usize);
    }

    /// Releases an array if nothing is in it.
    pub(super) fn release_if_empty(&mut self, array: usize) {
        let layers = &mut self.arrays[array];
        if layers.capacity() > 0 && layers.free_count() == layers.capacity() {
            layers.release();
            (self.moves, self.changes) = (self.moves + 1, self.changes + 1);
        }
    }

    /// Makes room for `textures` further textures in an array, if the device allows that number of layers.
    fn make_room(&mut self, device: &wgpu::Device, uploads: &CountedQueue, index: usize, textures: usize) {
        let array = &self.arrays[index];
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
        let locations = self.textures.iter().flatten().map(|texture| texture.location);
        locations.filter(move |location| location.array == index as u32).map(|location| location.layer)
    }

    /// Moves the textures of an array to the first layers of a new one, with this many layers, at least as many as
    /// textures.
    pub(super) fn move_array(&mut self, device: &wgpu::Device, uploads: &CountedQueue, index: usize, layers: u32) {
        let live: Vec<_> = self.live_layers(index).collect();
        self.arrays[index].move_to(device, uploads, ARRAY_SIDES[index], layers, &live);
        let moved = self.textures.iter_mut().flatten().filter(|texture| texture.location.array == index as u32);
        for (texture, layer) in moved.zip(0..) {
            texture.location.layer = layer;
        }
        // Frames in flight read those of the array before.
        self.lifetimes.forget_retired(|location| location.array == index as u32);
        (self.moves, self.changes) = (self.moves + 1, self.changes + 1);
    }
}
