//! Flat convex polygons of a surface.

use glam::DVec3;

use super::welded_mesh::{WeldedMesh, edges};
use super::{ConvexPart, Plane};

/// Merges coplanar triangles into convex polygons by removing shared edges, the longest first (after Hertel and
/// Mehlhorn, "Fast triangulation of the plane with respect to simple polygons", 1985).
///
/// Triangles of one winding whose edges cancel except for those of a convex loop cover the loop's interior exactly
/// once, so every ray through the polygon from the front meets one of them. If corners deviate from the plane a little,
/// this holds for all rays but those within that deviation of the loop.
pub(super) fn flat_polygons(welded: &WeldedMesh, component: &[u32], tolerance: f64, parts: &mut Vec<ConvexPart>) {
    let mut pool = Pool { welded, tolerance, polygons: Vec::new(), owners: vec![0; welded.triangles.len()] };
    for &triangle in component {
        pool.owners[triangle as usize] = pool.polygons.len();
        let corners = welded.triangles[triangle as usize].to_vec();
        let area = welded.areas[triangle as usize];
        let polygon =
            Polygon { corners, face: welded.faces[triangle as usize], slack: 0.0, area, triangles: vec![triangle] };
        pool.polygons.push(Some(polygon));
    }
    let mut shared_edges = Vec::new();
    for &triangle in component {
        for edge in edges(welded.triangles[triangle as usize]) {
            if let Some(other) = welded.neighbour(edge).filter(|_| edge[0] < edge[1]) {
                let [from, to] = edge.map(|index| welded.points[index as usize]);
                shared_edges.push((from.distance_squared(to), edge, triangle, other));
            }
        }
    }
    shared_edges.sort_by(|(one, edge, ..), (other, other_edge, ..)| other.total_cmp(one).then(edge.cmp(other_edge)));
    for (_, edge, triangle, other) in shared_edges {
        pool.merge(edge, pool.owners[triangle as usize], pool.owners[other as usize]);
    }
    for polygon in pool.polygons.into_iter().flatten() {
        let points: Vec<_> = polygon.corners.iter().map(|&index| welded.points[index as usize]).collect();
        let count = points.len() as u32;
        parts.push(ConvexPart {
            points,
            edges: (0..count).map(|corner| [corner, (corner + 1) % count]).collect(),
            faces: vec![polygon.face],
            is_closed: false,
            slack: polygon.slack,
            area: polygon.area,
        });
    }
}

/// The polygons during merging.
struct Pool<'a> {
    welded: &'a WeldedMesh,
    tolerance: f64,
    /// `None` for those that were merged into another.
    polygons: Vec<Option<Polygon>>,
    /// The index of each triangle's polygon.
    owners: Vec<usize>,
}

struct Polygon {
    /// Indices of points, counter-clockwise seen from the front.
    corners: Vec<u32>,
    face: Plane,
    /// A bound of the corners' distance from a convex loop in the face's plane.
    slack: f64,
    area: f64,
    triangles: Vec<u32>,
}

impl Pool<'_> {
    /// Merges two polygons that share an edge, given in the first one's direction, if the result is convex and flat.
    fn merge(&mut self, edge: [u32; 2], first: usize, second: usize) {
        if first == second {
            return;
        }
        let [Some(one), Some(other)] = [&self.polygons[first], &self.polygons[second]] else { return };
        if one.face.normal.dot(other.face.normal) < 0.5 {
            return;
        }
        let Some(corners) = merged_loop(&one.corners, &other.corners, edge) else { return };
        let face = if one.area >= other.area { one.face } else { other.face };
        let Some(slack) = self.slack(&corners, &face) else { return };
        let (Some(one), Some(other)) = (self.polygons[first].take(), self.polygons[second].take()) else { return };
        other.triangles.iter().for_each(|&triangle| self.owners[triangle as usize] = first);
        let triangles = [one.triangles, other.triangles].concat();
        self.polygons[first] = Some(Polygon { corners, face, slack, area: one.area + other.area, triangles });
    }

    /// A bound of the corners' distance from a convex loop in a plane; `None` if it exceeds the tolerance.
    fn slack(&self, corners: &[u32], face: &Plane) -> Option<f64> {
        let points: Vec<DVec3> = corners.iter().map(|&index| self.welded.points[index as usize]).collect();
        let off_plane = points.iter().map(|&point| face.signed_distance(point).abs()).fold(0.0, f64::max);
        let mut off_loop: f64 = 0.0;
        for (&from, &to) in points.iter().zip(points.iter().cycle().skip(1)) {
            let outwards = (to - from).cross(face.normal).try_normalize()?;
            off_loop = points.iter().map(|&point| outwards.dot(point - from)).fold(off_loop, f64::max);
        }
        let deviation = off_plane.max(off_loop);
        (deviation <= self.tolerance).then_some(deviation * 2.0)
    }
}

/// Merges two loops with a common edge, and removes spikes (edges traversed back and forth). `None` if a corner occurs
/// twice, or if there are too many corners.
fn merged_loop(one: &[u32], other: &[u32], [from, to]: [u32; 2]) -> Option<Vec<u32>> {
    let starting_at = |corners: &[u32], first: u32| {
        let start = corners.iter().position(|&corner| corner == first)?;
        Some([&corners[start..], &corners[..start]].concat())
    };
    // The first loop from the edge's end to its start, then the second loop, which has the edge in the opposite
    // direction.
    let mut corners = starting_at(one, to)?;
    let second = starting_at(other, from)?;
    if corners.last() != Some(&from) || second.last() != Some(&to) {
        return None;
    }
    corners.extend_from_slice(&second[1..second.len() - 1]);
    let mut index = 0;
    while corners.len() > 3 && index < corners.len() {
        let count = corners.len();
        let [before, after] = [(index + count - 1) % count, (index + 1) % count];
        if corners[before] == corners[after] {
            // This corner is the tip of a spike; after its removal, the previous corner may be one, too.
            corners.remove(index.max(after));
            corners.remove(index.min(after));
            index = 0;
        } else {
            index += 1;
        }
    }
    let mut sorted = corners.clone();
    sorted.sort_unstable();
    sorted.dedup();
    (sorted.len() == corners.len() && (3..=ConvexPart::MAX_CORNERS).contains(&corners.len())).then_some(corners)
}
