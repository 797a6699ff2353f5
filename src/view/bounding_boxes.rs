//! Boxes around objects, laid out to be tested many at a time.

use std::array::from_fn;

use glam::{DVec3, Vec3};

use super::frustum::{ALLOWANCE, LANES, bits, least};
use super::{BoundingSpheres, Frustum};
use crate::quality::CullingVolume;

/// A box around an object. It is centred where the object's sphere is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientedBox {
    /// From the centre to the middle of three of its faces, in metres along the world's axes.
    pub half_axes: [DVec3; 3],
    /// How much farther than the box the object may reach, in metres, since centres are rounded.
    pub margin: f64,
}

/// The boxes of as many objects as there are [`BoundingSpheres`], around the same centres.
#[derive(Clone, Debug)]
pub enum BoundingBoxes {
    /// Along the world's axes ([`CullingVolume::Box`]): half of what each measures along x, y and z, and its margin.
    World(Box<Groups<4>>),
    /// Along axes of their own ([`CullingVolume::OrientedBox`]): three half axes of three coordinates each, and its margin.
    Oriented(Box<Groups<10>>),
}

/// So many numbers a box, in metres. Those of eight boxes lie together, so that asking for one of them reads few lines of memory,
/// and for all of them no more than is needed.
pub type Groups<const NUMBERS: usize> = [[[f32; LANES]; NUMBERS]; BoundingSpheres::COUNT / LANES];

impl BoundingBoxes {
    /// Boxes as a volume asks for them, all of them points; `None` where it asks for none.
    pub fn new(volume: CullingVolume) -> Option<Self> {
        match volume {
            CullingVolume::None | CullingVolume::Sphere => None,
            CullingVolume::Box => Some(Self::World(Box::new([[[0.0; LANES]; _]; _]))),
            CullingVolume::OrientedBox => Some(Self::Oriented(Box::new([[[0.0; LANES]; _]; _]))),
        }
    }

    /// Changes one of them: to the box itself, or to that around it along the world's axes.
    ///
    /// # Panics
    /// If there is no such box.
    pub fn set(&mut self, entry: usize, object: &OrientedBox) {
        match self {
            Self::World(groups) => {
                let half = object.half_axes.iter().fold(DVec3::ZERO, |half, axis| half + axis.abs());
                put(groups, entry, [half.x, half.y, half.z], object.margin);
            }
            Self::Oriented(groups) => {
                let [a, b, c] = object.half_axes.map(|axis| axis.to_array());
                put(groups, entry, [a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]], object.margin);
            }
        }
    }

    /// The half axes of one of them, in metres along the world's axes, and how much farther than that its object may reach.
    ///
    /// # Panics
    /// If there is no such box.
    pub fn get(&self, entry: usize) -> ([Vec3; 3], f32) {
        let (group, lane) = (entry / LANES, entry % LANES);
        match self {
            Self::World(groups) => {
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

/// Rounds a box of so many numbers and a margin. What is allowed for the rounding of its reach is known here already: see
/// [`Frustum::intersects_boxes`].
fn put<const NUMBERS: usize, const SIZES: usize>(
    groups: &mut Groups<NUMBERS>,
    entry: usize,
    sizes: [f64; SIZES],
    margin: f64,
) {
    const { assert!(NUMBERS == SIZES + 1) }
    let (group, lane) = (&mut groups[entry / LANES], entry % LANES);
    for (numbers, size) in group.iter_mut().zip(sizes) {
        numbers[lane] = size as f32;
    }
    let sum: f64 = sizes.iter().map(|size| size.abs()).sum();
    group[SIZES][lane] = ((margin + f64::from(ALLOWANCE) * sum) as f32).next_up();
}

impl Frustum {
    /// Of the [`Frustum::WORD`] objects from `first` on that are `asked` for, those of whose boxes any may be seen: a bit each,
    /// from the lowest. Never left out is one that is, and sometimes kept one just outside.
    ///
    /// A box with the half axes a reaches Σ|n·a| from its centre towards a plane of normal n (Gottschalk et al. 1996). Each
    /// product carries five roundings of u = 2⁻²⁴ (of the normal, of the axis, of itself, and of two sums), and the sum over the
    /// axes two more; normals have unit length, so the reach R is off by no more than 7u·Σ‖a‖₁. The distance is off by no more
    /// than [`Frustum::intersects_sphere`] tells, 11.5uN + u|o|, and adding the two by u(|d| + R) ≤ u(1.5N + |o|) + u·Σ‖a‖₁. 16u each are
    /// allowed of N, of |o| and, in the margin, of Σ‖a‖₁.
    ///
    /// What is not a number is kept: whoever asks has left out what is nowhere.
    ///
    /// # Panics
    /// If there are fewer, or `first` is no multiple of 8.
    pub fn intersects_boxes(&self, spheres: &BoundingSpheres, boxes: &BoundingBoxes, first: usize, asked: u64) -> u64 {
        assert!(first.is_multiple_of(LANES), "boxes lie in groups of {LANES}");
        match boxes {
            BoundingBoxes::World(groups) => {
                self.keep_boxes(spheres, groups, first, asked, |[x, y, z, _], normal, lane| {
                    normal.x.abs() * x[lane] + normal.y.abs() * y[lane] + normal.z.abs() * z[lane]
                })
            }
            BoundingBoxes::Oriented(groups) => {
                self.keep_boxes(spheres, groups, first, asked, |numbers, normal, lane| {
                    let [a, b, c, d, e, f, g, h, i, _] = numbers;
                    let along = |x: &[f32; LANES], y: &[f32; LANES], z: &[f32; LANES]| {
                        (normal.x * x[lane] + normal.y * y[lane] + normal.z * z[lane]).abs()
                    };
                    along(a, b, c) + along(d, e, f) + along(g, h, i)
                })
            }
        }
    }

    /// Only groups in which there is one to be asked for are looked at: most objects' spheres are outside or inside as a whole.
    #[inline(always)]
    fn keep_boxes<const NUMBERS: usize>(
        &self,
        spheres: &BoundingSpheres,
        groups: &Groups<NUMBERS>,
        first: usize,
        asked: u64,
        reach: impl Fn(&[[f32; LANES]; NUMBERS], Vec3, usize) -> f32 + Copy,
    ) -> u64 {
        let [x, y, z] = spheres.coordinates().each_ref().map(|axis| axis[first..first + Self::WORD].as_chunks().0);
        let groups = &groups[first / LANES..][..Self::WORD / LANES];
        let mut kept = 0;
        for (place, (((x, y), z), group)) in x.iter().zip(y).zip(z).zip(groups).enumerate() {
            let here = asked >> (place * LANES) & ((1 << LANES) - 1);
            if here != 0 {
                kept |= (here & self.may_see_group([x, y, z], group, reach)) << (place * LANES);
            }
        }
        kept
    }

    #[inline(always)]
    fn may_see_group<const NUMBERS: usize>(
        &self,
        centers: [&[f64; LANES]; 3],
        group: &[[f32; LANES]; NUMBERS],
        reach: impl Fn(&[[f32; LANES]; NUMBERS], Vec3, usize) -> f32,
    ) -> u64 {
        let [x, y, z] = self.relative(centers);
        let [forward, right, left, upper, lower] = self.normals;
        let (mut nearest, mut margins) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let place = self.place([x[lane], y[lane], z[lane]]);
            let mut within = f32::MAX;
            let mut reaching = |distance: f32, normal| within = least(distance + reach(group, normal, lane), within);
            reaching(place.along + self.near, forward);
            reaching(self.far - place.along, forward);
            let [beyond_left, beyond_right] = self.edges[0].distances(place.along, place.aside[0]);
            reaching(beyond_left, right);
            reaching(beyond_right, left);
            let [beyond_lower, beyond_upper] = self.edges[1].distances(place.along, place.aside[1]);
            reaching(beyond_lower, upper);
            reaching(beyond_upper, lower);
            nearest[lane] = within;
            margins[lane] = group[NUMBERS - 1][lane] + ALLOWANCE * place.length;
        }
        !bits(|lane| nearest[lane] < -margins[lane])
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use glam::DMat3;
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// What is held is around what was given, and is found again at every place.
        #[test]
        fn a_box_holds_its_corners(
            entry in 0..BoundingSpheres::COUNT,
            axis in prop::array::uniform3(-1.0..1.0_f64),
            angle in -3.2..3.2_f64,
            exponents in prop::array::uniform3(-6.0..7.0_f64),
            margin in 0.0..1.0_f64,
        ) {
            let turn = DMat3::from_axis_angle(DVec3::from(axis).normalize_or(DVec3::X), angle);
            let half = DVec3::from(exponents.map(|exponent| 10_f64.powf(exponent)));
            let half_axes = [turn.x_axis * half.x, turn.y_axis * half.y, turn.z_axis * half.z];
            for volume in [CullingVolume::Box, CullingVolume::OrientedBox] {
                let mut boxes = BoundingBoxes::new(volume).unwrap();
                boxes.set(entry, &OrientedBox { half_axes, margin });
                prop_assert_eq!(boxes.get((entry + 1) % BoundingSpheres::COUNT).0, [Vec3::ZERO; 3]);
                let (held, held_margin) = boxes.get(entry);
                let held = held.map(Vec3::as_dvec3);
                for signs in [[1.0, 1.0, 1.0], [1.0, 1.0, -1.0], [1.0, -1.0, 1.0], [-1.0, 1.0, 1.0]] {
                    let corner: DVec3 = half_axes.iter().zip(signs).map(|(&axis, sign)| axis * sign).sum();
                    // Along each axis of what is held, the corner is no farther out than it, but for the margin.
                    for axis in held {
                        let out = corner.dot(axis.normalize()).abs() - axis.length();
                        prop_assert!(out <= f64::from(held_margin), "{:?}: {} by {}", volume, corner, out);
                    }
                }
            }
        }
    }
}
