//! Packs the bits in which sort keys differ.

use super::SortKey;

/// Packs the bits of sort keys that are not the same in all of them. Packed keys have the same order and are short: a
/// view's commands have a handful of states and meshes, and depths of a few powers of two.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct KeyPacker {
    runs: [Run; Self::MAX_RUNS],
    width: u32,
}

/// Adjacent bits of a key.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Run {
    /// The position of the lowest in the key.
    from: u32,
    /// Its position in the packed key.
    to: u32,
    /// As many low bits as the run is long.
    mask: u64,
}

impl KeyPacker {
    /// The most runs. A key has no more fields; if its differing bits form more runs, the gaps between the nearest ones
    /// are packed too.
    const MAX_RUNS: usize = 4;

    /// A packer for keys that differ only in the bits set in `differing`.
    pub(super) fn new(differing: u64) -> Self {
        let mut packed_bits = differing;
        while run_count(packed_bits) > Self::MAX_RUNS {
            packed_bits = close_narrowest_gap(packed_bits);
        }
        let mut bits = Self { runs: [Run::default(); Self::MAX_RUNS], width: 0 };
        for run in &mut bits.runs {
            if packed_bits == 0 {
                break;
            }
            let from = packed_bits.trailing_zeros();
            let length = (packed_bits >> from).trailing_ones();
            let mask = u64::MAX >> (u64::BITS - length);
            *run = Run { from, to: bits.width, mask };
            bits.width += length;
            packed_bits &= !(mask << from);
        }
        bits
    }

    /// The number of bits of a packed key.
    pub(super) fn width(&self) -> u32 {
        self.width
    }

    /// Packs a key.
    #[inline]
    pub(super) fn pack(&self, key: SortKey) -> u64 {
        self.runs.iter().fold(0, |packed, run| packed | (key.bits() >> run.from & run.mask) << run.to)
    }
}

fn run_count(bits: u64) -> usize {
    (bits & !(bits << 1)).count_ones() as usize
}

/// Sets the bits of the narrowest gap between two runs. `bits` has at least two runs.
fn close_narrowest_gap(bits: u64) -> u64 {
    let mut narrowest = u64::MAX;
    let mut rest = bits >> bits.trailing_zeros();
    let mut position = bits.trailing_zeros();
    while rest != 0 {
        let ones = rest.trailing_ones();
        let behind = rest.checked_shr(ones).unwrap_or(0);
        if behind == 0 {
            break;
        }
        let zeros = behind.trailing_zeros();
        let gap = (u64::MAX >> (u64::BITS - zeros)) << (position + ones);
        if gap.count_ones() < narrowest.count_ones() {
            narrowest = gap;
        }
        position += ones + zeros;
        rest = behind >> zeros;
    }
    bits | narrowest
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::command::DrawState;
    use crate::quality::{DepthCurve, DepthPrecision};

    proptest! {
        #[test]
        fn packed_keys_keep_their_order(
            base in any::<u64>(),
            differing in prop_oneof![any::<u64>(), prop::collection::vec((0_u32..64, 1_u32..12), 0..9).prop_map(|runs| {
                runs.into_iter().fold(0, |bits, (from, length)| bits | (u64::MAX >> (64 - length)) << from)
            })],
            random in prop::collection::vec(any::<u64>(), 2..20),
        ) {
            let packer = KeyPacker::new(differing);
            prop_assert!(packer.width() >= differing.count_ones());
            let keys: Vec<_> = random.iter().map(|&random| SortKey::from_bits(base ^ random & differing)).collect();
            for one in &keys {
                prop_assert!(packer.width() == 64 || packer.pack(*one) >> packer.width() == 0);
                for other in &keys {
                    prop_assert_eq!(packer.pack(*one).cmp(&packer.pack(*other)), one.cmp(other));
                }
            }
        }
    }

    #[test]
    fn bits_that_never_differ_are_left_out() {
        assert_eq!(KeyPacker::new(0).width(), 0);
        assert_eq!(KeyPacker::new(0xff00_00f0_0f00_000f).width(), 20);
        assert_eq!(KeyPacker::new(u64::MAX).width(), 64);
        // Six runs; the nearest three become one.
        assert_eq!(KeyPacker::new(0x8000_8000_8000_0421).width(), 3 + 11);
    }

    #[test]
    fn fewer_bits_of_depth_make_shorter_packed_keys() {
        let width = |bits: u32, blends: bool| {
            let key = |depth: u16| {
                let order = DepthPrecision { bits, curve: DepthCurve::Logarithmic };
                let depth = order.quantize(f32::from(depth) * 0.37, 0.1, 1e4);
                if blends { SortKey::blended(depth) } else { SortKey::opaque(DrawState::PLAIN, 5, depth) }
            };
            let differing = (0..5_000).fold(0, |bits, depth| bits | (key(depth).bits() ^ key(0).bits()));
            KeyPacker::new(differing).width()
        };
        for bits in [1, 4, 8, 16, 20] {
            assert_eq!([width(bits, false), width(bits, true)], [bits; 2]);
        }
    }
}
