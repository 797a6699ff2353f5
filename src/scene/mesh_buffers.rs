//! Meshes in an engine's own buffers on the device.

use super::{AttributeValue, VertexAttribute};

/// The vertices, and the indices if there are any, of a [mesh](super::Mesh::from_buffers) in buffers that the engine
/// owns: nothing is kept twice. The mesh keeps the buffers alive. Their content is the engine's: what it writes before
/// a frame is submitted is drawn.
///
/// Vertices are interleaved in one stream, or in several: a stream has some of the attributes of each vertex. Shaders
/// read attributes by their names, converted from the format that they have here.
///
/// ```no_run
/// use drawloom::glam::Vec3;
/// use drawloom::scene::{
///     MeshBuffers, IndexBuffer, Mesh, StreamAttribute, StreamLayout, Topology, VertexAttribute, VertexStream,
/// };
/// use drawloom::wgpu;
///
/// const TANGENT: VertexAttribute<[f32; 4]> = VertexAttribute::new("tangent");
///
/// /// 1,000 vertices of 24 bytes, and 16-bit indices behind them.
/// fn rock(buffer: wgpu::Buffer) -> Result<Mesh, drawloom::scene::SceneError> {
///     let attributes = vec![
///         StreamAttribute::position(wgpu::VertexFormat::Float32x3, 0),
///         StreamAttribute::normal(wgpu::VertexFormat::Snorm8x4, 12),
///         StreamAttribute::uv(wgpu::VertexFormat::Float16x2, 16),
///         StreamAttribute::of(TANGENT, wgpu::VertexFormat::Snorm8x4, 20),
///     ];
///     let layout = StreamLayout { stride: 24, attributes };
///     let buffers = MeshBuffers {
///         streams: vec![VertexStream { buffer: buffer.clone(), offset: 0, layout }],
///         vertex_count: 1_000,
///         indices: Some(IndexBuffer { buffer, offset: 24_000, format: wgpu::IndexFormat::Uint16, count: 5_400 }),
///     };
///     Mesh::from_buffers("rock", Topology::TriangleList, [Vec3::splat(-2.0), Vec3::splat(2.0)], buffers)
/// }
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct MeshBuffers {
    /// Where the attributes of vertices are.
    pub streams: Vec<VertexStream>,
    /// The number of vertices.
    pub vertex_count: u32,
    /// The indices; `None` for a mesh whose vertices form triangles in their own order.
    pub indices: Option<IndexBuffer>,
}

/// Some attributes of all vertices of a mesh, in a buffer with the usage `VERTEX`.
#[derive(Clone, Debug, PartialEq)]
pub struct VertexStream {
    /// The buffer.
    pub buffer: wgpu::Buffer,
    /// Where the first vertex begins, in bytes: a multiple of 4.
    pub offset: u64,
    /// What a vertex consists of.
    pub layout: StreamLayout,
}

/// What a vertex consists of in a stream.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct StreamLayout {
    /// The bytes from one vertex to the next: a multiple of 4, and not 0.
    pub stride: u64,
    /// The attributes, in any order. There may be gaps between them.
    pub attributes: Vec<StreamAttribute>,
}

/// An attribute in a stream. Its offset is in bytes from the beginning of the vertex: a multiple of 4, or of the size
/// of the format if that is less.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct StreamAttribute {
    /// Its name: that of a [`VertexAttribute`], or "position", "normal" or "uv".
    name: &'static str,
    format: wgpu::VertexFormat,
    offset: u64,
}

impl StreamAttribute {
    /// The position in object space, in metres. Every mesh must have it. The format must have three or four components
    /// that shaders read as `f32`.
    pub const fn position(format: wgpu::VertexFormat, offset: u64) -> Self {
        Self { name: POSITION, format, offset }
    }

    /// The normal in object space, of any length, in a format as that of [positions](Self::position). A mesh without
    /// normals has those of its triangles.
    pub const fn normal(format: wgpu::VertexFormat, offset: u64) -> Self {
        Self { name: NORMAL, format, offset }
    }

    /// Texture coordinates, in a format of two or more components that shaders read as `f32`. Those of a mesh without
    /// them are 0.
    pub const fn uv(format: wgpu::VertexFormat, offset: u64) -> Self {
        Self { name: UV, format, offset }
    }

    /// An attribute of the engine's own. The format need not be that of `T`, if shaders read it as the same kind of
    /// number: `Snorm8x4` for `[f32; 4]`, or `Uint8x4` for `[u32; 4]`.
    pub const fn of<T: AttributeValue>(attribute: VertexAttribute<T>, format: wgpu::VertexFormat, offset: u64) -> Self {
        Self { name: attribute.layout().name, format, offset }
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Its format in the buffer.
    pub fn format(&self) -> wgpu::VertexFormat {
        self.format
    }

    /// Its offset from the beginning of the vertex, in bytes.
    pub fn offset(&self) -> u64 {
        self.offset
    }

    /// The number of components.
    fn component_count(&self) -> u32 {
        use wgpu::VertexFormat as Format;
        match self.format {
            Format::Uint8
            | Format::Sint8
            | Format::Unorm8
            | Format::Snorm8
            | Format::Uint16
            | Format::Sint16
            | Format::Unorm16
            | Format::Snorm16
            | Format::Float16
            | Format::Uint32
            | Format::Sint32
            | Format::Float32
            | Format::Float64 => 1,
            Format::Uint8x2
            | Format::Sint8x2
            | Format::Unorm8x2
            | Format::Snorm8x2
            | Format::Uint16x2
            | Format::Sint16x2
            | Format::Unorm16x2
            | Format::Snorm16x2
            | Format::Float16x2
            | Format::Uint32x2
            | Format::Sint32x2
            | Format::Float32x2
            | Format::Float64x2 => 2,
            Format::Uint32x3 | Format::Sint32x3 | Format::Float32x3 | Format::Float64x3 => 3,
            _ => 4,
        }
    }

    /// The kind of number that shaders read.
    pub(crate) fn number_kind(&self) -> NumberKind {
        use wgpu::VertexFormat as Format;
        match self.format {
            Format::Uint8
            | Format::Uint8x2
            | Format::Uint8x4
            | Format::Uint16
            | Format::Uint16x2
            | Format::Uint16x4 => NumberKind::Unsigned,
            Format::Uint32 | Format::Uint32x2 | Format::Uint32x3 | Format::Uint32x4 => NumberKind::Unsigned,
            Format::Sint8
            | Format::Sint8x2
            | Format::Sint8x4
            | Format::Sint16
            | Format::Sint16x2
            | Format::Sint16x4 => NumberKind::Signed,
            Format::Sint32 | Format::Sint32x2 | Format::Sint32x3 | Format::Sint32x4 => NumberKind::Signed,
            Format::Float64 | Format::Float64x2 | Format::Float64x3 | Format::Float64x4 => NumberKind::Double,
            _ => NumberKind::Float,
        }
    }
}

/// The kind of number that shaders read of a vertex format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NumberKind {
    /// `f32`.
    Float,
    /// `u32`.
    Unsigned,
    /// `i32`.
    Signed,
    /// `f64`.
    Double,
}

/// The indices of a mesh, in a buffer with the usage `INDEX`. Each must be less than the number of vertices. Drawloom
/// cannot check that; what is drawn otherwise depends on the device, which reads nothing outside of the buffers.
#[derive(Clone, Debug, PartialEq)]
pub struct IndexBuffer {
    /// The buffer.
    pub buffer: wgpu::Buffer,
    /// Where the first index begins, in bytes: a multiple of the size of an index.
    pub offset: u64,
    /// 16 or 32 bits an index.
    pub format: wgpu::IndexFormat,
    /// The number of indices.
    pub count: u32,
}

/// The 16-bit index that devices do not take for one of a vertex, in strips.
const RESTART_INDEX: u32 = 0xFFFF;

pub(crate) const POSITION: &str = "position";
pub(crate) const NORMAL: &str = "normal";
pub(crate) const UV: &str = "uv";

impl MeshBuffers {
    /// The number of indices, or of vertices if there are no indices.
    pub fn index_count(&self) -> u32 {
        self.indices.as_ref().map_or(self.vertex_count, |indices| indices.count)
    }

    /// What is wrong with it as a list of triangles, or as a strip; `None` if nothing is.
    pub(super) fn problem(&self, forms_strip: bool) -> Option<String> {
        let mut names: Vec<&str> = Vec::new();
        for (index, stream) in self.streams.iter().enumerate() {
            if let Some(problem) = stream.problem(self.vertex_count) {
                return Some(format!("stream {index} {problem}"));
            }
            for attribute in &stream.layout.attributes {
                let &StreamAttribute { name, format, .. } = attribute;
                if names.contains(&name) {
                    return Some(format!("attribute {name:?} is there twice"));
                }
                names.push(name);
                let needed = match name {
                    POSITION | NORMAL => 3,
                    UV => 2,
                    _ => continue,
                };
                if attribute.number_kind() != NumberKind::Float {
                    return Some(format!("attribute {name:?} has {format:?}, which shaders do not read as f32"));
                }
                if attribute.component_count() < needed {
                    return Some(format!("attribute {name:?} has {format:?}, but needs {needed} components"));
                }
            }
        }
        if !names.contains(&POSITION) {
            return Some("it has no positions".to_owned());
        }
        let indices = self.indices.as_ref()?;
        if forms_strip && indices.format == wgpu::IndexFormat::Uint16 && self.vertex_count > RESTART_INDEX {
            let count = self.vertex_count;
            return Some(format!(
                "it has {count} vertices, but in a strip with 16-bit indices the index {RESTART_INDEX} begins another strip"
            ));
        }
        indices.problem().map(|problem| format!("its index buffer {problem}"))
    }
}

impl VertexStream {
    fn problem(&self, vertices: u32) -> Option<String> {
        let Self { buffer, offset, layout: StreamLayout { stride, attributes } } = self;
        if !buffer.usage().contains(wgpu::BufferUsages::VERTEX) {
            return Some("is in a buffer without the usage VERTEX".to_owned());
        }
        if *stride == 0 || !stride.is_multiple_of(4) {
            return Some(format!("has a stride of {stride} bytes, instead of 4, 8, 12 ..."));
        }
        if !offset.is_multiple_of(4) {
            return Some(format!("begins at byte {offset}, which is not a multiple of 4"));
        }
        for StreamAttribute { name, format, offset } in attributes {
            if !offset.is_multiple_of(format.size().min(4)) {
                let alignment = format.size().min(4);
                return Some(format!(
                    "has attribute {name:?} at byte {offset} of a vertex, which is not a multiple of {alignment}"
                ));
            }
            if offset.saturating_add(format.size()) > *stride {
                let end = offset.saturating_add(format.size());
                return Some(format!("has attribute {name:?} up to byte {end} of vertices that have {stride} bytes"));
            }
        }
        // A stream without attributes is not read.
        let used = attributes.iter().map(|attribute| attribute.offset + attribute.format.size()).max()?;
        let before_last = stride.saturating_mul(u64::from(vertices.saturating_sub(1)));
        let (end, size) = (offset.saturating_add(before_last).saturating_add(used), buffer.size());
        (end > size).then(|| format!("ends at byte {end} of a buffer that has {size} bytes, for {vertices} vertices"))
    }
}

impl IndexBuffer {
    fn problem(&self) -> Option<String> {
        let Self { buffer, offset, format, count } = self;
        let bytes = format.byte_size() as u64;
        if !buffer.usage().contains(wgpu::BufferUsages::INDEX) {
            return Some("is in a buffer without the usage INDEX".to_owned());
        }
        if !offset.is_multiple_of(bytes) {
            return Some(format!("begins at byte {offset}, which is not a multiple of {bytes}"));
        }
        let end = offset.saturating_add(bytes * u64::from(*count));
        (end > buffer.size())
            .then(|| format!("ends at byte {end} of a buffer that has {} bytes, for {count} indices", buffer.size()))
    }
}
