//! The bits in which keys differ, packed together.

use crate::command::SortKey;

/// Which bits of some keys are not the same in all of them. Taken out and put side by side they keep the keys' order, and
/// are few: a view's commands have a handful of states and meshes, and depths of a few powers of two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct KeyBits {
    runs: [Run; Self::MOST_RUNS],
    width: u32,
}

/// Bits that lie side by side.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Run {
    /// Where the lowest is in the key.
    from: u32,
    /// Where it is to be.
    to: u32,
    /// As many bits as are taken, from bit 0 on.
    mask: u64,
}

impl KeyBits {
    /// A key has no more than so many parts. Where bits that differ are scattered more than that, those between them are
    /// taken too.
    const MOST_RUNS: usize = 4;

    /// `differing` has the bits set in which any two keys differ.
    pub(super) fn new(differing: u64) -> Self {
        let mut taken = differing;
        while run_count(taken) > Self::MOST_RUNS {
            taken = without_narrowest_gap(taken);
        }
        let mut bits = Self { runs: [Run::default(); Self::MOST_RUNS], width: 0 };
        for run in &mut bits.runs {
            if taken == 0 {
                break;
            }
            let from = taken.trailing_zeros();
            let length = (taken >> from).trailing_ones();
            let mask = u64::MAX >> (u64::BITS - length);
            *run = Run { from, to: bits.width, mask };
            bits.width += length;
            taken &= !(mask << from);
        }
        bits
    }

    /// How many bits are left of a key.
    pub(super) fn width(&self) -> u32 {
        self.width
    }

    /// What is left of a key.
    #[inline]
    pub(super) fn of(&self, key: SortKey) -> u64 {
        self.runs.iter().fold(0, |packed, run| packed | (key.bits() >> run.from & run.mask) << run.to)
    }
}

fn run_count(bits: u64) -> usize {
    (bits & !(bits << 1)).count_ones() as usize
}

/// Sets the bits of the narrowest gap between two runs, of which there are two or more.
fn without_narrowest_gap(bits: u64) -> u64 {
    let mut narrowest = u64::MAX;
    let mut rest = bits >> bits.trailing_zeros();
    let mut place = bits.trailing_zeros();
    while rest != 0 {
        let ones = rest.trailing_ones();
        let behind = rest.checked_shr(ones).unwrap_or(0);
        if behind == 0 {
            break;
        }
        let zeros = behind.trailing_zeros();
        let gap = (u64::MAX >> (u64::BITS - zeros)) << (place + ones);
        if gap.count_ones() < narrowest.count_ones() {
            narrowest = gap;
        }
        place += ones + zeros;
        rest = behind >> zeros;
    }
    bits | narrowest
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::command::DrawState;
    use crate::quality::{DepthCurve, DepthKey};

    proptest! {
        #[test]
        fn what_is_left_of_keys_keeps_their_order(
            base in any::<u64>(),
            differing in prop_oneof![any::<u64>(), prop::collection::vec((0_u32..64, 1_u32..12), 0..9).prop_map(|runs| {
                runs.into_iter().fold(0, |bits, (from, length)| bits | (u64::MAX >> (64 - length)) << from)
            })],
            random in prop::collection::vec(any::<u64>(), 2..20),
        ) {
            let bits = KeyBits::new(differing);
            prop_assert!(bits.width() >= differing.count_ones());
            let keys: Vec<_> = random.iter().map(|&random| SortKey::from_bits(base ^ random & differing)).collect();
            for one in &keys {
                prop_assert!(bits.width() == 64 || bits.of(*one) >> bits.width() == 0);
                for other in &keys {
                    prop_assert_eq!(bits.of(*one).cmp(&bits.of(*other)), one.cmp(other));
                }
            }
        }
    }

    #[test]
    fn bits_that_are_the_same_are_left_out() {
        assert_eq!(KeyBits::new(0).width(), 0);
        assert_eq!(KeyBits::new(0xff00_00f0_0f00_000f).width(), 20);
        assert_eq!(KeyBits::new(u64::MAX).width(), 64);
        // Six runs, of which the three nearest become one.
        assert_eq!(KeyBits::new(0x8000_8000_8000_0421).width(), 3 + 11);
    }

    #[test]
    fn fewer_bits_of_depth_are_fewer_to_sort_by() {
        let width = |bits: u32, blends: bool| {
            let key = |depth: u16| {
                let order = DepthKey { bits, curve: DepthCurve::Logarithmic };
                let depth = order.code(f32::from(depth) * 0.37, 0.1, 1e4);
                if blends { SortKey::blended(depth) } else { SortKey::opaque(DrawState::PLAIN, 5, depth) }
            };
            let differing = (0..5_000).fold(0, |bits, depth| bits | (key(depth).bits() ^ key(0).bits()));
            KeyBits::new(differing).width()
        };
        for bits in [1, 4, 8, 16, 20] {
            assert_eq!([width(bits, false), width(bits, true)], [bits; 2]);
        }
    }
}
