//! Texture arrays on the device.

use drawloom::process::ShaderResource;
use drawloom::wgpu;

use super::error::DrawError;
use crate::array_sizes::ARRAYS;
use crate::mip_levels::{mip_count, mip_size};
use crate::texture_arrays::{TextureArray, TextureArrays};

/// Uploads texture arrays. Returns the resources of `textures.wgsl`: the arrays as colours, then as numbers, and two
/// samplers.
///
/// # Errors
/// If the device has too few layers or pixels, or too little memory for them.
pub(crate) fn upload(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    textures: &TextureArrays,
) -> Result<Vec<ShaderResource<'static>>, DrawError> {
    let white = TextureArray::white();
    let arrays = textures.arrays.iter().chain(std::iter::repeat(&white)).take(ARRAYS);
    let scopes = [wgpu::ErrorFilter::Internal, wgpu::ErrorFilter::OutOfMemory, wgpu::ErrorFilter::Validation];
    let scopes = scopes.map(|filter| device.push_error_scope(filter));
    let uploaded = arrays.map(|array| upload_array(device, queue, array)).collect::<Result<Vec<_>, _>>();
    // Scopes are a stack, and each must be popped.
    let mut failed = None;
    for scope in scopes.into_iter().rev() {
        failed = failed.or(pollster::block_on(scope.pop()));
    }
    if let Some(error) = failed {
        return Err(DrawError::Textures(error));
    }
    let uploaded = uploaded?;
    let formats = [wgpu::TextureFormat::Rgba8UnormSrgb, wgpu::TextureFormat::Rgba8Unorm];
    let views = formats.into_iter().flat_map(|format| uploaded.iter().map(move |texture| view(texture, format)));
    let samplers = [wgpu::FilterMode::Linear, wgpu::FilterMode::Nearest].map(|filter| sampler(device, filter));
    Ok(views.chain(samplers).collect())
}

fn upload_array(device: &wgpu::Device, queue: &wgpu::Queue, array: &TextureArray) -> Result<wgpu::Texture, DrawError> {
    let ([width, height], layers) = (array.size, array.layers.len() as u32);
    let limits = device.limits();
    if layers > limits.max_texture_array_layers || width.max(height) > limits.max_texture_dimension_2d {
        return Err(DrawError::TextureArray { layers, width, height });
    }
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: Some("glTF textures"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: layers },
        mip_level_count: mip_count(array.size),
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[wgpu::TextureFormat::Rgba8UnormSrgb],
    });
    for (layer, bytes) in (0..).zip(&array.layers) {
        let mut first = 0;
        for level in 0..mip_count(array.size) {
            let [width, height] = mip_size(array.size, level);
            let end = first + width as usize * height as usize * 4;
            let mut target = texture.as_image_copy();
            (target.mip_level, target.origin.z) = (level, layer);
            let layout = wgpu::TexelCopyBufferLayout {
                bytes_per_row: Some(width * 4),
                ..wgpu::TexelCopyBufferLayout::default()
            };
            let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
            #[expect(clippy::disallowed_methods, reason = "the texture is new")]
            queue.write_texture(target, &bytes[first..end], layout, size);
            first = end;
        }
    }
    Ok(texture)
}

fn view(texture: &wgpu::Texture, format: wgpu::TextureFormat) -> ShaderResource<'static> {
    let dimension = wgpu::TextureViewDimension::D2Array;
    let view = texture.create_view(&wgpu::TextureViewDescriptor {
        format: Some(format),
        dimension: Some(dimension),
        ..wgpu::TextureViewDescriptor::default()
    });
    ShaderResource::Texture { view, dimension }
}

fn sampler(device: &wgpu::Device, filter: wgpu::FilterMode) -> ShaderResource<'static> {
    let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
        address_mode_u: wgpu::AddressMode::Repeat,
        address_mode_v: wgpu::AddressMode::Repeat,
        mag_filter: filter,
        min_filter: filter,
        mipmap_filter: wgpu::MipmapFilterMode::Linear,
        ..wgpu::SamplerDescriptor::default()
    });
    ShaderResource::Sampler { sampler, kind: wgpu::SamplerBindingType::Filtering }
}
