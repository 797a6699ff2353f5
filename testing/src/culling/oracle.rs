//! What a camera sees, in f64: the judge.

use drawloom::glam::{DMat3, DVec3};
use drawloom::scene::{Camera, Projection, ViewKind};

/// The six planes of a camera, each as far as it goes in f64.
///
/// Its own error is that of some thirty operations of 2⁻⁵³ in terms no larger than what they are made of: 1e-14 of their sum is
/// more than that, and a ten-millionth of what f32 makes of it. What is within that of a plane is not judged.
pub struct Oracle {
    position: DVec3,
    /// To the right, up, and where it looks.
    axes: DMat3,
    edges: [Edge; 2],
    near: f64,
    far: f64,
}

/// Two opposite edges of the picture: what is at `sine · along + offset ≥ cosine · |aside|` is between them.
struct Edge {
    sine: f64,
    cosine: f64,
    offset: f64,
}

/// Where something is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Inside of every plane with some of it.
    Inside,
    /// Outside of a plane as a whole.
    Outside,
    /// It touches a plane: on which side of it, f64 does not tell.
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
            // Half a ball, within a box that begins a little behind it.
            _ => ([straight(far), straight(far)], -0.05 * far),
        };
        let axes = DMat3::from_cols(turn.x_axis, turn.y_axis, -turn.z_axis);
        Self { position: camera.position, axes, edges, near, far }
    }

    /// A place in the world relative to the camera.
    pub fn relative(&self, place: DVec3) -> DVec3 {
        place - self.position
    }

    /// The planes' normals, towards the inside: of the edges two and two, of the near and of the far plane.
    pub fn normals(&self) -> [DVec3; 6] {
        let DMat3 { x_axis, y_axis, z_axis } = self.axes;
        let normal = |edge: &Edge, axis: DVec3, sign: f64| z_axis * edge.sine + axis * (edge.cosine * sign);
        let [sides, ends] = &self.edges;
        let [right, left] = [-1.0, 1.0].map(|sign| normal(sides, x_axis, sign));
        let [upper, lower] = [-1.0, 1.0].map(|sign| normal(ends, y_axis, sign));
        [right, left, upper, lower, z_axis, -z_axis]
    }

    /// How far a place relative to the camera is inside of each plane.
    pub fn depths(&self, place: DVec3) -> [f64; 6] {
        let local = self.axes.transpose() * place;
        let depth = |edge: &Edge, aside: f64| edge.sine * local.z - edge.cosine * aside + edge.offset;
        let [sides, ends] = &self.edges;
        let [right, left] = [local.x, -local.x].map(|aside| depth(sides, aside));
        let [upper, lower] = [local.y, -local.y].map(|aside| depth(ends, aside));
        [right, left, upper, lower, local.z - self.near, self.far - local.z]
    }

    /// Where something is that reaches so far from a place relative to the camera, towards each plane; `size` is how far in any
    /// direction.
    pub fn judge(&self, place: DVec3, reaches: [f64; 6], size: f64) -> Verdict {
        let offsets = [self.edges[0].offset, self.edges[1].offset, self.near, self.far];
        let known = offsets.map(|offset| if offset.is_finite() { offset.abs() } else { 0.0 });
        let error = 1e-14 * (place.abs().element_sum() + size + known.iter().fold(0.0, |most, &one| one.max(most)));
        let depths = self.depths(place);
        let least = depths.iter().zip(reaches).map(|(depth, reach)| depth + reach).fold(f64::INFINITY, f64::min);
        match least {
            _ if least > error => Verdict::Inside,
            _ if least < -error => Verdict::Outside,
            _ => Verdict::Touching,
        }
    }

    /// A place relative to the camera that is `reaches` outside of the planes asked for, of which no two are opposite; and else
    /// as far along and aside as `along` and `aside` say, the latter in shares of the picture.
    pub fn touching(&self, asked: [bool; 6], reaches: [f64; 6], along: f64, aside: [f64; 2]) -> DVec3 {
        let along = match asked {
            [.., true, _] if self.near.is_finite() => self.near - reaches[4],
            [.., true] if self.far.is_finite() => self.far + reaches[5],
            _ => along,
        };
        let across = |pair: usize| {
            let edge = &self.edges[pair];
            let middle = edge.sine * along + edge.offset;
            match [asked[pair * 2], asked[pair * 2 + 1]] {
                [true, _] => (middle + reaches[pair * 2]) / edge.cosine,
                [_, true] => -(middle + reaches[pair * 2 + 1]) / edge.cosine,
                _ => aside[pair] * middle / edge.cosine,
            }
        };
        self.axes * DVec3::new(across(0), across(1), along)
    }

    /// The same place in the world, as near as f64 has it.
    pub fn world(&self, relative: DVec3) -> DVec3 {
        self.position + relative
    }
}
