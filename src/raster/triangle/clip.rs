//! Clips triangles against the planes of clip space (Sutherland and Hodgman 1974).

use std::array::from_fn;

use crate::raster::{Real, Vector4};

/// A corner: its clip-space position, and the varyings to interpolate.
pub(super) type ClipCorner<R, const V: usize> = (Vector4<R>, [R; V]);

/// What becomes of the part of a triangle that is in front of the near plane.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NearPlane {
    /// It is not drawn.
    Clips,
    /// Its pixels are drawn with the depth of the plane: a device's `unclipped_depth`.
    Clamps,
}

/// How a triangle lies relative to the planes of clip space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Overlap {
    /// It is invisible.
    Outside,
    /// It needs no clipping.
    Inside,
    /// It must be clipped.
    Across,
}

/// The guard band's size as a multiple of the picture's: triangles beyond the picture's edges are clipped only where
/// they exceed the guard band. In the largest picture it ends 2²⁷ steps away, within
/// [`MAX_COORDINATE`](super::grid::MAX_COORDINATE).
const GUARD_BAND: f64 = 64.0;

/// The near plane, the far plane, and the four sides.
const PLANES: usize = 6;

/// Classifies a triangle. One with a corner that is not finite is outside.
pub(super) fn classify<R: Real, const V: usize>(corners: &[ClipCorner<R, V>; 3], near_plane: NearPlane) -> Overlap {
    let is_finite = |(clip, _): &ClipCorner<R, V>| clip.0.iter().all(|number| number.is_finite());
    let outside = |clip, band| outside_planes(clip, band, near_plane);
    let outside_all = |band| corners.iter().fold(u32::MAX, |planes, (clip, _)| planes & outside(clip, band));
    let outside_any = |band| corners.iter().fold(0, |planes, (clip, _)| planes | outside(clip, band));
    if !corners.iter().all(is_finite) || outside_all(1.0) != 0 {
        Overlap::Outside
    } else if outside_any(GUARD_BAND) == 0 {
        Overlap::Inside
    } else {
        Overlap::Across
    }
}

/// The part of a triangle within the near plane, the far plane and the guard band: the corners of a polygon.
///
/// An intersection does not depend on the edge's direction, so two triangles with a common edge are clipped at
/// bit-identical points.
pub(super) fn clip<R: Real, const V: usize>(
    corners: &[ClipCorner<R, V>; 3],
    near_plane: NearPlane,
) -> Vec<ClipCorner<R, V>> {
    let mut polygon = corners.to_vec();
    let mut clipped = Vec::with_capacity(3 + PLANES);
    for plane in first_plane(near_plane)..PLANES {
        clipped.clear();
        let distance = |corner: &ClipCorner<R, V>| distances(&corner.0, GUARD_BAND)[plane];
        for (index, end) in polygon.iter().enumerate() {
            let start = &polygon[index.checked_sub(1).unwrap_or(polygon.len() - 1)];
            let [from, to] = [start, end].map(distance);
            if from >= R::zero() && to < R::zero() {
                clipped.push(between(start, end, [from, to]));
            } else if from < R::zero() && to >= R::zero() {
                clipped.push(between(end, start, [to, from]));
            }
            if to >= R::zero() {
                clipped.push(*end);
            }
        }
        std::mem::swap(&mut polygon, &mut clipped);
    }
    polygon
}

/// The first of the planes that clip.
fn first_plane(near_plane: NearPlane) -> usize {
    match near_plane {
        NearPlane::Clips => 0,
        NearPlane::Clamps => 1,
    }
}

/// A mask of the planes that a point is outside of.
fn outside_planes<R: Real>(clip: &Vector4<R>, band: f64, near_plane: NearPlane) -> u32 {
    distances(clip, band)[first_plane(near_plane)..]
        .iter()
        .fold(0, |planes, &distance| planes << 1 | u32::from(distance < R::zero()))
}

/// A point's distances inside all planes, the side planes scaled by `band`. The signs are exact, because `band` is a
/// power of 2.
fn distances<R: Real>(clip: &Vector4<R>, band: f64) -> [R; PLANES] {
    let [x, y, z, w] = clip.0;
    let [x, y] = [x, y].map(|coordinate| coordinate * R::of(1.0 / band));
    [w - z, z, w - x, w + x, w - y, w + y]
}

/// The intersection of a plane and an edge between a corner inside and one outside, given their distances.
fn between<R: Real, const V: usize>(
    inside: &ClipCorner<R, V>,
    outside: &ClipCorner<R, V>,
    [inner, outer]: [R; 2],
) -> ClipCorner<R, V> {
    // Interpolates from the corner nearer to the plane, which loses the least precision if the other is far away.
    let (near, far, share) = if inner < -outer {
        (inside, outside, inner / (inner - outer))
    } else {
        (outside, inside, outer / (outer - inner))
    };
    let along = |near: R, far: R| {
        let change = far - near;
        // The difference of two finite numbers may overflow.
        if change.is_finite() { near + change * share } else { near * (R::one() - share) + far * share }
    };
    (near.0.with(far.0, along), from_fn(|index| along(near.1[index], far.1[index])))
}
