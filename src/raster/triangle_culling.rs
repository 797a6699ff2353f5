//! Culls the triangles of a mesh that cover no pixel, before a device reads them (S 9.6).

use super::Vector4;
use super::culled_triangles::CulledTriangles;
use super::grid::{self, GridPoint, MAX_PICTURE_SIZE, Winding};

/// A vertex for [`cull_triangles`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CullVertex {
    /// The clip-space position, with reversed depth: visible points have 0 ≤ z ≤ w. A device's position may differ by
    /// 2⁻¹³ of |x| + |y| + |z| + |w|.
    pub clip: Vector4<f64>,
    /// Whether a device's position in the picture, before snapping, differs by less than a 256th of a pixel.
    pub is_accurate: bool,
}

/// Appends to `remaining` the indices, three each and in order, of the `triangles` that may cover a pixel of a
/// `picture` of that width and height in pixels. `vertices` are the mesh's vertices. `culled` is the winding to cull;
/// for a mirrored object it is the other one.
///
/// The result is conservative: no triangle that a device would draw is culled, although the device has positions in f32
/// only:
///
/// - **Off-screen**: all three corners are on the outer side of one plane. A corner counts as outside only by more than
///   2⁻¹² of |x| + |y| + |z| + |w|. A device's error may be that large: a sum of products in f32 is within some units
///   of 2⁻²⁴ of the sum of their magnitudes, and these may be a thousand times the result's. If all corners are outside
///   a plane, so are all points between them, in front of the camera and behind it.
/// - **Degenerate**: two corners have the same four coordinates, so they coincide on the device as well.
/// - **Back-facing** and **zero-size** are decided only for [accurate](CullVertex::is_accurate) corners. They are
///   snapped to steps of a 256th of a pixel, and tested in integers such that each corner may be a step off along both
///   axes. That suffices if a device's corner is less than a step away before it is snapped: the nearest integers of
///   two numbers less than 1 apart are at most 1 apart. With camera-relative transforms, corners are within 1e-3
///   pixels, a quarter of a step, unless they are nearer to the camera than their mesh is large. Twice the area, a×b +
///   b×c + c×a, changes by dᵢ×(pᵢ₊₁ − pᵢ₊₂) if one corner moves by dᵢ, at most by the opposite edge's extent along x
///   plus that along y, and by dᵢ×dⱼ if two move, at most 2 for each of the three pairs. So if twice the area exceeds
///   the extents of the edges + 6, the device finds the same winding. A covered pixel has its centre in the bounding
///   rectangle of the corners. So nothing is drawn if that rectangle, enlarged by a step on each side, contains no
///   pixel centre. Neither test applies to a triangle that a device may clip, because parts of it could turn over: that
///   is, if a corner is not certainly inside the near plane (with w ≤ 0 it is not), the far plane, and twice the
///   picture's width and height. All corners are inside a far plane at infinity if they have the same z: then z is a
///   constant, on the device as well.
///
/// So a triangle whose area is exactly 0 after snapping is kept if its corners differ and a pixel centre is in its
/// bounding rectangle: a step further, its area is not 0. Triangles with an index beyond `vertices`, or with a corner
/// that is not finite, are kept, too: the caller decides whether to reject them.
pub fn cull_triangles(
    vertices: &[CullVertex],
    triangles: impl Iterator<Item = [u32; 3]>,
    picture: [usize; 2],
    culled: Option<Winding>,
    remaining: &mut Vec<u32>,
) -> CulledTriangles {
    let corners: Vec<_> = vertices.iter().map(|vertex| Corner::new(vertex, picture)).collect();
    let corner = |index| corners.get(index as usize)?.as_ref();
    let mut counts = CulledTriangles::default();
    for triangle in triangles {
        counts.triangles += 1;
        let reason = match triangle.map(corner) {
            [Some(a), Some(b), Some(c)] => reason([a, b, c], culled),
            _ => None,
        };
        match reason {
            None => remaining.extend(triangle),
            Some(Reason::Degenerate) => counts.degenerate += 1,
            Some(Reason::OffScreen) => counts.off_screen += 1,
            Some(Reason::BackFacing) => counts.back_facing += 1,
            Some(Reason::ZeroSize) => counts.zero_size += 1,
        }
    }
    counts
}

/// The error that a device's clip-space positions may have: see [`cull_triangles`].
const CLIP_TOLERANCE: f64 = 1.0 / 4096.0;

/// The smallest guard band of a device, Mesa's: twice the picture's width and height.
const GUARD_BAND: f64 = 2.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reason {
    Degenerate,
    OffScreen,
    BackFacing,
    ZeroSize,
}

/// A vertex prepared for the tests.
struct Corner {
    clip: [f64; 4],
    /// A mask of the planes that it is certainly outside of.
    outside: u8,
    is_within_far_plane: bool,
    /// Its snapped position, if it is accurate and no plane except the far plane can clip a triangle because of it.
    snapped: Option<GridPoint>,
}

impl Corner {
    /// `None` if a coordinate is not finite.
    fn new(&CullVertex { clip, is_accurate }: &CullVertex, picture: [usize; 2]) -> Option<Self> {
        let [x, y, z, w] = clip.0;
        // If this overflows to infinity, the comparisons below are false, so nothing is decided.
        let margin = CLIP_TOLERANCE * (x.abs() + y.abs() + z.abs() + w.abs());
        let planes = [w - z, z, w - x, w + x, w - y, w + y];
        let outside = planes.iter().fold(0, |outside, &distance| outside << 1 | u8::from(distance < -margin));
        let band = GUARD_BAND * w - margin;
        let is_within = w > 0.0 && w - z > margin && x.abs() < band && y.abs() < band;
        let is_drawable = is_accurate && is_within && picture.iter().all(|&side| side <= MAX_PICTURE_SIZE);
        let snapped = is_drawable.then(|| grid::snap(&clip, picture));
        let is_finite = clip.0.iter().all(|number| number.is_finite());
        is_finite.then_some(Self { clip: clip.0, outside, is_within_far_plane: z > margin, snapped })
    }
}

fn reason([a, b, c]: [&Corner; 3], culled: Option<Winding>) -> Option<Reason> {
    if a.clip == b.clip || b.clip == c.clip || c.clip == a.clip {
        return Some(Reason::Degenerate);
    }
    if a.outside & b.outside & c.outside != 0 {
        return Some(Reason::OffScreen);
    }
    let corners = [a, b, c];
    let is_constant = |z: f64| z > 0.0 && corners.iter().all(|corner| corner.clip[2] == z);
    if !corners.iter().all(|corner| corner.is_within_far_plane) && !is_constant(a.clip[2]) {
        return None;
    }
    let points = [a.snapped?, b.snapped?, c.snapped?];
    if is_certainly_culled(culled, points) {
        Some(Reason::BackFacing)
    } else if covers_no_center(points) {
        Some(Reason::ZeroSize)
    } else {
        None
    }
}

/// Whether the winding is the culled one, even if corners move by a step.
fn is_certainly_culled(culled: Option<Winding>, points: [GridPoint; 3]) -> bool {
    let area = grid::doubled_area(points);
    let [a, b, c] = points;
    let extent = |from: GridPoint, to: GridPoint| (to[0] - from[0]).abs() + (to[1] - from[1]).abs();
    let change = extent(a, b) + extent(b, c) + extent(c, a) + 6;
    area.abs() > change && culled == Winding::of_area(area)
}

/// Whether no pixel centre is in the corners' bounding rectangle, even if they move by a step.
fn covers_no_center(points: [GridPoint; 3]) -> bool {
    [0, 1].into_iter().any(|axis| {
        let [a, b, c] = points.map(|point| point[axis]);
        grid::pixel_centers(a.min(b).min(c) - 1, a.max(b).max(c) + 1).is_empty()
    })
}

#[cfg(test)]
mod tests;
