//! Cascades: slices of what main cameras see, for each of which a directional light has a map (Zhang et al. 2006,
//! "Parallel-Split Shadow Maps for Large-scale Virtual Environments").

use glam::{DVec2, DVec3};

use crate::scene::{Camera, Projection, ViewKind};

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

/// A sphere around all that the main cameras among `cameras` see between the two distances of `slice`: its centre in the
/// world and its radius, in metres. Its size does not change when a camera turns. `None` without a main camera, or where no finite sphere is
/// around what they see.
pub(super) fn visible_sphere(cameras: &[Camera], slice: impl Fn(&Camera) -> [f64; 2]) -> Option<(DVec3, f64)> {
    let main = cameras.iter().filter(|camera| camera.kind == ViewKind::Main);
    let spheres = main.map(|camera| {
        let [begin, end] = slice(camera);
        (end > 0.0 && begin <= end).then(|| slice_sphere(camera, [begin, end]))
    });
    let sphere = spheres.collect::<Option<Vec<_>>>()?.into_iter().reduce(enclosing_sphere);
    sphere.filter(|(center, radius)| center.is_finite() && radius.is_finite() && *radius > 0.0)
}

/// A sphere around what a camera sees between two distances, wherever it may be when the frame is submitted: a turn moves the sphere's centre
/// along a chord around the camera.
fn slice_sphere(camera: &Camera, slice: [f64; 2]) -> (DVec3, f64) {
    let (center, radius) = recorded_slice_sphere(camera, slice);
    let moves = camera.late_latch.map_or(0.0, |motion| {
        let bounds = motion.with_rounding();
        bounds.distance + bounds.moves_at(center.distance(camera.position))
    });
    (center, radius + moves)
}

/// A sphere around what the camera sees from where it is.
fn recorded_slice_sphere(camera: &Camera, [begin, end]: [f64; 2]) -> (DVec3, f64) {
    let forward = camera.orientation.normalize().as_dquat() * DVec3::NEG_Z;
    let aspect = f64::from(camera.aspect());
    match camera.projection {
        Projection::Perspective { field_of_view } => {
            let up = (f64::from(field_of_view) * 0.5).tan();
            // Less a pixel, so that a jitter of less than that changes nothing for a camera that is on centre.
            let pixel = 2.0 / DVec2::from(camera.size.map(f64::from));
            let shift = (camera.shift.abs().as_dvec2() - pixel).max(DVec2::ZERO);
            let corner = DVec2::new(up * aspect, up) * (1.0 + shift);
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
            (camera.position + forward * ((begin + end) * 0.5), radius)
        }
        Projection::Paraboloid => (camera.position, end),
    }
}

/// Splits at equal ratios to a near plane nearer than this share of the far one would leave the first cascades nothing
/// to see.
const MIN_NEAR_SHARE: f64 = 1e-3;

/// The smallest sphere around two spheres.
fn enclosing_sphere((one, one_radius): (DVec3, f64), (other, other_radius): (DVec3, f64)) -> (DVec3, f64) {
    let distance = one.distance(other);
    if distance + other_radius <= one_radius {
        (one, one_radius)
    } else if distance + one_radius <= other_radius {
        (other, other_radius)
    } else {
        let radius = (distance + one_radius + other_radius) * 0.5;
        (one.lerp(other, (radius - one_radius) / distance), radius)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
