//! Meshes in an engine's own buffers.

use std::collections::HashMap;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

use wgpu::util::RenderEncoder;

use super::arena::filled_buffer;
use super::upload_queue::UploadQueue;
use crate::backend::BackendError;
use crate::backend::error::broken_rule;
use crate::backend::wgpu::error_scope::{catch_wgpu_panic, with_error_scope};
use crate::process::DeclaredAttribute;
use crate::scene::{AttributeLayout, DeviceGeometry, Mesh, NORMAL, POSITION, StreamLayout, Topology, UV};

/// What pipelines know of a mesh in an engine's own buffers. Meshes with equal layouts share pipelines.
#[derive(Debug)]
pub(crate) struct DeviceLayout {
    pub(crate) streams: Vec<StreamLayout>,
    /// Of strips, whose pipelines know it.
    pub(crate) strip_index_format: Option<wgpu::IndexFormat>,
    /// The name of a mesh with this layout, for errors.
    pub(crate) mesh: String,
}

impl PartialEq for DeviceLayout {
    fn eq(&self, other: &Self) -> bool {
        self.strip_index_format == other.strip_index_format && self.streams == other.streams
    }
}

impl Eq for DeviceLayout {}

impl Hash for DeviceLayout {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        self.strip_index_format.hash(hasher);
        self.streams.hash(hasher);
    }
}

/// Where a vertex buffer of a pipeline comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum VertexSlot {
    /// A stream of the mesh, by index.
    Stream(usize),
    /// The default of an attribute that the mesh lacks. All vertices have the same: the stride is 0.
    Default(&'static str),
}

impl DeviceLayout {
    fn new(mesh: &Mesh, geometry: &DeviceGeometry) -> Self {
        let indices = geometry.indices.as_ref().filter(|_| mesh.topology() == Topology::TriangleStrip);
        Self {
            streams: geometry.streams.iter().map(|stream| stream.layout.clone()).collect(),
            strip_index_format: indices.map(|indices| indices.format),
            mesh: mesh.name().to_owned(),
        }
    }

    /// The vertex buffers of a pipeline whose shader reads these attributes beside those of every vertex: in this order.
    pub(crate) fn slots<'a>(&'a self, attributes: &'a [AttributeLayout]) -> impl Iterator<Item = VertexSlot> + 'a {
        let names = || [POSITION, NORMAL, UV].into_iter().chain(attributes.iter().map(|attribute| attribute.name));
        let is_in = |stream: &StreamLayout, name| stream.attributes.iter().any(|attribute| attribute.name() == name);
        let is_read = move |(_, stream): &(usize, &StreamLayout)| names().any(|name| is_in(stream, name));
        let streams = self.streams.iter().enumerate().filter(is_read).map(|(index, _)| VertexSlot::Stream(index));
        let missing = names().filter(move |&name| !self.streams.iter().any(|stream| is_in(stream, name)));
        streams.chain(missing.map(VertexSlot::Default))
    }
}

/// A mesh in an engine's own buffers.
#[derive(Clone)]
pub(crate) struct DeviceMesh {
    pub(crate) layout: Arc<DeviceLayout>,
    pub(crate) geometry: Arc<DeviceGeometry>,
}

/// The meshes in an engine's own buffers, by slot, and the defaults of attributes that they lack.
#[derive(Clone, Default)]
pub(crate) struct DeviceMeshes {
    meshes: HashMap<u32, DeviceMesh>,
    /// By the name of the attribute.
    defaults: HashMap<&'static str, wgpu::Buffer>,
}

impl DeviceMeshes {
    /// The same for other meshes. A new one is checked.
    ///
    /// # Errors
    /// If a buffer is not one of this device, or the device has no room for defaults.
    pub(crate) fn updated<'a>(
        &self,
        device: &wgpu::Device,
        uploads: &UploadQueue,
        meshes: impl Iterator<Item = (u32, &'a Mesh)>,
        attributes: &[DeclaredAttribute],
    ) -> Result<Self, BackendError> {
        let mut updated = Self::default();
        for (slot, mesh) in meshes {
            let Some(geometry) = mesh.device_geometry() else { continue };
            let known = self.meshes.get(&slot).filter(|known| Arc::ptr_eq(&known.geometry, geometry));
            let mesh = match known {
                Some(known) => known.clone(),
                None => {
                    check_device(device, mesh.name(), geometry)?;
                    let layout = DeviceLayout::new(mesh, geometry);
                    let mut others = self.meshes.values().chain(updated.meshes.values());
                    let same = others.find(|other| *other.layout == layout).map(|other| Arc::clone(&other.layout));
                    DeviceMesh { layout: same.unwrap_or_else(|| Arc::new(layout)), geometry: Arc::clone(geometry) }
                }
            };
            updated.meshes.insert(slot, mesh);
        }
        if !updated.meshes.is_empty() {
            let zeros = [0; 16];
            let shipped = [NORMAL, UV].map(|name| (name, zeros.as_slice()));
            let own = attributes.iter().map(|attribute| (attribute.layout.name, attribute.default.as_slice()));
            for (name, bytes) in shipped.into_iter().chain(own) {
                let buffer =
                    filled_buffer(device, uploads, "default of an attribute", bytes, wgpu::BufferUsages::VERTEX)?;
                updated.defaults.insert(name, buffer);
            }
        }
        Ok(updated)
    }

    /// Whether there are none.
    pub(crate) fn is_empty(&self) -> bool {
        self.meshes.is_empty()
    }

    /// The mesh in a slot; `None` if that is in the arenas.
    pub(crate) fn get(&self, slot: u32) -> Option<&DeviceMesh> {
        self.meshes.get(&slot)
    }

    /// Whether the meshes in two slots have equal layouts. Those in the arenas have.
    pub(crate) fn have_equal_layouts(&self, one: u32, other: u32) -> bool {
        match (self.get(one), self.get(other)) {
            (None, None) => true,
            (Some(one), Some(other)) => Arc::ptr_eq(&one.layout, &other.layout),
            _ => false,
        }
    }

    /// Sets the buffers of a mesh, for a pipeline that reads these attributes.
    ///
    /// # Errors
    /// If an attribute has no default. This is a bug in Drawloom.
    pub(crate) fn set_buffers<'a>(
        &'a self,
        encoder: &mut impl RenderEncoder<'a>,
        mesh: &'a DeviceMesh,
        attributes: &[AttributeLayout],
    ) -> Result<(), BackendError> {
        for (slot, source) in (0..).zip(mesh.layout.slots(attributes)) {
            let slice = match source {
                VertexSlot::Stream(index) => {
                    let stream = &mesh.geometry.streams[index];
                    stream.buffer.slice(stream.offset..)
                }
                VertexSlot::Default(name) => {
                    let default = self.defaults.get(name);
                    default.ok_or_else(|| broken_rule("attributes have defaults before they are drawn"))?.slice(..)
                }
            };
            encoder.set_vertex_buffer(slot, Some(slice));
        }
        if let Some(indices) = &mesh.geometry.indices {
            encoder.set_index_buffer(indices.buffer.slice(indices.offset..), indices.format);
        }
        Ok(())
    }
}

/// Checks that buffers belong to a device: as long as they are only kept, wgpu does not.
///
/// # Errors
/// If one does not.
fn check_device(device: &wgpu::Device, mesh: &str, geometry: &DeviceGeometry) -> Result<(), BackendError> {
    let label = format!("the buffers of mesh `{mesh}`");
    let check = || {
        let mut encoder = device.create_render_bundle_encoder(&wgpu::RenderBundleEncoderDescriptor {
            color_formats: &[Some(wgpu::TextureFormat::Rgba8Unorm)],
            sample_count: 1,
            ..wgpu::RenderBundleEncoderDescriptor::default()
        });
        for stream in &geometry.streams {
            encoder.set_vertex_buffer(0, Some(stream.buffer.slice(..)));
        }
        if let Some(indices) = &geometry.indices {
            encoder.set_index_buffer(indices.buffer.slice(..), indices.format);
        }
        encoder.finish(&wgpu::RenderBundleDescriptor::default())
    };
    with_error_scope(device, &label, || catch_wgpu_panic(&label, check)).flatten().map(|_| ())
}
