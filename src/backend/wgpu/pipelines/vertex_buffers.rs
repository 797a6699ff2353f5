//! The vertex buffers of a pipeline.

use super::pipeline_key::VertexSource;
use crate::backend::BackendError;
use crate::backend::wgpu::resources::{
    VertexSlot, VertexStreamLayouts, vertex_attributes, vertex_format, vertex_stride,
};
use crate::process::{DeclaredAttribute, FIRST_OWN_LOCATION};
use crate::scene::{AttributeFormat, NORMAL, NumberKind, POSITION, StreamAttribute, UV, VERTEX_INDEX};

/// The vertex buffers of a pipeline, each with its attributes, in the order of their slots.
#[derive(PartialEq, Eq, Hash)]
pub(super) struct VertexBuffers(Vec<VertexBuffer>);

#[derive(PartialEq, Eq, Hash)]
struct VertexBuffer {
    /// Bytes from one vertex to the next; 0 if all vertices have the same.
    stride: u64,
    attributes: Vec<wgpu::VertexAttribute>,
}

impl VertexBuffers {
    /// Those of meshes in the crate's pages, or of shaders that need no mesh.
    pub(super) fn new(source: VertexSource, own: &[DeclaredAttribute]) -> Self {
        let shipped = match source {
            VertexSource::Meshes(format) => {
                VertexBuffer { stride: vertex_stride(format), attributes: vertex_attributes(format).to_vec() }
            }
            VertexSource::LightVolumes => {
                let attributes = wgpu::vertex_attr_array![0 => Float32x3].to_vec();
                return Self(vec![VertexBuffer { stride: size_of::<[f32; 3]>() as u64, attributes }]);
            }
            _ => return Self(Vec::new()),
        };
        let own =
            (FIRST_OWN_LOCATION..).zip(own).map(|(shader_location, DeclaredAttribute { layout, .. })| VertexBuffer {
                stride: layout.format.bytes() as u64,
                attributes: vec![wgpu::VertexAttribute {
                    format: vertex_format(layout.format),
                    offset: 0,
                    shader_location,
                }],
            });
        Self(std::iter::once(shipped).chain(own).collect())
    }

    /// Those of meshes with this layout.
    ///
    /// # Errors
    /// If an attribute is not of the kind of number that the process's shader reads, or the shader reads the index of
    /// vertices, and no stream has it.
    pub(super) fn of_imported_meshes(
        layout: &VertexStreamLayouts,
        own: &[DeclaredAttribute],
        process: &str,
    ) -> Result<Self, BackendError> {
        let index = VERTEX_INDEX.layout();
        if own.iter().any(|attribute| attribute.layout == index) && layout.lacks(index.name) {
            let (process, mesh) = (process.to_owned(), layout.mesh.clone());
            return Err(BackendError::MissingVertexIndex { process, mesh });
        }
        let shipped = [POSITION, NORMAL, UV].into_iter().map(|name| (name, AttributeFormat::Float32(4)));
        let names = shipped.chain(own.iter().map(|attribute| (attribute.layout.name, attribute.layout.format)));
        let locations: Vec<_> = (0..).zip(names).collect();
        let location_of = |name| locations.iter().find(|(_, (known, _))| *known == name);
        let mut buffers = Vec::new();
        for slot in layout.slots(own) {
            buffers.push(match slot {
                VertexSlot::Defaults => {
                    let missing = locations.iter().filter(|(_, (name, _))| layout.lacks(name));
                    let attributes = missing.map(|&(shader_location, (_, format))| wgpu::VertexAttribute {
                        format: vertex_format(format),
                        offset: u64::from(shader_location) * DEFAULT_BYTES as u64,
                        shader_location,
                    });
                    VertexBuffer { stride: 0, attributes: attributes.collect() }
                }
                VertexSlot::Stream(index) => {
                    let stream = &layout.streams[index];
                    let mut attributes = Vec::new();
                    for attribute in &stream.attributes {
                        let Some(&(shader_location, (name, format))) = location_of(attribute.name()) else { continue };
                        check_kind([process, &layout.mesh, name], attribute, format)?;
                        let (format, offset) = (attribute.format(), attribute.offset());
                        attributes.push(wgpu::VertexAttribute { format, offset, shader_location });
                    }
                    VertexBuffer { stride: stream.stride, attributes }
                }
            });
        }
        Ok(Self(buffers))
    }

    pub(super) fn layouts(&self) -> Vec<Option<wgpu::VertexBufferLayout<'_>>> {
        self.0.iter().map(|buffer| Some(buffer.layout())).collect()
    }
}

impl VertexBuffer {
    fn layout(&self) -> wgpu::VertexBufferLayout<'_> {
        let (array_stride, step_mode) = (self.stride, wgpu::VertexStepMode::Vertex);
        wgpu::VertexBufferLayout { array_stride, step_mode, attributes: &self.attributes }
    }
}

/// # Errors
/// If the shader of a process, which reads an attribute in the format `declared`, cannot read it from the stream of a
/// mesh.
fn check_kind(
    [process, mesh, name]: [&str; 3],
    attribute: &StreamAttribute,
    declared: AttributeFormat,
) -> Result<(), BackendError> {
    let (expected, as_wgsl) = match declared {
        AttributeFormat::Float32(_) | AttributeFormat::Unorm8x4 => (NumberKind::Float, "f32"),
        AttributeFormat::Uint32(_) => (NumberKind::Unsigned, "u32"),
    };
    if attribute.number_kind() == expected {
        return Ok(());
    }
    let [process, mesh, name] = [process, mesh, name].map(str::to_owned);
    let format = format!("{:?}", attribute.format());
    Err(BackendError::AttributeFormatMismatch { process, mesh, attribute: name, format, expected: as_wgsl })
}

/// The size of each element of [`attribute_defaults`]: that of the largest attribute.
const DEFAULT_BYTES: usize = 16;

/// The value of each attribute for meshes that lack it, by its location in the shader. Those of the shipped attributes
/// are 0.
pub(super) fn attribute_defaults(own: &[DeclaredAttribute]) -> Vec<u8> {
    let mut bytes = vec![0; FIRST_OWN_LOCATION as usize * DEFAULT_BYTES];
    for attribute in own {
        bytes.extend_from_slice(&attribute.default);
        bytes.resize(bytes.len().next_multiple_of(DEFAULT_BYTES), 0);
    }
    bytes
}
