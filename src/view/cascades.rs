//! Cascades: slices of what a main camera sees, for each of which a directional light has a map (Zhang et al. 2006,
//! "Parallel-Split Shadow Maps for Large-scale Virtual Environments").

use glam::{DVec2, DVec3};

use crate::scene::{Camera, Projection};

/// The distances from a camera between which a cascade lies, in metres, of `count` cascades that reach to `far`. The
/// first begins at the camera.
///
/// It is the practical split scheme: a pixel of the map seen at distance d is magnified by 1/d, so that splits at equal
/// ratios, near·(far/near)^(i/count), give all cascades the same error; but they leave nearly all maps to the first
/// metres. `lambda` blends them with splits at equal depths. A near plane below a thousandth of `far` counts as that.
pub(super) fn cascade_slice([near, far]: [f32; 2], lambda: f32, cascade: u32, count: u32) -> [f64; 2] {
    let (far, lambda) = (f64::from(far), f64::from(lambda));
    let near = f64::from(near).max(far * MIN_NEAR_SHARE).min(far);
    [cascade, cascade + 1].map(|split| match split {
        0 => 0.0,
        _ if split == count => far,
        _ => {
            let share = f64::from(split) / f64::from(count);
            let (logarithmic, uniform) = (near * (far / near).powf(share), near + (far - near) * share);
            logarithmic * lambda + uniform * (1.0 - lambda)
        }
    })
}

/// A sphere around all that a camera sees between the two distances of `slice`, and all that the whole picture shows of
/// which it draws a part: its centre in the world and its radius, in metres. Its size does not change when the camera
/// moves, turns or is jittered. `None` where no finite sphere is around what it sees.
pub(super) fn visible_sphere(camera: &Camera, [begin, end]: [f64; 2]) -> Option<(DVec3, f64)> {
    let sphere = (end > 0.0 && begin <= end).then(|| slice_sphere(camera, [begin, end]));
    sphere.filter(|(center, radius)| center.is_finite() && radius.is_finite() && *radius > 0.0)
}

/// A sphere around what a camera sees between two distances.
fn slice_sphere(camera: &Camera, [begin, end]: [f64; 2]) -> (DVec3, f64) {
    let forward = camera.orientation.normalize().as_dquat() * DVec3::NEG_Z;
    let aspect = f64::from(camera.aspect());
    let whole = camera.whole_picture();
    match whole.map_or(camera.projection, |whole| whole.projection) {
        Projection::Perspective { .. } => {
            let corner = |projection: Projection, shift: DVec2| {
                let up = projection.half_height();
                DVec2::new(up * aspect, up) * (1.0 + shift)
            };
            // Less a pixel, so that a jitter of less than that changes nothing for a camera that is on centre.
            let pixel = 2.0 / DVec2::from(camera.size.map(f64::from));
            let shift = (camera.shift.abs().as_dvec2() - pixel).max(DVec2::ZERO);
            let own = corner(camera.projection, shift);
            let corner = whole.map_or(own, |whole| own.max(corner(whole.projection, whole.shift.abs().as_dvec2())));
            let spread = corner.length_squared();
            // The sphere through the near and the far corners, or around the far corners if it is larger.
            let along = (begin + end) * (1.0 + spread) * 0.5;
            if along < end {
                (camera.position + forward * along, (along - begin).hypot(begin * spread.sqrt()))
            } else {
                (camera.position + forward * end, end * spread.sqrt())
            }
        }
        Projection::Orthographic { height } => {
            let half = f64::from(height) * 0.5;
            let depth = end - begin;
            let radius = (half * half * (1.0 + aspect * aspect) + depth * depth * 0.25).sqrt();
            let position = whole.map_or(camera.position, |whole| whole.position);
            (position + forward * ((begin + end) * 0.5), radius)
        }
        Projection::Paraboloid => (camera.position, end),
    }
}

/// Splits at equal ratios to a near plane nearer than this share of the far one would leave the first cascades nothing
/// to see.
const MIN_NEAR_SHARE: f64 = 1e-3;

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::view::frustum::tests::any_camera;

    /// The corners, at a distance, of the smallest picture around the camera's own that is symmetric about its axis; in
    /// camera space.
    fn corners(camera: &Camera, along: f64) -> [DVec3; 4] {
        let aspect = f64::from(camera.size[0]) / f64::from(camera.size[1]);
        let [half_width, half_height] = match camera.projection {
            Projection::Perspective { field_of_view } => {
                let half = along * (f64::from(field_of_view) / 2.0).tan();
                // Less a pixel, which may be jitter.
                let shift = [0, 1].map(|pair| f64::from(camera.shift[pair].abs()) - 2.0 / f64::from(camera.size[pair]));
                [half * aspect * (1.0 + shift[0].max(0.0)), half * (1.0 + shift[1].max(0.0))]
            }
            Projection::Orthographic { height } => [f64::from(height) / 2.0 * aspect, f64::from(height) / 2.0],
            Projection::Paraboloid => unreachable!("it has no corners"),
        };
        [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]
            .map(|[x, y]| DVec3::new(x * half_width, y * half_height, -along))
    }

    proptest! {
        #[test]
        fn the_sphere_of_a_slice_is_the_smallest_around_its_corners(
            camera in any_camera(),
            begin in 0.0..50.0_f64,
            depth in prop_oneof![0.01..1.0_f64, 1.0..100.0_f64],
        ) {
            let end = begin + depth;
            let (center, radius) = slice_sphere(&camera, [begin, end]);
            let aside = center - camera.position;
            // The aspect ratio and the orientation are in f32.
            let rounding = 1e-6 * (radius + end) + 1e-15 * camera.position.length();
            if camera.projection == Projection::Paraboloid {
                prop_assert_eq!((aside, radius), (DVec3::ZERO, end));
            } else {
                let rotation = camera.orientation.normalize().as_dquat();
                let [near, far] = [begin, end].map(|along| {
                    let corners = corners(&camera, along);
                    corners.map(|corner| (rotation * corner).distance(aside)).into_iter().fold(0.0, f64::max)
                });
                let along = aside.dot(rotation * DVec3::NEG_Z);
                prop_assert!((aside.length() - along).abs() < rounding, "{} along the axis", along);
                prop_assert!(along < end + rounding, "{} beyond the far end", along);
                // The smallest one has its centre where both ends are equally far away, or at the far end if the near
                // one is within it.
                prop_assert!((far - radius).abs() < rounding && near < radius + rounding, "{} {} of {}", near, far, radius);
                prop_assert!(
                    (near - radius).abs() < rounding || (along - end).abs() < rounding,
                    "{} of {} at {}", near, radius, along,
                );
            }
        }

        #[test]
        fn the_last_cascade_ends_where_the_map_does(
            near in 1e-3..10.0_f32, depth in 0.1..1e4_f32, lambda in 0.0..1.0_f32, count in 1_u32..9,
        ) {
            let far = near + depth;
            prop_assert_eq!(cascade_slice([near, far], lambda, count - 1, count)[1], f64::from(far));
        }
    }

    #[test]
    fn a_slice_that_is_empty_or_endless_has_no_sphere() {
        let perspective = Camera::looking_at("main", DVec3::ZERO, DVec3::X);
        let paraboloid = Camera { projection: Projection::Paraboloid, ..perspective.clone() };
        for camera in [perspective, paraboloid] {
            let sphere = |slice: [f64; 2]| visible_sphere(&camera, slice);
            assert!(sphere([1.0, 2.0]).is_some());
            for slice in [[0.0, f64::INFINITY], [2.0, 1.0], [-2.0, -1.0], [0.0, 0.0], [f64::NAN, 1.0], [0.0, f64::NAN]]
            {
                assert_eq!(sphere(slice), None, "{slice:?}");
            }
        }
    }

    /// The ends of four cascades from 0.5 m to 40 m.
    fn ends(lambda: f32) -> Vec<f64> {
        let slices: Vec<_> = (0..4).map(|cascade| cascade_slice([0.5, 40.0], lambda, cascade, 4)).collect();
        assert!(slices[0][0] == 0.0 && slices.windows(2).all(|pair| pair[0][1] == pair[1][0]), "{slices:?}");
        slices.iter().map(|[_, end]| *end).collect()
    }

    #[test]
    fn slices_follow_each_other_from_equal_depths_to_equal_ratios() {
        let near = |found: Vec<f64>, expected: [f64; 4]| {
            assert!(found.iter().zip(&expected).all(|(found, end)| (found - end).abs() < 1e-9), "{found:?}");
        };
        near(ends(0.0), [10.375, 20.25, 30.125, 40.0]);
        // 80 = 2.99…⁴.
        let ratio = 80_f64.powf(0.25);
        let ratios = [1, 2, 3, 4].map(|power| 0.5 * ratio.powi(power));
        near(ends(1.0), ratios);
        near(ends(0.5), std::array::from_fn(|index| (ratios[index] + ends(0.0)[index]) / 2.0));
    }

    #[test]
    fn one_cascade_is_all_that_is_seen() {
        assert_eq!(cascade_slice([0.5, 40.0], 0.7, 0, 1), [0.0, 40.0]);
    }
}
