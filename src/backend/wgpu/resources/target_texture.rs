//! Textures for targets, and the views of them.

use super::bind_groups::texture_format;
use crate::backend::BackendError;
use crate::backend::mip_generation::mip_level_count;
use crate::backend::wgpu::error_scope::with_error_scope;
use crate::process::{Format, PlannedTarget};

/// What a texture for a target is like. Only targets that are alike in all of it share one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct TextureKind {
    pub(crate) format: Format,
    pub(crate) multisampled: bool,
    pub(crate) stored: bool,
    pub(crate) mipmapped: bool,
    pub(crate) size: [u32; 2],
}

impl TextureKind {
    /// The texture for a target in a view with a picture of this size.
    pub(crate) fn of(planned: &PlannedTarget, picture: [u32; 2]) -> Self {
        let PlannedTarget { format, multisampled, stored, mipmapped, size, .. } = *planned;
        Self { format, multisampled, stored, mipmapped, size: size.in_view(picture) }
    }
}

/// The number of samples of the pixels of a target.
pub(crate) fn sample_count(multisampled: bool) -> u32 {
    // The only number beside 1 that every device has.
    if multisampled { 4 } else { 1 }
}

/// The size of a texture in bytes.
pub(super) fn texture_bytes(format: Format, texture: &wgpu::Texture) -> u64 {
    let pixels_of_level = |level: u32| {
        let size = texture.size().mip_level_size(level, wgpu::TextureDimension::D2);
        u64::from(size.width) * u64::from(size.height) * u64::from(size.depth_or_array_layers)
    };
    let pixels: u64 = (0..texture.mip_level_count()).map(pixels_of_level).sum();
    pixels * format.bytes() as u64 * u64::from(texture.sample_count())
}

/// A view to draw into, and one that shaders sample: of level 0, and of all levels unless the descriptor says
/// otherwise.
pub(super) fn new_views(
    texture: &wgpu::Texture,
    format: Format,
    descriptor: &wgpu::TextureViewDescriptor<'_>,
) -> (wgpu::TextureView, wgpu::TextureView) {
    let view = texture.create_view(&wgpu::TextureViewDescriptor { mip_level_count: Some(1), ..descriptor.clone() });
    let has_levels = texture.mip_level_count() > 1 && descriptor.mip_level_count != Some(1);
    let sampled = if has_levels {
        texture.create_view(descriptor)
    } else if format.has_depth() && format.has_stencil() {
        let aspect = wgpu::TextureAspect::DepthOnly;
        texture.create_view(&wgpu::TextureViewDescriptor { aspect, ..descriptor.clone() })
    } else {
        view.clone()
    };
    (view, sampled)
}

/// A texture for the target `label`.
///
/// # Errors
/// If the device lacks a feature, a limit is too low, or the device has no room.
pub(super) fn new_texture(
    device: &wgpu::Device,
    label: &str,
    kind: TextureKind,
    layers: u32,
) -> Result<wgpu::Texture, BackendError> {
    let TextureKind { format, multisampled, stored, mipmapped, size: [width, height] } = kind;
    let missing = texture_format(format).required_features() - device.features();
    if !missing.is_empty() {
        return Err(BackendError::MissingFeature { missing: missing.to_string() });
    }
    let limits = device.limits();
    let allowed = limits.max_texture_dimension_2d;
    if width.max(height) > allowed {
        return Err(BackendError::TargetTooLarge { target: label.to_owned(), width, height, allowed });
    }
    let allowed = limits.max_texture_array_layers;
    if layers > allowed {
        let (limit, allowed, needed) = ("max_texture_array_layers", u64::from(allowed), u64::from(layers));
        return Err(BackendError::Limit { limit, allowed, needed });
    }
    let sampled = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING;
    let copied = wgpu::TextureUsages::COPY_SRC | wgpu::TextureUsages::COPY_DST;
    let usage = if multisampled { sampled } else { sampled | copied };
    let descriptor = wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: layers },
        mip_level_count: if mipmapped { mip_level_count(kind.size) } else { 1 },
        sample_count: sample_count(multisampled),
        dimension: wgpu::TextureDimension::D2,
        format: texture_format(format),
        usage: if stored { usage | wgpu::TextureUsages::STORAGE_BINDING } else { usage },
        view_formats: &[],
    };
    // A scope of its own, so that the error names the target that there is no room for.
    with_error_scope(device, label, || device.create_texture(&descriptor))
}
