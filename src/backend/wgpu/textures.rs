//! Textures on the device, in arrays by size, so that no texture is ever bound for a single batch.

use super::uploads::Uploads;
use crate::backend::texels::{SIDES, array_for, mip_chain};
use crate::scene::{Assets, Texture};
use crate::view::RejectionReason;

/// Where a texture is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TexturePlace {
    pub(super) array: u32,
    pub(super) layer: u32,
}

impl TexturePlace {
    /// What a material without a texture has.
    pub(super) const NONE: Self = Self { array: SIDES.len() as u32, layer: 0 };
}

/// The arrays. Like arenas, they never overwrite a layer that a frame on its way may still read.
#[derive(Default)]
pub(super) struct TextureArrays {
    arrays: [Array; SIDES.len()],
    identity: u64,
}

#[derive(Default)]
struct Array {
    texture: Option<wgpu::Texture>,
    /// Layers in use, garbage included.
    used: u32,
    /// Slot, revision and layer of each texture in it.
    layers: Vec<(u32, u64, u32)>,
}

impl TextureArrays {
    /// Uploads the textures that are new or changed, and counts those that the device has no room for.
    pub(super) fn update(
        &mut self,
        device: &wgpu::Device,
        uploads: &Uploads,
        assets: &Assets,
        rejected: &mut Vec<(RejectionReason, usize)>,
    ) {
        if self.identity != assets.textures.identity() {
            *self = Self { identity: assets.textures.identity(), ..Self::default() };
        }
        let most_layers = device.limits().max_texture_array_layers;
        for (array, (entry, side)) in self.arrays.iter_mut().zip(SIDES).enumerate() {
            let mut wanted: Vec<(u32, u64, &Texture)> = assets
                .textures
                .iter_with_revision()
                .filter(|(_, _, texture)| array_for(texture) == array)
                .map(|(handle, revision, texture)| (handle.index(), revision, texture))
                .collect();
            if wanted.len() > most_layers as usize {
                let beyond = wanted.split_off(most_layers as usize);
                rejected.extend(beyond.iter().map(|(slot, ..)| (RejectionReason::TextureLimit, *slot as usize)));
            }
            entry.update(device, uploads, side, &wanted, most_layers);
        }
    }

    /// Where the texture of a slot is; `None` where there was no room for it.
    pub(super) fn place(&self, slot: u32) -> Option<TexturePlace> {
        self.arrays.iter().zip(0..).find_map(|(array, index)| {
            let (_, _, layer) = array.layers.iter().find(|(other, ..)| *other == slot)?;
            Some(TexturePlace { array: index, layer: *layer })
        })
    }

    /// One view an array; of a single pixel where it holds nothing.
    pub(super) fn views(&self, device: &wgpu::Device) -> [wgpu::TextureView; SIDES.len()] {
        self.arrays.each_ref().map(|array| {
            let texture = array.texture.clone().unwrap_or_else(|| new_array(device, 1, 1));
            texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..wgpu::TextureViewDescriptor::default()
            })
        })
    }
}

impl Array {
    fn update(
        &mut self,
        device: &wgpu::Device,
        uploads: &Uploads,
        side: u32,
        wanted: &[(u32, u64, &Texture)],
        most_layers: u32,
    ) {
        self.layers.retain(|(slot, revision, _)| {
            wanted.iter().any(|(other, other_revision, _)| (other, other_revision) == (slot, revision))
        });
        if wanted.is_empty() {
            *self = Self::default();
            return;
        }
        let missing = wanted.len() - self.layers.len();
        let room = self.texture.as_ref().map_or(0, |texture| texture.depth_or_array_layers() - self.used);
        if missing > room as usize {
            // Room for as many again, so that one that changes every frame does not move the others every frame.
            let layers = (wanted.len() as u32 * 2).min(most_layers);
            *self = Self { texture: Some(new_array(device, side, layers)), ..Self::default() };
        }
        let Some(array) = &self.texture else { return };
        for &(slot, revision, texture) in wanted {
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

fn write_layer(uploads: &Uploads, array: &wgpu::Texture, layer: u32, side: u32, texture: &Texture) {
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
