//! The planes of a camera's frustum along its own axes, before rounding.

use std::array::from_fn;

use glam::DVec3;

use super::inflated_volume::InflatedVolume;
use crate::scene::{Camera, CameraMotion, Projection, ViewKind};

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

/// The slopes of two opposite planes: a point c metres aside of the view direction and f metres along it is between them if
/// slope · f + offset ≥ |scale · c − skew · f|.
#[derive(Clone, Copy)]
pub(super) struct PairSlopes {
    pub(super) slope: f64,
    pub(super) scale: f64,
    pub(super) skew: f64,
}

impl PairSlopes {
    const PARALLEL: Self = Self { slope: 0.0, scale: 1.0, skew: 0.0 };

    /// Planes through the camera: half their distance at 1 m, and how far their middle is aside of the view direction there.
    fn of_tangents(half: f64, middle: f64) -> Self {
        // The longer normal of the two has unit length.
        let scale = 1.0 / (half + middle.abs()).hypot(1.0);
        Self { slope: half * scale, scale, skew: middle * scale }
    }

    /// The inward normal of the left or lower plane, with a sign of 1, or the right or upper one, with -1: along the axis of the pair, and
    /// along the view direction.
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
            Projection::Orthographic { .. } if camera.kind == ViewKind::Shadow => f32::INFINITY,
            // Filtering at the disc's rim reads a few texels beyond it.
            Projection::Paraboloid => camera.far * PARABOLOID_MARGIN,
            // Its near plane is the clip plane, which may be nearer.
            _ if camera.clip_plane.is_some() => 0.0,
            _ => -camera.near,
        };
        let exact = Self { pairs, offsets, near, far: camera.far };
        match camera.late_latch {
            Some(motion) if camera.kind != ViewKind::Shadow => exact.inflated(camera, motion, halves),
            _ => exact,
        }
    }

    /// Planes around all that the camera sees, wherever the motion leads it.
    fn inflated(self, camera: &Camera, motion: CameraMotion, half_extents: [f64; 2]) -> Self {
        let volume = InflatedVolume::new(camera, motion, half_extents, -f64::from(self.near));
        let pairs = match camera.projection {
            Projection::Perspective { .. } => from_fn(|pair| {
                let [half, middle] = volume.half_and_middle(pair);
                PairSlopes::of_tangents(half, middle)
            }),
            _ => self.pairs,
        };
        let offset_of_side = |pair: usize, sign: f64| {
            let [aside, forward] = pairs[pair].normal(sign);
            volume.offset([DVec3::X, DVec3::Y][pair] * aside + DVec3::Z * forward)
        };
        let offsets = [0, 1].map(|pair| offset_of_side(pair, 1.0).max(offset_of_side(pair, -1.0)));
        let [near, far] = [DVec3::Z, DVec3::NEG_Z].map(|normal| (volume.offset(normal) as f32).next_up());
        Self { pairs, offsets, near, far }
    }
}

/// How far a paraboloid view extends behind its camera, as a share of its range.
const PARABOLOID_MARGIN: f32 = 0.05;
