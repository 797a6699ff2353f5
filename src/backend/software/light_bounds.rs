//! Conservative bounds of what a light reaches in the picture.

use crate::process::{ShaderLight, ShaderView};
use crate::raster::{PixelBounds, Real, Vector3};
use crate::scene::Projection;

/// Conservative bounds of what a light reaches in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LightBounds {
    /// These contain every pixel whose surface the light reaches.
    pub(super) pixels: PixelBounds,
    /// Those surfaces' depths lie between these.
    pub(super) depths: [f64; 2],
}

impl LightBounds {
    /// A light reaches no farther than its range, so it is bounded by a sphere. The sphere's outline and its two ends
    /// along the camera's axis are computed in f64, whatever precision the shader has.
    ///
    /// Margins cover the shader's rounding: a pixel and a thousandth of the sphere around the outline; along the axis a
    /// thousandth of the range and a hundred-thousandth of the distance, a hundred times the rounding of f32. If the
    /// camera is inside of the sphere or beside it, the outline is the whole picture.
    pub(super) fn new<R: Real>(view: &ShaderView<R>, light: &ShaderLight<R>) -> Self {
        let whole = Self { pixels: PixelBounds::of_picture(view.size), depths: [0.0, f64::INFINITY] };
        if !light.kind.rules().is_bounded() {
            return whole;
        }
        let double = |vector: Vector3<R>| vector.0.map(Real::as_f64);
        let (position, range) = (double(light.position), light.range.as_f64());
        let along = |axis: [f64; 3]| {
            let length = dot(axis, axis).sqrt();
            (dot(axis, position) / length, length)
        };
        let (right, up, center) = (double(view.right), double(view.up), double(view.forward));
        let shift_along = |axis: [f64; 3]| dot(axis, center) / dot(axis, axis);
        let [shift_right, shift_up] = [right, up].map(shift_along);
        let forward = [0, 1, 2].map(|axis| center[axis] - shift_right * right[axis] - shift_up * up[axis]);
        let ahead = along(forward).0;
        let [columns, rows] = [(right, shift_right, view.size[0], 1.0), (up, shift_up, view.size[1], -1.0)].map(
            |(axis, shift, pixels, sign)| {
                let (aside, half) = along(axis);
                let [low, high] = match view.projection {
                    Projection::Perspective { .. } => disc_slopes(aside, ahead, range)?,
                    Projection::Orthographic { .. } => [aside - range, aside + range],
                    Projection::Paraboloid => return None,
                };
                let margin = (high - low) * 1e-3;
                let pixel_of = |value: f64| (sign * (value / half - shift) * 0.5 + 0.5) * pixels as f64;
                let [one, other] = [pixel_of(low - margin), pixel_of(high + margin)];
                let (first, last) = (one.min(other) - 1.0, one.max(other) + 1.0);
                // False for NaN, which an infinitely large light leads to: the bounds are the whole picture.
                (first <= last).then(|| (first.max(0.0) as usize, (last.ceil().max(0.0) as usize).min(pixels)))
            },
        );
        let pixels = match (columns, rows) {
            (Some((left, right)), Some((top, bottom))) => PixelBounds { left, top, right, bottom },
            _ => whole.pixels,
        };
        let margin = range * 1e-3 + ahead.abs() * 1e-5;
        let ends = [ahead + range + margin, ahead - range - margin];
        Self { pixels, depths: depths_at(view, ends).unwrap_or(whole.depths) }
    }
}

/// The depths at two distances along the camera's axis, the farther first; `None` if they cannot be computed.
fn depths_at<R: Real>(view: &ShaderView<R>, ends: [f64; 2]) -> Option<[f64; 2]> {
    let (near, far) = (view.near.as_f64(), view.far.as_f64());
    let depths = match view.projection {
        // From an oblique near plane, depth does not depend on the distance alone.
        Projection::Perspective { .. } if view.clip_from_relative[..3].iter().any(|column| column[2] != R::zero()) => {
            return None;
        }
        Projection::Perspective { .. } => {
            // An end behind the camera is nearer than everything visible.
            ends.map(|distance| if distance > 0.0 { near / distance } else { f64::INFINITY })
        }
        Projection::Orthographic { .. } => ends.map(|distance| (far - distance) / (far - near)),
        Projection::Paraboloid => return None,
    };
    depths.iter().all(|depth| !depth.is_nan()).then_some(depths)
}

/// The two slopes between which a disc is seen in perspective, by its centre's distances aside and ahead; `None` if
/// some of the disc is beside the camera.
///
/// The lines through the camera that touch the disc have the slopes (a·z ± r·√(a² + z² − r²)) ÷ (z² − r²).
fn disc_slopes(aside: f64, ahead: f64, radius: f64) -> Option<[f64; 2]> {
    let squared = ahead * ahead - radius * radius;
    let root = radius * (aside * aside + squared).sqrt();
    // Close to the camera's own plane the slopes are unbounded.
    (ahead > radius * 1.001).then(|| [(aside * ahead - root) / squared, (aside * ahead + root) / squared])
}

fn dot(one: [f64; 3], other: [f64; 3]) -> f64 {
    one.iter().zip(other).map(|(one, other)| one * other).sum()
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Quat, Vec3};
    use proptest::prelude::*;

    use super::*;
    use crate::backend::software::shader_inputs::{exact_view, light_as_uploaded};
    use crate::scene::{Camera, ClipPlane, Light};
    use crate::view::{GpuLight, RenderView};

    const SIZE: [u32; 2] = [160, 90];

    fn view_of(camera: &Camera) -> ShaderView<f64> {
        exact_view(&RenderView::new(camera), Vec3::ZERO)
    }

    fn light_bounds(camera: &Camera, position: DVec3, range: f32) -> LightBounds {
        let light = Light::Point { position, intensity: Vec3::ONE, range, casts_shadow: false };
        LightBounds::new(&view_of(camera), &light_as_uploaded(&GpuLight::new(&light, camera.position, None)))
    }

    fn bounds_of(camera: &Camera, position: DVec3, range: f32) -> PixelBounds {
        light_bounds(camera, position, range).pixels
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(4_000))]

        /// Every visible point of a light's sphere lies within the bounds.
        #[test]
        fn the_bounds_contain_all_that_a_light_reaches(
            position in prop::array::uniform3(-30.0..30.0_f64),
            exponent in -2.0..2.0_f64,
            direction in prop::array::uniform3(-1.0..1.0_f64),
            share in 0.9..1.0_f64,
            degrees in 1.0..170.0_f32,
            turn in 0.0..6.3_f32,
            is_orthographic in any::<bool>(),
            shift in prop::array::uniform2(-2.0..2.0_f32),
            clip_distance in prop::option::of(0.1..20.0_f64),
        ) {
            let mut camera = Camera::looking_at("main", DVec3::new(1e5, 2.0, 3.0), DVec3::ZERO);
            camera.orientation = Quat::from_rotation_y(turn);
            camera.size = SIZE;
            let perspective = Projection::Perspective { field_of_view: degrees.to_radians() };
            camera.projection = if is_orthographic { Projection::Orthographic { height: degrees } } else { perspective };
            camera.far = 1e4;
            if !is_orthographic {
                camera.shift = shift.into();
                let normal = camera.orientation * Vec3::NEG_Z;
                let plane = |distance| ClipPlane { point: camera.position + normal.as_dvec3() * distance, normal };
                camera.clip_plane = clip_distance.map(plane);
            }
            let position = camera.position + DVec3::from(position);
            let range = 10_f64.powf(exponent);
            let LightBounds { pixels: bounds, depths } = light_bounds(&camera, position, range as f32);
            let direction = DVec3::from(direction).normalize_or(DVec3::X);
            let point = position + direction * (range * share) - camera.position;

            let clip = RenderView::new(&camera).clip_from_relative().as_dmat4() * point.extend(1.0);
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
