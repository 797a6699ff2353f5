//! A ray tracer in f64, which predicts pixels.

use std::cell::RefCell;
use std::collections::HashMap;

use drawloom::glam::{DVec2, DVec3};
use drawloom::scene::{Camera, Mesh, Projection};

use crate::markers::Marker;

/// The prediction for a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prediction {
    Background,
    /// A marker, by its index.
    Marker(usize),
    /// An edge is too close to the pixel to predict it.
    Unsure,
}

/// What a picture shows, by the definition of a pinhole camera or of a parallel projection: in f64, and without a
/// [`Camera`] where a test derives one from another.
#[derive(Clone, Copy, Debug)]
pub struct View {
    /// The point in the world that everything below is relative to: near what the view shows, which may be far from the
    /// world's origin.
    pub reference: DVec3,
    /// Where the eye is; without perspective, the centre of the picture.
    pub origin: DVec3,
    /// To the right and upwards, each as long as half the picture; in perspective, at a distance of 1 along the axis.
    pub right: DVec3,
    pub up: DVec3,
    /// The ray of the picture's centre in perspective, and the axis of a parallel projection.
    pub forward: DVec3,
    pub is_perspective: bool,
    /// Nothing is visible at a smaller distance along the axis.
    pub near: f64,
    /// Only what is in front of it is visible: a point and a normal.
    pub clip_plane: Option<[DVec3; 2]>,
    /// The whole picture, in pixels, and where in it the upper left corner of this one is.
    pub whole: [f64; 2],
    pub corner: [f64; 2],
}

impl View {
    /// What a camera that was not derived from another one shows: it has no lens shift, and no clip plane.
    pub fn of(camera: &Camera) -> Self {
        let turn = camera.orientation.as_dquat().normalize();
        let [width, height] = camera.size.map(f64::from);
        let (half, is_perspective) = match camera.projection {
            Projection::Perspective { field_of_view } => ((f64::from(field_of_view) * 0.5).tan(), true),
            Projection::Orthographic { height } => (f64::from(height) * 0.5, false),
            other => unreachable!("no main camera is {other:?}"),
        };
        Self {
            reference: camera.position,
            origin: DVec3::ZERO,
            right: turn * DVec3::X * (half * width / height),
            up: turn * DVec3::Y * half,
            forward: turn * DVec3::NEG_Z,
            is_perspective,
            near: f64::from(camera.near),
            clip_plane: None,
            whole: [width, height],
            corner: [0.0; 2],
        }
    }

    /// With all directions turned, or mirrored.
    pub fn turned(self, turn: impl Fn(DVec3) -> DVec3) -> Self {
        let [right, up, forward] = [self.right, self.up, self.forward].map(turn);
        Self { right, up, forward, ..self }
    }

    /// The origin and the direction of the ray through a point of the picture, in pixels from its upper left corner.
    /// The direction has length 1 along the axis.
    pub fn ray(&self, x: f64, y: f64) -> [DVec3; 2] {
        let [x, y] = [x + self.corner[0], y + self.corner[1]];
        let aside = self.right * (x / self.whole[0] * 2.0 - 1.0) + self.up * (1.0 - y / self.whole[1] * 2.0);
        if self.is_perspective { [self.origin, aside + self.forward] } else { [self.origin + aside, self.forward] }
    }

    /// Where a point is in the picture, given relative to the reference, in pixels, and how far away along the axis.
    pub fn project(&self, point: DVec3) -> (DVec2, f64) {
        let offset = point - self.origin;
        let axis = self.right.cross(self.up).normalize();
        let axis = axis * axis.dot(self.forward).signum();
        let depth = axis.dot(offset) / axis.dot(self.forward);
        let aside = if self.is_perspective { offset / depth - self.forward } else { offset };
        let [x, y] = [self.right, self.up].map(|half| aside.dot(half) / half.length_squared());
        let pixel = DVec2::new((x * 0.5 + 0.5) * self.whole[0], (0.5 - y * 0.5) * self.whole[1]);
        (pixel - DVec2::from(self.corner), depth)
    }
}

/// Predicts which marker each pixel of a view shows.
pub struct Oracle {
    view: View,
    /// Front-facing triangles: corners relative to the view's reference, and the index of the marker.
    triangles: Vec<([DVec3; 3], usize)>,
    margin: f64,
    /// What rays hit, by the bits of their points in the picture: with a margin of a pixel, those of neighbouring
    /// pixels are the same.
    hits: RefCell<HashMap<[u64; 2], Option<usize>>>,
}

impl Oracle {
    /// `margin` is the smallest distance of a predictable pixel from an edge, in pixels.
    pub fn new(view: View, mesh: &Mesh, markers: &[Marker], margin: f64) -> Self {
        let mut triangles = Vec::new();
        for (index, marker) in markers.iter().enumerate() {
            let mirrored =
                marker.scale.to_array().into_iter().filter(|scale| scale.is_sign_negative()).count() % 2 == 1;
            for corners in mesh.indices().as_chunks::<3>().0 {
                let position = |corner: u32| marker.corner(view.reference, mesh, corner);
                let [a, b, c] = corners.map(position);
                let normal = (b - a).cross(c - a) * if mirrored { -1.0 } else { 1.0 };
                let to_eye = if view.is_perspective { view.origin - a } else { -view.forward };
                if marker.double_sided || normal.dot(to_eye) > 0.0 {
                    triangles.push(([a, b, c], index));
                }
            }
        }
        Self { view, triangles, margin, hits: RefCell::default() }
    }

    /// The prediction for the pixel in column `x` and row `y`.
    pub fn predict(&self, x: usize, y: usize) -> Prediction {
        let margin = self.margin;
        let at = |across: f64, down: f64| {
            let point = [x as f64 + 0.5 + across * margin, y as f64 + 0.5 + down * margin];
            let mut hits = self.hits.borrow_mut();
            *hits.entry(point.map(f64::to_bits)).or_insert_with(|| self.hit(point))
        };
        let middle = at(0.0, 0.0);
        let around =
            [[-1.0, -1.0], [0.0, -1.0], [1.0, -1.0], [-1.0, 0.0], [1.0, 0.0], [-1.0, 1.0], [0.0, 1.0], [1.0, 1.0]];
        if around.iter().any(|&[across, down]| at(across, down) != middle) {
            return Prediction::Unsure;
        }
        middle.map_or(Prediction::Background, Prediction::Marker)
    }

    /// The marker that the ray through a point of the picture hits first.
    fn hit(&self, [x, y]: [f64; 2]) -> Option<usize> {
        let [origin, direction] = self.view.ray(x, y);
        let is_visible = |depth: f64| {
            let point = origin + direction * depth;
            let is_clipped = self.view.clip_plane.is_some_and(|[of_plane, normal]| normal.dot(point - of_plane) < 0.0);
            depth >= self.view.near && !is_clipped
        };
        let hits = self
            .triangles
            .iter()
            .filter_map(|(corners, marker)| Some((intersect(origin, direction, corners)?, *marker)));
        let visible = hits.filter(|(depth, _)| is_visible(*depth));
        visible.min_by(|one, other| one.0.total_cmp(&other.0)).map(|(_, marker)| marker)
    }
}

/// The tolerance at the edges of triangles, in barycentric coordinates: no ray passes between two triangles.
const EDGE_TOLERANCE: f64 = 1e-10;

/// The ray parameter of an intersection (Möller and Trumbore 1997).
fn intersect(origin: DVec3, direction: DVec3, &[a, b, c]: &[DVec3; 3]) -> Option<f64> {
    let (one, other) = (b - a, c - a);
    let across = direction.cross(other);
    let determinant = one.dot(across);
    if determinant == 0.0 {
        return None;
    }
    let offset = origin - a;
    let u = offset.dot(across) / determinant;
    let up = offset.cross(one);
    let v = direction.dot(up) / determinant;
    let inside = u >= -EDGE_TOLERANCE && v >= -EDGE_TOLERANCE && u + v <= 1.0 + EDGE_TOLERANCE;
    inside.then(|| other.dot(up) / determinant)
}
