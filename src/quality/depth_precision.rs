//! Quantizes distances to the depth bits of sort keys.

use std::ops::RangeInclusive;

use super::QualityError;

/// How a sort key quantizes a command's distance along the view's axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthPrecision {
    /// The number of bits. With 0 bits, commands are not ordered by distance.
    pub bits: u32,
    /// The mapping from distances to codes.
    pub curve: DepthCurve,
}

/// How a [`DepthPrecision`] maps distances to codes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DepthCurve {
    /// Uniform from 0 to `far` metres. Distances beyond are clamped to `far`, and negative ones to 0.
    Linear {
        /// In metres, above 0 and finite.
        far: f32,
    },
    /// By the bits of the f32, from the view's near plane to its far plane: each doubling of the distance has the same
    /// number of codes, uniform in between. Nearer and farther distances are clamped. With a far plane at infinity,
    /// codes cover all distances up to 2¹²⁸ m.
    Logarithmic,
}

impl DepthPrecision {
    /// The maximum number of depth bits of opaque commands.
    pub const MAX_OPAQUE_BITS: u32 = 20;

    /// The maximum number of depth bits of blended commands: the code is then the f32 itself, whatever the curve.
    pub const MAX_BLENDED_BITS: u32 = 32;

    /// The whole f32: distances that differ in f32 are never in the wrong order.
    pub const EXACT: Self = Self { bits: Self::MAX_BLENDED_BITS, curve: DepthCurve::Logarithmic };

    /// No order by distance.
    pub const UNORDERED: Self = Self { bits: 0, curve: DepthCurve::Logarithmic };

    /// Quantizes a distance along the view's axis, in metres, for a view from `near` to `far`. Codes grow with the
    /// distance. A code is in the upper [`DepthPrecision::bits`] of the 32 bits; the others are 0, so shorter keys
    /// leave fewer bits to sort by.
    ///
    /// NaN counts as nearest. With 32 bits, which also order distances behind the camera, it counts as beyond the
    /// infinity of its sign.
    pub fn quantize(self, depth: f32, near: f32, far: f32) -> u32 {
        self.quantizer(near, far).quantize(depth)
    }

    /// The quantization step at `distance`: the maximum difference in metres between two distances in the wrong order,
    /// the farther being at `distance`, in a view from `near` to `far`, if both are within the curve's range. Infinite
    /// if `distance` is out of that range.
    ///
    /// Codes never decrease as the distance grows, so two distances can be in the wrong order only if they have the
    /// same code.
    ///
    /// Linear: a code's interval is `far` / 2ᵇ wide. Rounding in f64 adds at most 2⁻⁵³ of each of two codes below 2³¹,
    /// less than 2⁻²⁰ of the width.
    ///
    /// Logarithmic: with S floats from near to far, a code's interval contains S / 2ᵇ of them. Two floats that many
    /// apart differ by at most as many units in the last place of the greater one, each at most 2⁻²³ of it. S has 2²³
    /// floats for each doubling, and from m to m + 1 times a power of two (1 ≤ m ≤ 2) up to 0.0861 more than log₂
    /// gives, so the step is at most (log₂(far / near) + 0.0862) / 2ᵇ of the distance; a far plane at infinity counts
    /// as one at 2¹²⁸ m. If S is at most 2ᵇ, every float has its own code, and the step is 0. Rounding S adds less than
    /// 2⁻³⁰.
    ///
    /// With 32 bits the step is 0, whatever the curve; with 0 bits it is infinite.
    pub fn step(self, distance: f32, near: f32, far: f32) -> f64 {
        let bits = self.bits.min(Self::MAX_BLENDED_BITS);
        if bits == Self::MAX_BLENDED_BITS {
            return 0.0;
        }
        if bits == 0 {
            return f64::INFINITY;
        }
        let codes = 2_f64.powi(bits as i32);
        match self.curve {
            DepthCurve::Linear { far } if (0.0..=far).contains(&distance) => {
                f64::from(far) / codes * (1.0 + 2_f64.powi(-20))
            }
            DepthCurve::Logarithmic if (near..=far).contains(&distance) => {
                let floats = f64::from(span(near, far).1) / codes;
                let last_place = f64::from(distance.max(f32::MIN_POSITIVE)) * 2_f64.powi(-23);
                if floats <= 1.0 { 0.0 } else { floats * (1.0 + 2_f64.powi(-30)) * last_place }
            }
            _ => f64::INFINITY,
        }
    }

    /// The quantizer for a view from `near` to `far`.
    pub(crate) fn quantizer(self, near: f32, far: f32) -> DepthQuantizer {
        let bits = self.bits.min(Self::MAX_BLENDED_BITS);
        let unused = Self::MAX_BLENDED_BITS - bits;
        let curve = match self.curve {
            _ if unused == 0 => QuantizedCurve::Exact,
            _ if bits == 0 => QuantizedCurve::Unordered,
            DepthCurve::Linear { far } => {
                let codes = 2_f64.powi(bits as i32);
                QuantizedCurve::Linear { per_metre: codes / f64::from(far), last: (codes - 1.0) as u32 }
            }
            DepthCurve::Logarithmic => {
                let (near_bits, floats) = span(near, far);
                QuantizedCurve::Logarithmic { near_bits, last: floats - 1, per_float: (1 << 63) / u64::from(floats) }
            }
        };
        DepthQuantizer { curve, unused }
    }

    /// Checks the number of bits and the curve.
    ///
    /// # Errors
    /// Returns [`QualityError::OutOfRange`] if one of them is out of range.
    pub(super) fn check(&self, setting: &'static str, bits: RangeInclusive<u32>) -> Result<(), QualityError> {
        if !bits.contains(&self.bits) {
            let range = if *bits.start() == 0 { "0 to 20 bits" } else { "1 to 32 bits" };
            return Err(QualityError::OutOfRange { setting, value: format!("{} bits", self.bits), range });
        }
        match self.curve {
            DepthCurve::Linear { far } if !(far > 0.0 && far.is_finite()) => {
                let value = format!("linear up to {far} m");
                Err(QualityError::OutOfRange { setting, value, range: "linear up to a finite distance above 0" })
            }
            _ => Ok(()),
        }
    }
}

/// A [`DepthPrecision`] prepared for one view.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DepthQuantizer {
    curve: QuantizedCurve,
    /// The number of low bits that are always 0.
    unused: u32,
}

#[derive(Clone, Copy, Debug)]
enum QuantizedCurve {
    Exact,
    Unordered,
    Linear {
        per_metre: f64,
        last: u32,
    },
    Logarithmic {
        /// The bits of the near plane's float, and the number of floats beyond it.
        near_bits: u32,
        last: u32,
        /// The codes per float, in units of 2⁻⁶³ of all codes, so that no product exceeds 64 bits.
        per_float: u64,
    },
}

impl DepthQuantizer {
    /// See [`DepthPrecision::quantize`].
    #[inline]
    pub(crate) fn quantize(&self, depth: f32) -> u32 {
        match self.curve {
            QuantizedCurve::Exact => ordered_bits(depth),
            QuantizedCurve::Unordered => 0,
            // The cast converts NaN to 0, and saturates.
            QuantizedCurve::Linear { per_metre, last } => {
                ((f64::from(depth) * per_metre) as u32).min(last) << self.unused
            }
            QuantizedCurve::Logarithmic { near_bits, last, per_float } => {
                let beyond = bits_above_zero(depth).saturating_sub(near_bits).min(last);
                ((u64::from(beyond) * per_float) >> (31 + self.unused) << self.unused) as u32
            }
        }
    }
}

/// The bits of the near plane's float, and the number of floats from there to the far plane, at least 1.
fn span(near: f32, far: f32) -> (u32, u32) {
    let near_bits = bits_above_zero(near);
    (near_bits, bits_above_zero(far).saturating_sub(near_bits) + 1)
}

/// The bits of a float, which grow with it; those of 0 for negative numbers and NaN.
#[inline]
fn bits_above_zero(value: f32) -> u32 {
    // `max` converts NaN to 0, and the sum converts −0 to 0.
    (value.max(0.0) + 0.0).to_bits()
}

/// Maps a float to an integer of the same order: inverts all bits of a negative float, and the sign bit of others.
#[inline]
fn ordered_bits(value: f32) -> u32 {
    // Merges 0 and −0.
    let bits = (value + 0.0).to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn any_key() -> impl Strategy<Value = DepthPrecision> {
        let curve = prop_oneof![
            Just(DepthCurve::Logarithmic),
            (-6.0..9.0_f32).prop_map(|exponent| DepthCurve::Linear { far: 10_f32.powf(exponent) }),
        ];
        (0_u32..=32, curve).prop_map(|(bits, curve)| DepthPrecision { bits, curve })
    }

    fn any_planes() -> impl Strategy<Value = (f32, f32)> {
        let far = prop_oneof![Just(f32::INFINITY), Just(f32::MAX), (1e-5..9.0_f32).prop_map(|more| 10_f32.powf(more))];
        (-5.0..1.0_f32, far).prop_map(|(exponent, times)| {
            let near = 10_f32.powf(exponent);
            (near, (near * times).max(near.next_up()))
        })
    }

    /// Distances of all magnitudes, each with others a few floats away.
    fn depths() -> impl Strategy<Value = Vec<f32>> {
        let one = prop_oneof![
            4 => (-6.0..10.0_f32).prop_map(|exponent| 10_f32.powf(exponent)),
            2 => 0.0..200.0_f32,
            1 => any::<u32>().prop_map(f32::from_bits),
        ];
        prop::collection::vec((one, prop::collection::vec(-3000_i32..3000, 1..4)), 1..40).prop_map(|groups| {
            let around = |(depth, offsets): (f32, Vec<i32>)| {
                offsets.into_iter().map(move |offset| f32::from_bits(depth.to_bits().wrapping_add_signed(offset)))
            };
            groups.into_iter().flat_map(around).collect()
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2_000))]

        /// Sorts by codes, and the farthest first among equal codes: the worst possible order.
        #[test]
        fn no_pair_is_in_the_wrong_order_by_more_than_the_step(
            key in any_key(), (near, far) in any_planes(), mut depths in depths(),
        ) {
            depths.retain(|&depth| depth.is_finite() && key.step(depth, near, far).is_finite());
            depths.sort_by(|one, other| other.total_cmp(one));
            depths.sort_by_key(|&depth| key.quantize(depth, near, far));
            let mut farthest = f32::NEG_INFINITY;
            for &depth in &depths {
                let behind_by = f64::from(farthest) - f64::from(depth);
                prop_assert!(behind_by <= 0.0 || behind_by <= key.step(farthest, near, far), "{farthest} {depth}");
                farthest = farthest.max(depth);
            }
        }

        #[test]
        fn a_logarithmic_step_is_proportional_to_the_distance(
            bits in 1_u32..32, (near, far) in any_planes(), share in 0.0..=1.0_f32,
        ) {
            let key = DepthPrecision { bits, curve: DepthCurve::Logarithmic };
            let distance = (near * (far.min(f32::MAX) / near).powf(share)).clamp(near, far);
            let doublings = (f64::from(far).min(2_f64.powi(128)) / f64::from(near)).log2() + 0.0862;
            let bound = doublings / 2_f64.powi(bits as i32) * f64::from(distance);
            let step = key.step(distance, near, far);
            prop_assert!(step <= bound, "{step} {bound}");
        }

        #[test]
        fn exact_keys_order_all_floats(first in any::<f32>(), second in any::<f32>()) {
            prop_assume!(!first.is_nan() && !second.is_nan());
            let code = |depth| DepthPrecision::EXACT.quantize(depth, 1.0, 2.0);
            prop_assert_eq!(code(first).partial_cmp(&code(second)), first.partial_cmp(&second));
        }

        #[test]
        fn unused_bits_are_0(key in any_key(), (near, far) in any_planes(), depth in any::<f32>()) {
            prop_assert_eq!(key.quantize(depth, near, far).unbounded_shl(key.bits), 0);
        }
    }

    #[test]
    fn all_codes_are_used() {
        for bits in 1..32 {
            for key in
                [DepthCurve::Logarithmic, DepthCurve::Linear { far: 50.0 }].map(|curve| DepthPrecision { bits, curve })
            {
                assert_eq!(key.quantize(0.0, 0.1, 50.0), 0);
                // If there are fewer floats than codes, the last code is unused.
                if bits < 26 {
                    assert_eq!(key.quantize(50.0, 0.1, 50.0) >> (32 - bits), (1 << bits) - 1, "{key:?}");
                }
            }
        }
    }

    #[test]
    fn distances_out_of_range_are_clamped() {
        for curve in [DepthCurve::Logarithmic, DepthCurve::Linear { far: 10.0 }] {
            let key = DepthPrecision { bits: 16, curve };
            let code = |depth| key.quantize(depth, 0.5, 10.0);
            for near in [f32::NAN, -f32::NAN, f32::NEG_INFINITY, -3.0, -0.0, 0.0, f32::MIN_POSITIVE, 1e-40] {
                assert_eq!(code(near), code(0.0), "{near}");
            }
            for far in [10.0, 10.1, f32::MAX, f32::INFINITY] {
                assert_eq!(code(far), code(10.0), "{far}");
            }
            assert_eq!(key.step(10.1, 0.5, 10.0), f64::INFINITY);
            assert_eq!(key.step(f32::NAN, 0.5, 10.0), f64::INFINITY);
        }
        let key = DepthPrecision { bits: 16, curve: DepthCurve::Logarithmic };
        assert!(key.quantize(f32::MAX, 0.5, f32::INFINITY) < u32::MAX);
        assert_eq!(key.quantize(7.0, 5.0, 5.0), key.quantize(3.0, 5.0, 5.0));
    }

    #[test]
    fn invalid_keys_do_no_harm() {
        for bits in [0, 33, u32::MAX] {
            for curve in
                [DepthCurve::Logarithmic, DepthCurve::Linear { far: 0.0 }, DepthCurve::Linear { far: f32::NAN }]
            {
                for (near, far) in [(f32::NAN, f32::NAN), (9.0, 1.0), (-1.0, f32::INFINITY), (0.0, 0.0)] {
                    let key = DepthPrecision { bits, curve };
                    let _ = (key.quantize(3.0, near, far), key.quantize(f32::NAN, near, far), key.step(3.0, near, far));
                }
            }
        }
    }
}
