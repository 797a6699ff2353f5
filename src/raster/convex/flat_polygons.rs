//! Flat convex pieces of a surface.

use glam::DVec3;

use super::welded_mesh::{WeldedMesh, edges};
use super::{ConvexPart, Plane};

/// Joins triangles that lie in one plane into convex polygons, as large as come about by taking away the longest edges between
/// them first (after Hertel and Mehlhorn, "Fast triangulation of the plane with respect to simple polygons", 1985).
///
/// Triangles that are wound alike and whose edges cancel but for those of a convex loop cover what the loop encloses just once,
/// so from the side that is seen every ray through the polygon meets one of them. That still holds where each corner is a little
/// off its place, but for rays that pass the loop within as much.
pub(super) fn flat_polygons(welded: &WeldedMesh, piece: &[u32], tolerance: f64, parts: &mut Vec<ConvexPart>) {
    let mut pool = Pool { welded, tolerance, polygons: Vec::new(), owners: vec![0; welded.triangles.len()] };
    for &triangle in piece {
        pool.owners[triangle as usize] = pool.polygons.len();
        let corners = welded.triangles[triangle as usize].to_vec();
        let area = welded.areas[triangle as usize];
        let polygon =
            Polygon { corners, face: welded.faces[triangle as usize], slack: 0.0, area, triangles: vec![triangle] };
        pool.polygons.push(Some(polygon));
    }
    let mut between = Vec::new();
    for &triangle in piece {
        for edge in edges(welded.triangles[triangle as usize]) {
            if let Some(other) = welded.neighbour(edge).filter(|_| edge[0] < edge[1]) {
                let [from, to] = edge.map(|place| welded.places[place as usize]);
                between.push((from.distance_squared(to), edge, triangle, other));
            }
        }
    }
    between.sort_by(|(one, edge, ..), (other, other_edge, ..)| other.total_cmp(one).then(edge.cmp(other_edge)));
    for (_, edge, triangle, other) in between {
        pool.join(edge, pool.owners[triangle as usize], pool.owners[other as usize]);
    }
    for polygon in pool.polygons.into_iter().flatten() {
        let points: Vec<_> = polygon.corners.iter().map(|&place| welded.places[place as usize]).collect();
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

struct Pool<'a> {
    welded: &'a WeldedMesh,
    tolerance: f64,
    /// `None` for those that have become part of another.
    polygons: Vec<Option<Polygon>>,
    /// Which polygon each triangle is in.
    owners: Vec<usize>,
}

struct Polygon {
    /// Counter-clockwise seen from the side that is seen.
    corners: Vec<u32>,
    face: Plane,
    /// How far its corners are from a convex loop in the face's plane.
    slack: f64,
    area: f64,
    triangles: Vec<u32>,
}

impl Pool<'_> {
    /// Makes one of two polygons that share an edge, which is the first one's in this direction, if that is convex and flat.
    fn join(&mut self, edge: [u32; 2], first: usize, second: usize) {
        if first == second {
            return;
        }
        let [Some(one), Some(other)] = [&self.polygons[first], &self.polygons[second]] else { return };
        if one.face.normal.dot(other.face.normal) < 0.5 {
            return;
        }
        let Some(corners) = joined(&one.corners, &other.corners, edge) else { return };
        let face = if one.area >= other.area { one.face } else { other.face };
        let Some(slack) = self.slack(&corners, &face) else { return };
        let (Some(one), Some(other)) = (self.polygons[first].take(), self.polygons[second].take()) else { return };
        other.triangles.iter().for_each(|&triangle| self.owners[triangle as usize] = first);
        let triangles = [one.triangles, other.triangles].concat();
        self.polygons[first] = Some(Polygon { corners, face, slack, area: one.area + other.area, triangles });
    }

    /// How far a loop's corners are from a convex one in the plane; `None` where that is beyond the tolerance.
    fn slack(&self, corners: &[u32], face: &Plane) -> Option<f64> {
        let places: Vec<DVec3> = corners.iter().map(|&place| self.welded.places[place as usize]).collect();
        let off_plane = places.iter().map(|&place| face.signed_distance(place).abs()).fold(0.0, f64::max);
        let mut off_loop: f64 = 0.0;
        for (&from, &to) in places.iter().zip(places.iter().cycle().skip(1)) {
            let outwards = (to - from).cross(face.normal).try_normalize()?;
            off_loop = places.iter().map(|&place| outwards.dot(place - from)).fold(off_loop, f64::max);
        }
        let off = off_plane.max(off_loop);
        (off <= self.tolerance).then_some(off * 2.0)
    }
}

/// The loop around both of two loops with an edge in common, without what of it runs there and back; `None` where a corner is
/// in it twice, or where it has too many.
fn joined(one: &[u32], other: &[u32], [from, to]: [u32; 2]) -> Option<Vec<u32>> {
    let starting_at = |corners: &[u32], first: u32| {
        let place = corners.iter().position(|&corner| corner == first)?;
        Some([&corners[place..], &corners[..place]].concat())
    };
    // From the edge's end around to its start, and on by way of the other loop, which has the edge the other way round.
    let mut corners = starting_at(one, to)?;
    let way = starting_at(other, from)?;
    if corners.last() != Some(&from) || way.last() != Some(&to) {
        return None;
    }
    corners.extend_from_slice(&way[1..way.len() - 1]);
    let mut place = 0;
    while corners.len() > 3 && place < corners.len() {
        let count = corners.len();
        let [before, after] = [(place + count - 1) % count, (place + 1) % count];
        if corners[before] == corners[after] {
            // The corner is the end of a way there and back; so may be the one before it, then.
            corners.remove(place.max(after));
            corners.remove(place.min(after));
            place = 0;
        } else {
            place += 1;
        }
    }
    let mut sorted = corners.clone();
    sorted.sort_unstable();
    sorted.dedup();
    (sorted.len() == corners.len() && (3..=ConvexPart::MAX_CORNERS).contains(&corners.len())).then_some(corners)
}
