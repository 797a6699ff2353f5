//! Jobs of a run, encoded in 64 bits, so that queueing them allocates nothing.

use std::ops::Range;

/// A job of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Token {
    /// Start the ready nodes in these slots.
    Ready(Range<u32>),
    /// Start this node.
    Start(u32),
    /// Start this node, which is pinned.
    StartPinned(u32),
    /// Join the workers that run the chunks of this node.
    Join(u32),
}

/// Slots and nodes take 31 bits each. A graph that needs more does not fit into memory.
const BITS: u32 = 31;
const MASK: u64 = (1 << BITS) - 1;

impl Token {
    pub(super) fn encode(self) -> u64 {
        let (kind, high, low) = match self {
            Self::Ready(slots) => (0, slots.end, slots.start),
            Self::Start(node) => (1, 0, node),
            Self::StartPinned(node) => (2, 0, node),
            Self::Join(node) => (3, 0, node),
        };
        (kind << (2 * BITS)) | (u64::from(high) << BITS) | u64::from(low)
    }

    pub(super) fn decode(code: u64) -> Self {
        let low = (code & MASK) as u32;
        match code >> (2 * BITS) {
            0 => Self::Ready(low..((code >> BITS) & MASK) as u32),
            1 => Self::Start(low),
            2 => Self::StartPinned(low),
            _ => Self::Join(low),
        }
    }
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use std::iter;

    use fastrand::Rng;

    use super::{MASK, Token};

    const RANDOM_NUMBERS: usize = if cfg!(miri) { 8 } else { 64 };

    #[test]
    fn a_decoded_token_equals_the_encoded_one() {
        let mut random = Rng::with_seed(31);
        let edges = [0, 1, MASK as u32 - 1, MASK as u32];
        let drawn = iter::repeat_with(|| random.u32(..=MASK as u32)).take(RANDOM_NUMBERS);
        let numbers: Vec<u32> = edges.into_iter().chain(drawn).collect();
        for &low in &numbers {
            for token in [Token::Start(low), Token::StartPinned(low), Token::Join(low)] {
                assert_eq!(Token::decode(token.clone().encode()), token);
            }
            for &high in &numbers {
                let token = Token::Ready(low..high);
                assert_eq!(Token::decode(token.clone().encode()), token);
            }
        }
    }
}
