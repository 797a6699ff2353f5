//! Box meshes.

use glam::Vec3;

use super::{Mesh, SceneError, Topology, Vertex};

impl Mesh {
    /// A box around the origin of object space, of this size in metres, with separate normals for each side, and the
    /// whole of a texture on each: upright on those that stand. The signs of the size do not count.
    ///
    /// # Errors
    /// If the size is not finite, or too large.
    pub fn cuboid(name: impl Into<String>, size: Vec3) -> Result<Self, SceneError> {
        let (mut vertices, mut indices) = (Vec::new(), Vec::new());
        for (normal, right) in [
            (Vec3::X, Vec3::NEG_Z),
            (Vec3::NEG_X, Vec3::Z),
            (Vec3::Y, Vec3::X),
            (Vec3::NEG_Y, Vec3::X),
            (Vec3::Z, Vec3::X),
            (Vec3::NEG_Z, Vec3::NEG_X),
        ] {
            let up = normal.cross(right);
            let first = vertices.len() as u32;
            for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
                let position = (normal + right * x + up * y) * size.abs() * 0.5;
                let uv = [x * 0.5 + 0.5, 0.5 - y * 0.5];
                vertices.push(Vertex { position: position.to_array(), normal: normal.to_array(), uv });
            }
            indices.extend([0, 1, 2, 0, 2, 3].map(|corner| first + corner));
        }
        Self::new(name, Topology::TriangleList, vertices, indices)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cuboid_faces_outwards_and_its_textures_stand_upright() {
        let size = Vec3::new(2.0, 4.0, -6.0);
        let mesh = Mesh::cuboid("box", size).unwrap();
        assert_eq!(mesh.corners(), [Vec3::new(-1.0, -2.0, -3.0), Vec3::new(1.0, 2.0, 3.0)]);
        assert_eq!(mesh.triangles().count(), 12);
        for corners in mesh.triangles() {
            let [a, b, c] = corners.map(|corner| mesh.vertices()[corner as usize]);
            let [origin, right, up] = [a, b, c].map(|vertex| Vec3::from(vertex.position));
            let normal = Vec3::from(a.normal);
            assert!((right - origin).cross(up - origin).dot(normal) > 0.0, "{normal}");
            assert!(origin.dot(normal) > 0.0);
        }
        let standing = mesh.vertices().iter().filter(|vertex| vertex.normal[1] == 0.0);
        assert!(
            standing.clone().count() == 16
                && standing.clone().all(|vertex| vertex.uv[1] == if vertex.position[1] > 0.0 { 0.0 } else { 1.0 })
        );
        assert!(Mesh::cuboid("box", Vec3::NAN).is_err());
    }
}
