//! Box meshes.

use drawloom::glam::Vec3;
use drawloom::scene::{Mesh, SceneError, Topology, Vertex};

/// A box around the origin of object space. `half` is half of its size, in metres.
///
/// # Errors
/// Returns an error if `half` is not finite.
pub fn new_box(name: String, half: Vec3) -> Result<Mesh, SceneError> {
    let (mut vertices, mut indices) = (Vec::new(), Vec::new());
    for normal in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z] {
        let first = vertices.len() as u32;
        let (right, up) = normal.any_orthonormal_pair();
        for [across, along] in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]] {
            let position = ((normal + right * across + up * along) * half).to_array();
            let uv = [(across + 1.0) / 2.0, (1.0 - along) / 2.0];
            vertices.push(Vertex { position, normal: normal.to_array(), uv });
        }
        indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
    }
    Mesh::new(name, Topology::TriangleList, vertices, indices)
}
