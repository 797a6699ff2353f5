//! Pictures that the CPU made, as textures.

use super::error_scope::{check_device, with_error_scope};
use super::resources::texture_format;
use crate::backend::{BackendError, Picture};
use crate::process::ShaderResource;

/// A new texture with the pixels of a picture. It is uploaded before the submission that follows.
///
/// # Errors
/// If the device refuses it, or the picture is not whole.
pub(super) fn upload_picture(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    picture: &Picture,
) -> Result<ShaderResource<'static>, BackendError> {
    picture.check_upload()?;
    let Picture { width, height, format, ref bytes } = *picture;
    let label = "a picture of the CPU";
    let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
    let upload = || {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: texture_format(format),
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let bytes_per_row = Some(width * format.bytes() as u32);
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row, rows_per_image: None };
        // No command uses the texture yet, so no submission takes its lock (wgpu issue 9460).
        #[expect(clippy::disallowed_methods, reason = "the texture is new")]
        queue.write_texture(texture.as_image_copy(), bytes, layout, size);
        texture.create_view(&wgpu::TextureViewDescriptor::default())
    };
    let view = with_error_scope(device, label, upload)?;
    // A lost device makes textures without a word.
    check_device(device)?;
    Ok(ShaderResource::Texture { view, dimension: wgpu::TextureViewDimension::D2 })
}
