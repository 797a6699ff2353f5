//! Texture arrays and cube maps whose layers are targets of several views.

use std::sync::Arc;

use super::target_texture::{TextureKind, new_texture, new_views};
use crate::backend::BackendError;
use crate::process::{PlannedTarget, SampledShape, ViewArray};
use crate::view::RenderView;

/// The texture of a [`ViewArray`].
#[derive(Clone)]
pub(super) struct ViewArrayTexture {
    array: ViewArray,
    pub(super) planned: Arc<PlannedTarget>,
    pub(super) texture: wgpu::Texture,
    /// For each of the array's shapes, what shaders bind.
    sampled: Vec<wgpu::TextureView>,
}

impl ViewArrayTexture {
    /// The texture of an array; that of the frame before, among `known`, if the array
    /// [keeps](ViewArray::keeps_texture_of) it. The layers of views that the frame does not have are zeros.
    ///
    /// # Errors
    /// If a picture is larger than the device allows.
    pub(super) fn new(
        device: &wgpu::Device,
        planned: &Arc<PlannedTarget>,
        array: ViewArray,
        views: &[RenderView],
        known: &[Self],
    ) -> Result<Self, BackendError> {
        let size = array.view_indices.iter().flatten().next().map_or([1, 1], |view| views[*view].camera.size);
        let kind = TextureKind::of(planned, size);
        let [width, height] = kind.size;
        let extent = wgpu::Extent3d { width, height, depth_or_array_layers: array.view_indices.len() as u32 };
        let fits = |known: &&Self| {
            known.planned == *planned && known.texture.size() == extent && array.keeps_texture_of(&known.array)
        };
        if let Some(known) = known.iter().find(fits) {
            return Ok(Self { array, ..known.clone() });
        }
        let texture = new_texture(device, &planned.name, kind, extent.depth_or_array_layers)?;
        let sampled_as = |shape: &SampledShape| new_views(&texture, planned.format, &shape_descriptor(*shape)).1;
        let sampled = array.shapes.iter().map(sampled_as).collect();
        Ok(Self { array, planned: Arc::clone(planned), texture, sampled })
    }

    /// The indices of its views, each with its layer.
    pub(super) fn layers(&self) -> impl Iterator<Item = (usize, u32)> {
        (0..).zip(&self.array.view_indices).filter_map(|(layer, view)| view.map(|view| (view, layer)))
    }

    /// The texture that a shader binds to sample a target, by its index among the plan's, in this shape, if one of its
    /// layers is that of the view.
    pub(super) fn find(&self, view: usize, target: usize, shape: SampledShape) -> Option<&wgpu::TextureView> {
        let shape = self.array.shapes.iter().position(|known| *known == shape)?;
        let is_found = self.array.target_index == target && self.array.view_indices.contains(&Some(view));
        is_found.then(|| &self.sampled[shape])
    }
}

/// One layer, to draw into.
pub(super) fn layer_descriptor(layer: u32) -> wgpu::TextureViewDescriptor<'static> {
    wgpu::TextureViewDescriptor {
        dimension: Some(wgpu::TextureViewDimension::D2),
        base_array_layer: layer,
        array_layer_count: Some(1),
        ..wgpu::TextureViewDescriptor::default()
    }
}

/// What a shader that samples this shape binds.
pub(super) fn shape_descriptor(shape: SampledShape) -> wgpu::TextureViewDescriptor<'static> {
    wgpu::TextureViewDescriptor {
        dimension: Some(shape_dimension(shape)),
        array_layer_count: Some(shape.view_count()),
        ..wgpu::TextureViewDescriptor::default()
    }
}

/// How WGSL sees the shape.
pub(crate) fn shape_dimension(shape: SampledShape) -> wgpu::TextureViewDimension {
    match shape {
        SampledShape::Picture => wgpu::TextureViewDimension::D2,
        SampledShape::Layers(_) => wgpu::TextureViewDimension::D2Array,
        SampledShape::Cube => wgpu::TextureViewDimension::Cube,
    }
}
