//! Imported meshes: those in an engine's own buffers, and in buffers that CPU nodes fill.

use std::collections::HashMap;
use std::hash::{Hash, Hasher};
use std::sync::Arc;

use wgpu::util::{DeviceExt, RenderEncoder};

use super::buffers::new_buffer;
use crate::backend::BackendError;
use crate::process::DeclaredAttribute;
use crate::scene::{
    GeneratedGeometry, GeneratedSource, IndexBuffer, IndexSource, Mesh, MeshBuffers, NORMAL, POSITION, StreamAttribute,
    StreamLayout, Topology, UV, Vertex, VertexStream,
};

/// What pipelines know of an imported mesh. Meshes with equal layouts share pipelines.
#[derive(Debug)]
pub(crate) struct VertexStreamLayouts {
    pub(crate) streams: Vec<StreamLayout>,
    /// Of strips, whose pipelines know it.
    pub(crate) strip_index_format: Option<wgpu::IndexFormat>,
    /// The name of a mesh with this layout, for errors.
    pub(crate) mesh: String,
}

impl PartialEq for VertexStreamLayouts {
    fn eq(&self, other: &Self) -> bool {
        self.strip_index_format == other.strip_index_format && self.streams == other.streams
    }
}

impl Eq for VertexStreamLayouts {}

impl Hash for VertexStreamLayouts {
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
    /// The defaults of all attributes that the mesh lacks. All vertices have the same: the stride is 0.
    Defaults,
}

impl VertexStreamLayouts {
    fn new(mesh: &Mesh, buffers: &MeshBuffers) -> Self {
        let indices = buffers.indices.as_ref().filter(|_| mesh.topology() == Topology::TriangleStrip);
        Self {
            streams: buffers.streams.iter().map(|stream| stream.layout.clone()).collect(),
            strip_index_format: indices.map(|indices| indices.format),
            mesh: mesh.name().to_owned(),
        }
    }

    /// The vertex buffers of a pipeline whose shader reads these attributes beside those of every vertex: in this
    /// order.
    pub(crate) fn slots<'a>(&'a self, attributes: &'a [DeclaredAttribute]) -> impl Iterator<Item = VertexSlot> + 'a {
        let names = || [POSITION, NORMAL, UV].into_iter().chain(attributes.iter().map(|own| own.layout.name));
        let is_in = |stream: &StreamLayout, name| stream.attributes.iter().any(|attribute| attribute.name() == name);
        let is_read = move |(_, stream): &(usize, &StreamLayout)| names().any(|name| is_in(stream, name));
        let streams = self.streams.iter().enumerate().filter(is_read).map(|(index, _)| VertexSlot::Stream(index));
        let lacks_any = names().any(|name| self.lacks(name));
        streams.chain(lacks_any.then_some(VertexSlot::Defaults))
    }

    /// Whether no stream has the attribute.
    pub(crate) fn lacks(&self, attribute: &str) -> bool {
        let has = |stream: &StreamLayout| stream.attributes.iter().any(|known| known.name() == attribute);
        !self.streams.iter().any(has)
    }
}

/// A mesh in buffers of its own, with what pipelines know of it.
#[derive(Clone)]
pub(crate) struct ImportedMesh {
    pub(crate) layout: Arc<VertexStreamLayouts>,
    pub(crate) buffers: Arc<MeshBuffers>,
    /// If nodes make its vertices, and the buffers are not the engine's.
    generated: Option<Arc<GeneratedGeometry>>,
}

/// Where a mesh has its buffers from.
#[derive(Clone, Copy)]
enum BufferSource<'a> {
    Engine(&'a Arc<MeshBuffers>),
    Nodes(&'a Arc<GeneratedGeometry>),
}

/// The imported meshes by slot.
#[derive(Clone, Default)]
pub(crate) struct ImportedMeshes {
    meshes: HashMap<u32, ImportedMesh>,
}

impl ImportedMeshes {
    /// The imported meshes among `meshes`, which the device [can draw](super::mesh_check::check_mesh). Unchanged ones
    /// keep their entries.
    ///
    /// # Errors
    /// If the device has no room.
    pub(crate) fn updated<'a>(
        &self,
        device: &wgpu::Device,
        meshes: impl Iterator<Item = (u32, &'a Mesh)>,
    ) -> Result<Self, BackendError> {
        let mut updated = Self::default();
        for (slot, mesh) in meshes {
            let Some(source) = BufferSource::of(mesh) else { continue };
            let known = self.meshes.get(&slot).filter(|known| source.is_of(known));
            let mesh = match known {
                Some(known) => known.clone(),
                None => {
                    let (buffers, generated) = match source {
                        BufferSource::Engine(buffers) => (Arc::clone(buffers), None),
                        BufferSource::Nodes(generated) => {
                            (new_buffers(device, generated)?, Some(Arc::clone(generated)))
                        }
                    };
                    let layout = VertexStreamLayouts::new(mesh, &buffers);
                    let mut others = self.meshes.values().chain(updated.meshes.values());
                    let same = others.find(|other| *other.layout == layout).map(|other| Arc::clone(&other.layout));
                    ImportedMesh { layout: same.unwrap_or_else(|| Arc::new(layout)), buffers, generated }
                }
            };
            updated.meshes.insert(slot, mesh);
        }
        Ok(updated)
    }

    /// The buffers on the device that nodes fill by the identity of a
    /// [`GeneratedBuffer`](crate::scene::GeneratedBuffer), and the topology of those that are indices.
    pub(crate) fn filled_by(&self, identity: u64) -> impl Iterator<Item = (&wgpu::Buffer, Option<Topology>)> {
        let meshes = self.meshes.values().filter_map(|mesh| Some((mesh, mesh.generated.as_ref()?)));
        meshes.flat_map(move |(mesh, generated)| {
            let is_it = |source: &GeneratedSource| source.layout.identity == identity;
            let vertices = is_it(&generated.vertices).then(|| (&mesh.buffers.streams[0].buffer, None));
            let indices = match &generated.indices.0 {
                IndexSource::Generated(source) if is_it(source) => mesh.buffers.indices.as_ref(),
                _ => None,
            };
            vertices.into_iter().chain(indices.map(|indices| (&indices.buffer, Some(generated.topology))))
        })
    }

    /// Whether there are none.
    pub(crate) fn is_empty(&self) -> bool {
        self.meshes.is_empty()
    }

    /// The mesh in a slot; `None` if that is in the pages.
    pub(crate) fn get(&self, slot: u32) -> Option<&ImportedMesh> {
        self.meshes.get(&slot)
    }

    /// Whether the meshes in two slots have equal layouts. Two meshes in the pages always have.
    pub(crate) fn have_equal_layouts(&self, one: u32, other: u32) -> bool {
        match (self.get(one), self.get(other)) {
            (None, None) => true,
            (Some(one), Some(other)) => Arc::ptr_eq(&one.layout, &other.layout),
            _ => false,
        }
    }
}

impl ImportedMesh {
    /// Sets its buffers, for a pipeline that reads these attributes and has these defaults of them.
    pub(crate) fn set_buffers<'a>(
        &'a self,
        encoder: &mut impl RenderEncoder<'a>,
        attributes: &[DeclaredAttribute],
        defaults: &'a wgpu::Buffer,
    ) {
        for (slot, source) in (0..).zip(self.layout.slots(attributes)) {
            let slice = match source {
                VertexSlot::Stream(index) => {
                    let stream = &self.buffers.streams[index];
                    stream.buffer.slice(stream.offset..)
                }
                VertexSlot::Defaults => defaults.slice(..),
            };
            encoder.set_vertex_buffer(slot, Some(slice));
        }
        if let Some(indices) = &self.buffers.indices {
            encoder.set_index_buffer(indices.buffer.slice(indices.offset..), indices.format);
        }
    }
}

impl<'a> BufferSource<'a> {
    /// That of a mesh; `None` if the mesh lies in the pages.
    fn of(mesh: &'a Mesh) -> Option<Self> {
        mesh.generated_geometry().map(Self::Nodes).or_else(|| mesh.buffers().map(Self::Engine))
    }

    fn is_of(self, mesh: &ImportedMesh) -> bool {
        match (self, &mesh.generated) {
            (Self::Engine(buffers), None) => Arc::ptr_eq(buffers, &mesh.buffers),
            (Self::Nodes(generated), Some(known)) => Arc::ptr_eq(generated, known),
            _ => false,
        }
    }
}

/// Buffers for a mesh whose vertices nodes make.
///
/// # Errors
/// If the device has no room.
fn new_buffers(device: &wgpu::Device, generated: &GeneratedGeometry) -> Result<Arc<MeshBuffers>, BackendError> {
    use wgpu::{BufferUsages, VertexFormat};
    let GeneratedGeometry { vertices, indices, .. } = generated;
    let usage = BufferUsages::VERTEX | BufferUsages::COPY_DST;
    let buffer = new_buffer(device, vertices.layout.name, vertices.layout.bytes() as u64, usage)?;
    let attributes = vec![
        StreamAttribute::position(VertexFormat::Float32x3, std::mem::offset_of!(Vertex, position) as u64),
        StreamAttribute::normal(VertexFormat::Float32x3, std::mem::offset_of!(Vertex, normal) as u64),
        StreamAttribute::uv(VertexFormat::Float32x2, std::mem::offset_of!(Vertex, uv) as u64),
    ];
    let layout = StreamLayout { stride: size_of::<Vertex>() as u64, attributes };
    let usage = BufferUsages::INDEX | BufferUsages::COPY_DST;
    let index_buffer = match &indices.0 {
        IndexSource::Fixed(indices) => device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("indices of a mesh that nodes make"),
            contents: bytemuck::cast_slice(indices),
            usage,
        }),
        IndexSource::Generated(source) => new_buffer(device, source.layout.name, source.layout.bytes() as u64, usage)?,
    };
    let count = u32::try_from(indices.count()).unwrap_or(u32::MAX);
    Ok(Arc::new(MeshBuffers {
        streams: vec![VertexStream { buffer, offset: 0, layout }],
        vertex_count: u32::try_from(vertices.layout.capacity).unwrap_or(u32::MAX),
        indices: Some(IndexBuffer { buffer: index_buffer, offset: 0, format: wgpu::IndexFormat::Uint32, count }),
    }))
}
