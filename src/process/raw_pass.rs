//! Passes that an engine encodes itself.

use std::error::Error;

use bytemuck::Pod;
use wgpu::util::DeviceExt;

use super::raw_access::RawAccess;
use super::{AccessError, BufferLayout, StorageBuffer};
use crate::handle::Handle;
use crate::scene::{ColumnLayout, Material, MaterialLayout, MaterialType, ObjectColumn, ViewKind};
use crate::view::{RenderView, TextureSets};

/// A pass that gets the command encoder, because compute, copies and viewports cannot be recorded into a bundle.
///
/// It is called on a worker, once per frame and view of its process's kind, or
/// [once a frame](super::Declare::once_a_frame); for each of its encoders, if it has several.
pub trait RawPass: Send + Sync {
    /// The number of encoders that the pass is encoded in for a view: one, unless it says more. They are encoded at the
    /// same time, on any workers, and submitted in order. It is called when the frame begins. A frame with a pass of
    /// more than [`MAX_ENCODERS`](RawPassResources::MAX_ENCODERS) fails; 0 counts as 1.
    fn encoder_count(&self, _view: &RenderView) -> usize {
        1
    }

    /// Encodes the pass, or [one of its encoders](RawPassResources::encoder).
    ///
    /// # Errors
    /// Any error of the engine, or an [`AccessError`] of a lookup: the frame fails with an error that names the
    /// process.
    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &RawPassResources<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>>;
}

/// The resources of a raw pass: those that its process declares. It gets no others, in any build: processes are ordered
/// by what they declare, so another target may not be written yet, or not exist in the next plan.
///
/// A lookup that fails makes the frame fail, with an error that names the process and the resource, even if `encode`
/// goes on without the resource. The next frame is not affected. `tracing` warns, once, of what the process declares
/// and the pass has not asked for in the first 60 frames that encode it: a declaration orders processes, and keeps
/// those that write the target.
///
/// Textures and buffers that a pass destroys are made anew for a later frame: histories and buffers without what they
/// held. The frame itself fails, and so do those that were recorded before its submission.
///
/// Nothing checks how a pass uses what it gets: wgpu has no textures that can only be read, so no error tells of a pass
/// that writes a target which its process only [reads](super::Declare::reads).
pub struct RawPassResources<'a> {
    /// The device.
    pub device: &'a wgpu::Device,
    /// The view's index among [the frame's views](crate::RecordedFrame::views): those of the scene's cameras in
    /// their order, then those of shadow maps of lights.
    pub view: usize,
    /// Width and height of the view's picture, in pixels.
    pub size: [u32; 2],
    /// Which of the pass's [encoders](RawPass::encoder_count) is encoded: from 0 on, in the order of submission.
    pub encoder: usize,
    /// The layouts of [`RawPassResources::bind_groups`], for pipelines of the pass's own.
    pub bind_group_layouts: [&'a wgpu::BindGroupLayout; 2],
    /// `@group(0)` and `@group(1)` of the [prelude](super::SHADER_PRELUDE), for vertex, fragment and compute shaders:
    /// the view, all objects and the lights that reach the view; materials and their textures. `drawn` is empty. Where
    /// textures of materials are divided into sets, the second has the first of them: see
    /// [`Self::bind_group_of_material`].
    pub bind_groups: [&'a wgpu::BindGroup; 2],
    pub(crate) materials_bind_groups: &'a [wgpu::BindGroup],
    pub(crate) texture_sets: &'a TextureSets,
    pub(crate) access: RawAccess<'a>,
    pub(crate) columns: &'a dyn Fn(ColumnLayout) -> Option<wgpu::BufferBinding<'a>>,
    pub(crate) materials: &'a dyn Fn(MaterialLayout) -> Option<wgpu::BufferBinding<'a>>,
    pub(crate) buffers: &'a dyn Fn(BufferLayout) -> Option<&'a wgpu::Buffer>,
    pub(crate) textures: &'a dyn Fn(&str) -> Option<&'a wgpu::Texture>,
    pub(crate) layered: &'a dyn Fn(ViewKind, &str) -> Option<&'a wgpu::Texture>,
}

impl RawPassResources<'_> {
    /// The most encoders of a pass in a view.
    pub const MAX_ENCODERS: usize = 256;

    /// A new buffer with these bytes, for this frame. A write through the queue would be seen by every frame that is
    /// recorded and not yet submitted.
    pub fn buffer_of(&self, label: &str, usage: wgpu::BufferUsages, bytes: &[u8]) -> wgpu::Buffer {
        self.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: Some(label), contents: bytes, usage })
    }

    /// `@group(1)` with the textures of a material. It is the same one for materials whose textures have together no
    /// more sizes, formats and samplers than [`Material::MAX_TEXTURES`].
    pub fn bind_group_of_material(&self, material: Handle<Material>) -> &wgpu::BindGroup {
        let set = self.texture_sets.set_of(material.index());
        self.materials_bind_groups.get(set as usize).unwrap_or(self.bind_groups[1])
    }

    /// The values of a column of objects.
    ///
    /// # Errors
    /// If the process does not declare that it [reads](super::Declare::reads_column) it.
    pub fn column<T: Pod>(&self, column: ObjectColumn<T>) -> Result<wgpu::BufferBinding<'_>, AccessError> {
        self.access.column(column.layout(), || (self.columns)(column.layout()))
    }

    /// The values of a material type.
    ///
    /// # Errors
    /// If the process does not declare that it [reads](super::Declare::reads_materials) them.
    pub fn materials<T: Pod>(&self, material_type: MaterialType<T>) -> Result<wgpu::BufferBinding<'_>, AccessError> {
        self.access.material_type(material_type.layout(), || (self.materials)(material_type.layout()))
    }

    /// A buffer that processes share, with the usages `STORAGE`, `INDIRECT`, `COPY_SRC` and `COPY_DST`. To fill it,
    /// copy from [`RawPassResources::buffer_of`].
    ///
    /// # Errors
    /// If the process does not declare that it [reads](super::Declare::reads_buffer) or
    /// [changes](super::Declare::changes_buffer) it, or takes [arguments](super::Declare::reads_arguments) from it.
    pub fn buffer<T: Pod>(&self, buffer: StorageBuffer<T>) -> Result<&wgpu::Buffer, AccessError> {
        self.access.buffer(buffer.layout(), || (self.buffers)(buffer.layout()))
    }

    /// The view's target of this name; a history by its [`previous_name`](super::previous_name).
    ///
    /// # Errors
    /// If the process does not declare that it [reads](super::Declare::reads), [changes](super::Declare::changes) or
    /// [writes](super::Declare::writes) it, or [samples what it held before](super::Declare::samples_previous).
    pub fn target(&self, name: impl AsRef<str>) -> Result<&wgpu::Texture, AccessError> {
        let name = name.as_ref();
        self.access.target(name, || (self.textures)(name))
    }

    /// The texture array of this name that all views of a kind share.
    ///
    /// # Errors
    /// If the process does not declare that it [samples the layers](super::Declare::samples_layers), or, where the
    /// views are of its own kind, uses the target as others; or if the views share no target of this name.
    pub fn layered_target(&self, views: ViewKind, name: impl AsRef<str>) -> Result<&wgpu::Texture, AccessError> {
        let name = name.as_ref();
        self.access.layered_target(views, name, || (self.layered)(views, name))
    }
}
