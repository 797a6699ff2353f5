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
    use proptest::prelude::*;

    use super::{MASK, Token};

    proptest! {
        #[test]
        #[cfg_attr(miri, ignore = "proptest reads files")]
        fn a_decoded_token_equals_the_encoded_one(low in 0..=MASK as u32, high in 0..=MASK as u32) {
            for token in [Token::Ready(low..high), Token::Start(low), Token::StartPinned(low), Token::Join(low)] {
                prop_assert_eq!(Token::decode(token.clone().encode()), token);
            }
        }
    }
}
