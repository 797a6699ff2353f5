//! `light_tiles.wgsl` and `mark_lights.wgsl` in Rust.

use crate::process::cpu_shader::built_in::normalize;
use crate::process::{FullScreenCpuShader, FullScreenPixel, PassInputs, ShaderLight, ShaderView};
use crate::raster::{Real, Vector3, Vector4};
use crate::scene::Projection;

/// The width and height of a tile in pixels of the target that holds its marks, which is half as wide and high as the
/// picture.
const TILE_SIDE: usize = 16;

/// How many bits of a pixel are marks.
pub(in crate::process::deferred) const BITS: usize = 24;

/// A tile, in pixels of the target. At the right and the lower edge it may be smaller.
#[derive(Clone, Copy, Debug)]
pub(in crate::process::deferred) struct LightTile {
    pub(in crate::process::deferred) first: [usize; 2],
    pub(in crate::process::deferred) size: [usize; 2],
    /// How many lights, one after the other, share a bit.
    pub(in crate::process::deferred) lights_per_bit: usize,
}

impl LightTile {
    pub(in crate::process::deferred) fn of(pixel: [usize; 2], target_size: [usize; 2], lights: usize) -> Self {
        let first = pixel.map(|coordinate| coordinate / TILE_SIDE * TILE_SIDE);
        let size = [0, 1].map(|axis| TILE_SIDE.min(target_size[axis] - first[axis]));
        Self { first, size, lights_per_bit: lights.div_ceil(size[0] * size[1] * BITS).max(1) }
    }
}

/// Marks the lights that may reach each tile.
#[derive(Clone, Copy, Debug)]
pub(super) struct LightTilesCpuShader;

impl<R: Real> FullScreenCpuShader<R> for LightTilesCpuShader {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        let picture = pass.view.size;
        let target_size = picture.map(|pixels| pixels.div_ceil(2));
        let tile = LightTile::of(pixel.coordinates, target_size, pass.lights.len());
        let local = [0, 1].map(|axis| pixel.coordinates[axis] - tile.first[axis]);
        let first_bit = (local[1] * tile.size[0] + local[0]) * BITS;
        let end = [0, 1].map(|axis| ((tile.first[axis] + tile.size[axis]) * 2).min(picture[axis]));
        let clip_of = |axis: usize, coordinate: usize| {
            let fraction = R::of_integer(coordinate as i64) / R::of_integer(picture[axis] as i64);
            fraction * R::of(2.0) - R::one()
        };
        let horizontal = [clip_of(0, tile.first[0] * 2), clip_of(0, end[0])];
        let vertical = [-clip_of(1, end[1]), -clip_of(1, tile.first[1] * 2)];
        let lights = pass.lights.chunks(tile.lights_per_bit).skip(first_bit).take(BITS).enumerate();
        let marks =
            lights.filter(|(_, lights)| lights.iter().any(|light| may_reach(pass.view, light, horizontal, vertical)));
        let marks = marks.fold(0, |marks, (bit, _)| marks | 1 << bit);
        targets[0] = Vector4::zero();
        targets[0][0] = R::of_integer(marks);
        true
    }
}

/// Whether a light may reach what is seen between clip coordinates: whether its sphere is not wholly beyond one of four
/// planes. The margin is a hundred times what rounding makes.
fn may_reach<R: Real>(view: &ShaderView<R>, light: &ShaderLight<R>, horizontal: [R; 2], vertical: [R; 2]) -> bool {
    if !light.kind.rules().is_bounded() {
        return true;
    }
    let position = light.position;
    let reach = light.range * R::of(1.001) + position.dot(position).sqrt() * R::of(1e-5);
    let beyond = |axis, other_axis, clip| distance_beyond(view, axis, other_axis, clip, position);
    beyond(view.right, view.up, horizontal[0]) >= -reach
        && beyond(view.right, view.up, horizontal[1]) <= reach
        && beyond(view.up, view.right, vertical[0]) >= -reach
        && beyond(view.up, view.right, vertical[1]) <= reach
}

/// The distance of a position, along an axis of the picture, beyond the plane of all that has a clip coordinate there.
fn distance_beyond<R: Real>(
    view: &ShaderView<R>,
    axis: Vector3<R>,
    other_axis: Vector3<R>,
    clip: R,
    position: Vector3<R>,
) -> R {
    let (mut ray, mut from_plane) = (view.forward, position);
    if matches!(view.projection, Projection::Perspective { .. }) {
        ray = ray + axis * clip;
    } else {
        from_plane = from_plane - axis * clip;
    }
    let normal = normalize(other_axis.cross(ray));
    let distance = normal.dot(from_plane);
    if normal.dot(axis) < R::zero() { -distance } else { distance }
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};
    use proptest::prelude::*;

    use super::*;
    use crate::process::cpu_shader::test_inputs::{light_values, material, pass, view_values, views};
    use crate::raster::Vector;
    use crate::scene::{Blend, Light};
    use crate::view::RenderView;

    /// Whether the mark of a light is set in the tile of a pixel of the picture.
    fn is_marked<R: Real>(view: &ShaderView<R>, lights: &[ShaderLight<R>], light: usize, pixel: [usize; 2]) -> bool {
        let material = material(Blend::None);
        let mut pass = pass(view, &material, &[]);
        pass.lights = lights;
        let target_size = view.size.map(|pixels| pixels.div_ceil(2));
        let tile = LightTile::of(pixel.map(|coordinate| coordinate / 2), target_size, lights.len());
        let bit = light / tile.lights_per_bit;
        let word = bit / BITS;
        let coordinates = [tile.first[0] + word % tile.size[0], tile.first[1] + word / tile.size[0]];
        assert!(coordinates[0] < target_size[0] && coordinates[1] < target_size[1], "{tile:?} {word}");
        let mut targets = [Vector::zero()];
        let pixel = FullScreenPixel { coordinates, clip: Vector([R::zero(); 2]) };
        assert!(LightTilesCpuShader.fragment(&pass, &pixel, &mut targets));
        (targets[0][0].as_f64() as u32) >> (bit % BITS) & 1 == 1
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]

        /// A light within whose range a pixel's position is, is marked in the pixel's tile, whatever the picture's size
        /// and the lights before it.
        #[test]
        fn a_light_that_reaches_a_pixel_is_marked_in_its_tile(
            view in 0..4_usize,
            size in prop::array::uniform2(1..150_u32),
            share in prop::array::uniform2(0.0..1.0_f64),
            depth in 1e-3..1.0_f64,
            direction in prop::array::uniform3(-1.0..1.0_f64),
            exponent in -2.0..3.0_f64,
            others in 0..400_usize,
        ) {
            let mut camera = views()[view].camera.clone();
            camera.size = size;
            let view = RenderView::new(&camera);
            let pixel = [0, 1].map(|axis| (share[axis] * f64::from(size[axis])) as usize);
            let fraction = |axis: usize| (pixel[axis] as f64 + 0.5) / f64::from(size[axis]);
            let exact = view_values::<f64>(&view);
            let clip = Vector([fraction(0) * 2.0 - 1.0, 1.0 - fraction(1) * 2.0]);
            let position = exact.position_from_depth(clip, depth);
            prop_assume!(position.0.iter().all(|value| value.is_finite()));
            let range = 10_f64.powf(exponent);
            let offset = DVec3::from(direction).normalize_or(DVec3::X) * range * 0.999;
            let light = |position| Light::Point { position, intensity: Vec3::ONE, range: range as f32, casts_shadow: false };
            let reaching = light(DVec3::from(position.0) + offset);
            let far_away = light(DVec3::splat(-1e7));
            let lights: Vec<_> = (0..others).map(|_| light_values(&far_away, None)).chain([light_values(&reaching, None)]).collect();
            prop_assert!(is_marked(&exact, &lights, others, pixel), "{position:?} {reaching:?}");
            let single: Vec<_> = (0..others).map(|_| light_values(&far_away, None)).chain([light_values(&reaching, None)]).collect();
            prop_assert!(is_marked(&view_values::<f32>(&view), &single, others, pixel), "f32: {position:?} {reaching:?}");
        }
    }

    #[test]
    fn a_small_light_is_marked_where_it_is() {
        let mut camera = views()[0].camera.clone();
        camera.size = [160, 96];
        let view = view_values::<f64>(&RenderView::new(&camera));
        let lamp =
            Light::Point { position: DVec3::NEG_Z * 50.0, intensity: Vec3::ONE, range: 0.5, casts_shadow: false };
        let lights = [light_values(&lamp, None)];
        for (pixel, expected) in [([80, 48], true), ([0, 0], false), ([159, 48], false), ([80, 95], false)] {
            assert_eq!(is_marked(&view, &lights, 0, pixel), expected, "{pixel:?}");
        }
        let sun = Light::Directional { direction: Vec3::NEG_Y, illuminance: Vec3::ONE, casts_shadow: false };
        assert!(is_marked(&view, &[light_values(&sun, None)], 0, [0, 0]));
    }
}
