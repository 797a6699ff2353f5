//! Spheres of any number of triangles.

use std::f32::consts::{FRAC_1_SQRT_2, PI, TAU};

use drawloom::scene::{LevelOfDetail, Mesh, SceneError, Topology, Vertex};

/// A sphere around the origin, of radius 1: `rings` rings from pole to pole, each of twice as many segments. Of its
/// `levels` levels of detail each has half as many rings as the one before.
///
/// # Errors
/// Returns an error if there are fewer than two rings at the coarsest level, or too many vertices.
pub fn new(name: &str, rings: u32, levels: u32) -> Result<Mesh, SceneError> {
    let segments = rings * 2;
    let vertex = |index: u32| {
        let (ring, segment) = (index / (segments + 1), index % (segments + 1));
        let (from_pole, around) = (ring as f32 / rings as f32, segment as f32 / segments as f32);
        let ((radius, height), (x, z)) = ((from_pole * PI).sin_cos(), (around * TAU).sin_cos());
        let position = [radius * x, height, radius * z];
        Vertex { position, normal: position, uv: [around, from_pole] }
    };
    let vertices = (0..(rings + 1) * (segments + 1)).map(vertex).collect();
    let mesh = Mesh::new(name, Topology::TriangleList, vertices, indices(rings, 1))?;
    let coarser = (1..=levels).map(|level| {
        let step = 1 << level;
        // The angle from the middle of a triangle to its corners, which are on the sphere.
        let angle = PI * step as f32 / rings as f32 * FRAC_1_SQRT_2;
        LevelOfDetail::new(indices(rings, step), 1.0 - angle.cos())
    });
    mesh.with_levels(coarser)
}

/// The triangles of every `step`-th ring and segment, counter-clockwise as seen from outside.
fn indices(rings: u32, step: u32) -> Vec<u32> {
    let segments = rings * 2;
    let mut indices = Vec::new();
    for ring in (0..rings).step_by(step as usize) {
        for segment in (0..segments).step_by(step as usize) {
            let corner = |down: u32, along: u32| (ring + down) * (segments + 1) + segment + along;
            if ring > 0 {
                indices.extend([corner(0, 0), corner(step, step), corner(0, step)]);
            }
            if ring + step < rings {
                indices.extend([corner(0, 0), corner(step, 0), corner(step, step)]);
            }
        }
    }
    indices
}

#[cfg(test)]
mod tests {
    use drawloom::glam::Vec3;

    use super::*;

    #[test]
    fn triangles_of_all_levels_face_outwards_close_the_sphere_and_keep_their_errors() {
        let mesh = new("sphere", 32, 3).unwrap();
        let of_levels = mesh.levels().iter().map(|level| (level.indices(), level.error()));
        let mut rings = 32;
        for (indices, error) in [(mesh.indices(), 0.01)].into_iter().chain(of_levels) {
            let mut volume = 0.0;
            for triangle in indices.chunks_exact(3) {
                let [a, b, c] = [0, 1, 2].map(|corner| Vec3::from(mesh.vertices()[triangle[corner] as usize].position));
                let normal = (b - a).cross(c - a);
                assert!(normal.dot(a) > 0.0, "{a} {b} {c}");
                // The nearest point of the triangle's plane bounds that of the triangle.
                assert!(normal.normalize().dot(a) >= 1.0 - error, "{a} {b} {c}: {error}");
                volume += a.dot(b.cross(c)) / 6.0;
            }
            // Two triangles a quad, and one at each pole.
            assert_eq!(indices.len() / 3, 4 * rings * (rings - 1));
            assert!((volume / (4.0 / 3.0 * PI) - 1.0).abs() < 3.0 * error, "{volume}");
            rings /= 2;
        }
    }
}
