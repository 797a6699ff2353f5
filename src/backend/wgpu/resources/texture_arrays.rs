//! Textures on the device: layers of arrays of equal textures, which are bound in [sets](TextureSets).

use super::buffers::CountedQueue;
use super::residents::{AssetMemory, Residents};
use super::snapshot_lifetimes::SnapshotLifetimes;
use super::texture_layers::{TextureLayers, can_hold, copy_layer, new_array};
use crate::backend::BackendError;
use crate::scene::{Assets, Sampler, Texture, TextureClass, TextureFormat};
use crate::view::{IssueReason, TextureSets};

/// The array and layer of a texture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TextureLocation {
    pub(crate) array: u32,
    pub(crate) layer: u32,
}

/// All texture arrays. An array that is full moves to a larger one, and the device copies its layers.
#[derive(Default)]
pub(crate) struct TextureArrays {
    pub(super) arrays: Vec<ArrayOnDevice>,
    /// The array of each texture, by slot; [`NO_ARRAY`] for none.
    array_of: Vec<u32>,
    /// That of the sets that the arrays are of.
    revision: Option<u64>,
    /// Counts how often an array was replaced. While it is the same, so are the views.
    pub(super) moves: u64,
}

/// An array, as far as it is on the device.
pub(super) struct ArrayOnDevice {
    pub(super) class: TextureClass,
    /// The number of textures that the scene has for it.
    pub(super) textures: u32,
    pub(super) layers: TextureLayers,
}

const NO_ARRAY: u32 = u32::MAX;

impl TextureArrays {
    /// The array of the texture in a slot.
    pub(super) fn array_of(&self, texture: u32) -> Option<usize> {
        self.array_of.get(texture as usize).filter(|array| **array != NO_ARRAY).map(|array| *array as usize)
    }

    /// The bytes of a layer of an array.
    pub(super) fn layer_bytes(&self, index: usize) -> u64 {
        self.arrays[index].class.bytes()
    }

    /// The bytes that an array takes.
    fn bytes_of(&self, array: &ArrayOnDevice) -> u64 {
        array.layers.capacity() as u64 * array.class.bytes()
    }
}

/// The textures on the device. Like those of meshes, uploads never overwrite what a frame in flight may still read.
pub(crate) type ResidentTextures = Residents<TextureArrays>;

impl AssetMemory for TextureArrays {
    type Asset = Texture;
    type Location = TextureLocation;

    fn bytes(&self) -> u64 {
        self.arrays.iter().map(|array| self.bytes_of(array)).sum()
    }

    fn vacate(&mut self, TextureLocation { array, layer }: TextureLocation) {
        self.arrays[array as usize].layers.free(layer);
    }

    fn release_empty(
        &mut self,
        TextureLocation { array, .. }: TextureLocation,
        _: &SnapshotLifetimes<TextureLocation>,
    ) {
        let layers = &mut self.arrays[array as usize].layers;
        if layers.capacity() > 0 && layers.free_count() == layers.capacity() {
            layers.release();
            self.moves += 1;
        }
    }

    fn clear(&mut self) {
        self.arrays.iter_mut().for_each(|array| array.layers.release());
        self.moves += 1;
    }
}

impl ResidentTextures {
    /// The textures are in these arrays from the next frame on.
    pub(super) fn set_arrays(&mut self, sets: &TextureSets) {
        let memory = &mut self.memory;
        if memory.revision == Some(sets.revision()) {
            return;
        }
        let classes = memory.arrays.iter().zip(sets.arrays());
        if classes.len() < memory.arrays.len() || classes.into_iter().any(|(array, of)| array.class != of.class) {
            // They are those of other assets.
            self.clear();
            self.memory.arrays.clear();
        }
        let memory = &mut self.memory;
        let known = memory.arrays.len();
        memory.arrays.iter_mut().zip(sets.arrays()).for_each(|(array, of)| array.textures = of.textures);
        memory.arrays.extend(sets.arrays()[known..].iter().map(|of| ArrayOnDevice {
            class: of.class,
            textures: of.textures,
            layers: TextureLayers::default(),
        }));
        memory.array_of.clear();
        memory.array_of.extend((0..sets.texture_slots()).map(|slot| sets.array_of(slot).unwrap_or(NO_ARRAY)));
        memory.revision = Some(sets.revision());
    }

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
        let mut wanted = vec![0; self.memory.arrays.len()];
        for array in missing.iter().filter_map(|(handle, ..)| self.memory.array_of(handle.index())) {
            wanted[array] += 1;
        }
        for (index, textures) in wanted.into_iter().enumerate().filter(|(_, textures)| *textures > 0) {
            self.make_room(device, uploads, index, textures);
        }
        let label = Some("new and changed textures");
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label });
        for (handle, revision, texture) in missing {
            let found = self.memory.array_of(handle.index()).and_then(|index| {
                let layers = &mut self.memory.arrays[index].layers;
                Some((index, layers.take()?, layers.texture()?))
            });
            match found {
                Some((index, layer, on_device)) => {
                    copy_layer(device, &mut encoder, on_device, layer, texture)?;
                    uploads.count(texture.class().bytes());
                    self.add((handle, revision), TextureLocation { array: index as u32, layer });
                }
                None => rejected.push((IssueReason::TextureLimit, handle.index() as usize)),
            }
        }
        uploads.add_commands([encoder.finish()]);
        Ok(())
    }

    /// The texture of each array; `None` for one that is empty.
    pub(super) fn arrays(&self) -> impl ExactSizeIterator<Item = Option<&wgpu::Texture>> {
        self.memory.arrays.iter().map(|array| array.layers.texture())
    }

    /// Makes room for `textures` further textures in an array, if the device allows that number of layers.
    fn make_room(&mut self, device: &wgpu::Device, uploads: &CountedQueue, index: usize, textures: usize) {
        let ArrayOnDevice { class, layers: array, .. } = &self.memory.arrays[index];
        let max_layers = device.limits().max_texture_array_layers as usize;
        let has_retired = self.lifetimes.retired().any(|location| location.array == index as u32);
        let is_at_limit = array.capacity() == max_layers && !has_retired;
        if textures <= array.free_count() || is_at_limit || !can_hold(device, *class) {
            return;
        }
        // Twice the layers, so that a texture that changes every frame does not move the others every frame. Most
        // arrays are filled once.
        let needed = self.live_layers(index).count() + textures;
        let with_headroom = if array.capacity() > 0 { needed * 2 } else { needed };
        let layers = with_headroom.max(array.capacity()).min(max_layers);
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
        let ArrayOnDevice { class, layers: array, .. } = &mut self.memory.arrays[index];
        array.move_to(device, uploads, *class, layers, &live);
        let moved = self.slots.iter_mut().flatten().filter(|texture| texture.location.array == index as u32);
        for (texture, layer) in moved.zip(0..) {
            texture.location.layer = layer;
        }
        // Frames in flight read those of the array before.
        self.lifetimes.forget_retired(|location| location.array == index as u32);
        self.memory.moves += 1;
    }
}

/// The views of texture arrays. An array has the same one as long as it stays where it is.
pub(super) struct ArrayViews {
    of_arrays: Vec<Option<(wgpu::Texture, wgpu::TextureView)>>,
    /// Of an array of a single texel, to be bound where there is none.
    empty: wgpu::TextureView,
}

impl ArrayViews {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let (format, sampler) = (TextureFormat::Rgba8Unorm, Sampler::REPEAT);
        let class = TextureClass { width: 1, height: 1, format, mip_levels: 1, sampler };
        Self { of_arrays: Vec::new(), empty: view_of(&new_array(device, class, 1)) }
    }

    /// Makes the views of arrays that have moved.
    pub(super) fn update<'a>(&mut self, arrays: impl ExactSizeIterator<Item = Option<&'a wgpu::Texture>>) {
        self.of_arrays.resize(arrays.len(), None);
        for (known, array) in self.of_arrays.iter_mut().zip(arrays) {
            if known.as_ref().map(|(texture, _)| texture) != array {
                *known = array.map(|texture| (texture.clone(), view_of(texture)));
            }
        }
    }

    /// That of an array, by index; that of an empty one where there is none.
    pub(super) fn of_array(&self, array: Option<usize>) -> &wgpu::TextureView {
        let known = array.and_then(|array| self.of_arrays.get(array)?.as_ref());
        known.map_or(&self.empty, |(_, view)| view)
    }
}

fn view_of(array: &wgpu::Texture) -> wgpu::TextureView {
    array.create_view(&wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2Array),
        ..wgpu::TextureViewDescriptor::default()
    })
}
