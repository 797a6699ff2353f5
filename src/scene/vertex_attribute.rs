//! Data of an engine's own for each vertex.

use std::marker::PhantomData;

use bytemuck::Pod;

/// A name for data that meshes have for each vertex beside [`Vertex`](super::Vertex), such as tangents, colours, or
/// joints and weights. Make it once, as a constant: meshes bring values for it, and processes declare that their
/// shaders read them.
///
/// ```
/// use drawloom::scene::{Mesh, Topology, Vertex, VertexAttribute};
///
/// const COLOR: VertexAttribute<[f32; 4]> = VertexAttribute::new("colour");
///
/// let corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
/// let corners = corners.map(|position| Vertex { position, ..Vertex::default() }).to_vec();
/// let mesh = Mesh::new("triangle", Topology::TriangleList, corners, vec![0, 1, 2])?
///     .with_attribute(COLOR, &[[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0]])?;
/// # Ok::<(), drawloom::scene::SceneError>(())
/// ```
///
/// A shader has it as a field of `VertexInput`: see
/// [`Declare::reads_attribute`](crate::process::Declare::reads_attribute).
pub struct VertexAttribute<T> {
    name: &'static str,
    /// Neither owns nor borrows a `T`.
    value: PhantomData<fn() -> T>,
}

impl<T: AttributeValue> VertexAttribute<T> {
    /// An attribute of this name, which is that of a field of `VertexInput` in shaders. Two attributes of one name are
    /// the same attribute.
    ///
    /// # Panics
    /// If the name is not made of ASCII letters, digits and underscores, begins with a digit or an underscore, or is
    /// that of a field that every vertex has. For a constant, that is an error of the compiler.
    pub const fn new(name: &'static str) -> Self {
        assert!(is_field_name(name), "the name of an attribute is that of a field in WGSL");
        Self { name, value: PhantomData }
    }

    /// Its name and format.
    pub(crate) const fn layout(self) -> AttributeLayout {
        AttributeLayout { name: self.name, format: T::FORMAT }
    }
}

const fn is_field_name(name: &str) -> bool {
    let bytes = name.as_bytes();
    let mut index = 0;
    while index < bytes.len() {
        let is_inner = index > 0 && (bytes[index].is_ascii_digit() || bytes[index] == b'_');
        if !bytes[index].is_ascii_alphabetic() && !is_inner {
            return false;
        }
        index += 1;
    }
    !(bytes.is_empty() || matches!(bytes, b"position" | b"normal" | b"uv" | b"instance"))
}

/// The colours of vertices: red, green and blue, linear, from 0 to 1. A pipeline [with vertex
/// colours](crate::process::Deferred::vertex_colors) multiplies the diffuse colour of materials by them.
pub const VERTEX_COLOR: VertexAttribute<[f32; 3]> = VertexAttribute::new("color");

/// The index of a vertex in its mesh, which Drawloom fills in for processes that [read
/// it](crate::process::Declare::reads_attribute): shaders find by it what an engine has for each vertex in buffers of
/// its own, such as morph targets. It takes 4 bytes for each vertex on the device.
///
/// `@builtin(vertex_index)` is no such index. Meshes share buffers, so it begins where the mesh lies in them, which
/// changes when meshes come and go. Levels of detail of [one mesh](super::Mesh::with_levels) have the vertices of the
/// mesh; a [subdivided](super::Mesh::subdivided) mesh has vertices, and indices, of its own.
///
/// Meshes bring no values, but for those [in the engine's own buffers](super::Mesh::from_buffers): a process that reads
/// the index leaves out objects whose mesh has none, and warns.
pub const VERTEX_INDEX: VertexAttribute<u32> = VertexAttribute::new("vertex_index");

// Derived implementations would require them of `T`.
impl<T> Clone for VertexAttribute<T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for VertexAttribute<T> {}

impl<T> std::fmt::Debug for VertexAttribute<T> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_tuple("VertexAttribute").field(&self.name).finish()
    }
}

/// A [`VertexAttribute`] without the type of its values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct AttributeLayout {
    /// Its name.
    pub name: &'static str,
    /// The format of its values.
    pub format: AttributeFormat,
}

/// The format of an attribute's values: one to four numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum AttributeFormat {
    /// This many `f32`.
    Float32(u8),
    /// This many `u32`, which are not interpolated.
    Uint32(u8),
    /// Four bytes that shaders read as `f32` from 0 to 1.
    Unorm8x4,
}

impl AttributeFormat {
    /// The type that shaders read.
    #[cfg(feature = "wgpu")]
    pub(crate) fn wgsl_type(self) -> String {
        match self {
            Self::Float32(1) => "f32".into(),
            Self::Uint32(1) => "u32".into(),
            Self::Float32(components) => format!("vec{components}<f32>"),
            Self::Uint32(components) => format!("vec{components}<u32>"),
            Self::Unorm8x4 => "vec4<f32>".into(),
        }
    }

    /// The number of bytes of a value.
    pub const fn bytes(self) -> usize {
        match self {
            Self::Float32(components) | Self::Uint32(components) => 4 * components as usize,
            Self::Unorm8x4 => 4,
        }
    }

    /// The value halfway between two, as bytes; that of the first for whole numbers. It is appended.
    pub(super) fn append_midpoint(self, one: &[u8], other: &[u8], bytes: &mut Vec<u8>) {
        match self {
            Self::Float32(_) => {
                for (one, other) in one.chunks_exact(4).zip(other.chunks_exact(4)) {
                    let [one, other]: [f32; 2] = [one, other].map(bytemuck::pod_read_unaligned);
                    bytes.extend(one.midpoint(other).to_ne_bytes());
                }
            }
            Self::Uint32(_) => bytes.extend_from_slice(one),
            Self::Unorm8x4 => bytes.extend(one.iter().zip(other).map(|(one, other)| one.midpoint(*other))),
        }
    }

    /// The numbers of a value that has these bytes, and 0 for those that it lacks.
    #[cfg(feature = "software")]
    pub(crate) fn numbers(self, value: &[u8]) -> [f64; 4] {
        let mut numbers = [0.0; 4];
        match self {
            Self::Float32(_) => {
                let read = |bytes: &[u8]| f64::from(bytemuck::pod_read_unaligned::<f32>(bytes));
                numbers.iter_mut().zip(value.chunks_exact(4)).for_each(|(number, bytes)| *number = read(bytes));
            }
            Self::Uint32(_) => {
                let read = |bytes: &[u8]| f64::from(bytemuck::pod_read_unaligned::<u32>(bytes));
                numbers.iter_mut().zip(value.chunks_exact(4)).for_each(|(number, bytes)| *number = read(bytes));
            }
            Self::Unorm8x4 => {
                numbers.iter_mut().zip(value).for_each(|(number, byte)| *number = f64::from(*byte) / 255.0);
            }
        }
        numbers
    }
}

/// A value of an attribute: one to four `f32` or `u32`, or four bytes.
pub trait AttributeValue: Pod + sealed::HasFormat {}

mod sealed {
    /// Only the crate knows formats.
    pub trait HasFormat {
        const FORMAT: super::AttributeFormat;
    }
}

macro_rules! attribute_values {
    ($($value:ty => $format:expr),* $(,)?) => {
        $(
            impl sealed::HasFormat for $value {
                const FORMAT: AttributeFormat = $format;
            }

            impl AttributeValue for $value {}
        )*
    };
}

attribute_values! {
    f32 => AttributeFormat::Float32(1),
    [f32; 2] => AttributeFormat::Float32(2),
    [f32; 3] => AttributeFormat::Float32(3),
    [f32; 4] => AttributeFormat::Float32(4),
    u32 => AttributeFormat::Uint32(1),
    [u32; 2] => AttributeFormat::Uint32(2),
    [u32; 3] => AttributeFormat::Uint32(3),
    [u32; 4] => AttributeFormat::Uint32(4),
    [u8; 4] => AttributeFormat::Unorm8x4,
}

/// The values that a mesh has for an attribute.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MeshAttribute {
    pub(super) layout: AttributeLayout,
    /// One value for each vertex.
    pub(super) bytes: Vec<u8>,
}

impl MeshAttribute {
    /// The same with a value for each vertex that was added halfway between two others.
    pub(super) fn subdivided(&self, midpoint_ends: &[[u32; 2]]) -> Self {
        let (mut bytes, stride) = (self.bytes.clone(), self.layout.format.bytes());
        for ends in midpoint_ends {
            let [one, other] = ends.map(|end| bytes[end as usize * stride..][..stride].to_vec());
            self.layout.format.append_midpoint(&one, &other, &mut bytes);
        }
        Self { layout: self.layout, bytes }
    }
}
