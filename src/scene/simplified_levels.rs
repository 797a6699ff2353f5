//! Levels of detail by mesh simplification.

use meshopt::{SimplifyOptions, simplify_decoder};

use super::{LevelOfDetail, Mesh, SceneError};

/// The error of a level, as a multiple of meshoptimizer's.
const ERROR_FACTOR: f32 = 6.0;

/// A level with more than this share of the triangles of the one before it is not worth its memory.
const LARGEST_SHARE: f64 = 0.8;

impl Mesh {
    /// Replaces the mesh's coarser levels by ones that meshoptimizer simplifies, each of about half of the triangles of
    /// the one before it, down to where the mesh's topology allows no fewer. A strip becomes a list. A mesh [in the
    /// engine's own buffers](Self::from_buffers) does not change.
    ///
    /// Vertices are collapsed by quadric error (Garland and Heckbert, "Surface Simplification Using Quadric Error
    /// Metrics", 1997), and seams of normals, texture coordinates and attributes stay. The
    /// [error](LevelOfDetail::error) rests on an estimate: meshoptimizer states a mean of squared distances to planes,
    /// not the largest distance. Of terrains, tori, spheres and plateaus the largest distance was up to 4.8 times as
    /// much, so levels state six times as much. Where a bound must hold, measure the levels, and supply them by
    /// [`Mesh::with_levels`].
    ///
    /// It takes some milliseconds for each 10,000 triangles.
    ///
    /// # Errors
    /// If the mesh is so large that an error exceeds the range of f32.
    pub fn with_simplified_levels(self) -> Result<Self, SceneError> {
        if !self.has_triangles() {
            return Ok(self);
        }
        let mesh = self.into_list();
        let positions: Vec<_> = mesh.vertices().iter().map(|vertex| vertex.position).collect();
        let (mut levels, mut corners, mut error) = (Vec::new(), mesh.indices().len(), 0.0_f32);
        while levels.len() < LevelOfDetail::MAX_COUNT {
            let (options, mut estimate) = (SimplifyOptions::ErrorAbsolute, 0.0);
            let target = corners / 6 * 3;
            let indices = simplify_decoder(mesh.indices(), &positions, target, f32::MAX, options, Some(&mut estimate));
            if indices.is_empty() || indices.len() as f64 > corners as f64 * LARGEST_SHARE {
                break;
            }
            // What is flat is simplified without an error, but for rounding.
            let rounding = mesh.bounds().radius * f32::EPSILON;
            (corners, error) = (indices.len(), (estimate * ERROR_FACTOR).max(rounding).max(error.next_up()));
            levels.push(LevelOfDetail::new(indices, error));
        }
        mesh.with_levels(levels)
    }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;
    use crate::scene::{Topology, Vertex};

    type Shape = fn(f64, f64) -> [f64; 3];

    /// Shapes over the unit square: a terrain, a torus, a sphere, and a plateau with flat sides.
    const SHAPES: [Shape; 4] = [
        |x, z| [x, 0.1 * (x * 9.0).sin() * (z * 7.0).cos() + 0.03 * (x * 31.0).sin() * (z * 27.0).sin(), z],
        |x, z| {
            let [around, across] = [x, z].map(|angle| angle * std::f64::consts::TAU);
            let distance = 1.0 + 0.3 * across.cos();
            [distance * around.cos(), 0.3 * across.sin(), distance * around.sin()]
        },
        |x, z| {
            let (around, down) = (x * std::f64::consts::TAU, z * std::f64::consts::PI);
            [around.sin() * down.sin(), down.cos(), around.cos() * down.sin()]
        },
        |x, z| [x, 0.3 - ((x - 0.5).abs().max((z - 0.5).abs()) - 0.25).max(0.0), z],
    ];

    fn mesh_of(shape: Shape, side: u32) -> Mesh {
        let share = |number: u32| f64::from(number) / f64::from(side);
        let vertices = (0..=side).flat_map(|row| (0..=side).map(move |column| shape(share(row), share(column))));
        let vertices = vertices.map(|position| Vertex { position: position.map(|x| x as f32), ..Vertex::default() });
        let corners = (0..side * side).map(|cell| cell / side * (side + 1) + cell % side);
        let indices = corners.flat_map(|a| [a, a + 1, a + side + 2, a, a + side + 2, a + side + 1]);
        Mesh::new("shape", Topology::TriangleList, vertices.collect(), indices.collect()).unwrap()
    }

    fn corners_of<'a>(mesh: &'a Mesh, indices: &'a [u32]) -> impl Iterator<Item = [DVec3; 3]> + 'a {
        let position = |index: u32| Vec3::from(mesh.vertices()[index as usize].position).as_dvec3();
        indices.as_chunks::<3>().0.iter().map(move |corners| corners.map(position))
    }

    /// The distance of a point from a triangle: inside that of its plane, elsewhere that of its edges.
    fn distance(point: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
        let normal = (b - a).cross(c - a);
        let is_inside =
            [(a, b), (b, c), (c, a)].iter().all(|(one, other)| (*other - *one).cross(point - *one).dot(normal) >= 0.0);
        if is_inside && normal != DVec3::ZERO {
            return normal.normalize().dot(point - a).abs();
        }
        let to_edge = |one: DVec3, other: DVec3| {
            let along = other - one;
            let share = ((point - one).dot(along) / along.length_squared()).clamp(0.0, 1.0);
            (one + along * if share.is_nan() { 0.0 } else { share }).distance(point)
        };
        to_edge(a, b).min(to_edge(b, c)).min(to_edge(c, a))
    }

    /// The largest distance of sampled points of a surface from another one.
    fn largest_distance(mesh: &Mesh, from: &[u32], to: &[u32]) -> f64 {
        let steps = 3;
        let points = corners_of(mesh, from).flat_map(|[a, b, c]| {
            let shares = (0..=steps).flat_map(move |one| (0..=steps - one).map(move |other| (one, other)));
            shares.map(move |(one, other)| {
                let [one, other] = [one, other].map(|step| f64::from(step) / f64::from(steps));
                a + (b - a) * one + (c - a) * other
            })
        });
        let nearest =
            |point| corners_of(mesh, to).map(|corners| distance(point, corners)).fold(f64::INFINITY, f64::min);
        points.map(nearest).fold(0.0, f64::max)
    }

    #[test]
    fn simplified_levels_have_half_the_triangles_and_the_errors_that_they_state() {
        // The last one is the one with the largest distances for their estimates.
        for (shape, side) in SHAPES.map(|shape| (shape, 12)).into_iter().chain([(SHAPES[3], 20)]) {
            let mesh = mesh_of(shape, side).with_simplified_levels().unwrap();
            assert!(mesh.levels().len() >= 3, "{}", mesh.levels().len());
            let mut before = mesh.triangle_count();
            for level in mesh.levels() {
                assert!(level.indices().len() / 3 <= before * 8 / 10);
                before = level.indices().len() / 3;
                let there = largest_distance(&mesh, mesh.indices(), level.indices());
                let back = largest_distance(&mesh, level.indices(), mesh.indices());
                assert!(there.max(back) <= f64::from(level.error()), "{there} and {back} m, not {}", level.error());
            }
            assert!(before < mesh.triangle_count() / 6);
        }
    }

    #[test]
    fn a_strip_becomes_a_list_and_a_triangle_stays_alone() {
        let corner =
            |index: u32| Vertex { position: [(index / 2) as f32, (index % 2) as f32, 0.0], ..Vertex::default() };
        let mesh = |count: u32| {
            Mesh::new("row", Topology::TriangleStrip, (0..count).map(corner).collect(), (0..count).collect()).unwrap()
        };
        let row = mesh(40).with_simplified_levels().unwrap();
        assert_eq!((row.topology(), row.triangle_count()), (Topology::TriangleList, 38));
        assert!(row.levels().len() > 2 && row.levels().iter().all(|level| level.error() > 0.0));
        assert!(mesh(3).with_simplified_levels().unwrap().levels().is_empty());
    }
}
