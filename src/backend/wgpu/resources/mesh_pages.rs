//! The pages that meshes lie in, and how a mesh is written to them.

use std::mem;
use std::sync::Arc;

use super::buffers::new_buffer;
use super::page_set::{PageBuffers, PageRange, PageSet};
use super::residents::{AssetMemory, Residents};
use super::snapshot_lifetimes::SnapshotLifetimes;
use super::vertex_data::{AttributeBuffers, AttributeSet, vertex_stride};
use crate::backend::BackendError;
use crate::backend::error::broken_rule;
use crate::quality::VertexFormat;
use crate::scene::Mesh;

/// The buffers of a page of vertices. A vertex has the same index in all of them.
#[derive(Clone)]
pub(crate) struct VertexBuffers {
    pub(crate) vertices: wgpu::Buffer,
    pub(crate) attributes: AttributeBuffers,
}

/// Where a mesh lies: its vertices, and its indices followed by those of its coarser levels.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeshLocation {
    pub(crate) vertices: PageRange,
    pub(crate) indices: PageRange,
    /// Of level 0.
    pub(crate) index_count: u32,
}

impl MeshLocation {
    /// Whether both have some memory.
    pub(super) fn overlaps(&self, other: Self) -> bool {
        self.vertices.overlaps(other.vertices) || self.indices.overlaps(other.indices)
    }
}

/// How long new pages are, in bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct PageSizes {
    pub(super) min: u64,
    pub(super) max: MeshBytes,
}

/// The pages of all meshes.
#[derive(Default)]
pub(crate) struct MeshPages {
    pub(crate) format: VertexFormat,
    pub(super) attributes: Arc<AttributeSet>,
    pub(super) vertices: PageSet<VertexBuffers>,
    pub(super) indices: PageSet<wgpu::Buffer>,
}

impl MeshPages {
    /// The lengths of new pages without a budget: a page has room for everything that is about to come, of which this
    /// is the number of bytes, or for as much as all pages before it. So a scene at rest has few pages, whatever its
    /// size.
    pub(super) fn sizes_for(&self, expected: MeshBytes) -> PageSizes {
        let (min, max) = (1 << 16, 8 << 20);
        let vertices = expected.vertices.max(self.vertices.length() * self.bytes_per_vertex());
        let indices = expected.indices.max(self.indices.length() * INDEX);
        PageSizes { min, max: MeshBytes { vertices: vertices.clamp(min, max), indices: indices.clamp(min, max) } }
    }

    /// Takes memory that was vacated.
    pub(super) fn occupy(&mut self, location: MeshLocation) {
        self.vertices.occupy(location.vertices);
        self.indices.occupy(location.indices);
    }

    /// What writing a mesh to its location takes.
    ///
    /// # Errors
    /// If there is no such page. This is a bug in Drawloom.
    pub(super) fn target(&self, location: MeshLocation) -> Result<MeshTarget, BackendError> {
        let missing = || broken_rule("a mesh lies in pages that exist");
        let (vertices, vertex_count) = self.vertices.page(location.vertices.page).ok_or_else(missing)?;
        let (indices, index_count) = self.indices.page(location.indices.page).ok_or_else(missing)?;
        Ok(MeshTarget {
            location,
            format: self.format,
            attributes: Arc::clone(&self.attributes),
            vertices: Arc::clone(vertices),
            indices: Arc::clone(indices),
            lengths: [vertex_count, index_count],
        })
    }

    /// The buffers of a page of vertices; `None` if they are not made yet.
    pub(super) fn vertex_buffers(&self, page: u32) -> Option<&VertexBuffers> {
        self.vertices.page(page)?.0.get()
    }

    /// The buffer of a page of indices; `None` if it is not made yet.
    pub(super) fn index_buffer(&self, page: u32) -> Option<&wgpu::Buffer> {
        self.indices.page(page)?.0.get()
    }

    /// What a mesh takes.
    pub(super) fn bytes_of(&self, mesh: &Mesh) -> MeshBytes {
        MeshBytes {
            vertices: mesh.vertices().len() as u64 * self.bytes_per_vertex(),
            indices: index_count(mesh) as u64 * INDEX,
        }
    }

    pub(super) fn bytes_per_vertex(&self) -> u64 {
        vertex_stride(self.format) + self.attributes.bytes_per_vertex()
    }
}

/// The meshes on the device.
pub(crate) type ResidentMeshes = Residents<MeshPages>;

impl AssetMemory for MeshPages {
    type Asset = Mesh;
    type Location = MeshLocation;

    fn bytes(&self) -> u64 {
        self.vertices.length() * self.bytes_per_vertex() + self.indices.length() * INDEX
    }

    fn vacate(&mut self, location: MeshLocation) {
        self.vertices.vacate(location.vertices);
        self.indices.vacate(location.indices);
    }

    fn release_empty(&mut self, location: MeshLocation, retired: &SnapshotLifetimes<MeshLocation>) {
        let (vertices, indices) = (location.vertices.page, location.indices.page);
        self.vertices.release_if_empty(vertices, || retired.retired().any(|other| other.vertices.page == vertices));
        self.indices.release_if_empty(indices, || retired.retired().any(|other| other.indices.page == indices));
    }

    fn clear(&mut self) {
        (self.vertices, self.indices) = (PageSet::default(), PageSet::default());
    }
}

/// The size of an index.
pub(super) const INDEX: u64 = mem::size_of::<u32>() as u64;

/// The indices of a mesh and of its coarser levels.
pub(super) fn index_count(mesh: &Mesh) -> usize {
    mesh.indices().len() + mesh.levels().iter().map(|level| level.indices().len()).sum::<usize>()
}

/// What meshes take on the device, in bytes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct MeshBytes {
    /// Of vertices and their attributes.
    pub(crate) vertices: u64,
    pub(crate) indices: u64,
}

impl MeshBytes {
    pub(crate) fn total(self) -> u64 {
        self.vertices + self.indices
    }
}

impl std::iter::Sum for MeshBytes {
    fn sum<I: Iterator<Item = Self>>(meshes: I) -> Self {
        let add = |sum: Self, mesh: Self| Self {
            vertices: sum.vertices + mesh.vertices,
            indices: sum.indices + mesh.indices,
        };
        meshes.fold(Self::default(), add)
    }
}

/// What writing a mesh takes. It does not refer to the pages, so that a job can write while a frame changes them.
pub(crate) struct MeshTarget {
    pub(crate) location: MeshLocation,
    pub(crate) format: VertexFormat,
    attributes: Arc<AttributeSet>,
    vertices: PageBuffers<VertexBuffers>,
    indices: PageBuffers<wgpu::Buffer>,
    /// Of the pages, in vertices and in indices.
    lengths: [u32; 2],
}

impl MeshTarget {
    /// What is written to it.
    pub(crate) fn bytes(&self) -> u64 {
        let MeshLocation { vertices, indices, .. } = self.location;
        let stride = vertex_stride(self.format) + self.attributes.bytes_per_vertex();
        u64::from(vertices.length) * stride + u64::from(indices.length) * INDEX
    }

    /// Makes the buffers of the pages if nothing was written to them yet.
    ///
    /// # Errors
    /// If the device allows no buffer of that size.
    pub(crate) fn create_buffers(&self, device: &wgpu::Device) -> Result<(), BackendError> {
        let [vertex_count, index_count] = self.lengths.map(u64::from);
        let usage = |usage: wgpu::BufferUsages| usage | wgpu::BufferUsages::COPY_DST;
        if self.vertices.get().is_none() {
            let (size, usage) = (vertex_count * vertex_stride(self.format), usage(wgpu::BufferUsages::VERTEX));
            let vertices = new_buffer(device, "vertices", size.max(4), usage)?;
            let attributes = self.attributes.new_buffers(device, vertex_count)?;
            // Another thread may have been faster; its buffers are as good.
            let _ = self.vertices.set(VertexBuffers { vertices, attributes });
        }
        if self.indices.get().is_none() {
            let usage = usage(wgpu::BufferUsages::INDEX);
            let _ = self.indices.set(new_buffer(device, "indices", (index_count * INDEX).max(4), usage)?);
        }
        Ok(())
    }

    /// Calls `write` for each buffer write of a mesh, with the buffer, the offset in bytes, and the bytes. `vertices`
    /// are those of the mesh, in the pages' format. The writes are the same, in the same order, every time.
    ///
    /// # Errors
    /// If the pages have no buffers. This is a bug in Drawloom.
    pub(crate) fn for_each_write(
        &self,
        mesh: &Mesh,
        vertices: &[u8],
        mut write: impl FnMut(&wgpu::Buffer, u64, &[u8]),
    ) -> Result<(), BackendError> {
        let missing = || broken_rule("a page has buffers before it is written to");
        let (vertex_buffers, index_buffer) =
            (self.vertices.get().ok_or_else(missing)?, self.indices.get().ok_or_else(missing)?);
        let first = u64::from(self.location.vertices.start);
        write(&vertex_buffers.vertices, first * vertex_stride(self.format), vertices);
        self.attributes.for_each_value(mesh, &vertex_buffers.attributes, |buffer, stride, bytes| {
            write(buffer, first * stride, bytes);
        });
        let mut offset = u64::from(self.location.indices.start) * INDEX;
        let levels = mesh.levels().iter().map(|level| level.indices());
        for indices in [mesh.indices()].into_iter().chain(levels) {
            write(index_buffer, offset, bytemuck::cast_slice(indices));
            offset += indices.len() as u64 * INDEX;
        }
        Ok(())
    }
}
