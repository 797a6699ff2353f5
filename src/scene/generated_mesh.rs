//! Meshes whose vertices CPU nodes make anew in each frame.

use std::sync::Arc;

use glam::Vec3;

#[cfg(feature = "software")]
use super::GeneratedContents;
use super::generated_geometry::{GeneratedGeometry, GeneratedIndices, IndexSource};
use super::mesh::{check_corner_count, triangle_count};
use super::{Bounds, GeneratedBuffer, Mesh, SceneError, Topology, Vertex};

impl Mesh {
    /// A mesh whose vertices [CPU nodes](crate::CpuNode) make anew in each frame, and if they like its indices: a
    /// terrain around the camera, or a surface that is subdivided (S 9.5). All processes draw it, shadow maps among
    /// them. `bounding_box` is its minimum and maximum in object space, in metres, in all frames: triangles outside of
    /// it may be missing.
    ///
    /// Like a mesh [in the engine's own buffers](Self::from_buffers) it has no triangles that the CPU sees when it
    /// culls, so it is never an occluder, and neither subdivided for paraboloids nor culled by triangle. The software
    /// backend draws it; if a vertex is then not finite, or an index is not one of a vertex that
    /// [counts](crate::NodeContext::set_count), that frame lacks the mesh, and a warning names it. Nothing is drawn of
    /// it until a node has filled its buffers.
    ///
    /// # Errors
    /// If it has no triangle, or a part of one, or if the bounding box is inverted, not finite or too large.
    pub fn generated(
        name: impl Into<String>,
        topology: Topology,
        bounding_box: [Vec3; 2],
        vertices: &GeneratedBuffer<Vertex>,
        indices: impl Into<GeneratedIndices>,
    ) -> Result<Self, SceneError> {
        let (name, indices) = (name.into(), indices.into());
        check_corner_count(&name, topology, indices.count())?;
        if let IndexSource::Fixed(fixed) = &indices.0
            && let Some(&index) = fixed.iter().find(|&&index| index as usize >= vertices.capacity())
        {
            return Err(SceneError::IndexOutOfRange { mesh: name, index, vertices: vertices.capacity() });
        }
        let mut mesh = Self::from_valid_parts(name, topology, Vec::new(), Vec::new());
        let [low, high] = bounding_box;
        (mesh.bounds, mesh.corners) = (Bounds::around(bounding_box.into_iter()), bounding_box);
        if !(low.cmple(high).all() && mesh.bounds.is_valid()) {
            return Err(SceneError::MeshTooLarge { mesh: mesh.name });
        }
        mesh.generated =
            Some(Arc::new(GeneratedGeometry { topology, vertices: Arc::clone(vertices.source()), indices }));
        Ok(mesh)
    }

    /// The mesh of one frame as one that the CPU knows, from what its buffers are filled with; `None` while one never
    /// was, and if no triangle counts.
    ///
    /// # Errors
    /// If a vertex is not finite, or an index is not one of a vertex.
    #[cfg(feature = "software")]
    pub(crate) fn with_contents(
        &self,
        contents_of: impl Fn(u64) -> Option<Arc<GeneratedContents>>,
    ) -> Result<Option<Self>, SceneError> {
        let Some(GeneratedGeometry { vertices, indices, .. }) = self.generated.as_deref() else { return Ok(None) };
        let Some(vertices) = contents_of(vertices.layout.identity) else { return Ok(None) };
        let indices = match &indices.0 {
            IndexSource::Fixed(fixed) => fixed.clone(),
            IndexSource::Generated(source) => {
                let Some(contents) = contents_of(source.layout.identity) else { return Ok(None) };
                let mut made = contents.elements();
                made.truncate(contents.whole_triangles(self.topology()).0);
                made
            }
        };
        if indices.is_empty() {
            return Ok(None);
        }
        Self::new(self.name(), self.topology(), vertices.elements(), indices).map(Some)
    }

    /// Where its vertices come from, if nodes make them.
    #[cfg(any(feature = "wgpu", feature = "software"))]
    pub(crate) fn generated_geometry(&self) -> Option<&Arc<GeneratedGeometry>> {
        self.generated.as_ref()
    }

    /// The number of triangles of a generated mesh; 0 of another one.
    pub(super) fn generated_triangle_count(&self) -> usize {
        self.generated.as_ref().map_or(0, |geometry| triangle_count(self.topology(), geometry.indices.count()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_generated_mesh_that_no_frame_can_draw_is_refused() {
        let buffer = GeneratedBuffer::<Vertex>::new("vertices", 3);
        let make = |corners: [Vec3; 2], indices: Vec<u32>| {
            Mesh::generated("leaf", Topology::TriangleList, corners, &buffer, indices)
        };
        let unit = [Vec3::ZERO, Vec3::ONE];
        assert!(matches!(make(unit, vec![]), Err(SceneError::EmptyMesh { .. })));
        assert!(matches!(make(unit, vec![0, 1]), Err(SceneError::EmptyMesh { .. })));
        assert!(matches!(make(unit, vec![0, 1, 2, 2]), Err(SceneError::PartialTriangle { .. })));
        assert!(matches!(make(unit, vec![0, 1, 3]), Err(SceneError::IndexOutOfRange { index: 3, vertices: 3, .. })));
        for corners in [[Vec3::ONE, Vec3::ZERO], [Vec3::NAN, Vec3::ONE], [Vec3::ZERO, Vec3::INFINITY]] {
            assert!(matches!(make(corners, vec![0, 1, 2]), Err(SceneError::MeshTooLarge { .. })), "{corners:?}");
        }
        let mesh = make(unit, vec![0, 1, 2, 2, 1, 0]).unwrap();
        assert_eq!((mesh.triangle_count(), mesh.has_triangles(), mesh.corners()), (2, false, unit));
    }
}
