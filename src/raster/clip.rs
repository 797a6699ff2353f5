//! Cuts triangles along the planes of clip space (Sutherland and Hodgman 1974).

use std::array::from_fn;

use super::{Real, Vector4};

/// A corner: where it is in clip space, and numbers to interpolate.
pub(super) type ClipCorner<R, const V: usize> = (Vector4<R>, [R; V]);

/// How a triangle lies to the planes of clip space.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Overlap {
    /// No part of it can be seen.
    Outside,
    /// It can be drawn as it is.
    Inside,
    /// It has to be cut.
    Across,
}

/// How many times as wide and as high as the picture the guard band is: what reaches past the picture's edge is cut
/// only where it reaches past this. In the largest picture that is 2²⁷ steps away, within
/// [`MAX_COORDINATE`](super::grid::MAX_COORDINATE).
const GUARD_BAND: f64 = 64.0;

/// The near plane, the far plane, and the four sides.
const PLANES: usize = 6;

/// How three corners lie. What is not finite cannot be seen.
pub(super) fn classify<R: Real, const V: usize>(corners: &[ClipCorner<R, V>; 3]) -> Overlap {
    let is_finite = |(clip, _): &ClipCorner<R, V>| clip.0.iter().all(|number| number.is_finite());
    let beyond_all = |band| corners.iter().fold(u32::MAX, |beyond, (clip, _)| beyond & outside_planes(clip, band));
    let beyond_any = |band| corners.iter().fold(0, |beyond, (clip, _)| beyond | outside_planes(clip, band));
    if !corners.iter().all(is_finite) || beyond_all(1.0) != 0 {
        Overlap::Outside
    } else if beyond_any(GUARD_BAND) == 0 {
        Overlap::Inside
    } else {
        Overlap::Across
    }
}

/// The part of a triangle within the near plane, the far plane and the guard band: the corners of a polygon.
///
/// A point on an edge is computed from its ends whichever of them comes first, so that two triangles with a common edge
/// are cut at the same place, bit for bit.
pub(super) fn clip<R: Real, const V: usize>(corners: &[ClipCorner<R, V>; 3]) -> Vec<ClipCorner<R, V>> {
    let mut polygon = corners.to_vec();
    let mut cut = Vec::with_capacity(3 + PLANES);
    for plane in 0..PLANES {
        cut.clear();
        let distance = |corner: &ClipCorner<R, V>| distances(&corner.0, GUARD_BAND)[plane];
        for (index, end) in polygon.iter().enumerate() {
            let start = &polygon[index.checked_sub(1).unwrap_or(polygon.len() - 1)];
            let [from, to] = [start, end].map(distance);
            if from >= R::zero() && to < R::zero() {
                cut.push(between(start, end, [from, to]));
            } else if from < R::zero() && to >= R::zero() {
                cut.push(between(end, start, [to, from]));
            }
            if to >= R::zero() {
                cut.push(*end);
            }
        }
        std::mem::swap(&mut polygon, &mut cut);
    }
    polygon
}

/// A bit for each plane that has the place on its outer side.
fn outside_planes<R: Real>(clip: &Vector4<R>, band: f64) -> u32 {
    distances(clip, band).iter().fold(0, |beyond, &distance| beyond << 1 | u32::from(distance < R::zero()))
}

/// How far a place lies within each plane, the sides `band` times as wide as the picture. The sign is exact, as `band`
/// is a power of 2.
fn distances<R: Real>(clip: &Vector4<R>, band: f64) -> [R; PLANES] {
    let [x, y, z, w] = clip.0;
    let [x, y] = [x, y].map(|across| across * R::of(1.0 / band));
    [w - z, z, w - x, w + x, w - y, w + y]
}

/// Where an edge passes a plane: from a corner within to one without, whose distances are given.
fn between<R: Real, const V: usize>(
    within: &ClipCorner<R, V>,
    without: &ClipCorner<R, V>,
    [inner, outer]: [R; 2],
) -> ClipCorner<R, V> {
    // From the end that is nearer to the plane, so that as little as can be is lost of it if the other is far away.
    let (near, far, share) = if inner < -outer {
        (within, without, inner / (inner - outer))
    } else {
        (without, within, outer / (outer - inner))
    };
    let along = |near: R, far: R| {
        let change = far - near;
        // A difference may leave the numbers there are where neither end does.
        if change.is_finite() { near + change * share } else { near * (R::one() - share) + far * share }
    };
    (near.0.with(far.0, along), from_fn(|index| along(near.1[index], far.1[index])))
}
