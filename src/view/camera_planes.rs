//! The planes of a camera's frustum along its own axes, before rounding.

use std::array::from_fn;

use crate::scene::{Camera, Projection};

/// The planes of a camera's frustum, without tolerance, in metres.
pub(super) struct CameraPlanes {
    /// The left and right planes, and the bottom and top planes.
    pub(super) pairs: [PairSlopes; 2],
    /// Of each pair.
    pub(super) offsets: [f64; 2],
    /// A point f metres along the view direction is not before the near plane if f + near ≥ 0.
    pub(super) near: f32,
    /// It is not beyond the far plane if far − f ≥ 0.
    pub(super) far: f32,
}

/// The slopes of two opposite planes: a point c metres aside of the view direction and f metres along it is between
/// them if slope · f + offset ≥ |scale · c − skew · f|.
#[derive(Clone, Copy)]
pub(super) struct PairSlopes {
    pub(super) slope: f64,
    pub(super) scale: f64,
    pub(super) skew: f64,
}

impl PairSlopes {
    const PARALLEL: Self = Self { slope: 0.0, scale: 1.0, skew: 0.0 };

    /// Planes through the camera: half their distance at 1 m, and how far their middle is aside of the view direction
    /// there.
    fn of_tangents(half: f64, middle: f64) -> Self {
        // The longer normal of the two has unit length.
        let scale = 1.0 / (half + middle.abs()).hypot(1.0);
        Self { slope: half * scale, scale, skew: middle * scale }
    }

    /// The inward normal of the left or lower plane, with a sign of 1, or the right or upper one, with -1: along the
    /// axis of the pair, and along the view direction.
    pub(super) fn normal(self, sign: f64) -> [f64; 2] {
        [self.scale * sign, self.slope - self.skew * sign]
    }
}

impl CameraPlanes {
    pub(super) fn new(camera: &Camera) -> Self {
        let [width, height] = camera.size.map(f64::from);
        let half = camera.projection.half_height();
        let halves = [half * width / height, half];
        let (pairs, offsets) = match camera.projection {
            Projection::Perspective { .. } => {
                let middle = |pair: usize| halves[pair] * f64::from(camera.shift[pair]);
                (from_fn(|pair| PairSlopes::of_tangents(halves[pair], middle(pair))), [0.0; 2])
            }
            Projection::Orthographic { .. } => ([PairSlopes::PARALLEL; 2], halves),
            Projection::Paraboloid => ([PairSlopes::PARALLEL; 2], [f64::from(camera.far); 2]),
        };
        let near = match camera.projection {
            // Objects in front of the near plane of a shadow map cast shadows too.
            _ if camera.clamps_depth() => f32::INFINITY,
            // Filtering at the disc's rim reads a few texels beyond it.
            Projection::Paraboloid => camera.far * PARABOLOID_MARGIN,
            // Its near plane is the clip plane, which may be nearer.
            _ if camera.clip_plane.is_some() => 0.0,
            _ => -camera.near,
        };
        Self { pairs, offsets, near, far: camera.far }
    }
}

/// How far a paraboloid view extends behind its camera, as a share of its range.
const PARABOLOID_MARGIN: f32 = 0.05;
