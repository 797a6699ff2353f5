//! The view frustum as planes, with conservative tests against bounding volumes, and the bounding spheres of objects as
//! a structure of arrays, for SIMD culling.

use std::array::from_fn;

use glam::{DVec3, Vec3};
use multiversion::multiversion;

use crate::bit_set::BITS_PER_WORD;
use crate::scene::{Camera, Projection};

/// A bounding sphere in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BoundingSphere {
    /// The centre in metres.
    pub center: DVec3,
    /// The radius in metres.
    pub radius: f32,
}

impl BoundingSphere {
    /// The sphere that no frustum intersects.
    pub const EMPTY: Self = Self { center: DVec3::ZERO, radius: f32::NEG_INFINITY };
}

/// The bounding spheres of [`BoundingSpheres::COUNT`] objects, one array for each coordinate: a test loads only the
/// coordinates that it needs, and tests several spheres with one instruction.
#[derive(Clone, Debug)]
pub struct BoundingSpheres {
    /// World-space x, y and z in metres.
    centers: [[f64; Self::COUNT]; 3],
    /// In metres.
    radii: [f32; Self::COUNT],
}

impl BoundingSpheres {
    /// The number of spheres.
    pub const COUNT: usize = 256;

    /// Returns the sphere at `entry`.
    ///
    /// # Panics
    /// If `entry` is not below [`BoundingSpheres::COUNT`].
    #[inline]
    pub fn get(&self, entry: usize) -> BoundingSphere {
        let [x, y, z] = &self.centers;
        BoundingSphere { center: DVec3::new(x[entry], y[entry], z[entry]), radius: self.radii[entry] }
    }

    /// Replaces the sphere at `entry`.
    ///
    /// # Panics
    /// If `entry` is not below [`BoundingSpheres::COUNT`].
    #[inline]
    pub fn set(&mut self, entry: usize, bounds: BoundingSphere) {
        for (coordinates, coordinate) in self.centers.iter_mut().zip(bounds.center.to_array()) {
            coordinates[entry] = coordinate;
        }
        self.radii[entry] = bounds.radius;
    }

    /// Replaces the eight spheres from `entry` on.
    #[inline(always)]
    pub(super) fn set_packet(&mut self, entry: usize, centers: &[[f64; LANES]; 3], radii: &[f32; LANES]) {
        for (coordinates, new) in self.centers.iter_mut().zip(centers) {
            coordinates[entry..entry + LANES].copy_from_slice(new);
        }
        self.radii[entry..entry + LANES].copy_from_slice(radii);
    }

    /// The centres' world-space x, y and z in metres.
    pub fn coordinates(&self) -> &[[f64; Self::COUNT]; 3] {
        &self.centers
    }

    /// The radii in metres.
    pub fn radii(&self) -> &[f32; Self::COUNT] {
        &self.radii
    }
}

impl Default for BoundingSpheres {
    /// All spheres are [`BoundingSphere::EMPTY`].
    fn default() -> Self {
        Self { centers: [[0.0; Self::COUNT]; 3], radii: [BoundingSphere::EMPTY.radius; Self::COUNT] }
    }
}

/// The planes of a camera's frustum, without tolerance, in metres.
struct CameraPlanes {
    /// The left and right planes, and the bottom and top planes.
    pairs: [PairSlopes; 2],
    /// Of each pair.
    offsets: [f64; 2],
    /// A point f metres along the view direction is not before the near plane if f + near ≥ 0.
    near: f32,
    /// It is not beyond the far plane if far − f ≥ 0.
    far: f32,
}

/// The slopes of two opposite planes: a point c metres aside of the view direction and f metres along it is between
/// them if slope · f + offset ≥ |scale · c − skew · f|.
#[derive(Clone, Copy)]
struct PairSlopes {
    slope: f64,
    scale: f64,
    skew: f64,
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
    fn normal(self, sign: f64) -> [f64; 2] {
        [self.scale * sign, self.slope - self.skew * sign]
    }
}

impl CameraPlanes {
    fn new(camera: &Camera) -> Self {
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

/// The volume that a camera sees, within six planes: a pyramid, a box or a hemisphere.
///
/// The planes are relative to the camera, so positions far from the world's origin lose no precision: the only
/// subtraction of large numbers, centre − camera, is done in f64. Opposite planes share dot products: for a point c
/// relative to the camera, forward·c suffices for the near and the far plane; a pair of opposite side planes also needs
/// across·c, and the two differ only in its sign. That takes 28 operations for six planes instead of 42.
#[derive(Clone, Debug, PartialEq)]
pub struct Frustum {
    pub(super) origin: DVec3,
    /// The view direction, of unit length.
    pub(super) forward: Vec3,
    /// The left and right planes, and the bottom and top planes.
    pub(super) sides: [SidePlanes; 2],
    /// A point c with `forward · c + near ≥ 0` is not before the near plane. In metres, with tolerance.
    pub(super) near: f32,
    /// A point c with `far − forward · c ≥ 0` is not beyond the far plane. In metres, with tolerance.
    pub(super) far: f32,
    /// `forward`, and the normals of the two pairs of side planes: inward, as long as in [`SidePlanes`].
    pub(super) normals: [Vec3; 5],
    /// All planes as the tests of spheres compute them, in f64: inward normals, and offsets with tolerance.
    pub(super) planes: [([f64; 3], f64); 6],
}

/// Two opposite side planes, relative to the camera. A point c with `slope · (forward · c) + offset ≥ |across · c|`
/// lies between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SidePlanes {
    /// The normals are `slope · forward ± across`, of at most unit length: a shorter one only makes tests accept more.
    /// Without a shift it is perpendicular to `forward`, and its length is the cosine of half the field of view; 1
    /// without perspective.
    across: Vec3,
    /// Without a shift, the sine of half the field of view; 0 without perspective.
    slope: f32,
    /// In metres, with tolerance.
    offset: f32,
}

/// The dot products of a point c, relative to the camera, that all planes are evaluated from.
#[derive(Clone, Copy)]
pub(super) struct CameraPoint {
    /// `forward · c`.
    pub(super) forward: f32,
    /// `across · c` for both pairs of side planes.
    pub(super) across: [f32; 2],
    /// ‖c‖₁. [`ROUNDING_TOLERANCE`] times this bounds the rounding error of the distance from any plane: see
    /// [`Frustum::intersects_sphere`].
    pub(super) norm: f32,
}

impl Frustum {
    /// The frustum of `camera`.
    pub fn new(camera: &Camera) -> Self {
        let orientation = camera.orientation.as_dquat().normalize();
        let forward = orientation * DVec3::NEG_Z;
        let CameraPlanes { pairs, offsets, near, far } = CameraPlanes::new(camera);
        let axes = [DVec3::X, DVec3::Y].map(|axis| orientation * axis);
        let sides = from_fn(|pair| {
            let PairSlopes { slope, scale, skew } = pairs[pair];
            // Rounded up, so that the plane errs outwards.
            let offset = moved_outwards((offsets[pair] as f32).next_up());
            SidePlanes { across: (axes[pair] * scale - forward * skew).as_vec3(), slope: slope as f32, offset }
        });
        let normal = |pair: usize, sign: f64| {
            let [aside, along] = pairs[pair].normal(sign);
            (forward * along + axes[pair] * aside).as_vec3()
        };
        let (near, far) = (moved_outwards(near), moved_outwards(far));
        Self {
            origin: camera.position,
            forward: forward.as_vec3(),
            sides,
            near,
            far,
            planes: planes(forward.as_vec3(), near, far, &sides),
            normals: [forward.as_vec3(), normal(0, 1.0), normal(0, -1.0), normal(1, 1.0), normal(1, -1.0)],
        }
    }

    /// Whether a sphere intersects the frustum. The test is conservative: never `false` for a sphere that does,
    /// sometimes `true` for one just outside.
    ///
    /// With u = 2⁻²⁴, and N = ‖c‖₁ of the centre relative to the camera, to first order: forward·c carries five
    /// roundings (of the normal, of the centre, of the product, and of two sums), so its error is at most 5uN; times
    /// the slope, the error is 7u·slope·N. The error of across·c is 5u·|across|·N. Their difference and its sum with
    /// the offset o add 2u(slope + |across|)N and u|o|. Slope and |across| are sine and cosine of one angle, so the
    /// error of the distance from a side plane is at most (9·slope + 7·|across|)uN + u|o| ≤ 11.5uN + u|o|, and that
    /// from the near or the far plane 6uN + u|o|. With a shift, let h and m be the tangents of half the picture and of
    /// its centre. Then slope is h ÷ √(1 + (h + |m|)²) and |across| is √(1 + m²) ÷ √(1 + (h + |m|)²), and the sum is
    /// smaller. The tolerance is 16u(N + r) in the sphere's radius and 16u|o| in the offset, which also covers the
    /// tolerance's own rounding. Subnormal numbers lose less than the smallest normal number, which the offset includes
    /// as well. The bound consists of magnitudes from before any cancellation.
    ///
    /// NaN does not intersect. A centre so far away that it overflows does.
    #[inline]
    pub fn intersects_sphere(&self, center: DVec3, radius: f32) -> bool {
        let point = self.camera_point((center - self.origin).as_vec3().to_array());
        self.signed_distance(point) >= -tolerant_radius(radius, point)
    }

    /// Tests the 64 spheres from `first` on. Bit 0 of the mask is `first`.
    ///
    /// # Panics
    /// If there are fewer than 64 spheres from `first` on.
    pub fn intersects_spheres(&self, spheres: &BoundingSpheres, first: usize) -> u64 {
        intersecting_spheres(self, spheres, first)
    }

    /// Like [`Frustum::intersects_spheres`], and also finds the spheres that are entirely inside. That costs a third
    /// more; where the caller ignores it, inlining removes it.
    #[inline(always)]
    pub(super) fn classify_spheres(&self, spheres: &BoundingSpheres, first: usize) -> Classified {
        let entries = first..first + BITS_PER_WORD;
        let [x, y, z] = spheres.coordinates().each_ref().map(|axis| axis[entries.clone()].as_chunks().0);
        let radii = spheres.radii()[entries].as_chunks::<LANES>().0;
        let mut classified = Classified { intersecting: 0, inside: 0 };
        for (group, (((x, y), z), radii)) in x.iter().zip(y).zip(z).zip(radii).enumerate() {
            let [x, y, z] = self.camera_relative([x, y, z]);
            // Loops over arrays of a fixed length compile to vector instructions.
            let (mut distances, mut radii_with_tolerance) = ([0.0; LANES], [0.0; LANES]);
            for lane in 0..LANES {
                let point = self.camera_point([x[lane], y[lane], z[lane]]);
                distances[lane] = self.signed_distance(point);
                radii_with_tolerance[lane] = tolerant_radius(radii[lane], point);
            }
            classified.intersecting |=
                lane_mask(|lane| distances[lane] >= -radii_with_tolerance[lane]) << (group * LANES);
            classified.inside |= lane_mask(|lane| distances[lane] >= radii_with_tolerance[lane]) << (group * LANES);
        }
        classified
    }

    /// World-space positions relative to the camera, in metres.
    #[inline(always)]
    pub(super) fn camera_relative(&self, [x, y, z]: [&[f64; LANES]; 3]) -> [[f32; LANES]; 3] {
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
    pub(super) fn camera_point(&self, [x, y, z]: [f32; 3]) -> CameraPoint {
        let dot = |normal: Vec3| normal.x * x + normal.y * y + normal.z * z;
        CameraPoint {
            forward: dot(self.forward),
            across: [dot(self.sides[0].across), dot(self.sides[1].across)],
            norm: x.abs() + y.abs() + z.abs(),
        }
    }

    /// The least of a point's signed distances from all planes; positive inside.
    #[inline(always)]
    fn signed_distance(&self, CameraPoint { forward, across, .. }: CameraPoint) -> f32 {
        let from_sides = |pair: usize| {
            let planes = &self.sides[pair];
            planes.slope * forward - across[pair].abs() + planes.offset
        };
        let distance = min(from_sides(1), min(from_sides(0), f32::MAX));
        min(self.far - forward, min(forward + self.near, distance))
    }
}

impl SidePlanes {
    /// A point's signed distances from both planes; positive inside.
    #[inline(always)]
    pub(super) fn distances(&self, forward: f32, across: f32) -> [f32; 2] {
        let middle = self.slope * forward;
        [middle + across + self.offset, middle - across + self.offset]
    }
}

/// See [`Frustum::planes`].
fn planes(forward: Vec3, near: f32, far: f32, sides: &[SidePlanes; 2]) -> [([f64; 3], f64); 6] {
    let forward = forward.as_dvec3();
    let side = |pair: usize, sign: f64| {
        let SidePlanes { across, slope, offset } = sides[pair];
        let normal = forward * f64::from(slope) + across.as_dvec3() * sign;
        (normal.to_array(), f64::from(offset))
    };
    [
        (forward.to_array(), f64::from(near)),
        ((-forward).to_array(), f64::from(far)),
        side(0, 1.0),
        side(0, -1.0),
        side(1, 1.0),
        side(1, -1.0),
    ]
}

/// [`Frustum::intersects_spheres`].
#[multiversion(targets("x86_64+avx2"))]
fn intersecting_spheres(frustum: &Frustum, spheres: &BoundingSpheres, first: usize) -> u64 {
    frustum.classify_spheres(spheres, first).intersecting
}

/// A sphere's radius with the tolerance for rounding.
#[inline(always)]
fn tolerant_radius(radius: f32, point: CameraPoint) -> f32 {
    radius + ROUNDING_TOLERANCE * (point.norm + radius)
}

/// How spheres lie relative to the frustum: a bit for each sphere.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Classified {
    /// Spheres that intersect the frustum or lie inside.
    pub(super) intersecting: u64,
    /// Spheres entirely inside all planes.
    pub(super) inside: u64,
}

/// The number of volumes tested together: as many f32 as fit into the vector registers of any supported processor.
pub(super) const LANES: usize = 8;

/// The lesser of two numbers; the second if the first is NaN. Unlike [`f32::min`], it compiles to one instruction.
#[inline(always)]
pub(super) fn min(one: f32, other: f32) -> f32 {
    if one < other { one } else { other }
}

/// A mask of the lanes for which a predicate holds.
#[inline(always)]
pub(super) fn lane_mask(predicate: impl Fn(usize) -> bool) -> u64 {
    (0..LANES).fold(0, |mask, lane| mask | u64::from(predicate(lane)) << lane)
}

/// An offset with the tolerance for its own rounding, and for subnormal numbers.
fn moved_outwards(offset: f32) -> f32 {
    offset + ROUNDING_TOLERANCE * offset.abs() + f32::MIN_POSITIVE
}

/// 16 unit roundoffs of 2⁻²⁴ each: see [`Frustum::intersects_sphere`].
pub(super) const ROUNDING_TOLERANCE: f32 = 16.0 * (f32::EPSILON / 2.0);

#[cfg(test)]
pub(super) mod tests {
    use glam::Quat;
    use proptest::prelude::*;

    use super::*;
    use crate::scene::{Projection, ViewKind};
    use crate::view::BoundingSphere;

    /// The least distance of a point inside the camera's planes, in f64, from the camera's definition.
    fn depth_inside(camera: &Camera, center: DVec3) -> f64 {
        let local = camera.orientation.as_dquat().normalize().inverse() * (center - camera.position);
        let away = -local.z;
        let aspect = f64::from(camera.size[0]) / f64::from(camera.size[1]);
        let (near, far) = (away - f64::from(camera.near), f64::from(camera.far) - away);
        let distances = match camera.projection {
            Projection::Perspective { field_of_view } => {
                let half = (f64::from(field_of_view) * 0.5).tan();
                let halves = [half * aspect, half];
                // The distance from the lines through the camera at both ends of the picture.
                let edge = |aside: f64, pair: usize| {
                    let [low, high] = [-1.0, 1.0].map(|end| (end + f64::from(camera.shift[pair])) * halves[pair]);
                    let from = |slope: f64, sign: f64| sign * (aside - away * slope) / slope.hypot(1.0);
                    from(low, 1.0).min(from(high, -1.0))
                };
                [near, far, edge(local.x, 0), edge(local.y, 1)]
            }
            Projection::Orthographic { height } => {
                let half = f64::from(height) * 0.5;
                let near = if camera.kind == ViewKind::Shadow { f64::INFINITY } else { near };
                [near, far, half * aspect - local.x.abs(), half - local.y.abs()]
            }
            // The planes enclose a hemisphere; it suffices that no part of it is outside them.
            Projection::Paraboloid => [away, f64::from(camera.far) - local.length(), f64::INFINITY, f64::INFINITY],
        };
        distances.into_iter().fold(f64::INFINITY, f64::min)
    }

    /// The least length of a side plane's normal: a sphere is culled if it is 1 ÷ that of its radius outside.
    fn least_normal(camera: &Camera) -> f64 {
        let Projection::Perspective { field_of_view } = camera.projection else { return 1.0 };
        let half = (f64::from(field_of_view) * 0.5).tan();
        let of_pair = |half: f64, shift: f32| {
            let [one, other] = [-1.0, 1.0].map(|end| ((f64::from(shift) + end) * half).hypot(1.0));
            one.min(other) / one.max(other)
        };
        of_pair(half * f64::from(camera.aspect()), camera.shift.x).min(of_pair(half, camera.shift.y))
    }

    prop_compose! {
        pub(in crate::view) fn any_camera()(
            position in prop::array::uniform3(-1.0..1.0_f64),
            exponent in 0.0..9.0_f64,
            axis in prop::array::uniform3(-1.0..1.0_f32),
            angle in 0.0..std::f32::consts::TAU,
            degrees in 0.1..179.0_f32,
            width in 1_u32..4000,
            height in 1_u32..4000,
            near_exponent in -5.0..2.0_f32,
            far_exponent in 0.001..6.0_f32,
            projection in 0_usize..4,
            shift in prop::array::uniform2(-3.0..3.0_f32),
            is_shifted in any::<bool>(),
        ) -> Camera {
            let mut camera = Camera::looking_at("any", DVec3::from(position) * 10_f64.powf(exponent), DVec3::ZERO);
            camera.orientation = Quat::from_axis_angle(Vec3::from(axis).normalize_or(Vec3::X), angle);
            camera.size = [width, height];
            camera.near = 10_f32.powf(near_exponent);
            let perspective = Projection::Perspective { field_of_view: degrees.to_radians() };
            camera.projection = match projection {
                0 | 1 => perspective,
                2 => Projection::Orthographic { height: degrees * camera.near },
                _ => Projection::Paraboloid,
            };
            if projection < 2 && is_shifted {
                camera.shift = shift.into();
            }
            // One perspective camera in two has an infinite far plane.
            if projection != 0 {
                camera.far = camera.near * 10_f32.powf(far_exponent);
            }
            camera.kind = if projection == 3 || width % 2 == 0 { ViewKind::Shadow } else { ViewKind::Main };
            camera
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(20_000))]

        /// Each sphere almost touches the nearest plane.
        #[test]
        fn a_visible_sphere_is_never_culled(
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
        fn a_sphere_well_outside_is_culled(
            camera in any_camera(),
            direction in prop::array::uniform3(-1.0..1.0_f64),
            exponent in -3.0..7.0_f64,
        ) {
            let center = camera.position + DVec3::from(direction).normalize_or(DVec3::X) * 10_f64.powf(exponent);
            let depth = depth_inside(&camera, center);
            let far = if camera.far.is_finite() { f64::from(camera.far) } else { 0.0 };
            let slack = 4e-6 * ((center - camera.position).length() + f64::from(camera.near) + far);
            let outside = -depth * least_normal(&camera) - slack;
            if outside > 0.0 && camera.projection != Projection::Paraboloid {
                let radius = outside as f32;
                prop_assert!(!Frustum::new(&camera).intersects_sphere(center, radius), "depth {depth} radius {radius}");
            }
        }
    }

    // Each case has 256 spheres.
    proptest! {
        #![proptest_config(ProptestConfig::with_cases(500))]

        #[test]
        fn testing_spheres_together_gives_the_same_result_as_one_by_one(
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
                    0 => BoundingSphere::EMPTY,
                    1 => BoundingSphere { center: DVec3::NAN, radius: 1.0 },
                    2 => BoundingSphere { center, radius: f32::INFINITY },
                    _ => BoundingSphere { center, radius: 10_f32.powf(radius) },
                };
                spheres.set(entry, bounds);
            }
            for first in [0, 64, 100, 192] {
                let together = frustum.intersects_spheres(&spheres, first);
                for entry in 0..BITS_PER_WORD {
                    let BoundingSphere { center, radius } = spheres.get(first + entry);
                    prop_assert_eq!(together >> entry & 1 == 1, frustum.intersects_sphere(center, radius), "{} {}", center, radius);
                }
            }
        }
    }

    #[test]
    fn a_paraboloid_culls_spheres_behind_it_and_beyond_its_range() {
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
    fn nan_does_not_intersect() {
        let camera = Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z);
        let frustum = Frustum::new(&camera);
        assert!(frustum.intersects_sphere(DVec3::NEG_Z * 5.0, 1.0));
        assert!(!frustum.intersects_sphere(DVec3::NEG_Z * f64::NAN, 1.0));
        assert!(!frustum.intersects_sphere(DVec3::NEG_Z * 5.0, f32::NEG_INFINITY));
    }
}
