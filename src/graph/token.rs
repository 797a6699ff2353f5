//! What a worker is to do next in a run, in 64 bits, so that it goes through the queues without taking memory.

use std::ops::Range;

/// A piece of a run.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Token {
    /// Start the nodes that stand ready at these places.
    Ready(Range<u32>),
    /// Start this node.
    Start(u32),
    /// Start this node, which is pinned.
    StartPinned(u32),
    /// Take part in this node, which another worker has started.
    Join(u32),
}

/// Places and nodes take 31 bits each. Long before there are so many, memory is full.
const BITS: u32 = 31;
const MASK: u64 = (1 << BITS) - 1;

impl Token {
    pub(super) fn encode(self) -> u64 {
        let (kind, high, low) = match self {
            Self::Ready(places) => (0, places.end, places.start),
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

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use proptest::prelude::*;

    use super::{MASK, Token};

    proptest! {
        #[test]
        fn tokens_come_back_as_they_were(low in 0..=MASK as u32, high in 0..=MASK as u32) {
            for token in [Token::Ready(low..high), Token::Start(low), Token::StartPinned(low), Token::Join(low)] {
                prop_assert_eq!(Token::decode(token.clone().encode()), token);
            }
        }
    }
}
