//! Light volumes: geometry around what a light reaches.

use std::f64::consts::TAU;

use glam::DVec3;

use crate::scene::LightVolume;

impl LightVolume {
    /// Three corners for each triangle, counter-clockwise seen from outside. The volumes are closed.
    ///
    /// A sphere's corners are positions; a cone's are (x, y, tier), as `cone_corner` takes them; the screen's are (x,
    /// y) in clip space and 0.
    pub(crate) fn corners(self) -> Vec<[f32; 3]> {
        match self {
            Self::Sphere => sphere(),
            Self::Cone => cone(),
            Self::Screen => vec![[-1.0, -1.0, 0.0], [3.0, -1.0, 0.0], [-1.0, 3.0, 0.0]],
        }
    }
}

/// How far a volume exceeds what the light reaches, as a fraction of its range.
const GROWTH: f32 = 1e-4;

const SIDES: usize = 16;

const TIP: f32 = 0.0;
const NEAR_RING: f32 = 1.0;
const FAR_RING: f32 = 2.0;
const FAR_MIDDLE: f32 = 3.0;

/// An icosahedron with each face split into four and the corners moved to the unit sphere, scaled so that it contains
/// the sphere.
fn sphere() -> Vec<[f32; 3]> {
    let split = |[a, b, c]: [DVec3; 3]| {
        let [ab, bc, ca] = [a + b, b + c, c + a].map(DVec3::normalize);
        [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    };
    let faces: Vec<_> = icosahedron().into_iter().flat_map(split).collect();
    let distance = |&[a, b, c]: &[DVec3; 3]| (b - a).cross(c - a).normalize().dot(a);
    let nearest = faces.iter().map(distance).fold(f64::INFINITY, f64::min);
    let scale = (1.0 + f64::from(GROWTH)) / nearest;
    faces.into_iter().flatten().map(|corner| (corner * scale).as_vec3().to_array()).collect()
}

/// The twenty faces of an icosahedron, with corners at distance 1.
fn icosahedron() -> Vec<[DVec3; 3]> {
    let golden = (1.0 + 5_f64.sqrt()) / 2.0;
    let signs = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
    let rectangles = signs.map(|[one, other]| {
        let (short, long) = (one, other * golden);
        [DVec3::new(0.0, short, long), DVec3::new(short, long, 0.0), DVec3::new(long, 0.0, short)]
    });
    let corners = rectangles.as_flattened();
    // Neighbours are at a distance of 2, other corners at more than 3.
    let are_neighbours = |one: DVec3, other: DVec3| one.distance_squared(other) < 5.0;
    let mut faces = Vec::new();
    for (index, &a) in corners.iter().enumerate() {
        let after = &corners[index + 1..];
        for (index, &b) in after.iter().enumerate().filter(|&(_, &b)| are_neighbours(a, b)) {
            for &c in after[index + 1..].iter().filter(|&&c| are_neighbours(a, c) && are_neighbours(b, c)) {
                let face = if a.cross(b).dot(c) > 0.0 { [a, b, c] } else { [a, c, b] };
                faces.push(face.map(DVec3::normalize));
            }
        }
    }
    faces
}

fn cone() -> Vec<[f32; 3]> {
    let around = |side: usize, tier: f32| {
        let (sine, cosine) = (TAU * (side % SIDES) as f64 / SIDES as f64).sin_cos();
        [cosine as f32, sine as f32, tier]
    };
    let (tip, far_middle) = ([0.0, 0.0, TIP], [0.0, 0.0, FAR_MIDDLE]);
    let side = |side: usize| {
        let [near, near_next] = [side, side + 1].map(|side| around(side, NEAR_RING));
        let [far, far_next] = [side, side + 1].map(|side| around(side, FAR_RING));
        [[tip, near_next, near], [near, near_next, far_next], [near, far_next, far], [far, far_next, far_middle]]
    };
    (0..SIDES).flat_map(side).flatten().collect()
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;
    use std::f64::consts::{FRAC_PI_2, PI};

    use glam::Vec3;
    use proptest::prelude::*;

    use super::*;

    /// The position of a corner (x, y, tier) of `LightVolume::Cone`, in metres, for a light at the origin that shines
    /// along +Z.
    ///
    /// A light of half-angle α reaches, within its range r, no farther out than r·sin α, and no farther ahead than r.
    /// So the cone ends at r·cos α, with a radius of r·sin α, and a cylinder continues to r.
    ///
    /// Tier 0 is the tip, 1 and 2 are the rings at the cylinder's two ends, 3 is the middle of its far end. The radius
    /// and the far end are larger by a ten-thousandth of the range, and the tip and its cone are moved back by as much,
    /// to cover rounding in the shader.
    ///
    /// `cosine_of_half_angle` is clamped to 0 to 1. `range` is in metres. It is the same function as in
    /// `light_volume.wgsl`.
    fn cone_corner(corner: [f32; 3], cosine_of_half_angle: f32, range: f32) -> Vec3 {
        let [x, y, tier] = corner;
        let along = cosine_of_half_angle.clamp(0.0, 1.0);
        let sine = ((1.0 - along * along).max(0.0) + COSINE_ROUNDING).sqrt();
        let radius = (sine + GROWTH) / APOTHEM;
        let height = match tier {
            TIP => -GROWTH,
            NEAR_RING => along - GROWTH,
            _ => 1.0 + GROWTH,
        };
        Vec3::new(x * radius, y * radius, height) * range
    }

    /// How much greater the sine's square may be than the cosine implies. Near 1 a cosine in f32 is off by up to 2⁻²⁵,
    /// and so is the one that a shader compares it with; at 0° that hides an angle of some 0.03°.
    const COSINE_ROUNDING: f32 = 1.0 / (1 << 22) as f32;

    /// cos(π/16): the middle of each side is closer to the axis than its edges by this factor.
    const APOTHEM: f32 = 0.980_785_3;

    type Triangle = [DVec3; 3];

    fn triangles(corners: &[Vec3]) -> Vec<Triangle> {
        corners.as_chunks().0.iter().map(|corners| corners.map(|corner| corner.as_dvec3())).collect()
    }

    fn unit_sphere() -> Vec<Triangle> {
        triangles(&LightVolume::Sphere.corners().into_iter().map(Vec3::from).collect::<Vec<_>>())
    }

    fn placed_cone(cosine: f32, range: f32) -> Vec<Triangle> {
        let position = |corner: [f32; 3]| cone_corner(corner, cosine, range);
        triangles(&LightVolume::Cone.corners().into_iter().map(position).collect::<Vec<_>>())
    }

    fn volume(triangles: &[Triangle]) -> f64 {
        triangles.iter().map(|[a, b, c]| a.dot(b.cross(*c)) / 6.0).sum()
    }

    /// A point's greatest distance outside of the planes; negative inside.
    fn distance_outside(triangles: &[Triangle], point: DVec3) -> f64 {
        let outside = |&[a, b, c]: &Triangle| (b - a).cross(c - a).normalize().dot(point - a);
        triangles.iter().map(outside).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Whether each edge occurs once in each direction.
    fn is_closed(corners: &[[f32; 3]]) -> bool {
        let bits = |corner: [f32; 3]| corner.map(f32::to_bits);
        let (triangles, rest) = corners.as_chunks::<3>();
        let edges = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).map(|edge| edge.map(bits));
        let edges: Vec<_> = edges.collect();
        let distinct: HashSet<_> = edges.iter().copied().collect();
        rest.is_empty() && distinct.len() == edges.len() && edges.iter().all(|&[a, b]| distinct.contains(&[b, a]))
    }

    #[test]
    fn volumes_are_closed() {
        assert!(is_closed(&LightVolume::Sphere.corners()));
        assert!(is_closed(&LightVolume::Cone.corners()));
        assert_eq!(LightVolume::Sphere.corners().len(), 80 * 3);
        assert_eq!(LightVolume::Cone.corners().len(), 64 * 3);
    }

    #[test]
    fn the_sphere_contains_the_unit_sphere_with_little_margin() {
        let sphere = unit_sphere();
        for [a, b, c] in &sphere {
            let across = (b - a).cross(c - a);
            assert!(across.normalize().dot(*a) >= 1.0 + 0.9e-4);
            assert!(across.dot(a + b + c) > 0.0);
        }
        let furthest = sphere.as_flattened().iter().map(|corner| corner.length()).fold(0.0, f64::max);
        assert!(furthest < 1.08, "{furthest}");
        let share = volume(&sphere) / (4.0 / 3.0 * PI);
        assert!((1.0..1.13).contains(&share), "{share}");
    }

    /// The planes are those of the convex hull, since no corner is outside any of them.
    #[test]
    fn every_cone_is_convex_and_faces_outwards() {
        for degrees in 0..=90 {
            let cone = placed_cone((f64::from(degrees).to_radians().cos()) as f32, 3.0);
            for &corner in cone.as_flattened() {
                let outside = distance_outside(&cone, corner);
                assert!(outside < 1e-6, "{degrees}: {outside}");
            }
            assert!(volume(&cone) > 0.0);
        }
    }

    #[test]
    fn a_cone_is_no_larger_than_it_has_to_be() {
        for (half_angle, most) in
            [(0.001, 1.4), (0.01, 1.04), (0.1, 1.022), (0.8, 1.02), (1.2, 1.02), (FRAC_PI_2, 1.02)]
        {
            let (sine, cosine) = f64::sin_cos(half_angle);
            let cone = placed_cone(cosine as f32, 1.0);
            let radius = cone.as_flattened().iter().map(|corner| corner.truncate().length()).fold(0.0, f64::max);
            assert!((1.0..most).contains(&(radius / sine)), "{half_angle}: {}", radius / sine);
            let heights: Vec<_> = cone.as_flattened().iter().map(|corner| corner.z).collect();
            let lowest = heights.iter().copied().fold(0.0, f64::min);
            let highest = heights.iter().copied().fold(0.0, f64::max);
            assert!((0.9e-4..1.1e-4).contains(&-lowest) && (0.9e-4..1.1e-4).contains(&(highest - 1.0)));
        }
    }

    #[test]
    fn cosines_beyond_the_ends_count_as_the_ends() {
        assert_eq!(placed_cone(1.5, 2.0), placed_cone(1.0, 2.0));
        assert_eq!(placed_cone(-4.4e-8, 2.0), placed_cone(0.0, 2.0));
        assert!(placed_cone(0.0, 1e30).as_flattened().iter().all(|corner| corner.is_finite()));
    }

    #[test]
    fn the_screen_is_covered() {
        let screen = LightVolume::Screen.corners();
        let [a, b, c] = [0, 1, 2].map(|corner| Vec3::from(screen[corner]).truncate());
        for point in [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]].map(glam::Vec2::from) {
            assert!([[a, b], [b, c], [c, a]].iter().all(|[one, other]| (other - one).perp_dot(point - one) >= 0.0));
        }
        assert_eq!(screen.len(), 3);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(5_000))]

        /// Points at the very end of the light, at its edge, and anywhere in it. The cosine is as it comes out of f32.
        #[test]
        fn all_that_a_light_reaches_is_in_its_volume(
            half_angle in prop_oneof![0.001_f64.to_radians()..=0.01, 0.0..=FRAC_PI_2, Just(FRAC_PI_2)],
            around in 0.0..TAU,
            share_of_angle in prop_oneof![Just(1.0), 0.0..1.0],
            share_of_range in prop_oneof![Just(1.0), 0.0..1.0],
            exponent in -30.0..30.0_f32,
        ) {
            let range = 10_f32.powf(exponent);
            let (sine, cosine) = (half_angle * share_of_angle).sin_cos();
            let direction = DVec3::new(sine * around.cos(), sine * around.sin(), cosine);
            let point = direction * share_of_range;

            prop_assert!(distance_outside(&unit_sphere(), point) < 0.0);
            let cone = placed_cone((half_angle as f32).cos(), range);
            // In units of the range, so that nothing is lost to the smallest numbers.
            let cone: Vec<_> = cone.into_iter().map(|face| face.map(|corner| corner / f64::from(range))).collect();
            let outside = distance_outside(&cone, point);
            prop_assert!(outside < 0.0, "{outside} outside");
        }
    }
}
