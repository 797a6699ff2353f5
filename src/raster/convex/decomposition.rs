//! Decomposes a mesh into convex parts.

use super::ConvexPart;
use super::closed_body::closed_body;
use super::flat_polygons::flat_polygons;
use super::welded_mesh::WeldedMesh;
use crate::scene::Mesh;

impl ConvexPart {
    /// The convex parts of a mesh, the largest first: each of its pieces that is a closed convex body is one, and flat surfaces
    /// of the others are cut into convex ones. Parts that are small beside the largest are left out.
    ///
    /// Vertices are places rounded to f32, so what was flat or convex is no longer quite so. Up to 16 unit roundoffs of 2⁻²⁴
    /// of the mesh's farthest coordinate count as flat; [`ConvexPart::slack`] says what it really was.
    pub fn of(mesh: &Mesh) -> Vec<Self> {
        if mesh.triangle_count() > Self::MAX_TRIANGLES {
            return Vec::new();
        }
        let welded = WeldedMesh::new(mesh);
        let farthest = welded.places.iter().map(|place| place.abs().max_element()).fold(0.0, f64::max);
        let tolerance = farthest * TOLERANCE;
        let mut parts = Vec::new();
        for piece in welded.pieces() {
            match closed_body(&welded, &piece, tolerance) {
                Some(part) => parts.push(part),
                None => flat_polygons(&welded, &piece, tolerance, &mut parts),
            }
        }
        parts.sort_by(|one, other| other.area.total_cmp(&one.area));
        let least = parts.first().map_or(0.0, |largest| largest.area * MIN_AREA_SHARE);
        parts.retain(|part| part.area > least);
        parts.truncate(Self::MAX_PARTS);
        parts
    }
}

/// 16 unit roundoffs of f32: a rotation that was worked into a mesh's vertices leaves no more.
const TOLERANCE: f64 = 1.0 / 1_048_576.0;

/// A part of less than this share of the largest one's area hides little that the others do not.
const MIN_AREA_SHARE: f64 = 1.0 / 256.0;

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use glam::{DVec3, Quat, Vec3};

    use super::*;
    use crate::raster::Plane;
    use crate::scene::{Topology, Vertex};

    fn mesh(places: &[Vec3], triangles: &[[u32; 3]]) -> Mesh {
        let vertex = |place: &Vec3| Vertex { position: place.to_array(), ..Vertex::default() };
        let vertices = places.iter().map(vertex).collect();
        Mesh::new("shape", Topology::TriangleList, vertices, triangles.iter().flatten().copied().collect()).unwrap()
    }

    /// The corners of a box and its triangles, which face outwards.
    fn box_of(half: Vec3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let sign = |corner: u32, axis: u32| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
        let places = (0..8).map(|corner| half * Vec3::new(sign(corner, 0), sign(corner, 1), sign(corner, 2))).collect();
        let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        (places, quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
    }

    #[test]
    fn a_box_is_one_body_of_six_faces_however_it_is_turned() {
        for turns in 0..20 {
            let turn = Quat::from_axis_angle(Vec3::new(1.0, 2.0, -0.5).normalize(), turns as f32 * 0.7);
            let (places, triangles) = box_of(Vec3::new(3.0, 0.2, 40.0));
            let places: Vec<_> = places.into_iter().map(|place| turn * place + Vec3::new(7.0, -3.0, 1.0)).collect();
            let parts = ConvexPart::of(&mesh(&places, &triangles));
            let [part] = parts.as_slice() else { panic!("{} parts after {turns} turns", parts.len()) };
            assert!(part.is_closed && part.faces.len() == 6 && part.points.len() == 8, "{part:?}");
            assert!(part.slack < 1e-4 && (turns > 0 || part.slack == 0.0), "{}", part.slack);
            for face in &part.faces {
                assert!(
                    part.points.iter().all(|&point| face.signed_distance(point) <= part.slack),
                    "after {turns} turns"
                );
            }
        }
    }

    #[test]
    fn what_is_no_convex_body_is_cut_into_flat_pieces() {
        // A box without its lid, one turned inside out, and one with a dent.
        let (places, triangles) = box_of(Vec3::ONE);
        let open = ConvexPart::of(&mesh(&places, &triangles[..10]));
        assert_eq!(open.len(), 5);
        let inverted: Vec<_> = triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
        let inverted = ConvexPart::of(&mesh(&places, &inverted));
        assert_eq!(inverted.len(), 6);
        let mut dented = places.clone();
        dented[7] = Vec3::splat(0.2);
        let dented = ConvexPart::of(&mesh(&dented, &triangles));
        for part in open.iter().chain(&inverted).chain(&dented) {
            assert!(!part.is_closed && part.faces.len() == 1, "{part:?}");
        }
        let quads = |parts: &[ConvexPart]| parts.iter().filter(|part| part.points.len() == 4).count();
        assert_eq!([quads(&open), quads(&inverted), quads(&dented)], [5, 6, 3]);
    }

    #[test]
    fn pieces_of_a_mesh_are_parts_of_their_own_the_largest_first() {
        let (mut places, mut triangles) = box_of(Vec3::ONE);
        let (larger, more) = box_of(Vec3::splat(2.0));
        triangles.extend(more.iter().map(|triangle| triangle.map(|corner| corner + 8)));
        places.extend(larger.iter().map(|&place| place + Vec3::X * 9.0));
        let (tiny, more) = box_of(Vec3::splat(0.01));
        triangles.extend(more.iter().map(|triangle| triangle.map(|corner| corner + 16)));
        places.extend(tiny.iter().map(|&place| place - Vec3::X * 9.0));
        let parts = ConvexPart::of(&mesh(&places, &triangles));
        let areas: Vec<_> = parts.iter().map(|part| part.area).collect();
        assert_eq!(areas, [96.0, 24.0]);
    }

    /// An L of six triangles on a grid: its parts cover it once, and none is larger than what is there.
    #[test]
    fn flat_pieces_cover_their_surface_once() {
        let at = |x: f32, y: f32| Vec3::new(x, y, 3.0);
        let places = [
            at(0.0, 0.0),
            at(1.0, 0.0),
            at(2.0, 0.0),
            at(0.0, 1.0),
            at(1.0, 1.0),
            at(2.0, 1.0),
            at(0.0, 2.0),
            at(1.0, 2.0),
        ];
        let triangles = [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [3, 4, 7], [3, 7, 6]];
        let parts = ConvexPart::of(&mesh(&places, &triangles));
        assert_eq!(parts.iter().map(|part| part.area).sum::<f64>(), 3.0);
        assert_eq!(parts[0].area, 2.0);
        for part in &parts {
            assert_eq!(part.faces, [Plane { normal: DVec3::Z, offset: 3.0 }]);
            let is_in_the_gap = |point: &DVec3| point.x > 1.0 && point.y > 1.0;
            assert!(!part.points.iter().any(is_in_the_gap));
        }
    }

    #[test]
    fn what_has_no_area_or_too_many_faces_is_no_part() {
        let line = [Vec3::ZERO, Vec3::X, Vec3::X * 2.0];
        assert_eq!(ConvexPart::of(&mesh(&line, &[[0, 1, 2]])), []);
        assert_eq!(ConvexPart::of(&mesh(&[Vec3::ONE; 3], &[[0, 1, 2]])), []);
        // A ball of 20 times 20 faces, which would have to be looked at for every square it covers.
        let ring = |row: u32, step: u32| {
            let (height, turn) = (row as f32 / 20.0 * std::f32::consts::PI, step as f32 / 20.0 * std::f32::consts::TAU);
            Vec3::new(height.sin() * turn.cos(), height.cos(), height.sin() * turn.sin())
        };
        let places: Vec<_> = (0..=20).flat_map(|row| (0..20).map(move |step| ring(row, step))).collect();
        let at = |row: u32, step: u32| row * 20 + step % 20;
        let faces = (0..20).flat_map(|row| {
            (0..20).flat_map(move |step| {
                let [a, b, c, d] = [at(row, step), at(row, step + 1), at(row + 1, step + 1), at(row + 1, step)];
                [[a, b, c], [a, c, d]]
            })
        });
        let parts = ConvexPart::of(&mesh(&places, &faces.collect::<Vec<_>>()));
        assert!(parts.iter().all(|part| part.points.len() <= 4 && !part.is_closed), "{}", parts.len());
    }
}
