//! Where in the picture a light may reach.

use crate::process::{LightValues, ViewValues};
use crate::raster::{PixelBounds, Real, Vector3};
use crate::scene::{LightKind, Projection};

/// What of a picture a light may reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reached {
    /// Pixels among which are all whose surface it reaches.
    pub(super) bounds: PixelBounds,
    /// Depths between which those surfaces lie.
    pub(super) depths: [f64; 2],
}

/// What a light may reach: it reaches no farther than its range, so that is a ball, whose outline and whose two ends along the
/// camera's axis are found in f64, whatever the twin computes in.
///
/// What the twin rounds is allowed for: around the outline a pixel and a thousandth of the ball, and along the axis a thousandth
/// of the range and a hundred-thousandth of the distance, a hundred times what f32 rounds. Where the camera is inside of the ball or
/// beside it, the outline is the whole picture.
pub(super) fn reached_by<R: Real>(view: &ViewValues<R>, light: &LightValues<R>) -> Reached {
    let whole = Reached { bounds: PixelBounds::of_picture(view.size), depths: [0.0, f64::INFINITY] };
    if light.kind == LightKind::Directional {
        return whole;
    }
    let double = |vector: Vector3<R>| vector.0.map(Real::as_f64);
    let (position, range) = (double(light.position), light.range.as_f64());
    let along = |axis: Vector3<R>| {
        let axis = double(axis);
        let length = dot(axis, axis).sqrt();
        (dot(axis, position) / length, length)
    };
    let ahead = along(view.forward).0;
    let [columns, rows] =
        [(view.right, view.size[0], 1.0), (view.up, view.size[1], -1.0)].map(|(axis, pixels, sign)| {
            let (aside, half) = along(axis);
            let [low, high] = match view.projection {
                Projection::Perspective { .. } => seen_in_perspective(aside, ahead, range)?,
                Projection::Orthographic { .. } => [aside - range, aside + range],
                Projection::Paraboloid => return None,
            };
            let slack = (high - low) * 1e-3;
            let place = |value: f64| (sign * value / half * 0.5 + 0.5) * pixels as f64;
            let [one, other] = [place(low - slack), place(high + slack)];
            let (first, last) = (one.min(other) - 1.0, one.max(other) + 1.0);
            // What is not a number, as of a light that is infinitely large, is everywhere.
            (first <= last).then(|| (first.max(0.0) as usize, (last.ceil().max(0.0) as usize).min(pixels)))
        });
    let bounds = match (columns, rows) {
        (Some((left, right)), Some((top, bottom))) => PixelBounds { left, top, right, bottom },
        _ => whole.bounds,
    };
    let slack = range * 1e-3 + ahead.abs() * 1e-5;
    let ends = [ahead + range + slack, ahead - range - slack];
    Reached { bounds, depths: depths_between(view, ends).unwrap_or(whole.depths) }
}

/// The depths at the farther and at the nearer of two distances along the camera's axis; `None` where that cannot be said.
fn depths_between<R: Real>(view: &ViewValues<R>, ends: [f64; 2]) -> Option<[f64; 2]> {
    let (near, far) = (view.near.as_f64(), view.far.as_f64());
    let depths = match view.projection {
        Projection::Perspective { .. } => {
            // What lies behind the camera is behind all that is seen.
            ends.map(|distance| if distance > 0.0 { near / distance } else { f64::INFINITY })
        }
        Projection::Orthographic { .. } => ends.map(|distance| (far - distance) / (far - near)),
        Projection::Paraboloid => return None,
    };
    depths.iter().all(|depth| !depth.is_nan()).then_some(depths)
}

/// Between which slopes a disc is seen whose centre is so far aside and ahead; `None` where some of it is beside the eye.
///
/// The lines through the eye that touch the disc have the slopes (a·z ± r·√(a² + z² − r²)) ÷ (z² − r²).
fn seen_in_perspective(aside: f64, ahead: f64, radius: f64) -> Option<[f64; 2]> {
    let squared = ahead * ahead - radius * radius;
    let root = radius * (aside * aside + squared).sqrt();
    // Close to the eye's own plane the slopes are without bound.
    (ahead > radius * 1.001).then(|| [(aside * ahead - root) / squared, (aside * ahead + root) / squared])
}

fn dot(one: [f64; 3], other: [f64; 3]) -> f64 {
    one.iter().zip(other).map(|(one, other)| one * other).sum()
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use glam::{DVec3, Quat, Vec3};
    use proptest::prelude::*;

    use super::*;
    use crate::backend::software::values::{exact_view, light_of_record};
    use crate::scene::{Assets, Camera, Light, SceneRef};
    use crate::view::{GpuLight, RenderView};

    const SIZE: [u32; 2] = [160, 90];

    fn view_of(camera: &Camera) -> ViewValues<f64> {
        let assets = Assets::default();
        let scene = SceneRef {
            positions: &[],
            orientations: &[],
            scales: &[],
            bounds: &[],
            meshes: &[],
            materials: &[],
            assets: &assets,
            lights: &[],
            cameras: &[],
            ambient: Vec3::ZERO,
            background: Vec3::ZERO,
        };
        exact_view(&RenderView::new(camera), &scene)
    }

    fn reached(camera: &Camera, position: DVec3, range: f32) -> Reached {
        let light = Light::Point { position, intensity: Vec3::ONE, range };
        reached_by(&view_of(camera), &light_of_record(&GpuLight::new(&light, camera.position, None)))
    }

    fn bounds_of(camera: &Camera, position: DVec3, range: f32) -> PixelBounds {
        reached(camera, position, range).bounds
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4_000))]

        /// Whatever of a light's ball lies in a pixel is within the bounds.
        #[test]
        fn they_hold_all_that_a_light_reaches(
            position in prop::array::uniform3(-30.0..30.0_f64),
            exponent in -2.0..2.0_f64,
            direction in prop::array::uniform3(-1.0..1.0_f64),
            share in 0.9..1.0_f64,
            degrees in 1.0..170.0_f32,
            turn in 0.0..6.3_f32,
            is_flat in any::<bool>(),
        ) {
            let mut camera = Camera::looking_at("main", DVec3::new(1e5, 2.0, 3.0), DVec3::ZERO);
            camera.orientation = Quat::from_rotation_y(turn);
            camera.size = SIZE;
            let perspective = Projection::Perspective { field_of_view: degrees.to_radians() };
            camera.projection = if is_flat { Projection::Orthographic { height: degrees } } else { perspective };
            camera.far = 1e4;
            let position = camera.position + DVec3::from(position);
            let range = 10_f64.powf(exponent);
            let Reached { bounds, depths } = reached(&camera, position, range as f32);
            let direction = DVec3::from(direction).normalize_or(DVec3::X);
            let place = position + direction * (range * share) - camera.position;

            let clip = RenderView::new(&camera).clip_from_relative().as_dmat4() * place.extend(1.0);
            let (x, y) = (clip.x / clip.w, clip.y / clip.w);
            let column = ((x * 0.5 + 0.5) * f64::from(SIZE[0])).floor();
            let row = ((0.5 - y * 0.5) * f64::from(SIZE[1])).floor();
            let is_seen = clip.w > 1e-3 && (0.0..f64::from(SIZE[0])).contains(&column) && (0.0..f64::from(SIZE[1])).contains(&row);
            if is_seen {
                let (column, row) = (column as usize, row as usize);
                let is_within = (bounds.left..bounds.right).contains(&column) && (bounds.top..bounds.bottom).contains(&row);
                prop_assert!(is_within, "({column}, {row}) is not in {bounds:?}");
                let depth = clip.z / clip.w;
                prop_assert!(depths[0] <= depth && depth <= depths[1], "{depth} is not in {depths:?}");
            }
        }
    }

    #[test]
    fn a_small_light_far_away_has_small_bounds() {
        let camera = Camera { size: SIZE, ..Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z) };
        let PixelBounds { left, top, right, bottom } = bounds_of(&camera, DVec3::NEG_Z * 50.0, 1.0);
        // 2 m at 50 m are 3 of 90 rows.
        assert!(left >= 75 && right <= 85 && top >= 40 && bottom <= 50, "{left} {top} {right} {bottom}");
        assert!(left < 79 && right > 81 && top < 44 && bottom > 46);
        for inside in [DVec3::ZERO, DVec3::NEG_Z, DVec3::X * 0.9] {
            assert_eq!(bounds_of(&camera, inside, 1.0), PixelBounds::of_picture([160, 90]));
        }
        let beside = bounds_of(&camera, DVec3::new(1e3, 0.0, -10.0), 1.0);
        assert!(beside.is_empty(), "{beside:?}");
    }
}
