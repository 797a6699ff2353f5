//! Tells damaged bytes from those that were stored.

/// A sum over bytes that grow at their end, however they came to be appended. It is for accidents: who changes bytes on purpose
/// can make them fit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Checksum {
    /// How many bytes are in the sum: whole words.
    followed: usize,
    sum: u64,
}

const WORD: usize = size_of::<u64>();

/// 2⁶⁴ divided by the golden ratio, made odd.
const FACTOR: u64 = 0x9e37_79b9_7f4a_7c15;

impl Default for Checksum {
    fn default() -> Self {
        // Of a sum that begins with 0, zeros would make 0.
        Self { followed: 0, sum: FACTOR }
    }
}

impl Checksum {
    /// Takes in the words that `bytes` has become longer by.
    pub(super) fn follow(&mut self, bytes: &[u8]) {
        let words = bytes[self.followed..].chunks_exact(WORD);
        self.followed = bytes.len() / WORD * WORD;
        self.sum = words.fold(self.sum, |sum, word| mix(sum, word_of(word)));
    }

    /// The sum over these bytes, which it has followed, and their number of commands.
    pub(super) fn value(&self, bytes: &[u8], count: u64) -> u32 {
        let last = &bytes[self.followed..];
        let sum = mix(mix(mix(self.sum, word_of(last)), bytes.len() as u64), count);
        (mix(sum, sum >> 32) >> 32) as u32
    }
}

/// Different for different sums, and for different words.
fn mix(sum: u64, word: u64) -> u64 {
    (sum ^ word).wrapping_mul(FACTOR).rotate_left(31)
}

/// Up to 8 bytes, and zeros for those that are missing.
fn word_of(bytes: &[u8]) -> u64 {
    let mut word = [0; WORD];
    word[..bytes.len()].copy_from_slice(bytes);
    u64::from_le_bytes(word)
}
