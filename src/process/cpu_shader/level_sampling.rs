//! Trilinear sampling of targets in CPU shaders.

use crate::raster::{Real, Vector2, Vector4};

/// Blends the two levels around a level of detail, of `count` levels. `sample` samples a level.
pub(super) fn trilinear<R: Real>(count: usize, level: R, sample: impl Fn(usize) -> Vector4<R>) -> Vector4<R> {
    // NaN counts as 0.
    let level = level.max(R::zero()).min(R::of_integer(count as i64 - 1));
    let finer = level.floor();
    let fraction = level - finer;
    let finer = finer.as_f64() as usize;
    let one = sample(finer);
    if fraction == R::zero() {
        return one;
    }
    one + (sample(finer + 1) - one) * fraction
}

/// Blends the four pixels around a point of a level of this size, from (0, 0) to (1, 1). Beyond the edges it is as on
/// them.
pub(super) fn bilinear<R: Real>(
    size: [usize; 2],
    uv: Vector2<R>,
    load: impl Fn([usize; 2]) -> Vector4<R>,
) -> Vector4<R> {
    // The two nearest columns or rows, and the weight of the second.
    let nearest = |axis: usize| {
        let last = size[axis] - 1;
        let position = uv[axis] * R::of_integer(size[axis] as i64) - R::of(0.5);
        // NaN counts as 0.
        let position = position.max(R::zero()).min(R::of_integer(last as i64));
        let first = position.floor();
        let index = first.as_f64() as usize;
        ([index, (index + 1).min(last)], position - first)
    };
    let (([left, right], across), ([upper, lower], down)) = (nearest(0), nearest(1));
    let blend = |one: Vector4<R>, other: Vector4<R>, weight: R| one + (other - one) * weight;
    let row = |y: usize| blend(load([left, y]), load([right, y]), across);
    blend(row(upper), row(lower), down)
}

#[cfg(test)]
mod tests {
    use crate::process::SampledTexture;
    use crate::raster::{Vector, Vector4};

    /// Levels of 4 × 2, 2 × 1 and one pixel, whose numbers are the column, the row and the level.
    struct Levels;

    impl SampledTexture<f64> for Levels {
        fn size(&self) -> [usize; 2] {
            [4, 2]
        }

        fn load(&self, coordinates: [usize; 2], layer: usize) -> Vector4<f64> {
            self.load_level(coordinates, layer, 0)
        }

        fn level_count(&self) -> usize {
            3
        }

        fn load_level(&self, [x, y]: [usize; 2], layer: usize, level: usize) -> Vector4<f64> {
            let [width, height] = self.size_of_level(level);
            assert!(x < width && y < height && level < 3, "({x}, {y}) is outside of level {level}");
            Vector([x, y, level, layer].map(|number| number as f64))
        }
    }

    #[test]
    fn a_point_is_blended_from_pixels_and_levels() {
        let sampled = |uv: [f64; 2], level: f64| Levels.sample_level(Vector(uv), 5, level).0;
        // The centre of the pixel at column 2 of the lower row.
        assert_eq!(sampled([0.625, 0.75], 0.0), [2.0, 1.0, 0.0, 5.0]);
        assert_eq!(sampled([0.5, 0.5], 0.0), [1.5, 0.5, 0.0, 5.0]);
        assert_eq!(sampled([0.5, 0.5], 1.0), [0.5, 0.0, 1.0, 5.0]);
        assert_eq!(sampled([0.5, 0.5], 0.25), [1.25, 0.375, 0.25, 5.0]);
    }

    #[test]
    fn what_is_beyond_the_edges_is_as_on_them() {
        let sampled = |uv: [f64; 2], level: f64| Levels.sample_level(Vector(uv), 0, level).0;
        assert_eq!(sampled([-3.0, 7.0], -1.0), [0.0, 1.0, 0.0, 0.0]);
        assert_eq!(sampled([f64::INFINITY, f64::NEG_INFINITY], 9.0), [0.0, 0.0, 2.0, 0.0]);
        assert_eq!(sampled([f64::INFINITY, 0.0], 0.0), [3.0, 0.0, 0.0, 0.0]);
        assert_eq!(sampled([f64::NAN, f64::NAN], f64::NAN), [0.0; 4]);
    }
}
