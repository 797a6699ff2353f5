//! What a camera sees, as planes that never cull what it does see.

use std::array::from_fn;

use glam::{DVec3, Vec3};

use super::BoundingSpheres;
use crate::scene::{Camera, Projection, ViewKind};

/// What a camera sees: a pyramid, a box or half a ball, within six planes.
///
/// The planes are relative to the camera, so that a place far from the world's origin costs no precision: the only
/// subtraction of large numbers, centre − camera, is done in f64. Opposite planes share what they can: for a place c relative
/// to the camera, forward·c tells how far along it is, and is all that the near and the far plane ask for; two opposite edges
/// of the picture ask for across·c besides, and differ in its sign alone. That is 28 operations for six planes, and not 42.
#[derive(Clone, Debug, PartialEq)]
pub struct Frustum {
    origin: DVec3,
    /// Where the camera looks, of unit length.
    forward: Vec3,
    /// Those of the picture at its sides, and those above and below.
    pub(super) edges: [Edges; 2],
    /// What is at `forward · c + near ≥ 0` is not before the near plane; in metres, moved out.
    pub(super) near: f32,
    /// What is at `far − forward · c ≥ 0` is not beyond the far plane; in metres, moved out.
    pub(super) far: f32,
    /// `forward`, and the normals of the edges, two and two: towards the inside, of unit length.
    pub(super) normals: [Vec3; 5],
}

/// Two opposite edges of the picture, relative to the camera. What is at `slope · (forward · c) + offset ≥ |across · c|` is
/// between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Edges {
    /// At right angles to `forward`, and as long as the cosine of half the angle of view: 1 without perspective.
    across: Vec3,
    /// The sine of half the angle of view: 0 without perspective.
    slope: f32,
    /// In metres, moved out.
    offset: f32,
}

/// A place relative to the camera, as the planes ask for it.
#[derive(Clone, Copy)]
pub(super) struct Place {
    /// `forward · c`.
    pub(super) along: f32,
    /// `across · c` of both pairs of edges.
    pub(super) aside: [f32; 2],
    /// ‖c‖₁, of which [`ALLOWANCE`] is allowed for the rounding of the distances from all planes: see [`Frustum::intersects_sphere`].
    pub(super) length: f32,
}

impl Frustum {
    /// What `camera` sees.
    pub fn new(camera: &Camera) -> Self {
        let orientation = camera.orientation.as_dquat().normalize();
        let forward = orientation * DVec3::NEG_Z;
        let [width, height] = camera.size.map(f64::from);
        let (sines_and_cosines, offsets) = match camera.projection {
            Projection::Perspective { field_of_view } => {
                let tangent_y = (f64::from(field_of_view) * 0.5).tan();
                let of_tangent = |tangent: f64| [tangent, 1.0].map(|side| side / tangent.hypot(1.0));
                ([of_tangent(tangent_y * width / height), of_tangent(tangent_y)], [0.0; 2])
            }
            Projection::Orthographic { height: picture } => {
                let half = f64::from(picture) * 0.5;
                ([[0.0, 1.0]; 2], [half * width / height, half])
            }
            Projection::Paraboloid => ([[0.0, 1.0]; 2], [f64::from(camera.far); 2]),
        };
        let near = match camera.projection {
            // Into a shadow map, what is before the near plane casts its shadow too.
            Projection::Orthographic { .. } if camera.kind == ViewKind::Shadow => f32::INFINITY,
            // Who filters a shadow map at the disc's rim looks a few pixels past it.
            Projection::Paraboloid => camera.far * PAST_THE_RIM,
            _ => -camera.near,
        };
        let axes = [DVec3::X, DVec3::Y].map(|axis| orientation * axis);
        let edges = from_fn(|pair| {
            let [sine, cosine] = sines_and_cosines[pair];
            // Rounded up, so that a plane is rather too far out.
            let offset = moved_out((offsets[pair] as f32).next_up());
            Edges { across: (axes[pair] * cosine).as_vec3(), slope: sine as f32, offset }
        });
        let normal = |pair: usize, sign: f64| {
            let [sine, cosine] = sines_and_cosines[pair];
            (forward * sine + axes[pair] * (cosine * sign)).as_vec3()
        };
        Self {
            origin: camera.position,
            forward: forward.as_vec3(),
            edges,
            near: moved_out(near),
            far: moved_out(camera.far),
            normals: [forward.as_vec3(), normal(0, 1.0), normal(0, -1.0), normal(1, 1.0), normal(1, -1.0)],
        }
    }

    /// Whether any of a sphere may be seen: never `false` for one that is, sometimes `true` for one just outside.
    ///
    /// With u = 2⁻²⁴, and N = ‖c‖₁ of the centre relative to the camera, to first order: forward·c carries five roundings (of
    /// the normal, of the centre, of the product, and of two sums), so it is off by no more than 5uN; times the slope it is off
    /// by 7u·slope·N. across·c is off by 5u·|across|·N. Their difference and its sum with the offset o add 2u(slope + |across|)N
    /// and u|o|. Slope and |across| are sine and cosine of one angle, so the distance from an edge is off by no more than
    /// (9·slope + 7·|across|)uN + u|o| ≤ 11.5uN + u|o|, and that from the near or the far plane by 6uN + u|o|. 16u(N + r) are
    /// allowed in the sphere's reach and 16u|o| in the offset, which leaves more than their own roundings take. Where numbers
    /// are so small that they lose bits, what they lose is far below the smallest normal number, which is allowed as well.
    /// The bound is made of magnitudes from before any cancellation.
    ///
    /// What is not a number is not seen. What is so far away that it overflows is.
    #[inline]
    pub fn intersects_sphere(&self, center: DVec3, radius: f32) -> bool {
        let place = self.place((center - self.origin).as_vec3().to_array());
        self.nearest(place) >= -reach(radius, place)
    }

    /// The same for the [`Frustum::WORD`] spheres from `first` on: a bit each, from the lowest.
    ///
    /// # Panics
    /// If there are fewer.
    pub fn intersects_spheres(&self, spheres: &BoundingSpheres, first: usize) -> u64 {
        self.judge_each(spheres, first).seen
    }

    /// How many spheres [`Frustum::intersects_spheres`] looks at.
    pub const WORD: usize = 64;

    /// As [`Frustum::intersects_spheres`], and which of them are inside as a whole: that costs a third more, but nothing where it is not
    /// used.
    #[inline(always)]
    pub(super) fn judge_each(&self, spheres: &BoundingSpheres, first: usize) -> Judged {
        let entries = first..first + Self::WORD;
        let [x, y, z] = spheres.coordinates().each_ref().map(|axis| axis[entries.clone()].as_chunks().0);
        let radii = spheres.radii()[entries].as_chunks::<LANES>().0;
        let mut judged = Judged { seen: 0, whole: 0 };
        for (group, (((x, y), z), radii)) in x.iter().zip(y).zip(z).zip(radii).enumerate() {
            let [x, y, z] = self.relative([x, y, z]);
            // One loop a step, over arrays of a fixed length: such loops become vector instructions.
            let (mut nearest, mut reaches) = ([0.0; LANES], [0.0; LANES]);
            for lane in 0..LANES {
                let place = self.place([x[lane], y[lane], z[lane]]);
                nearest[lane] = self.nearest(place);
                reaches[lane] = reach(radii[lane], place);
            }
            judged.seen |= bits(|lane| nearest[lane] >= -reaches[lane]) << (group * LANES);
            judged.whole |= bits(|lane| nearest[lane] >= reaches[lane]) << (group * LANES);
        }
        judged
    }

    /// Places in the world relative to the camera, in metres.
    #[inline(always)]
    pub(super) fn relative(&self, [x, y, z]: [&[f64; LANES]; 3]) -> [[f32; LANES]; 3] {
        let relative = |coordinates: &[f64; LANES], origin: f64| {
            let mut relative = [0.0; LANES];
            for lane in 0..LANES {
                relative[lane] = (coordinates[lane] - origin) as f32;
            }
            relative
        };
        [relative(x, self.origin.x), relative(y, self.origin.y), relative(z, self.origin.z)]
    }

    #[inline(always)]
    pub(super) fn place(&self, [x, y, z]: [f32; 3]) -> Place {
        let dot = |normal: Vec3| normal.x * x + normal.y * y + normal.z * z;
        Place {
            along: dot(self.forward),
            aside: [dot(self.edges[0].across), dot(self.edges[1].across)],
            length: x.abs() + y.abs() + z.abs(),
        }
    }

    /// How far a place is inside of the nearest plane, or outside of the farthest.
    #[inline(always)]
    fn nearest(&self, Place { along, aside, .. }: Place) -> f32 {
        let between = |pair: usize| {
            let edges = &self.edges[pair];
            edges.slope * along - aside[pair].abs() + edges.offset
        };
        let nearest = least(between(1), least(between(0), f32::MAX));
        least(self.far - along, least(along + self.near, nearest))
    }
}

impl Edges {
    /// How far a place is inside of each.
    #[inline(always)]
    pub(super) fn distances(&self, along: f32, aside: f32) -> [f32; 2] {
        let middle = self.slope * along;
        [middle + aside + self.offset, middle - aside + self.offset]
    }
}

/// How far a sphere reaches, with what is allowed for rounding.
#[inline(always)]
fn reach(radius: f32, place: Place) -> f32 {
    radius + ALLOWANCE * (place.length + radius)
}

/// What is known of some volumes: a bit each, from the lowest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Judged {
    /// Of which something may be seen.
    pub(super) seen: u64,
    /// Which are inside of all planes as a whole.
    pub(super) whole: u64,
}

/// How many are tested together: what fits into the registers that every processor has.
pub(super) const LANES: usize = 8;

/// The lesser of two; the second if the first is not a number. One instruction, which [`f32::min`] is not.
#[inline(always)]
pub(super) fn least(one: f32, other: f32) -> f32 {
    if one < other { one } else { other }
}

/// What holds for which of them, from the lowest bit.
#[inline(always)]
pub(super) fn bits(holds: impl Fn(usize) -> bool) -> u64 {
    (0..LANES).fold(0, |bits, lane| bits | u64::from(holds(lane)) << lane)
}

/// An offset with what is allowed for the rounding of itself, and for numbers too small to keep all their bits.
fn moved_out(offset: f32) -> f32 {
    offset + ALLOWANCE * offset.abs() + f32::MIN_POSITIVE
}

/// How far behind a paraboloid's camera is looked, as a share of its range.
const PAST_THE_RIM: f32 = 0.05;

/// 16 unit roundoffs, of 2⁻²⁴ each: see [`Frustum::intersects_sphere`].
pub(super) const ALLOWANCE: f32 = 16.0 * (f32::EPSILON / 2.0);

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use glam::Quat;
    use proptest::prelude::*;

    use super::*;
    use crate::view::BoundingSphere;

    /// How far the sphere's centre is inside the nearest plane, in f64, from the camera's own definition.
    fn depth_inside(camera: &Camera, center: DVec3) -> f64 {
        let local = camera.orientation.as_dquat().normalize().inverse() * (center - camera.position);
        let away = -local.z;
        let aspect = f64::from(camera.size[0]) / f64::from(camera.size[1]);
        let (near, far) = (away - f64::from(camera.near), f64::from(camera.far) - away);
        let distances = match camera.projection {
            Projection::Perspective { field_of_view } => {
                let half = f64::from(field_of_view) * 0.5;
                let half_x = (half.tan() * aspect).atan();
                let edge = |aside: f64, half: f64| away * half.sin() - aside.abs() * half.cos();
                [near, far, edge(local.x, half_x), edge(local.y, half)]
            }
            Projection::Orthographic { height } => {
                let half = f64::from(height) * 0.5;
                let near = if camera.kind == ViewKind::Shadow { f64::INFINITY } else { near };
                [near, far, half * aspect - local.x.abs(), half - local.y.abs()]
            }
            // The planes hold half a ball; what counts is that none of it is outside of them.
            Projection::Paraboloid => [away, f64::from(camera.far) - local.length(), f64::INFINITY, f64::INFINITY],
        };
        distances.into_iter().fold(f64::INFINITY, f64::min)
    }

    prop_compose! {
        fn any_camera()(
            place in prop::array::uniform3(-1.0..1.0_f64),
            exponent in 0.0..9.0_f64,
            axis in prop::array::uniform3(-1.0..1.0_f32),
            angle in 0.0..std::f32::consts::TAU,
            degrees in 0.1..179.0_f32,
            width in 1_u32..4000,
            height in 1_u32..4000,
            near_exponent in -5.0..2.0_f32,
            far_exponent in 0.001..6.0_f32,
            projection in 0_usize..4,
        ) -> Camera {
            let mut camera = Camera::looking_at("any", DVec3::from(place) * 10_f64.powf(exponent), DVec3::ZERO);
            camera.orientation = Quat::from_axis_angle(Vec3::from(axis).normalize_or(Vec3::X), angle);
            camera.size = [width, height];
            camera.near = 10_f32.powf(near_exponent);
            let perspective = Projection::Perspective { field_of_view: degrees.to_radians() };
            camera.projection = match projection {
                0 | 1 => perspective,
                2 => Projection::Orthographic { height: degrees * camera.near },
                _ => Projection::Paraboloid,
            };
            // One perspective in two sees for ever.
            if projection != 0 {
                camera.far = camera.near * 10_f32.powf(far_exponent);
            }
            camera.kind = if projection == 3 || width % 2 == 0 { ViewKind::Shadow } else { ViewKind::Main };
            camera
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        /// Spheres are moved along the direction to the nearest plane until they all but touch it.
        #[test]
        fn a_sphere_that_is_seen_is_never_culled(
            camera in any_camera(),
            direction in prop::array::uniform3(-1.0..1.0_f64),
            exponent in -3.0..7.0_f64,
            radius_exponent in -6.0..7.0_f64,
            nudge in -1e-5..1e-5_f64,
        ) {
            let center = camera.position + DVec3::from(direction).normalize_or(DVec3::X) * 10_f64.powf(exponent);
            let depth = depth_inside(&camera, center);
            let tangent = if depth < 0.0 { -depth * (1.0 + nudge) } else { 10_f64.powf(radius_exponent) };
            let radius = tangent as f32;
            if depth >= -f64::from(radius) {
                prop_assert!(Frustum::new(&camera).intersects_sphere(center, radius), "depth {depth} radius {radius}");
            }
        }

        #[test]
        fn spheres_are_seen_together_as_each_by_itself(
            camera in any_camera(),
            exponents in prop::collection::vec((-3.0..7.0_f64, -6.0..7.0_f32), BoundingSpheres::COUNT),
            turn in 0.0..1.0_f64,
        ) {
            let frustum = Frustum::new(&camera);
            let mut spheres = BoundingSpheres::default();
            for (entry, (distance, radius)) in exponents.into_iter().enumerate() {
                let (height, angle) = ((entry as f64 * 0.618 + turn).fract() * 2.0 - 1.0, entry as f64 * 2.4);
                let across = (1.0 - height * height).sqrt();
                let direction = DVec3::new(across * angle.cos(), height, across * angle.sin());
                let center = camera.position + direction * 10_f64.powf(distance);
                let bounds = match entry % 19 {
                    0 => BoundingSphere::NOTHING,
                    1 => BoundingSphere { center: DVec3::NAN, radius: 1.0 },
                    2 => BoundingSphere { center, radius: f32::INFINITY },
                    _ => BoundingSphere { center, radius: 10_f32.powf(radius) },
                };
                spheres.set(entry, bounds);
            }
            for first in [0, 64, 100, 192] {
                let together = frustum.intersects_spheres(&spheres, first);
                for entry in 0..Frustum::WORD {
                    let BoundingSphere { center, radius } = spheres.get(first + entry);
                    prop_assert_eq!(together >> entry & 1 == 1, frustum.intersects_sphere(center, radius), "{} {}", center, radius);
                }
            }
        }

        #[test]
        fn a_sphere_well_outside_is_culled(
            camera in any_camera(),
            direction in prop::array::uniform3(-1.0..1.0_f64),
            exponent in -3.0..7.0_f64,
        ) {
            let center = camera.position + DVec3::from(direction).normalize_or(DVec3::X) * 10_f64.powf(exponent);
            let depth = depth_inside(&camera, center);
            let far = if camera.far.is_finite() { f64::from(camera.far) } else { 0.0 };
            let slack = 4e-6 * ((center - camera.position).length() + f64::from(camera.near) + far);
            if depth < -slack && camera.projection != Projection::Paraboloid {
                let radius = (-depth - slack) as f32;
                prop_assert!(!Frustum::new(&camera).intersects_sphere(center, radius), "depth {depth} radius {radius}");
            }
        }
    }

    #[test]
    fn a_paraboloid_leaves_out_what_is_behind_it_and_beyond_its_range() {
        let camera = Camera {
            projection: Projection::Paraboloid,
            far: 10.0,
            kind: ViewKind::Shadow,
            ..Camera::looking_at("lamp", DVec3::ZERO, DVec3::NEG_Y)
        };
        let frustum = Frustum::new(&camera);
        assert!(frustum.intersects_sphere(DVec3::new(9.0, -0.1, 0.0), 0.0));
        assert!(!frustum.intersects_sphere(DVec3::new(0.0, 2.0, 0.0), 1.0));
        assert!(!frustum.intersects_sphere(DVec3::new(0.0, -12.0, 0.0), 1.0));
        assert!(!frustum.intersects_sphere(DVec3::new(12.0, -1.0, 0.0), 1.0));
    }

    #[test]
    fn what_is_not_a_number_is_not_seen() {
        let camera = Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z);
        let frustum = Frustum::new(&camera);
        assert!(frustum.intersects_sphere(DVec3::NEG_Z * 5.0, 1.0));
        assert!(!frustum.intersects_sphere(DVec3::NEG_Z * f64::NAN, 1.0));
        assert!(!frustum.intersects_sphere(DVec3::NEG_Z * 5.0, f32::NEG_INFINITY));
    }
}
