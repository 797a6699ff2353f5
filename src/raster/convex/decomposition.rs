//! Decomposes a mesh into convex parts.

use super::ConvexPart;
use super::closed_body::closed_body;
use super::flat_polygons::flat_polygons;
use super::welded_mesh::WeldedMesh;
use crate::scene::Mesh;

impl ConvexPart {
    /// Decomposes a mesh into convex parts, the largest first. A connected component that is a closed convex body is
    /// one part; the flat surfaces of other components are divided into convex polygons. Parts much smaller than the
    /// largest are omitted.
    ///
    /// Vertices are rounded to f32, so surfaces are not exactly flat or convex. The tolerance is 16 unit roundoffs of
    /// 2⁻²⁴ of the mesh's largest coordinate; [`ConvexPart::slack`] is the actual deviation.
    pub fn decompose(mesh: &Mesh) -> Vec<Self> {
        if mesh.triangle_count() > Self::MAX_TRIANGLES {
            return Vec::new();
        }
        let welded = WeldedMesh::new(mesh);
        let max_coordinate = welded.points.iter().map(|point| point.abs().max_element()).fold(0.0, f64::max);
        let tolerance = max_coordinate * TOLERANCE;
        let mut parts = Vec::new();
        for component in welded.components() {
            match closed_body(&welded, &component, tolerance) {
                Some(part) => parts.push(part),
                None => flat_polygons(&welded, &component, tolerance, &mut parts),
            }
        }
        parts.sort_by(|one, other| other.area.total_cmp(&one.area));
        let min_area = parts.first().map_or(0.0, |largest| largest.area * MIN_AREA_SHARE);
        parts.retain(|part| part.area > min_area);
        parts.truncate(Self::MAX_PARTS);
        parts
    }
}

/// 16 unit roundoffs of f32: rotating a mesh's vertices in f32 causes no larger errors.
const TOLERANCE: f64 = 1.0 / 1_048_576.0;

/// Parts with an area below this share of the largest part's hide little that others do not hide.
const MIN_AREA_SHARE: f64 = 1.0 / 256.0;

#[cfg(test)]
mod tests {
    use glam::{DVec3, Quat, Vec3};

    use super::*;
    use crate::raster::Plane;
    use crate::scene::{Topology, Vertex};

    fn mesh(points: &[Vec3], triangles: &[[u32; 3]]) -> Mesh {
        let vertex = |point: &Vec3| Vertex { position: point.to_array(), ..Vertex::default() };
        let vertices = points.iter().map(vertex).collect();
        Mesh::new("shape", Topology::TriangleList, vertices, triangles.iter().flatten().copied().collect()).unwrap()
    }

    /// Points turned around an axis, and moved: their coordinates are rounded.
    fn turned(points: Vec<Vec3>, angle: f32) -> Vec<Vec3> {
        let turn = Quat::from_axis_angle(Vec3::new(1.0, 2.0, -0.5).normalize(), angle);
        points.into_iter().map(|point| turn * point + Vec3::new(7.0, -3.0, 1.0)).collect()
    }

    /// The corners and the outward-facing triangles of a box.
    fn box_of(half: Vec3) -> (Vec<Vec3>, Vec<[u32; 3]>) {
        let sign = |corner: u32, axis: u32| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
        let points = (0..8).map(|corner| half * Vec3::new(sign(corner, 0), sign(corner, 1), sign(corner, 2))).collect();
        let quads = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        (points, quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect())
    }

    #[test]
    fn a_box_in_any_orientation_is_one_body_with_six_faces() {
        for turns in 0..20 {
            let (points, triangles) = box_of(Vec3::new(3.0, 0.2, 40.0));
            let parts = ConvexPart::decompose(&mesh(&turned(points, turns as f32 * 0.7), &triangles));
            let [part] = parts.as_slice() else { panic!("{} parts after {turns} turns", parts.len()) };
            assert!(part.is_closed && part.faces.len() == 6 && part.points.len() == 8, "{part:?}");
            assert!(part.slack < 1e-4 && (turns > 0 || part.slack == 0.0), "{}", part.slack);
            let mut lengths: Vec<_> = part
                .edges
                .iter()
                .map(|edge| edge.map(|corner| part.points[corner as usize]))
                .map(|[from, to]| (from.distance(to) * 10.0).round() / 10.0)
                .collect();
            lengths.sort_by(f64::total_cmp);
            assert_eq!(lengths, [[0.4; 4], [6.0; 4], [80.0; 4]].concat());
            for face in &part.faces {
                assert!(
                    part.points.iter().all(|&point| face.signed_distance(point) <= part.slack),
                    "after {turns} turns"
                );
            }
        }
    }

    /// The corners and the triangles of a wedge of length 5, turned.
    fn wedge(half_thickness: f32) -> (Vec<Vec3>, [[u32; 3]; 8]) {
        let profile = [[0.0, 0.0], [5.0, -half_thickness], [5.0, half_thickness]];
        let corners = [-1.0, 1.0].into_iter().flat_map(|z| profile.map(|[x, y]| Vec3::new(x, y, z)));
        let points = turned(corners.collect(), 0.7);
        (points, [[0, 2, 1], [3, 4, 5], [0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]])
    }

    #[test]
    fn the_slack_of_a_wedge_grows_with_its_sharpness() {
        for degrees in [8.0_f32, 30.0, 55.0] {
            let half_angle = (degrees / 2.0).to_radians();
            let (points, triangles) = wedge(5.0 * half_angle.tan());
            let parts = ConvexPart::decompose(&mesh(&points, &triangles));
            let [part] = parts.as_slice() else { panic!("{} parts at {degrees} degrees", parts.len()) };
            assert!(part.is_closed && part.faces.len() == 5, "{part:?}");
            // The distance of each face from its own corners; other corners are much farther away.
            let deviation = part
                .faces
                .iter()
                .flat_map(|face| part.points.iter().map(|&point| face.signed_distance(point).abs()))
                .filter(|distance| *distance < 1e-3)
                .fold(0.0, f64::max);
            // Where two planes that are off by δ meet at this angle, their edge is off by δ ÷ sin(angle ÷ 2).
            let expected = deviation / f64::from(half_angle).sin();
            assert!(deviation > 0.0 && (part.slack / expected - 1.0).abs() < 1e-4, "{} {expected}", part.slack);
        }
    }

    #[test]
    fn other_surfaces_are_divided_into_flat_polygons() {
        // A box without its lid, a box turned inside out, and one with a dent.
        let (points, triangles) = box_of(Vec3::ONE);
        let open = ConvexPart::decompose(&mesh(&points, &triangles[..10]));
        assert_eq!(open.len(), 5);
        let inverted: Vec<_> = triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
        let inverted = ConvexPart::decompose(&mesh(&points, &inverted));
        assert_eq!(inverted.len(), 6);
        let mut dented = points.clone();
        dented[7] = Vec3::splat(0.2);
        let dented = ConvexPart::decompose(&mesh(&dented, &triangles));
        for part in open.iter().chain(&inverted).chain(&dented) {
            assert!(!part.is_closed && part.faces.len() == 1, "{part:?}");
        }
        let quads = |parts: &[ConvexPart]| parts.iter().filter(|part| part.points.len() == 4).count();
        assert_eq!([quads(&open), quads(&inverted), quads(&dented)], [5, 6, 3]);
    }

    #[test]
    fn a_dent_deeper_than_half_the_tolerance_is_not_convex() {
        // With a point in the middle of a side, the plane of a triangle there is off the opposite edge by twice the
        // dent.
        for (dent, is_closed) in [(0.0, true), (0.4, true), (0.6, false)] {
            let (mut points, mut triangles) = box_of(Vec3::ONE);
            triangles.truncate(10);
            points.push(Vec3::Z * (1.0 - dent * TOLERANCE as f32));
            triangles.extend([[4, 5, 8], [5, 7, 8], [7, 6, 8], [6, 4, 8]]);
            let parts = ConvexPart::decompose(&mesh(&points, &triangles));
            assert!(!parts.is_empty() && parts.iter().all(|part| part.is_closed == is_closed), "{dent}: {parts:?}");
        }
    }

    #[test]
    fn components_of_a_mesh_are_separate_parts_in_order_of_size() {
        let (mut points, mut triangles) = box_of(Vec3::ONE);
        let (larger, more) = box_of(Vec3::splat(2.0));
        triangles.extend(more.iter().map(|triangle| triangle.map(|corner| corner + 8)));
        points.extend(larger.iter().map(|&point| point + Vec3::X * 9.0));
        let (tiny, more) = box_of(Vec3::splat(0.01));
        triangles.extend(more.iter().map(|triangle| triangle.map(|corner| corner + 16)));
        points.extend(tiny.iter().map(|&point| point - Vec3::X * 9.0));
        let parts = ConvexPart::decompose(&mesh(&points, &triangles));
        let areas: Vec<_> = parts.iter().map(|part| part.area).collect();
        assert_eq!(areas, [96.0, 24.0]);
    }

    #[test]
    fn a_wedge_so_sharp_that_nothing_bounds_its_outline_is_not_a_body() {
        let (points, triangles) = wedge(0.0003);
        let parts = ConvexPart::decompose(&mesh(&points, &triangles));
        assert!(!parts.is_empty() && parts.iter().all(|part| !part.is_closed));
        // Without any deviation, the sharpest of all edges do no harm: a triangle with two sides.
        let [a, b, c] = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let parts = ConvexPart::decompose(&mesh(&[a, b, c], &[[0, 1, 2], [0, 2, 1]]));
        let [part] = parts.as_slice() else { panic!("{} parts", parts.len()) };
        assert!(part.is_closed && part.slack == 0.0, "{part:?}");
    }

    /// A regular polygon of radius 1 with this many corners, at a height.
    fn ring(corners: u32, height: f32) -> impl Iterator<Item = Vec3> {
        (0..corners).map(move |corner| {
            let (sine, cosine) = (corner as f32 / corners as f32 * std::f32::consts::TAU).sin_cos();
            Vec3::new(cosine, sine, height)
        })
    }

    #[test]
    fn meshes_at_a_limit_are_decomposed_and_those_beyond_it_are_not() {
        // Without a corner in the middle.
        let fan = |corners: u32| (2..corners).map(|corner| [0, corner - 1, corner]);
        for (corners, is_closed) in
            [(ConvexPart::MAX_FACES as u32 - 2, true), (ConvexPart::MAX_FACES as u32 - 1, false)]
        {
            let points: Vec<_> = ring(corners, -1.0).chain(ring(corners, 1.0)).collect();
            let mut triangles: Vec<_> = fan(corners).map(|[a, b, c]| [a, c, b]).collect();
            triangles.extend(fan(corners).map(|triangle| triangle.map(|corner| corner + corners)));
            for (one, other) in (0..corners).map(|corner| (corner, (corner + 1) % corners)) {
                triangles.extend([[one, other, other + corners], [one, other + corners, one + corners]]);
            }
            let parts = ConvexPart::decompose(&mesh(&points, &triangles));
            assert!(!parts.is_empty());
            assert_eq!(parts.len() == 1, is_closed, "a prism of {corners} corners");
            assert!(parts.iter().all(|part| part.is_closed == is_closed), "a prism of {corners} corners");
        }
        for corners in [ConvexPart::MAX_CORNERS as u32, ConvexPart::MAX_CORNERS as u32 + 1] {
            let parts = ConvexPart::decompose(&mesh(
                &ring(corners, 0.0).collect::<Vec<_>>(),
                &fan(corners).collect::<Vec<_>>(),
            ));
            let most = parts.iter().map(|part| part.points.len()).max();
            assert_eq!(most, Some(ConvexPart::MAX_CORNERS), "a polygon of {corners} corners");
        }
        let points = [Vec3::ZERO, Vec3::X, Vec3::Y];
        for (count, is_decomposed) in [(ConvexPart::MAX_TRIANGLES, true), (ConvexPart::MAX_TRIANGLES + 1, false)] {
            let parts = ConvexPart::decompose(&mesh(&points, &vec![[0, 1, 2]; count]));
            assert_eq!(!parts.is_empty(), is_decomposed, "{count} triangles");
        }
    }

    /// The number of corners, and the area, of the only part of a surface.
    fn only_part(points: &[Vec3], triangles: &[[u32; 3]]) -> (u32, f64) {
        let parts = ConvexPart::decompose(&mesh(points, triangles));
        let [part] = parts.as_slice() else { panic!("{} parts", parts.len()) };
        let count = part.points.len() as u32;
        let next = |corner: u32| if corner + 1 < count { corner + 1 } else { 0 };
        assert_eq!(part.edges, (0..count).map(|corner| [corner, next(corner)]).collect::<Vec<_>>());
        (count, part.area)
    }

    #[test]
    fn corners_that_differ_in_the_sign_of_0_are_one() {
        let points = [
            Vec3::ZERO,
            Vec3::X,
            Vec3::new(1.0, 1.0, -0.0),
            Vec3::new(-0.0, 0.0, -0.0),
            Vec3::new(1.0, 1.0, 0.0),
            Vec3::Y,
        ];
        assert_eq!(only_part(&points, &[[0, 1, 2], [3, 4, 5]]), (4, 1.0));
    }

    #[test]
    fn a_polygon_with_corners_inside_is_one_part() {
        // Fans around a point in the middle.
        let square = [
            Vec3::ZERO,
            Vec3::new(-1.0, -1.0, 0.0),
            Vec3::new(1.0, -1.0, 0.0),
            Vec3::ONE.with_z(0.0),
            Vec3::new(-1.0, 1.0, 0.0),
        ];
        assert_eq!(only_part(&square, &[[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 1]]), (4, 4.0));
        let fan: Vec<_> = (0..12).map(|corner| [12, corner, (corner + 1) % 12]).collect();
        let (corners, area) = only_part(&ring(12, 0.0).chain([Vec3::ZERO]).collect::<Vec<_>>(), &fan);
        assert!(corners == 12 && (area - 3.0).abs() < 1e-6, "{corners} {area}");
        // A grid of four times two rectangles has three corners inside, one after the other. The edges between columns
        // are the longer ones, so each row is a polygon before both are one.
        let points: Vec<_> = (0..15).map(|index| Vec3::new((index % 5) as f32, (index / 5 * 2) as f32, 0.0)).collect();
        let rectangles = (0..8).map(|rectangle| rectangle / 4 * 5 + rectangle % 4);
        let triangles: Vec<_> = rectangles.flat_map(|at| [[at, at + 1, at + 6], [at, at + 6, at + 5]]).collect();
        assert_eq!(only_part(&points, &triangles), (12, 16.0));
    }

    #[test]
    fn the_slack_of_a_polygon_is_at_least_twice_the_deviation_from_its_plane() {
        let (points, triangles) = box_of(Vec3::new(3.0, 0.2, 40.0));
        let parts = ConvexPart::decompose(&mesh(&turned(points, 0.7), &triangles[..10]));
        let deviation = |part: &ConvexPart| {
            part.points.iter().map(|&point| part.faces[0].signed_distance(point).abs()).fold(0.0, f64::max)
        };
        assert!(parts.iter().all(|part| part.slack >= 2.0 * deviation(part)));
        assert!(parts.iter().any(|part| deviation(part) > 0.0));
        assert!(parts.iter().all(|part| part.slack < 1e-4));
    }

    /// The parts of an L of six triangles on a grid cover it exactly once.
    #[test]
    fn flat_polygons_cover_their_surface_once() {
        let at = |x: f32, y: f32| Vec3::new(x, y, 3.0);
        let points = [
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
        let parts = ConvexPart::decompose(&mesh(&points, &triangles));
        assert_eq!(parts.iter().map(|part| part.area).sum::<f64>(), 3.0);
        assert_eq!(parts[0].area, 2.0);
        for part in &parts {
            assert_eq!(part.faces, [Plane { normal: DVec3::Z, offset: 3.0 }]);
            let is_in_the_gap = |point: &DVec3| point.x > 1.0 && point.y > 1.0;
            assert!(!part.points.iter().any(is_in_the_gap));
        }
    }

    #[test]
    fn surfaces_without_area_and_bodies_with_too_many_faces_are_not_parts() {
        let line = [Vec3::ZERO, Vec3::X, Vec3::X * 2.0];
        assert_eq!(ConvexPart::decompose(&mesh(&line, &[[0, 1, 2]])), []);
        assert_eq!(ConvexPart::decompose(&mesh(&[Vec3::ONE; 3], &[[0, 1, 2]])), []);
        // A sphere of 20 times 20 faces, all of which would be evaluated for every tile that it covers.
        let ring = |row: u32, step: u32| {
            let (height, turn) = (row as f32 / 20.0 * std::f32::consts::PI, step as f32 / 20.0 * std::f32::consts::TAU);
            Vec3::new(height.sin() * turn.cos(), height.cos(), height.sin() * turn.sin())
        };
        let points: Vec<_> = (0..=20).flat_map(|row| (0..20).map(move |step| ring(row, step))).collect();
        let at = |row: u32, step: u32| row * 20 + step % 20;
        let faces = (0..20).flat_map(|row| {
            (0..20).flat_map(move |step| {
                let [a, b, c, d] = [at(row, step), at(row, step + 1), at(row + 1, step + 1), at(row + 1, step)];
                [[a, b, c], [a, c, d]]
            })
        });
        let parts = ConvexPart::decompose(&mesh(&points, &faces.collect::<Vec<_>>()));
        assert!(parts.iter().all(|part| part.points.len() <= 4 && !part.is_closed), "{}", parts.len());
    }
}
