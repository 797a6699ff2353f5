//! Closed convex bodies.

use super::welded_mesh::{WeldedMesh, edges};
use super::{ConvexPart, Plane};

/// A piece of a mesh as a closed convex body, if that is what it is: every edge has a triangle on either side, and no corner is
/// farther outside of any triangle's plane than the tolerance.
///
/// **Its rim.** Let no corner be farther outside of any face than δ. An edge of the rim, seen from wherever, lies between a face
/// that is seen, with the normal n₁, and one that is not, with n₂; the plane through the eye and the edge has a normal
/// n = α n₁ + β n₂ with α, β ≥ 0, so no corner is farther outside of it than (α + β) δ. From |n| = 1 and c = n₁ · n₂ follows
/// 1 = (α + β)² − 2αβ(1 − c) ≥ (α + β)² (1 + c) / 2, so α + β ≤ √(2 / (1 + c)): the sharper an edge, the farther off. The
/// piece's own rim is within that of the rim of all its corners.
///
/// **Its depth.** A ray that meets the piece enters it through a triangle that is seen, and that is at most δ behind its face.
/// Triangles that lie in one plane to within δ share a face; where one of them is seen and the face is not, the plane through the
/// eye and the triangle supports the piece to within 2δ, so the triangle is at the rim.
pub(super) fn closed_body(welded: &WeldedMesh, piece: &[u32], tolerance: f64) -> Option<ConvexPart> {
    let mut faces: Vec<Plane> = Vec::new();
    let mut depth: f64 = 0.0;
    let mut face_of = Vec::with_capacity(piece.len());
    for &triangle in piece {
        let corners = welded.corners(triangle);
        let own = welded.faces[triangle as usize];
        let off =
            |face: &Plane| corners.map(|corner| face.signed_distance(corner).abs()).into_iter().fold(0.0, f64::max);
        let known = faces.iter().position(|face| face.normal.dot(own.normal) > 0.5 && off(face) <= tolerance);
        let face = known.unwrap_or_else(|| {
            faces.push(own);
            faces.len() - 1
        });
        depth = depth.max(off(&faces[face]));
        face_of.push(face);
        if faces.len() > ConvexPart::MAX_FACES {
            return None;
        }
    }

    let mut places: Vec<u32> = piece.iter().flat_map(|&triangle| welded.triangles[triangle as usize]).collect();
    places.sort_unstable();
    places.dedup();
    let points: Vec<_> = places.iter().map(|&place| welded.places[place as usize]).collect();
    for face in &faces {
        for &point in &points {
            depth = depth.max(face.signed_distance(point));
        }
        if depth > tolerance {
            return None;
        }
    }

    let mut sorted: Vec<(u32, usize)> = piece.iter().copied().zip(face_of).collect();
    sorted.sort_unstable();
    let face_of = |triangle: u32| sorted[sorted.partition_point(|&(other, _)| other < triangle)].1;
    let index_of = |place: u32| places.partition_point(|&other| other < place) as u32;
    let mut rim = Vec::new();
    let mut sharpest: f64 = 1.0;
    for &(triangle, face) in &sorted {
        for edge in edges(welded.triangles[triangle as usize]) {
            let other = face_of(welded.neighbour(edge)?);
            if edge[0] < edge[1] && face != other {
                rim.push(edge.map(index_of));
                sharpest = sharpest.min(faces[face].normal.dot(faces[other].normal));
            }
        }
    }
    // A depth of 0 stays 0, however sharp.
    let slack = if depth > 0.0 { depth * (2.0 / (1.0 + sharpest)).sqrt().max(2.0) } else { 0.0 };
    let area = piece.iter().map(|&triangle| welded.areas[triangle as usize]).sum();
    // An edge so sharp that the slack is many times the tolerance is no edge to rely on; nor is one that is none.
    (slack <= tolerance * 8.0).then_some(ConvexPart { points, edges: rim, faces, is_closed: true, slack, area })
}
