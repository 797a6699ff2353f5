//! What WGSL has built in and CPU shaders need, for any number.
//!
//! Where a number is not one, `min` and `max` give the other, as they do on devices; so `clamp` gives its lower end.

use crate::raster::{Real, Vector, Vector3, Vector4};

/// `clamp`.
pub(in crate::process) fn clamp<R: Real>(value: R, low: R, high: R) -> R {
    value.max(low).min(high)
}

/// `mix`: from `one` at a share of 0 to `other` at a share of 1.
pub(in crate::process) fn mix<R: Real>(one: R, other: R, share: R) -> R {
    one * (R::one() - share) + other * share
}

/// `smoothstep`: from 0 at `low` to 1 at `high`; a step where the two are the same.
pub(in crate::process) fn smoothstep<R: Real>(low: R, high: R, value: R) -> R {
    let share = clamp((value - low) / (high - low), R::zero(), R::one());
    share * share * (R::of(3.0) - R::of(2.0) * share)
}

/// `fract`: what is above the next whole number below, for negative numbers too.
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

/// `normalize`; 0 where there is no direction.
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

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_number_ends_here() {
        assert_eq!(clamp(f32::NAN, 2.0, 3.0), 2.0);
        assert_eq!(smoothstep(0.5_f32, 0.5, 0.5), 0.0);
        assert_eq!(sign(f64::NAN), 0.0);
        assert_eq!(normalize(Vector([0.0_f32, -0.0, 0.0])), Vector::zero());
    }

    #[test]
    fn they_are_what_wgsl_says() {
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
