//! Where the vertices and indices of generated meshes come from.

use std::sync::Arc;

use super::generated_buffer::GeneratedSource;
use super::{GeneratedBuffer, Topology};

/// The vertices and indices of a [generated mesh](super::Mesh::generated).
#[derive(Debug, PartialEq)]
pub(crate) struct GeneratedGeometry {
    pub(crate) topology: Topology,
    pub(crate) vertices: Arc<GeneratedSource>,
    pub(crate) indices: GeneratedIndices,
}

/// The indices of a [generated mesh](super::Mesh::generated).
#[derive(Clone, Debug, PartialEq)]
pub struct GeneratedIndices(pub(crate) IndexSource);

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum IndexSource {
    /// The same in all frames.
    Fixed(Vec<u32>),
    Generated(Arc<GeneratedSource>),
}

impl From<Vec<u32>> for GeneratedIndices {
    /// The same in all frames.
    fn from(indices: Vec<u32>) -> Self {
        Self(IndexSource::Fixed(indices))
    }
}

impl From<&GeneratedBuffer<u32>> for GeneratedIndices {
    /// Those that nodes fill the buffer with. Each is less than the number of vertices. The number of triangles is that
    /// of a full buffer; of indices beyond the [count](crate::NodeContext::set_count), and of a triangle that these
    /// would complete, nothing is drawn.
    fn from(buffer: &GeneratedBuffer<u32>) -> Self {
        Self(IndexSource::Generated(Arc::clone(buffer.source())))
    }
}

impl GeneratedIndices {
    /// The number of indices.
    pub(crate) fn count(&self) -> usize {
        match &self.0 {
            IndexSource::Fixed(indices) => indices.len(),
            IndexSource::Generated(source) => source.layout.capacity,
        }
    }
}

impl GeneratedGeometry {
    /// Whether it has its vertices or indices from the buffer of this identity.
    #[cfg(feature = "software")]
    pub(crate) fn reads(&self, identity: u64) -> bool {
        let is_of_indices = match &self.indices.0 {
            IndexSource::Fixed(_) => false,
            IndexSource::Generated(source) => source.layout.identity == identity,
        };
        self.vertices.layout.identity == identity || is_of_indices
    }
}
