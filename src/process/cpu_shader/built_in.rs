//! WGSL's built-in functions that CPU shaders need, for either precision.
//!
//! If one argument is NaN, `min` and `max` return the other, as on devices; so `clamp` of NaN returns the lower end.

use crate::raster::{Real, Vector, Vector3, Vector4};

/// `clamp`.
pub(in crate::process) fn clamp<R: Real>(value: R, low: R, high: R) -> R {
    value.max(low).min(high)
}

/// `mix`: `one` at a factor of 0, `other` at a factor of 1.
pub(in crate::process) fn mix<R: Real>(one: R, other: R, factor: R) -> R {
    one * (R::one() - factor) + other * factor
}

/// `smoothstep`: from 0 at `low` to 1 at `high`; a step if the two are equal.
pub(in crate::process) fn smoothstep<R: Real>(low: R, high: R, value: R) -> R {
    let factor = clamp((value - low) / (high - low), R::zero(), R::one());
    factor * factor * (R::of(3.0) - R::of(2.0) * factor)
}

/// `fract`: the distance from the next integer below, for negative numbers too.
pub(in crate::process) fn fract<R: Real>(value: R) -> R {
    value - value.floor()
}

/// `sign`: 0 for 0.
pub(in crate::process) fn sign<R: Real>(value: R) -> R {
    if value > R::zero() {
        R::one()
    } else if value < R::zero() {
        -R::one()
    } else {
        R::zero()
    }
}

/// `inverseSqrt`.
pub(in crate::process) fn inverse_square_root<R: Real>(value: R) -> R {
    R::one() / value.sqrt()
}

/// `normalize`; 0 for a vector of length 0.
pub(in crate::process) fn normalize<R: Real, const N: usize>(vector: Vector<R, N>) -> Vector<R, N> {
    let length_squared = vector.dot(vector);
    if length_squared > R::zero() { vector * inverse_square_root(length_squared) } else { Vector::zero() }
}

/// `.rgb`.
pub(in crate::process) fn rgb<R: Real>(color: Vector4<R>) -> Vector3<R> {
    let [red, green, blue, _] = color.0;
    Vector([red, green, blue])
}

/// A colour and its opacity.
pub(in crate::process) fn with_alpha<R: Real>(color: Vector3<R>, alpha: R) -> Vector4<R> {
    let [red, green, blue] = color.0;
    Vector([red, green, blue, alpha])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nan_and_zero_lengths_give_finite_results() {
        assert_eq!(clamp(f32::NAN, 2.0, 3.0), 2.0);
        assert_eq!(smoothstep(0.5_f32, 0.5, 0.5), 0.0);
        assert_eq!(sign(f64::NAN), 0.0);
        assert_eq!(normalize(Vector([0.0_f32, -0.0, 0.0])), Vector::zero());
    }

    #[test]
    fn the_functions_follow_the_wgsl_specification() {
        for value in [-2.5, -1.0, -0.25, 0.0, 0.5, 1.0, 7.75_f64] {
            assert_eq!(clamp(value, 0.0, 1.0), value.clamp(0.0, 1.0));
            assert_eq!(fract(value), value.rem_euclid(1.0));
            assert_eq!(sign(value), if value == 0.0 { 0.0 } else { value.signum() });
            assert_eq!(mix(3.0, -1.0, value), 3.0 - 4.0 * value);
        }
        let steps = [-1.0, 0.0, 0.25, 0.5, 1.0, 2.0].map(|value| smoothstep(0.0_f64, 1.0, value));
        assert_eq!(steps, [0.0, 0.0, 0.15625, 0.5, 1.0, 1.0]);
        assert_eq!([0.0, 0.25, 1.0].map(|value| smoothstep(0.25_f64, 0.25, value)), [0.0, 0.0, 1.0]);
        assert_eq!(normalize(Vector([3.0, 0.0, -4.0_f64])), Vector([3.0, 0.0, -4.0]) * 0.2);
        assert_eq!(rgb(with_alpha(Vector([1.0, 2.0, 3.0_f32]), 4.0)), Vector([1.0, 2.0, 3.0]));
    }
}
