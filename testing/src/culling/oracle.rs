//! A frustum oracle in f64.

use drawloom::glam::{DMat3, DVec3};
use drawloom::scene::{Camera, Projection, ViewKind};

/// The six planes of a camera in f64.
///
/// Its error is that of some thirty operations with a relative error of 2⁻⁵³ each: less than 1e-14 of the sum of the
/// operands, which is a ten-millionth of the error of f32. Bounds that close to a plane are not classified.
pub struct Oracle {
    position: DVec3,
    /// Right, up and forward.
    axes: DMat3,
    edges: [Edge; 2],
    near: f64,
    far: f64,
}

/// Two opposite edges of the picture. Points with `sine · along + offset ≥ cosine · |across|` are between them.
struct Edge {
    sine: f64,
    cosine: f64,
    offset: f64,
}

/// The position of a bounding volume relative to the frustum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Classification {
    /// A part of it is inside of every plane.
    Inside,
    /// All of it is outside of a plane.
    Outside,
    /// It touches a plane to within the error of f64.
    Touching,
}

impl Oracle {
    pub fn new(camera: &Camera) -> Self {
        let turn = DMat3::from_quat(camera.orientation.as_dquat().normalize());
        let aspect = f64::from(camera.size[0]) / f64::from(camera.size[1]);
        let (near, far) = (f64::from(camera.near), f64::from(camera.far));
        let straight = |offset: f64| Edge { sine: 0.0, cosine: 1.0, offset };
        let (edges, near) = match camera.projection {
            Projection::Perspective { field_of_view } => {
                let half = f64::from(field_of_view) * 0.5;
                let edge = |angle: f64| Edge { sine: angle.sin(), cosine: angle.cos(), offset: 0.0 };
                ([edge((half.tan() * aspect).atan()), edge(half)], near)
            }
            Projection::Orthographic { height } => {
                let half = f64::from(height) * 0.5;
                let near = if camera.kind == ViewKind::Shadow { f64::NEG_INFINITY } else { near };
                ([straight(half * aspect), straight(half)], near)
            }
            // A half-sphere, within a box that begins a little behind it.
            _ => ([straight(far), straight(far)], -0.05 * far),
        };
        let axes = DMat3::from_cols(turn.x_axis, turn.y_axis, -turn.z_axis);
        Self { position: camera.position, axes, edges, near, far }
    }

    /// A world position relative to the camera.
    pub fn relative(&self, position: DVec3) -> DVec3 {
        position - self.position
    }

    /// The planes' inward normals: right, left, top, bottom, near, far.
    pub fn normals(&self) -> [DVec3; 6] {
        let DMat3 { x_axis, y_axis, z_axis } = self.axes;
        let normal = |edge: &Edge, axis: DVec3, sign: f64| z_axis * edge.sine + axis * (edge.cosine * sign);
        let [sides, ends] = &self.edges;
        let [right, left] = [-1.0, 1.0].map(|sign| normal(sides, x_axis, sign));
        let [upper, lower] = [-1.0, 1.0].map(|sign| normal(ends, y_axis, sign));
        [right, left, upper, lower, z_axis, -z_axis]
    }

    /// The distance of a point relative to the camera from each plane, positive inside.
    pub fn depths(&self, point: DVec3) -> [f64; 6] {
        let local = self.axes.transpose() * point;
        let depth = |edge: &Edge, across: f64| edge.sine * local.z - edge.cosine * across + edge.offset;
        let [sides, ends] = &self.edges;
        let [right, left] = [local.x, -local.x].map(|across| depth(sides, across));
        let [upper, lower] = [local.y, -local.y].map(|across| depth(ends, across));
        [right, left, upper, lower, local.z - self.near, self.far - local.z]
    }

    /// Classifies a volume around a point relative to the camera. `reaches` is its extent towards each plane, `size`
    /// that in any direction.
    pub fn classify(&self, center: DVec3, reaches: [f64; 6], size: f64) -> Classification {
        let offsets = [self.edges[0].offset, self.edges[1].offset, self.near, self.far];
        let known = offsets.map(|offset| if offset.is_finite() { offset.abs() } else { 0.0 });
        let error = 1e-14 * (center.abs().element_sum() + size + known.iter().fold(0.0, |max, &one| one.max(max)));
        let depths = self.depths(center);
        let min = depths.iter().zip(reaches).map(|(depth, reach)| depth + reach).fold(f64::INFINITY, f64::min);
        match min {
            _ if min > error => Classification::Inside,
            _ if min < -error => Classification::Outside,
            _ => Classification::Touching,
        }
    }

    /// A point relative to the camera, at a distance of `reaches` outside of the selected planes. No two of them may be
    /// opposite. `along` and `across` give the other coordinates, the latter as fractions of the picture.
    pub fn touching(&self, selected: [bool; 6], reaches: [f64; 6], along: f64, across: [f64; 2]) -> DVec3 {
        let along = match selected {
            [.., true, _] if self.near.is_finite() => self.near - reaches[4],
            [.., true] if self.far.is_finite() => self.far + reaches[5],
            _ => along,
        };
        let across = |pair: usize| {
            let edge = &self.edges[pair];
            let middle = edge.sine * along + edge.offset;
            match [selected[pair * 2], selected[pair * 2 + 1]] {
                [true, _] => (middle + reaches[pair * 2]) / edge.cosine,
                [_, true] => -(middle + reaches[pair * 2 + 1]) / edge.cosine,
                _ => across[pair] * middle / edge.cosine,
            }
        };
        self.axes * DVec3::new(across(0), across(1), along)
    }

    /// The world position of a point relative to the camera, rounded to f64.
    pub fn world(&self, relative: DVec3) -> DVec3 {
        self.position + relative
    }
}
