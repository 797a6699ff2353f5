//! `fxaa.wgsl` on the CPU.

use crate::process::cpu_shader::built_in::{mix, rgb, smoothstep};
use crate::process::{FullScreenCpuShader, FullScreenPixel, PassInputs, SampledTexture};
use crate::raster::{Real, Vector, Vector4};

/// Smooths aliased edges: see [`Fxaa`](super::Fxaa), whose settings these are, each from 0 to 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct FxaaCpuShader {
    pub(super) contrast_threshold: f32,
    pub(super) dark_threshold: f32,
    pub(super) sub_pixel: f32,
}

impl<R: Real> FullScreenCpuShader<R> for FxaaCpuShader {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        targets[0] = self.smooth(&Source(pass.sampled[0]), pixel.coordinates.map(|coordinate| coordinate as i64));
        true
    }
}

impl FxaaCpuShader {
    fn smooth<R: Real>(&self, source: &Source<'_, R>, pixel: Coordinates) -> Vector4<R> {
        let setting = |value: f32| R::of(f64::from(value));
        let two = R::of(2.0);
        let at = |x: i64, y: i64| source.brightness_at(sum(pixel, [x, y]));
        let color = source.color_at(pixel);
        let middle = brightness(color);
        let [above, below, left, right] = [at(0, -1), at(0, 1), at(-1, 0), at(1, 0)];
        let brightest = middle.max(above.max(below).max(left.max(right)));
        let darkest = middle.min(above.min(below).min(left.min(right)));
        let contrast = brightest - darkest;
        if contrast <= setting(self.dark_threshold).max(brightest * setting(self.contrast_threshold)) {
            return color;
        }

        let [above_left, above_right, below_left, below_right] = [at(-1, -1), at(1, -1), at(-1, 1), at(1, 1)];

        // An edge lies across the direction in which brightness has the greatest second difference.
        let bend = |one: R, between: R, other: R| (one - two * between + other).abs();
        let bend_down = bend(above_left, left, below_left)
            + two * bend(above, middle, below)
            + bend(above_right, right, below_right);
        let bend_right = bend(above_left, above, above_right)
            + two * bend(left, middle, right)
            + bend(below_left, below, below_right);
        let lies_along_row = bend_down >= bend_right;
        let (along, before, after) = if lies_along_row { ([1, 0], above, below) } else { ([0, 1], left, right) };

        // The edge is on the side of the pixel with the greater contrast.
        let is_before = (before - middle).abs() >= (after - middle).abs();
        let [x, y]: Coordinates = along;
        let (other_side, other) = if is_before { ([-y, -x], before) } else { ([y, x], after) };

        let covered = source.covered_fraction(pixel, along, other_side, middle, other);
        let neighbours = two * (above + below + left + right) + above_left + above_right + below_left + below_right;
        // The blend factor for details smaller than a pixel, from the pixel's deviation from the mean of its neighbours
        // as a fraction of the contrast. Beside a straight edge that is 1/3, which must not change.
        let deviation = (neighbours / R::of(12.0) - middle).abs() / contrast;
        let small = setting(self.sub_pixel) * smoothstep(R::of(1.0 / 3.0), R::one(), deviation);
        let factor = covered.max(small);
        color.with(source.color_at(sum(pixel, other_side)), |own, other| mix(own, other, factor))
    }
}

/// How many pixels the search for the end of a step goes in each direction.
const REACH: i64 = 16;

/// Column and row.
type Coordinates = [i64; 2];

fn sum([x, y]: Coordinates, [right, down]: Coordinates) -> Coordinates {
    [x + right, y + down]
}

/// Perceived brightness: approximately the square root of luminance.
fn brightness<R: Real>(color: Vector4<R>) -> R {
    rgb(color).dot(Vector([0.2126, 0.7152, 0.0722].map(R::of))).sqrt()
}

/// The picture that is smoothed.
struct Source<'a, R>(&'a dyn SampledTexture<R>);

struct StepEnd<R> {
    /// From the pixel's centre, in pixels.
    distance: R,
    /// The mean brightness of the two sides there, less that at the pixel.
    change: R,
}

impl<R: Real> Source<'_, R> {
    /// The fraction of the pixel on the other side of a straight edge through the middles of the step's two ends; at
    /// most one half.
    fn covered_fraction(
        &self,
        pixel: Coordinates,
        along: Coordinates,
        other_side: Coordinates,
        middle: R,
        other: R,
    ) -> R {
        let between = (middle + other) / R::of(2.0);
        let tolerance = (other - middle).abs() / R::of(4.0);
        let backward = self.step_end(pixel, along.map(|step| -step), other_side, between, tolerance);
        let forward = self.step_end(pixel, along, other_side, between, tolerance);
        let length = backward.distance + forward.distance;
        if backward.distance == forward.distance {
            // In the middle of a step that leads from one side to the other, the edge cuts a triangle off the pixel:
            // half a pixel along, and half a pixel's slope across. Without this, edges at 45 degrees, whose steps are
            // one pixel long, would stay as they are.
            let leads_across = backward.change * forward.change < R::zero();
            return if leads_across { R::of(0.125) / length } else { R::zero() };
        }

        // Beyond the end, both sides have the brightness of one of the two. If that is the pixel's own, the edge turns
        // away from it, and the pixels opposite are the ones that are partly covered.
        let nearest = if backward.distance < forward.distance { backward } else { forward };
        let turns_away = (nearest.change < R::zero()) == (middle < between);
        if turns_away { R::zero() } else { R::of(0.5) - nearest.distance / length }
    }

    /// Where along an edge the mean of its two sides changes.
    fn step_end(
        &self,
        pixel: Coordinates,
        along: Coordinates,
        other_side: Coordinates,
        between: R,
        tolerance: R,
    ) -> StepEnd<R> {
        for distance in 1..=REACH {
            let along_edge = sum(pixel, along.map(|step| step * distance));
            let mean = (self.brightness_at(along_edge) + self.brightness_at(sum(along_edge, other_side))) / R::of(2.0);
            let change = mean - between;
            if change.abs() >= tolerance {
                // The end is where the first pixel that differs begins.
                return StepEnd { distance: R::of(distance as f64 - 0.5), change };
            }
        }
        StepEnd { distance: R::of(REACH as f64), change: R::zero() }
    }

    fn brightness_at(&self, pixel: Coordinates) -> R {
        brightness(self.color_at(pixel))
    }

    /// Coordinates are clamped to the picture.
    fn color_at(&self, [x, y]: Coordinates) -> Vector4<R> {
        let [width, height] = self.0.size();
        let clamped = |coordinate: i64, size: usize| coordinate.clamp(0, size as i64 - 1) as usize;
        self.0.load([clamped(x, width), clamped(y, height)], 0)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::process::RenderProcess;
    use crate::process::cpu_shader::TypedCpuShader;
    use crate::process::cpu_shader::test_inputs::{FunctionTexture, material, pass, view_values, views};
    use crate::process::post::{Fxaa, PostStep};
    use crate::scene::Blend;

    const SIZE: [usize; 2] = [40, 40];

    /// A picture of one number a pixel, smoothed.
    fn smoothed(settings: Fxaa, shade: impl Fn(i64, i64) -> f64 + Sync) -> Vec<[f64; 4]> {
        let TypedCpuShader::FullScreen(cpu_shader) = settings.process("mapped", "picture").cpu_shader().unwrap().double
        else {
            panic!("it draws every pixel once")
        };
        let color = |[x, y]: [usize; 2], _| {
            Vector([1.0, 1.0, 1.0, 0.0]) * shade(x as i64, y as i64) + Vector([0.0, 0.0, 0.0, 1.0])
        };
        let source = FunctionTexture { size: SIZE, color };
        let (view, material) = (view_values(&views()[0]), material(Blend::None));
        let sampled: [&dyn SampledTexture<f64>; 1] = [&source];
        let pass = pass(&view, &material, &sampled);
        let places = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y]));
        let pixel = |coordinates| {
            let mut targets = [Vector::zero()];
            assert!(cpu_shader.fragment(&pass, &FullScreenPixel { coordinates, clip: Vector::zero() }, &mut targets));
            targets[0].0
        };
        places.map(pixel).collect()
    }

    fn shades(shade: impl Fn(i64, i64) -> f64) -> Vec<f64> {
        (0..SIZE[1] as i64).flat_map(|y| (0..SIZE[0] as i64).map(move |x| [x, y])).map(|[x, y]| shade(x, y)).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn flat_pictures_and_straight_edges_stay_to_the_bit(shades_of in prop::array::uniform2(0.0..1.0_f64), edge in 1..39_i64) {
            let [one, other] = shades_of;
            let sides = |is_one: bool| if is_one { one } else { other };
            let pictures: [&(dyn Fn(i64, i64) -> f64 + Sync); 3] =
                [&|_, _| one, &|x, _| sides(x < edge), &|_, y| sides(y < edge)];
            for picture in pictures {
                for (found, expected) in smoothed(Fxaa::default(), picture).into_iter().zip(shades(picture)) {
                    prop_assert_eq!(found, [expected, expected, expected, 1.0]);
                }
            }
        }

        /// A result lies between the pixel and its neighbours.
        #[test]
        fn results_lie_between_a_pixel_and_its_neighbours(bits in prop::collection::vec(0.0..1.0_f64, SIZE[0] * SIZE[1]), sub_pixel in 0.0..1.0_f32) {
            let at = |x: i64, y: i64| bits[(y.clamp(0, 39) * 40 + x.clamp(0, 39)) as usize];
            let settings = Fxaa { sub_pixel, ..Fxaa::default() };
            for (index, found) in (0..).zip(smoothed(settings, at)) {
                let (x, y) = (index % 40, index / 40);
                let around = [at(x, y), at(x - 1, y), at(x + 1, y), at(x, y - 1), at(x, y + 1)];
                let least = around.into_iter().fold(f64::MAX, f64::min) - 1e-15;
                let most = around.into_iter().fold(f64::MIN, f64::max) + 1e-15;
                prop_assert!((least..=most).contains(&found[0]), "{found:?} {around:?}");
            }
        }
    }

    /// Along an edge that rises one pixel in `length` columns, the blend factor equals the covered area, in both
    /// orientations.
    #[test]
    fn aliased_steps_become_the_coverage_of_the_straight_edge() {
        let settings = Fxaa { sub_pixel: 0.0, ..Fxaa::default() };
        for length in 1..=12_i64 {
            // A pixel is lit if its centre is below the edge, and no centre lies exactly on it.
            let start = if length % 2 == 0 { 20.0 } else { 20.5 };
            let height = |x: f64| 20.0 + (x - start) / length as f64;
            let aliased = |x: i64, y: i64| f64::from(u8::from(y as f64 + 0.5 > height(x as f64 + 0.5)));
            // The area under a line within a pixel, by a sum over slices of it.
            let covered = |x: i64, y: i64| {
                let slices = (0..1000).map(|slice| x as f64 + (f64::from(slice) + 0.5) / 1000.0);
                slices.map(|x| ((y + 1) as f64 - height(x)).clamp(0.0, 1.0)).sum::<f64>() / 1000.0
            };
            for is_upright in [false, true] {
                let picture = smoothed(settings, |x, y| if is_upright { aliased(y, x) } else { aliased(x, y) });
                for x in 14..26_i64 {
                    for y in 13..27_i64 {
                        let index = if is_upright { x * 40 + y } else { y * 40 + x };
                        let (found, expected) = (picture[index as usize][0], covered(x, y));
                        assert!((found - expected).abs() < 2e-3, "{length} {is_upright} {x} {y}: {found} {expected}");
                    }
                }
            }
        }
    }

    #[test]
    fn weak_edges_stay_and_single_pixels_fade_by_the_setting() {
        let weak = |x: i64, y: i64| if x + y < 20 { 0.5 } else { 0.55 };
        let settings = Fxaa { dark_threshold: 0.2, ..Fxaa::default() };
        let kept: Vec<_> = smoothed(settings, weak).into_iter().map(|[red, ..]| red).collect();
        assert_eq!(kept, shades(weak));
        let dot = |x: i64, y: i64| f64::from(u8::from([x, y] == [20, 12]));
        let [sharp, soft] =
            [0.0, 1.0].map(|sub_pixel| smoothed(Fxaa { sub_pixel, ..Fxaa::default() }, dot)[12 * 40 + 20][0]);
        assert_eq!([sharp, soft], [1.0, 0.0]);
    }
}
