//! Textures on the device, in texture arrays by size. All arrays are bound at once, so no batch changes a binding.

use super::upload_queue::UploadQueue;
use crate::backend::mip_generation::{ARRAY_SIDES, array_for, mip_chain};
use crate::scene::{Assets, Texture};
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

/// All texture arrays. Like arenas, they never overwrite a layer that a frame in flight may still read.
#[derive(Default)]
pub(crate) struct TextureArrays {
    arrays: [TextureArray; ARRAY_SIDES.len()],
    /// Of each texture, by slot.
    locations: Vec<Option<TextureLocation>>,
    identity: u64,
}

#[derive(Default)]
struct TextureArray {
    texture: Option<wgpu::Texture>,
    /// Layers in use, garbage included.
    used: u32,
    /// Slot, revision and layer of each live texture.
    layers: Vec<(u32, u64, u32)>,
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
        if self.identity != assets.textures.identity() {
            *self = Self { identity: assets.textures.identity(), ..Self::default() };
        }
        let max_layers = device.limits().max_texture_array_layers;
        for (index, (array, side)) in self.arrays.iter_mut().zip(ARRAY_SIDES).enumerate() {
            let mut textures: Vec<(u32, u64, &Texture)> = assets
                .textures
                .iter_with_revision()
                .filter(|(_, _, texture)| array_for(texture) == index)
                .map(|(handle, revision, texture)| (handle.index(), revision, texture))
                .collect();
            if textures.len() > max_layers as usize {
                let beyond = textures.split_off(max_layers as usize);
                rejected.extend(beyond.iter().map(|(slot, ..)| (RejectionReason::TextureLimit, *slot as usize)));
            }
            array.update(device, uploads, side, &textures, max_layers);
        }
        self.locations.clear();
        self.locations.resize(assets.textures.slot_count(), None);
        for (index, array) in (0..).zip(&self.arrays) {
            for &(slot, _, layer) in &array.layers {
                self.locations[slot as usize] = Some(TextureLocation { array: index, layer });
            }
        }
    }

    /// The location of the texture in a slot; `None` if it was rejected.
    pub(crate) fn location(&self, slot: u32) -> Option<TextureLocation> {
        self.locations.get(slot as usize).copied().flatten()
    }

    /// A view of each array; an empty array is a single pixel.
    pub(crate) fn views(&self, device: &wgpu::Device) -> [wgpu::TextureView; ARRAY_SIDES.len()] {
        self.arrays.each_ref().map(|array| {
            let texture = array.texture.clone().unwrap_or_else(|| new_array(device, 1, 1));
            texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..wgpu::TextureViewDescriptor::default()
            })
        })
    }
}

impl TextureArray {
    fn update(
        &mut self,
        device: &wgpu::Device,
        uploads: &UploadQueue,
        side: u32,
        textures: &[(u32, u64, &Texture)],
        max_layers: u32,
    ) {
        self.layers.retain(|(slot, revision, _)| {
            textures.iter().any(|(other, other_revision, _)| (other, other_revision) == (slot, revision))
        });
        if textures.is_empty() {
            *self = Self::default();
            return;
        }
        let missing = textures.len() - self.layers.len();
        let room = self.texture.as_ref().map_or(0, |texture| texture.depth_or_array_layers() - self.used);
        if missing > room as usize {
            // Twice the layers, so that a texture that changes every frame does not move the others every frame.
            let layers = (textures.len() as u32 * 2).min(max_layers);
            *self = Self { texture: Some(new_array(device, side, layers)), ..Self::default() };
        }
        let Some(array) = &self.texture else { return };
        for &(slot, revision, texture) in textures {
            if self.layers.iter().all(|(other, ..)| *other != slot) {
                write_layer(uploads, array, self.used, side, texture);
                self.layers.push((slot, revision, self.used));
                self.used += 1;
            }
        }
    }
}

fn new_array(device: &wgpu::Device, side: u32, layers: u32) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("textures"),
        size: wgpu::Extent3d { width: side, height: side, depth_or_array_layers: layers },
        mip_level_count: side.ilog2() + 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8UnormSrgb,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    })
}

fn write_layer(uploads: &UploadQueue, array: &wgpu::Texture, layer: u32, side: u32, texture: &Texture) {
    for (level, pixels) in (0..).zip(mip_chain(texture, side)) {
        let side = side >> level;
        uploads.write_texture(
            wgpu::TexelCopyTextureInfo {
                texture: array,
                mip_level: level,
                origin: wgpu::Origin3d { x: 0, y: 0, z: layer },
                aspect: wgpu::TextureAspect::All,
            },
            &pixels,
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(side * 4), rows_per_image: Some(side) },
            wgpu::Extent3d { width: side, height: side, depth_or_array_layers: 1 },
        );
    }
}
