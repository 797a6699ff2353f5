//! Bounding boxes of objects as a structure of arrays, for SIMD culling.

use std::array::from_fn;

use glam::{DVec3, Vec3};

use super::frustum::{LANES, ROUNDING_TOLERANCE, lane_mask, min};
use super::{BoundingSpheres, Frustum};
use crate::bit_set::BITS_PER_WORD;
use crate::quality::CullingVolume;

/// An oriented bounding box. Its centre is that of the object's bounding sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientedBox {
    /// World-space vectors in metres from the centre to the middles of three faces.
    pub half_axes: [DVec3; 3],
    /// How far in metres the object may reach beyond the box, because centres are rounded.
    pub margin: f64,
}

/// Bounding boxes of [`BoundingSpheres::COUNT`] objects, with the same centres as their [`BoundingSpheres`].
#[derive(Clone, Debug)]
pub enum BoundingBoxes {
    /// Axis-aligned boxes ([`CullingVolume::Box`]): half extents along x, y and z, and a margin.
    AxisAligned(Box<LaneGroups<4>>),
    /// Oriented boxes ([`CullingVolume::OrientedBox`]): three half axes of three coordinates each, and a margin.
    Oriented(Box<LaneGroups<10>>),
}

/// `N` numbers per box, in metres. The numbers of eight boxes are adjacent, so a test of one box touches few cache
/// lines, and a test of all boxes loads nothing superfluous.
pub type LaneGroups<const N: usize> = [[[f32; LANES]; N]; BoundingSpheres::COUNT / LANES];

impl BoundingBoxes {
    /// Boxes of zero size for a culling volume; `None` if the volume is not a box.
    pub fn new(volume: CullingVolume) -> Option<Self> {
        match volume {
            CullingVolume::None | CullingVolume::Sphere => None,
            CullingVolume::Box => Some(Self::AxisAligned(Box::new([[[0.0; LANES]; _]; _]))),
            CullingVolume::OrientedBox => Some(Self::Oriented(Box::new([[[0.0; LANES]; _]; _]))),
        }
    }

    /// Replaces the box at `entry`: by `object` itself, or by the axis-aligned box around it.
    ///
    /// # Panics
    /// If `entry` is not below [`BoundingSpheres::COUNT`].
    pub fn set(&mut self, entry: usize, object: &OrientedBox) {
        match self {
            Self::AxisAligned(groups) => {
                let half = object.half_axes.iter().fold(DVec3::ZERO, |half, axis| half + axis.abs());
                store(groups, entry, [half.x, half.y, half.z], object.margin);
            }
            Self::Oriented(groups) => {
                let [a, b, c] = object.half_axes.map(|axis| axis.to_array());
                store(groups, entry, [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]], object.margin);
            }
        }
    }

    /// Returns the world-space half axes of the box at `entry`, and its margin, in metres.
    ///
    /// # Panics
    /// If `entry` is not below [`BoundingSpheres::COUNT`].
    pub fn get(&self, entry: usize) -> ([Vec3; 3], f32) {
        let (group, lane) = (entry / LANES, entry % LANES);
        match self {
            Self::AxisAligned(groups) => {
                let [x, y, z, margin] = groups[group].map(|numbers| numbers[lane]);
                ([Vec3::X * x, Vec3::Y * y, Vec3::Z * z], margin)
            }
            Self::Oriented(groups) => {
                let numbers = groups[group].map(|numbers| numbers[lane]);
                (from_fn(|axis| Vec3::from_slice(&numbers[axis * 3..])), numbers[9])
            }
        }
    }
}

/// Rounds and stores the extents of a box and its margin. The margin includes the tolerance for rounding that
/// [`Frustum::intersects_boxes`] derives.
fn store<const N: usize, const M: usize>(groups: &mut LaneGroups<N>, entry: usize, sizes: [f64; M], margin: f64) {
    const { assert!(N == M + 1) }
    let (group, lane) = (&mut groups[entry / LANES], entry % LANES);
    for (numbers, size) in group.iter_mut().zip(sizes) {
        numbers[lane] = size as f32;
    }
    let sum: f64 = sizes.iter().map(|size| size.abs()).sum();
    group[M][lane] = ((margin + f64::from(ROUNDING_TOLERANCE) * sum) as f32).next_up();
}

impl Frustum {
    /// Tests the boxes of the `candidates` among the 64 objects from `first` on; bit 0 of either mask is
    /// `first`. Returns a mask of the boxes that intersect the frustum. The test is conservative: a box that intersects
    /// the frustum is never missing, a box just outside may be included.
    ///
    /// A box with the half axes a extends Σ|n·a| from its centre towards a plane of normal n (Gottschalk et al. 1996).
    /// Each product carries five roundings of u = 2⁻²⁴ (of the normal, of the axis, of itself, and of two sums), and
    /// the sum over the axes two more; normals have unit length, so the error of the extent R is at most 7u·Σ‖a‖₁. The
    /// error of the distance is at most 11.5uN + u|o| (see [`Frustum::intersects_sphere`]), and that of their sum at
    /// most u(|d| + R) ≤ u(1.5N + |o|) + u·Σ‖a‖₁. The tolerance is 16u each of N, of |o| and, in the margin, of Σ‖a‖₁.
    ///
    /// NaN counts as intersecting: the caller has already rejected objects with invalid transforms.
    ///
    /// # Panics
    /// If `first` is not a multiple of 8, or fewer than 64 objects follow it.
    pub fn intersects_boxes(
        &self,
        spheres: &BoundingSpheres,
        boxes: &BoundingBoxes,
        first: usize,
        candidates: u64,
    ) -> u64 {
        assert!(first.is_multiple_of(LANES), "`first` must be a multiple of {LANES}");
        match boxes {
            BoundingBoxes::AxisAligned(groups) => {
                self.intersecting_boxes(spheres, groups, first, candidates, |[x, y, z, _], normal, lane| {
                    normal.x.abs() * x[lane] + normal.y.abs() * y[lane] + normal.z.abs() * z[lane]
                })
            }
            BoundingBoxes::Oriented(groups) => {
                self.intersecting_boxes(spheres, groups, first, candidates, |numbers, normal, lane| {
                    let [a, b, c, d, e, f, g, h, i, _] = numbers;
                    let along = |x: &[f32; LANES], y: &[f32; LANES], z: &[f32; LANES]| {
                        (normal.x * x[lane] + normal.y * y[lane] + normal.z * z[lane]).abs()
                    };
                    along(a, b, c) + along(d, e, f) + along(g, h, i)
                })
            }
        }
    }

    /// Skips groups without candidates: the sphere test has already decided most objects.
    #[inline(always)]
    fn intersecting_boxes<const N: usize>(
        &self,
        spheres: &BoundingSpheres,
        groups: &LaneGroups<N>,
        first: usize,
        candidates: u64,
        extent: impl Fn(&[[f32; LANES]; N], Vec3, usize) -> f32 + Copy,
    ) -> u64 {
        let [x, y, z] = spheres.coordinates().each_ref().map(|axis| axis[first..first + BITS_PER_WORD].as_chunks().0);
        let groups = &groups[first / LANES..][..BITS_PER_WORD / LANES];
        let mut intersecting = 0;
        for (index, (((x, y), z), group)) in x.iter().zip(y).zip(z).zip(groups).enumerate() {
            let in_group = candidates >> (index * LANES) & ((1 << LANES) - 1);
            if in_group != 0 {
                intersecting |= (in_group & self.intersecting_group([x, y, z], group, extent)) << (index * LANES);
            }
        }
        intersecting
    }

    #[inline(always)]
    fn intersecting_group<const N: usize>(
        &self,
        centers: [&[f64; LANES]; 3],
        group: &[[f32; LANES]; N],
        extent: impl Fn(&[[f32; LANES]; N], Vec3, usize) -> f32,
    ) -> u64 {
        let [x, y, z] = self.camera_relative(centers);
        let [forward, right, left, upper, lower] = self.normals;
        let (mut distances, mut margins) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let point = self.camera_point([x[lane], y[lane], z[lane]]);
            let mut distance = f32::MAX;
            let mut test = |to_center: f32, normal| distance = min(to_center + extent(group, normal, lane), distance);
            test(point.forward + self.near, forward);
            test(self.far - point.forward, forward);
            let [from_left, from_right] = self.sides[0].distances(point.forward, point.across[0]);
            test(from_left, right);
            test(from_right, left);
            let [from_lower, from_upper] = self.sides[1].distances(point.forward, point.across[1]);
            test(from_lower, upper);
            test(from_upper, lower);
            distances[lane] = distance;
            margins[lane] = group[N - 1][lane] + ROUNDING_TOLERANCE * point.norm;
        }
        !lane_mask(|lane| distances[lane] < -margins[lane])
    }
}

#[cfg(test)]
mod tests {
    use glam::DMat3;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// A stored box contains the given box, at every entry.
        #[test]
        fn a_stored_box_contains_its_corners(
            entry in 0..BoundingSpheres::COUNT,
            axis in prop::array::uniform3(-1.0..1.0_f64),
            angle in -3.2..3.2_f64,
            exponents in prop::array::uniform3(-6.0..7.0_f64),
            margin in 0.0..1.0_f64,
        ) {
            let rotation = DMat3::from_axis_angle(DVec3::from(axis).normalize_or(DVec3::X), angle);
            let half = DVec3::from(exponents.map(|exponent| 10_f64.powf(exponent)));
            let half_axes = [rotation.x_axis * half.x, rotation.y_axis * half.y, rotation.z_axis * half.z];
            for volume in [CullingVolume::Box, CullingVolume::OrientedBox] {
                let mut boxes = BoundingBoxes::new(volume).unwrap();
                boxes.set(entry, &OrientedBox { half_axes, margin });
                prop_assert_eq!(boxes.get((entry + 1) % BoundingSpheres::COUNT).0, [Vec3::ZERO; 3]);
                let (stored, stored_margin) = boxes.get(entry);
                let stored = stored.map(Vec3::as_dvec3);
                for signs in [[1.0, 1.0, 1.0], [1.0, 1.0, -1.0], [1.0, -1.0, 1.0], [-1.0, 1.0, 1.0]] {
                    let corner: DVec3 = half_axes.iter().zip(signs).map(|(&axis, sign)| axis * sign).sum();
                    // Along each axis of the stored box, the corner exceeds it by no more than the margin.
                    for axis in stored {
                        let out = corner.dot(axis.normalize()).abs() - axis.length();
                        prop_assert!(out <= f64::from(stored_margin), "{:?}: {} by {}", volume, corner, out);
                    }
                }
            }
        }
    }
}
