//! Passes that an engine encodes itself.

use std::error::Error;

use bytemuck::Pod;
use wgpu::util::DeviceExt;

use super::{BufferLayout, StorageBuffer};
use crate::scene::{ColumnLayout, MaterialLayout, MaterialType, ObjectColumn, ViewKind};

/// A pass that gets the command encoder, because compute, copies and viewports cannot be recorded into a bundle.
///
/// It is called on a worker, once per frame and view of its process's kind, or
/// [once a frame](super::Declare::once_a_frame).
pub trait RawPass: Send + Sync {
    /// Encodes the pass.
    ///
    /// # Errors
    /// Any error of the engine: the frame fails with an error that names the process.
    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &RawPassResources<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>>;
}

/// The resources of a raw pass.
pub struct RawPassResources<'a> {
    /// The device.
    pub device: &'a wgpu::Device,
    /// The view's index among the frame's views.
    pub view: usize,
    /// Width and height of the view's picture, in pixels.
    pub size: [u32; 2],
    /// The layouts of [`RawPassResources::bind_groups`], for pipelines of the pass's own.
    pub bind_group_layouts: [&'a wgpu::BindGroupLayout; 2],
    /// `@group(0)` and `@group(1)` of the [prelude](super::SHADER_PRELUDE), for vertex, fragment and compute shaders: the view,
    /// all objects and the lights that reach the view; materials and their textures. `drawn` is empty.
    pub bind_groups: [&'a wgpu::BindGroup; 2],
    pub(crate) columns: &'a dyn Fn(ColumnLayout) -> Option<wgpu::BufferBinding<'a>>,
    pub(crate) materials: &'a dyn Fn(MaterialLayout) -> Option<wgpu::BufferBinding<'a>>,
    pub(crate) buffers: &'a dyn Fn(BufferLayout) -> Option<&'a wgpu::Buffer>,
    pub(crate) textures: &'a dyn Fn(&str) -> Option<&'a wgpu::Texture>,
    pub(crate) layered: &'a dyn Fn(ViewKind, &str) -> Option<&'a wgpu::Texture>,
}

impl RawPassResources<'_> {
    /// A new buffer with these bytes, for this frame. A write through the queue would be seen by every frame that is recorded and not
    /// yet submitted.
    pub fn buffer_of(&self, label: &str, usage: wgpu::BufferUsages, bytes: &[u8]) -> wgpu::Buffer {
        self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents: bytes, usage })
    }

    /// The values of a column of objects; `None` if the process does not declare that it [reads](super::Declare::reads_column) it.
    pub fn column<T: Pod>(&self, column: ObjectColumn<T>) -> Option<wgpu::BufferBinding<'_>> {
        (self.columns)(column.layout())
    }

    /// The values of a material type; `None` if the process does not declare that it [reads](super::Declare::reads_materials) them.
    pub fn materials<T: Pod>(&self, material_type: MaterialType<T>) -> Option<wgpu::BufferBinding<'_>> {
        (self.materials)(material_type.layout())
    }

    /// A buffer that processes share, with the usages `STORAGE`, `INDIRECT`, `COPY_SRC` and `COPY_DST`; `None` if the process does not
    /// declare that it [reads](super::Declare::reads_buffer) or [changes](super::Declare::changes_buffer) it. To fill it, copy from
    /// [`RawPassResources::buffer_of`].
    pub fn buffer<T: Pod>(&self, buffer: StorageBuffer<T>) -> Option<&wgpu::Buffer> {
        (self.buffers)(buffer.layout())
    }

    /// The view's target of this name; `None` if no process declares it.
    pub fn target(&self, name: &str) -> Option<&wgpu::Texture> {
        (self.textures)(name)
    }

    /// The texture array of this name that all views of a kind share; `None` if no process declares it.
    pub fn layered_target(&self, views: ViewKind, name: &str) -> Option<&wgpu::Texture> {
        (self.layered)(views, name)
    }
}
