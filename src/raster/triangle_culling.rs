//! Leaves out the triangles of a mesh that would cover no pixel, before a device reads them (S 9.6).

use std::ops::AddAssign;

use super::Vector4;
use super::grid::{self, GridPoint, MAX_PICTURE_SIZE, Winding};

/// How many triangles there were, and how many of them were left out, by the first reason that held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CulledTriangles {
    /// Those looked at.
    pub triangles: usize,
    /// Those of which two corners are at one place.
    pub degenerate: usize,
    /// Those beyond the near plane, the far plane or a side of the picture.
    pub off_screen: usize,
    /// Those wound the way that is left out.
    pub back_facing: usize,
    /// Those between the middles of pixels.
    pub zero_size: usize,
}

impl CulledTriangles {
    /// Those left out.
    pub fn culled(&self) -> usize {
        self.degenerate + self.off_screen + self.back_facing + self.zero_size
    }

    /// The share left out, from 0 to 1; 0 if there was no triangle.
    pub fn share(&self) -> f64 {
        self.culled() as f64 / self.triangles.max(1) as f64
    }
}

impl AddAssign for CulledTriangles {
    fn add_assign(&mut self, other: Self) {
        self.triangles += other.triangles;
        self.degenerate += other.degenerate;
        self.off_screen += other.off_screen;
        self.back_facing += other.back_facing;
        self.zero_size += other.zero_size;
    }
}

/// A mesh's vertex, for [`cull_triangles`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CullVertex {
    /// Where it is in clip space, with reversed depth: what is seen has 0 ≤ z ≤ w. A device may have it elsewhere by 2⁻¹³ of
    /// |x| + |y| + |z| + |w|.
    pub clip: Vector4<f64>,
    /// Whether a device has it less than a 256th of a pixel from where that is in the picture, before it snaps it.
    pub is_accurate: bool,
}

/// Appends to `remaining` the indices of the `triangles` that may cover a pixel of a `picture` of so many pixels to the
/// right and down; in their order, three each. `corners` are the mesh's vertices. `culled`: the winding in the picture that is left out; that of a
/// mirrored object is the other one.
///
/// It never leaves out what a device would have drawn, although the device knows the places in f32 only:
///
/// - **Off-screen** is what has all three corners on the outer side of one plane. A corner is taken for outside only by
///   more than 2⁻¹² of |x| + |y| + |z| + |w|. What a device makes of it may be that wrong: a sum of products in f32 is
///   within some units of 2⁻²⁴ of the sum of their magnitudes, and these may be a thousand times those of the result.
///   If all corners are outside of a plane, so are all points between them, in front of the camera and behind it.
/// - **Degenerate** is what has two corners with the same four numbers: a device puts them at the same place as well.
/// - **Back-facing** and **zero-size** are decided of corners that are [placed](CullVertex::is_accurate), after these are snapped to steps of a 256th of a pixel, in
///   integers, and so that each corner may be a step off along both axes. This holds if a device's corner is less than
///   a step away before it snaps it: the nearest integers of two numbers less than 1 apart are at most 1 apart. Drawn
///   relative to the camera, corners are within 1e-3 pixels, a quarter of a step, unless they are nearer to the camera
///   than their mesh is large. Twice the area, a×b + b×c + c×a, changes by dᵢ×(pᵢ₊₁ − pᵢ₊₂) for a corner that moves by
///   dᵢ, at most by the opposite edge's extent along x plus that along y, and by dᵢ×dⱼ for two that do, at most 2 for
///   each of the three pairs. So what is wound the wrong way by more than the extents of the edges + 6 is so on the
///   device. What covers a pixel has its middle in the rectangle around its corners. So nothing is drawn of what has
///   none in that rectangle, a step larger on each side. Neither is asked of a triangle that a device may clip, as
///   parts of it could turn over: if a corner is not clearly within the near plane (with w ≤ 0 it is not), the far
///   plane, and twice the width and height of the picture. It is within a far plane that is infinitely far away if z is
///   the same at all three corners: then it is a constant, and the device's as well.
///
/// So what has exactly no area after snapping is kept if its corners differ and its rectangle has a pixel's middle: a
/// step farther, it has one. Triangles with an index beyond `corners`, or a corner that is not finite, are kept too: it is
/// for who draws to refuse them.
pub fn cull_triangles(
    corners: &[CullVertex],
    triangles: impl Iterator<Item = [u32; 3]>,
    picture: [usize; 2],
    culled: Option<Winding>,
    remaining: &mut Vec<u32>,
) -> CulledTriangles {
    let corners: Vec<_> = corners.iter().map(|corner| Corner::new(corner, picture)).collect();
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

/// How far a device's clip space may be off: see [`cull_triangles`].
const CLIP_MARGIN: f64 = 1.0 / 4096.0;

/// The narrowest guard band of a device: Mesa's, which is twice as wide and as high as the picture.
const GUARD_BAND: f64 = 2.0;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reason {
    Degenerate,
    OffScreen,
    BackFacing,
    ZeroSize,
}

/// What there is to know of a corner.
struct Corner {
    clip: [f64; 4],
    /// A bit for each plane of the picture's that it is clearly outside of.
    outside: u8,
    is_within_far_plane: bool,
    /// Where it is in the picture, if no other plane clips a triangle because of it.
    place: Option<GridPoint>,
}

impl Corner {
    /// None if it is not finite.
    fn new(&CullVertex { clip, is_accurate }: &CullVertex, picture: [usize; 2]) -> Option<Self> {
        let [x, y, z, w] = clip.0;
        // Of numbers so large that this is infinite nothing is decided: the comparisons below are false then.
        let margin = CLIP_MARGIN * (x.abs() + y.abs() + z.abs() + w.abs());
        let planes = [w - z, z, w - x, w + x, w - y, w + y];
        let outside = planes.iter().fold(0, |outside, &distance| outside << 1 | u8::from(distance < -margin));
        let band = GUARD_BAND * w - margin;
        let is_within = w > 0.0 && w - z > margin && x.abs() < band && y.abs() < band;
        let is_drawable = is_accurate && is_within && picture.iter().all(|&side| side <= MAX_PICTURE_SIZE);
        let place = is_drawable.then(|| grid::snap(&clip, picture));
        let is_finite = clip.0.iter().all(|number| number.is_finite());
        is_finite.then_some(Self { clip: clip.0, outside, is_within_far_plane: z > margin, place })
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
    let places = [a.place?, b.place?, c.place?];
    if is_surely(culled, places) {
        Some(Reason::BackFacing)
    } else if is_between_middles(places) {
        Some(Reason::ZeroSize)
    } else {
        None
    }
}

/// Whether it is wound the way that is left out, wherever within a step its corners are.
fn is_surely(culled: Option<Winding>, places: [GridPoint; 3]) -> bool {
    let area = grid::doubled_area(places);
    let [a, b, c] = places;
    let extent = |from: GridPoint, to: GridPoint| (to[0] - from[0]).abs() + (to[1] - from[1]).abs();
    let change = extent(a, b) + extent(b, c) + extent(c, a) + 6;
    area.abs() > change && culled == Winding::of_area(area)
}

/// Whether there is no pixel's middle in the rectangle around the corners, wherever within a step they are.
fn is_between_middles(places: [GridPoint; 3]) -> bool {
    [0, 1].into_iter().any(|axis| {
        let [a, b, c] = places.map(|place| place[axis]);
        grid::pixel_centers(a.min(b).min(c) - 1, a.max(b).max(c) + 1).is_empty()
    })
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests;
