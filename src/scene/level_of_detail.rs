//! A level of detail of a mesh.

/// Coarser triangles of a mesh, over the same vertices, for where it is small in the picture. The mesh itself is level
/// 0; the others are counted from 1.
#[derive(Clone, Debug)]
pub struct LevelOfDetail {
    pub(super) indices: Vec<u32>,
    error: f32,
    /// As [`Mesh::longest_edge`](super::Mesh::longest_edge); 0 until the level belongs to a mesh.
    pub(super) longest_edge: f32,
}

/// Levels are equal if their indices and errors are: what a mesh has computed of one makes no difference.
impl PartialEq for LevelOfDetail {
    fn eq(&self, other: &Self) -> bool {
        (&self.indices, self.error) == (&other.indices, other.error)
    }
}

impl LevelOfDetail {
    /// How many levels a mesh may have beside level 0.
    pub const MAX_COUNT: usize = 7;

    /// A level with these indices, which form triangles as those of its mesh do.
    ///
    /// `error` is in metres in object space: no point of the surface of level 0 is farther than that from this level's
    /// surface, and no point of this surface is farther from that of level 0 (the Hausdorff distance). Whoever supplies
    /// the level vouches for it; what [`Quality::level_of_detail`](crate::quality::Quality::level_of_detail) promises
    /// rests on it.
    pub fn new(indices: Vec<u32>, error: f32) -> Self {
        Self { indices, error, longest_edge: 0.0 }
    }

    /// The indices, each below the number of the mesh's vertices.
    pub fn indices(&self) -> &[u32] {
        &self.indices
    }

    /// The largest distance between the surfaces of this level and of level 0, in metres in object space.
    pub fn error(&self) -> f32 {
        self.error
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Mesh, Topology, Vertex};

    #[test]
    fn a_level_equals_itself_as_a_part_of_a_mesh() {
        let corner = |[x, y]: [f32; 2]| Vertex { position: [x, y, 0.0], ..Vertex::default() };
        let vertices = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]].map(corner).to_vec();
        let mesh = Mesh::new("square", Topology::TriangleList, vertices, vec![0, 1, 2, 2, 1, 3]).unwrap();
        let level = LevelOfDetail::new(vec![0, 1, 2], 0.5);
        assert_eq!(mesh.with_levels(vec![level.clone()]).unwrap().levels(), std::slice::from_ref(&level));
        assert_ne!(LevelOfDetail::new(vec![0, 1, 3], 0.5), level);
        assert_ne!(LevelOfDetail::new(vec![0, 1, 2], 0.25), level);
    }
}
