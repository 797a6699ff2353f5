//! One texture array, and which of its layers are in use.

use super::buffers::CountedQueue;
use crate::backend::BackendError;
use crate::backend::mip_generation::mip_chain;
use crate::backend::wgpu::error_scope::{loss_or, refused};
use crate::scene::{Texture, TextureClass, TextureFormat};

/// A texture array of equal layers with all mip levels.
#[derive(Default)]
pub(super) struct TextureLayers {
    /// `None` while no layer is in use.
    texture: Option<wgpu::Texture>,
    /// By layer.
    is_used: Vec<bool>,
    free_count: usize,
}

impl TextureLayers {
    /// A free layer, which is in use from now on; `None` if there is none.
    pub(super) fn take(&mut self) -> Option<u32> {
        let free = self.is_used.iter().position(|is_used| !is_used)?;
        self.is_used[free] = true;
        self.free_count -= 1;
        Some(free as u32)
    }

    /// Makes a layer free.
    pub(super) fn free(&mut self, layer: u32) {
        if let Some(is_used) = self.is_used.get_mut(layer as usize) {
            self.free_count += usize::from(*is_used);
            *is_used = false;
        }
    }

    pub(super) fn capacity(&self) -> usize {
        self.is_used.len()
    }

    pub(super) fn free_count(&self) -> usize {
        self.free_count
    }

    pub(super) fn texture(&self) -> Option<&wgpu::Texture> {
        self.texture.as_ref()
    }

    /// Drops the texture. Snapshots keep it while they need it.
    pub(super) fn release(&mut self) {
        *self = Self::default();
    }

    /// Moves to a texture with this many layers; to none if that is 0. The device copies `live` layers to the first
    /// ones, in their order; all others are free then. The copy is submitted before anything that reads it.
    pub(super) fn move_to(
        &mut self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        class: TextureClass,
        layers: u32,
        live: &[u32],
    ) {
        if layers == 0 {
            return self.release();
        }
        let texture = new_array(device, class, layers);
        if let Some(before) = self.texture.as_ref().filter(|_| !live.is_empty()) {
            let label = Some("textures move to another array");
            let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label });
            let mut first = 0;
            for run in live.chunk_by(|one, next| one + 1 == *next) {
                copy_layers(&mut encoder, (before, run[0]), (&texture, first), run.len() as u32);
                first += run.len() as u32;
            }
            uploads.add_commands([encoder.finish()]);
        }
        let is_used = (0..layers as usize).map(|layer| layer < live.len()).collect();
        *self = Self { texture: Some(texture), is_used, free_count: layers as usize - live.len() };
    }
}

/// Copies `count` layers, with all mip levels, from one layer on to those from another one on.
fn copy_layers(
    encoder: &mut wgpu::CommandEncoder,
    source: (&wgpu::Texture, u32),
    destination: (&wgpu::Texture, u32),
    count: u32,
) {
    for mip_level in 0..source.0.mip_level_count() {
        let of = |(texture, z)| {
            let origin = wgpu::Origin3d { x: 0, y: 0, z };
            wgpu::TexelCopyTextureInfo { texture, mip_level, origin, aspect: wgpu::TextureAspect::All }
        };
        let level = source.0.size().mip_level_size(mip_level, wgpu::TextureDimension::D2);
        // Copies of compressed levels are of whole blocks.
        let level = level.physical_size(source.0.format());
        let size = wgpu::Extent3d { depth_or_array_layers: count, ..level };
        encoder.copy_texture_to_texture(of(source), of(destination), size);
    }
}

/// An array of layers of a class.
pub(super) fn new_array(device: &wgpu::Device, class: TextureClass, layers: u32) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: Some("textures"),
        size: wgpu::Extent3d { width: class.width, height: class.height, depth_or_array_layers: layers },
        mip_level_count: class.mip_levels,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: format_of(class.format),
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST | wgpu::TextureUsages::COPY_SRC,
        view_formats: &[],
    })
}

/// Whether a device can have an array of a class.
pub(super) fn can_hold(device: &wgpu::Device, class: TextureClass) -> bool {
    let has_size = class.width.max(class.height) <= device.limits().max_texture_dimension_2d;
    has_size && device.features().contains(format_of(class.format).required_features())
}

fn format_of(format: TextureFormat) -> wgpu::TextureFormat {
    let astc = |channel| wgpu::TextureFormat::Astc { block: wgpu::AstcBlock::B4x4, channel };
    match format {
        TextureFormat::R8Unorm => wgpu::TextureFormat::R8Unorm,
        TextureFormat::Rg8Unorm => wgpu::TextureFormat::Rg8Unorm,
        TextureFormat::Rgba8Unorm => wgpu::TextureFormat::Rgba8Unorm,
        TextureFormat::Rgba8Srgb => wgpu::TextureFormat::Rgba8UnormSrgb,
        TextureFormat::R16Float => wgpu::TextureFormat::R16Float,
        TextureFormat::Rg16Float => wgpu::TextureFormat::Rg16Float,
        TextureFormat::Rgba16Float => wgpu::TextureFormat::Rgba16Float,
        TextureFormat::Bc1Srgb => wgpu::TextureFormat::Bc1RgbaUnormSrgb,
        TextureFormat::Bc3Srgb => wgpu::TextureFormat::Bc3RgbaUnormSrgb,
        TextureFormat::Bc4Unorm => wgpu::TextureFormat::Bc4RUnorm,
        TextureFormat::Bc5Unorm => wgpu::TextureFormat::Bc5RgUnorm,
        TextureFormat::Bc6hUfloat => wgpu::TextureFormat::Bc6hRgbUfloat,
        TextureFormat::Bc7Unorm => wgpu::TextureFormat::Bc7RgbaUnorm,
        TextureFormat::Bc7Srgb => wgpu::TextureFormat::Bc7RgbaUnormSrgb,
        TextureFormat::Etc2Rgba8Unorm => wgpu::TextureFormat::Etc2Rgba8Unorm,
        TextureFormat::Etc2Rgba8Srgb => wgpu::TextureFormat::Etc2Rgba8UnormSrgb,
        TextureFormat::Astc4x4Unorm => astc(wgpu::AstcChannel::Unorm),
        TextureFormat::Astc4x4Srgb => astc(wgpu::AstcChannel::UnormSrgb),
    }
}

/// The most bytes that are copied at once: a level may have more than a buffer can.
const MAX_COPY_BYTES: u32 = 64 << 20;

/// Records a copy of a texture, with all mip levels, to a layer.
///
/// # Errors
/// If the device has no room, or is lost.
pub(super) fn copy_layer(
    device: &wgpu::Device,
    encoder: &mut wgpu::CommandEncoder,
    array: &wgpu::Texture,
    layer: u32,
    texture: &Texture,
) -> Result<(), BackendError> {
    let class = texture.class();
    for (level, bytes) in (0..).zip(mip_chain(texture)) {
        let (_, row_bytes) = class.level_rows(level);
        let rows = (MAX_COPY_BYTES / row_bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT)).max(1);
        let portions = bytes.chunks((rows * row_bytes) as usize);
        for (first, portion) in (0..).step_by(rows as usize).zip(portions) {
            copy_rows(device, encoder, (array, class), (layer, level), first, portion)?;
        }
    }
    Ok(())
}

/// Records a copy of whole rows, which are rows of blocks if the format has blocks, to a mip level of a layer of an
/// array of this class, from row `first` on. The rows wait in a buffer of their own.
/// `Queue::write_texture` would copy them under a lock that every submission takes. It can also deadlock with a
/// submission of commands that were recorded before all layers of the texture were initialised (wgpu issue 9460).
///
/// # Errors
/// If the device has no room, or is lost.
pub(crate) fn copy_rows(
    device: &wgpu::Device,
    encoder: &mut wgpu::CommandEncoder,
    (array, class): (&wgpu::Texture, TextureClass),
    (layer, mip_level): (u32, u32),
    first: u32,
    pixels: &[u8],
) -> Result<(), BackendError> {
    let (_, row_bytes) = class.level_rows(mip_level);
    let (rows, side) = (pixels.len() as u32 / row_bytes, class.format.block_side());
    let width = class.level_size(mip_level)[0].next_multiple_of(side);
    let extent = wgpu::Extent3d { width, height: rows * side, depth_or_array_layers: 1 };
    let stride = row_bytes.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let label = "rows of a texture";
    let size = u64::from(stride) * u64::from(rows);
    // With `MAP_WRITE` the rows are written into this buffer. Without it, wgpu maps another one, which the device
    // copies to this one.
    let usage = wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::MAP_WRITE;
    let buffer =
        device.create_buffer(&wgpu::BufferDescriptor { label: Some(label), size, usage, mapped_at_creation: true });
    {
        let view = buffer.get_mapped_range_mut(..);
        let mut view = view.map_err(|error| loss_or(device, refused(label, error.to_string())))?;
        if stride == row_bytes {
            view.copy_from_slice(pixels);
        } else {
            for (row, bytes) in pixels.chunks_exact(row_bytes as usize).enumerate() {
                let first = row * stride as usize;
                view.slice(first..first + bytes.len()).copy_from_slice(bytes);
            }
        }
    }
    buffer.unmap();
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(stride), rows_per_image: Some(rows) };
    let origin = wgpu::Origin3d { x: 0, y: first * side, z: layer };
    let destination =
        wgpu::TexelCopyTextureInfo { texture: array, mip_level, origin, aspect: wgpu::TextureAspect::All };
    encoder.copy_buffer_to_texture(wgpu::TexelCopyBufferInfo { buffer: &buffer, layout }, destination, extent);
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::wgpu::error_scope::with_error_scope;
    use crate::backend::wgpu::noop_device::noop_device;

    #[test]
    fn on_a_lost_device_a_copy_returns_the_loss() {
        let (device, _queue) = noop_device();
        let texture = Texture::new("plain", 1, 1, vec![255; 4]).unwrap();
        let array = new_array(&device, texture.class(), 2);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut copy =
            || with_error_scope(&device, "a copy", || copy_layer(&device, &mut encoder, &array, 1, &texture)).flatten();
        copy().unwrap();
        device.destroy();
        assert!(matches!(copy(), Err(BackendError::DeviceLost { .. })));
    }
}
