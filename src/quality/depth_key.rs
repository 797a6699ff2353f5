//! How distances become the bits that commands are sorted by.

use super::QualityError;

/// A distance along a view's axis as a number of a few bits: what commands are sorted by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthKey {
    /// How many, 1 or more.
    pub bits: u32,
    /// How they are shared out over distances.
    pub curve: DepthCurve,
}

/// How the numbers of a [`DepthKey`] are shared out over distances.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum DepthCurve {
    /// Evenly from 0 to `far` metres; what is farther counts as there, and what is behind the camera as 0.
    Linear {
        /// In metres, above 0 and finite.
        far: f32,
    },
    /// By the bits of the f32 from the view's near plane to its far plane: each doubling of the distance has as many numbers, and
    /// they are even in between. What is nearer or farther counts as there. A far plane that is infinitely far away takes numbers
    /// for all distances up to 2¹²⁸ m.
    Logarithmic,
}

impl DepthKey {
    /// The most bits that opaque commands have for their distance.
    pub const MAX_OPAQUE_BITS: u32 = 20;

    /// The most bits that blended commands have for their distance: then it is the f32 itself, whatever the curve.
    pub const MAX_BLENDED_BITS: u32 = 32;

    /// The whole f32: nothing is drawn in the wrong order that f32 can tell apart.
    pub const EXACT: Self = Self { bits: Self::MAX_BLENDED_BITS, curve: DepthCurve::Logarithmic };

    /// The number of a distance along the view's axis, in metres, in a view from `near` to `far`: the farther, the greater. It is
    /// in the upper [`DepthKey::bits`] of the 32, and those below are 0, so that keys of fewer bits have fewer to sort by.
    ///
    /// What is no number counts as nearest; but to 32 bits, which tell apart what is behind the camera as well, as beyond the end
    /// that its sign is of.
    pub fn quantize(self, depth: f32, near: f32, far: f32) -> u32 {
        self.quantizer(near, far).quantize(depth)
    }

    /// How far apart two things can be, in metres, that are drawn in the wrong order, where the farther of them is at `distance`:
    /// in a view from `near` to `far`, both within what the curve tells apart. Infinite where `distance` is not.
    ///
    /// Numbers never fall as the distance grows, so the wrong order takes two that are the same.
    ///
    /// Linear: a number is as wide as `far` / 2ᵇ. Rounding in f64 adds at most 2⁻⁵³ of each of two numbers below 2³¹, less than 2⁻²⁰
    /// of their width.
    ///
    /// Logarithmic: with S floats from near to far, a number is as wide as S / 2ᵇ of them. Two floats that lie that many apart
    /// differ by as many of the greater one's last places at most, each of which is at most 2⁻²³ of it. In S there are 2²³ for
    /// each doubling, and from m to m + 1 times a power of two (1 ≤ m ≤ 2) up to 0.0861 more than log₂ says, so the step is at most
    /// (log₂(far / near) + 0.0862) / 2ᵇ of the distance; an infinite far plane counts as one at 2¹²⁸ m. Where S is 2ᵇ or less every
    /// float has a number of its own, and the step is 0. Rounding S adds less than 2⁻³⁰.
    ///
    /// To 32 bits it is 0, whatever the curve.
    pub fn step(self, distance: f32, near: f32, far: f32) -> f64 {
        let bits = self.bits.clamp(1, Self::MAX_BLENDED_BITS);
        if bits == Self::MAX_BLENDED_BITS {
            return 0.0;
        }
        let numbers = 2_f64.powi(bits as i32);
        match self.curve {
            DepthCurve::Linear { far } if (0.0..=far).contains(&distance) => {
                f64::from(far) / numbers * (1.0 + 2_f64.powi(-20))
            }
            DepthCurve::Logarithmic if (near..=far).contains(&distance) => {
                let floats = f64::from(span(near, far).1) / numbers;
                let last_place = f64::from(distance.max(f32::MIN_POSITIVE)) * 2_f64.powi(-23);
                if floats <= 1.0 { 0.0 } else { floats * (1.0 + 2_f64.powi(-30)) * last_place }
            }
            _ => f64::INFINITY,
        }
    }

    /// The numbers of distances in a view from `near` to `far`.
    pub(crate) fn quantizer(self, near: f32, far: f32) -> DepthQuantizer {
        let bits = self.bits.clamp(1, Self::MAX_BLENDED_BITS);
        let unused = Self::MAX_BLENDED_BITS - bits;
        let curve = match self.curve {
            _ if unused == 0 => QuantizedCurve::Exact,
            DepthCurve::Linear { far } => {
                let numbers = 2_f64.powi(bits as i32);
                QuantizedCurve::Linear { per_metre: numbers / f64::from(far), last: (numbers - 1.0) as u32 }
            }
            DepthCurve::Logarithmic => {
                let (nearest, floats) = span(near, far);
                QuantizedCurve::Logarithmic { nearest, last: floats - 1, per_float: (1 << 63) / u64::from(floats) }
            }
        };
        DepthQuantizer { curve, unused }
    }

    pub(super) fn check(&self, knob: &'static str, most: u32) -> Result<(), QualityError> {
        if !(1..=most).contains(&self.bits) {
            let range = if most == Self::MAX_OPAQUE_BITS { "1 to 20 bits" } else { "1 to 32 bits" };
            return Err(QualityError::OutOfRange { knob, value: format!("{} bits", self.bits), range });
        }
        match self.curve {
            DepthCurve::Linear { far } if !(far > 0.0 && far.is_finite()) => {
                let value = format!("linear up to {far} m");
                Err(QualityError::OutOfRange { knob, value, range: "linear up to a finite distance above 0" })
            }
            _ => Ok(()),
        }
    }
}

/// The numbers of distances in one view: what of a [`DepthKey`] is the same for all of them, worked out once.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DepthQuantizer {
    curve: QuantizedCurve,
    /// How many of the 32 bits.
    unused: u32,
}

#[derive(Clone, Copy, Debug)]
enum QuantizedCurve {
    Exact,
    Linear {
        per_metre: f64,
        last: u32,
    },
    Logarithmic {
        /// The bits of the nearest float that has a number, and how many beyond it there are.
        nearest: u32,
        last: u32,
        /// In 2⁻⁶³ of all numbers, so that no product leaves 64 bits.
        per_float: u64,
    },
}

impl DepthQuantizer {
    /// See [`DepthKey::quantize`].
    #[inline]
    pub(crate) fn quantize(&self, depth: f32) -> u32 {
        match self.curve {
            QuantizedCurve::Exact => ordered_bits(depth),
            // To turn a float into an integer also turns a NaN into 0, and what is too large into the greatest.
            QuantizedCurve::Linear { per_metre, last } => {
                ((f64::from(depth) * per_metre) as u32).min(last) << self.unused
            }
            QuantizedCurve::Logarithmic { nearest, last, per_float } => {
                let beyond = bits_above_zero(depth).saturating_sub(nearest).min(last);
                ((u64::from(beyond) * per_float) >> (31 + self.unused) << self.unused) as u32
            }
        }
    }
}

/// The bits of the nearest float of a view, and how many there are up to the farthest, 1 or more.
fn span(near: f32, far: f32) -> (u32, u32) {
    let nearest = bits_above_zero(near);
    (nearest, bits_above_zero(far).saturating_sub(nearest) + 1)
}

/// The bits of a float, which grow with it; those of 0 for what is less, or no number.
#[inline]
fn bits_above_zero(value: f32) -> u32 {
    // `max` turns a NaN into 0, and the sum a −0.
    (value.max(0.0) + 0.0).to_bits()
}

/// Maps a float to a number of the same order: negative ones have all their bits turned, the others only their sign.
#[inline]
fn ordered_bits(value: f32) -> u32 {
    // Both zeros are one depth.
    let bits = (value + 0.0).to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn any_key() -> impl Strategy<Value = DepthKey> {
        let curve = prop_oneof![
            Just(DepthCurve::Logarithmic),
            (-6.0..9.0_f32).prop_map(|exponent| DepthCurve::Linear { far: 10_f32.powf(exponent) }),
        ];
        (1_u32..=32, curve).prop_map(|(bits, curve)| DepthKey { bits, curve })
    }

    fn any_planes() -> impl Strategy<Value = (f32, f32)> {
        let far = prop_oneof![Just(f32::INFINITY), Just(f32::MAX), (1e-5..9.0_f32).prop_map(|more| 10_f32.powf(more))];
        (-5.0..1.0_f32, far).prop_map(|(exponent, times)| {
            let near = 10_f32.powf(exponent);
            (near, (near * times).max(near.next_up()))
        })
    }

    /// Distances of every size, each with others a few floats from it.
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

        /// Sorted by their numbers, and in each number the farthest first, which is the worst that can come of it.
        #[test]
        fn nothing_is_in_the_wrong_order_by_more_than_the_step(
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
        fn a_logarithmic_step_is_a_share_of_the_distance(
            bits in 1_u32..32, (near, far) in any_planes(), share in 0.0..=1.0_f32,
        ) {
            let key = DepthKey { bits, curve: DepthCurve::Logarithmic };
            let distance = (near * (far.min(f32::MAX) / near).powf(share)).clamp(near, far);
            let doublings = (f64::from(far).min(2_f64.powi(128)) / f64::from(near)).log2() + 0.0862;
            let bound = doublings / 2_f64.powi(bits as i32) * f64::from(distance);
            let step = key.step(distance, near, far);
            prop_assert!(step <= bound, "{step} {bound}");
        }

        #[test]
        fn every_float_has_an_exact_number_of_its_own(first in any::<f32>(), second in any::<f32>()) {
            prop_assume!(!first.is_nan() && !second.is_nan());
            let number = |depth| DepthKey::EXACT.quantize(depth, 1.0, 2.0);
            prop_assert_eq!(number(first).partial_cmp(&number(second)), first.partial_cmp(&second));
        }

        #[test]
        fn bits_that_are_not_asked_for_are_0(key in any_key(), (near, far) in any_planes(), depth in any::<f32>()) {
            prop_assert_eq!(key.quantize(depth, near, far).unbounded_shl(key.bits), 0);
        }
    }

    #[test]
    fn all_bits_are_made_use_of() {
        for bits in 1..32 {
            for key in [DepthCurve::Logarithmic, DepthCurve::Linear { far: 50.0 }].map(|curve| DepthKey { bits, curve })
            {
                assert_eq!(key.quantize(0.0, 0.1, 50.0), 0);
                // Where there are fewer floats than numbers, the last of these is nobody's.
                if bits < 26 {
                    assert_eq!(key.quantize(50.0, 0.1, 50.0) >> (32 - bits), (1 << bits) - 1, "{key:?}");
                }
            }
        }
    }

    #[test]
    fn what_is_out_of_range_counts_as_the_end() {
        for curve in [DepthCurve::Logarithmic, DepthCurve::Linear { far: 10.0 }] {
            let key = DepthKey { bits: 16, curve };
            let number = |depth| key.quantize(depth, 0.5, 10.0);
            for near in [f32::NAN, -f32::NAN, f32::NEG_INFINITY, -3.0, -0.0, 0.0, f32::MIN_POSITIVE, 1e-40] {
                assert_eq!(number(near), number(0.0), "{near}");
            }
            for far in [10.0, 10.1, f32::MAX, f32::INFINITY] {
                assert_eq!(number(far), number(10.0), "{far}");
            }
            assert_eq!(key.step(10.1, 0.5, 10.0), f64::INFINITY);
            assert_eq!(key.step(f32::NAN, 0.5, 10.0), f64::INFINITY);
        }
        let key = DepthKey { bits: 16, curve: DepthCurve::Logarithmic };
        assert!(key.quantize(f32::MAX, 0.5, f32::INFINITY) < u32::MAX);
        assert_eq!(key.quantize(7.0, 5.0, 5.0), key.quantize(3.0, 5.0, 5.0));
    }

    #[test]
    fn what_no_quality_can_have_does_no_harm() {
        for bits in [0, 33, u32::MAX] {
            for curve in
                [DepthCurve::Logarithmic, DepthCurve::Linear { far: 0.0 }, DepthCurve::Linear { far: f32::NAN }]
            {
                for (near, far) in [(f32::NAN, f32::NAN), (9.0, 1.0), (-1.0, f32::INFINITY), (0.0, 0.0)] {
                    let key = DepthKey { bits, curve };
                    let _ = (key.quantize(3.0, near, far), key.quantize(f32::NAN, near, far), key.step(3.0, near, far));
                }
            }
        }
    }
}
