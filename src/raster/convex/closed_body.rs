//! Closed convex bodies.

use super::welded_mesh::{WeldedMesh, edges};
use super::{ConvexPart, Plane};

/// Converts a connected component; `None` if it is not closed and convex. It is closed if every edge has a triangle on
/// either side, and convex if no corner is farther outside any triangle's plane than the tolerance.
///
/// **The outline's error.** Let no corner be farther outside any face than δ. From any viewpoint, an edge of the
/// outline lies between a front face with the normal n₁ and a back face with n₂. The plane through the eye and the edge
/// has a normal n = α n₁ + β n₂ with α, β ≥ 0, so no corner is farther outside it than (α + β) δ. From |n| = 1 and c =
/// n₁ · n₂ follows 1 = (α + β)² − 2αβ(1 − c) ≥ (α + β)² (1 + c) / 2, so α + β ≤ √(2 / (1 + c)): the sharper an edge,
/// the larger the error. The component's outline is within that distance of the outline of all its corners.
///
/// **The depth's error.** A ray that meets the component enters it through a front-facing triangle, which is at most δ
/// behind its face. Triangles that are in one plane to within δ share a face. If one of them is front-facing and the
/// face is not, the plane through the eye and the triangle supports the component to within 2δ, so the triangle is at
/// the outline.
pub(super) fn closed_body(welded: &WeldedMesh, component: &[u32], tolerance: f64) -> Option<ConvexPart> {
    let mut faces: Vec<Plane> = Vec::new();
    let mut max_deviation: f64 = 0.0;
    let mut face_of = Vec::with_capacity(component.len());
    for &triangle in component {
        let corners = welded.corners(triangle);
        let own = welded.faces[triangle as usize];
        let deviation =
            |face: &Plane| corners.map(|corner| face.signed_distance(corner).abs()).into_iter().fold(0.0, f64::max);
        let existing = faces.iter().position(|face| face.normal.dot(own.normal) > 0.5 && deviation(face) <= tolerance);
        let face = existing.unwrap_or_else(|| {
            faces.push(own);
            faces.len() - 1
        });
        max_deviation = max_deviation.max(deviation(&faces[face]));
        face_of.push(face);
        if faces.len() > ConvexPart::MAX_FACES {
            return None;
        }
    }

    let mut indices: Vec<u32> = component.iter().flat_map(|&triangle| welded.triangles[triangle as usize]).collect();
    indices.sort_unstable();
    indices.dedup();
    let points: Vec<_> = indices.iter().map(|&index| welded.points[index as usize]).collect();
    for face in &faces {
        for &point in &points {
            max_deviation = max_deviation.max(face.signed_distance(point));
        }
        if max_deviation > tolerance {
            return None;
        }
    }

    let mut sorted: Vec<(u32, usize)> = component.iter().copied().zip(face_of).collect();
    sorted.sort_unstable();
    let face_of = |triangle: u32| sorted[sorted.partition_point(|&(other, _)| other < triangle)].1;
    let local_index = |index: u32| indices.partition_point(|&other| other < index) as u32;
    let mut body_edges = Vec::new();
    let mut min_cosine: f64 = 1.0;
    for &(triangle, face) in &sorted {
        for edge in edges(welded.triangles[triangle as usize]) {
            let other = face_of(welded.neighbour(edge)?);
            if edge[0] < edge[1] && face != other {
                body_edges.push(edge.map(local_index));
                min_cosine = min_cosine.min(faces[face].normal.dot(faces[other].normal));
            }
        }
    }
    // If there is no deviation, the slack is 0, however sharp the edges.
    let slack = if max_deviation > 0.0 { max_deviation * (2.0 / (1.0 + min_cosine)).sqrt().max(2.0) } else { 0.0 };
    let area = component.iter().map(|&triangle| welded.areas[triangle as usize]).sum();
    // Rejects edges so sharp that the slack is many times the tolerance, and NaN.
    (slack <= tolerance * 8.0).then_some(ConvexPart { points, edges: body_edges, faces, is_closed: true, slack, area })
}
