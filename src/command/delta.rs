//! Commands in as few bytes as they differ by.

mod code;
#[cfg(all(test, not(drawloom_loom)))]
mod tests;

use std::iter::FusedIterator;

use crc32fast::Hasher;

use super::RenderCommand;
use code::{Coder, Fault, LONGEST};

/// Commands one after the other, of each only what it does not share with the one before (M 10.3, its "bonus points"). Any
/// commands come back as they were, bit by bit, but it is sorted ones that become short.
///
/// ```text
/// byte 0 … 3 | 4 … 7    | 8 … 15            | 16 …
/// "DLC2"     | checksum | count of commands | the commands
/// ```
///
/// All numbers are little-endian. The checksum is the CRC-32 of the commands followed by their count. It finds
/// accidents, not bytes that were changed on purpose. A command is a byte that says how long its parts are, and those
/// parts: the difference of the keys, that of the objects if it is not the same as last time, and mesh, material and
/// state where they are not as expected. Expected is what the key of an opaque command repeats of them; of other
/// commands, what they were before.
///
/// They are for commands that leave the frame: stored, sent, or kept for many frames. Sorted commands take 1 to 6 bytes in
/// place of 24. To code, to check and to decode one takes 3 to 8 ns each, so they win where bytes pass at less than 0.8 GB/s.
/// Within a frame they lose, and it does not use them: commands are sorted and read there several times, and to copy the
/// fixed form takes 0.5 ns, to compare it with the last frame's 1.3. (`cargo bench -p drawloom-benches --bench delta`, on a virtual machine of two
/// cores.)
///
/// ```
/// use drawloom::command::{DeltaCommands, DrawState, RenderCommand, SortKey};
/// use drawloom::quality::DepthKey;
///
/// let depth = DepthKey::EXACT.quantize(12.0, 0.1, 100.0);
/// let command = |object| {
///     let key = SortKey::opaque(DrawState::PLAIN, 3, depth);
///     RenderCommand { key, object, mesh: 3, material: 7, state: DrawState::PLAIN }
/// };
/// let commands: Vec<_> = (0..100).map(|copy| command(copy * 126)).collect();
/// let sent = DeltaCommands::encode(&commands).into_bytes();
/// assert!(sent.len() < 150);
///
/// let received = DeltaCommands::from_bytes(sent)?;
/// assert!(received.iter().eq(commands));
/// # Ok::<(), drawloom::command::DeltaError>(())
/// ```
#[derive(Clone, Debug)]
pub struct DeltaCommands {
    bytes: Vec<u8>,
    count: usize,
    /// The CRC-32 of the commands.
    crc: Hasher,
    /// Behind the last command.
    coder: Coder,
}

/// Why bytes are no [`DeltaCommands`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DeltaError {
    /// They begin with something else.
    #[error("these bytes are no delta commands, or are of another version")]
    Foreign,
    /// They end too early.
    #[error("the bytes end within command {index} of {count}")]
    Truncated {
        /// Which command, from 0.
        index: u64,
        /// How many there should be.
        count: u64,
    },
    /// A command whose first bytes mean nothing.
    #[error("command {index} is coded in no way that there is")]
    Malformed {
        /// Which command, from 0.
        index: u64,
    },
    /// They go on behind the last command.
    #[error("{bytes} bytes are left behind the last command")]
    TooLong {
        /// How many are left.
        bytes: usize,
    },
    /// Some are not what they were.
    #[error("the bytes are damaged: their checksum is {found:#010x}, not {stored:#010x}")]
    Damaged {
        /// What it is.
        found: u32,
        /// What it was.
        stored: u32,
    },
}

const MARK: [u8; 4] = *b"DLC2";
const HEADER: usize = 16;
/// Commands that are coded before they are appended as one.
const TOGETHER: usize = 64;

impl DeltaCommands {
    /// No commands.
    pub fn new() -> Self {
        let mut new = Self { bytes: vec![0; HEADER], count: 0, crc: Hasher::new(), coder: Coder::default() };
        new.write_header();
        new
    }

    /// These commands.
    pub fn encode(commands: &[RenderCommand]) -> Self {
        let mut new = Self::new();
        new.extend_from_slice(commands);
        new
    }

    /// The commands in what [`DeltaCommands::bytes`] once were, stored or sent since. It takes no memory, whatever the bytes
    /// say.
    ///
    /// # Errors
    /// If they are anything else, or damaged.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self, DeltaError> {
        let (header, body) = bytes.split_first_chunk::<HEADER>().ok_or(DeltaError::Foreign)?;
        let [m0, m1, m2, m3, s0, s1, s2, s3, count @ ..] = *header;
        if [m0, m1, m2, m3] != MARK {
            return Err(DeltaError::Foreign);
        }
        let (stored, count) = (u32::from_le_bytes([s0, s1, s2, s3]), u64::from_le_bytes(count));
        let (mut coder, mut rest) = (Coder::default(), body);
        for index in 0..count {
            coder.decode(&mut rest).map_err(|fault| match fault {
                Fault::Truncated => DeltaError::Truncated { index, count },
                Fault::Malformed => DeltaError::Malformed { index },
            })?;
        }
        if !rest.is_empty() {
            return Err(DeltaError::TooLong { bytes: rest.len() });
        }
        let mut crc = Hasher::new();
        crc.update(body);
        let found = checksum(&crc, count);
        if found != stored {
            return Err(DeltaError::Damaged { found, stored });
        }
        // Each command is a byte at least, so there are no more of them than fit into memory.
        Ok(Self { bytes, count: count as usize, crc, coder })
    }

    /// Appends a command.
    pub fn push(&mut self, command: RenderCommand) {
        self.extend_from_slice(&[command]);
    }

    /// Appends commands.
    pub fn extend_from_slice(&mut self, commands: &[RenderCommand]) {
        let old_length = self.bytes.len();
        let mut coded = [0; TOGETHER * LONGEST + code::SLACK];
        for part in commands.chunks(TOGETHER) {
            let mut end = 0;
            for command in part {
                end = self.coder.encode(command, &mut coded, end);
            }
            self.bytes.extend_from_slice(&coded[..end]);
        }
        self.count += commands.len();
        self.crc.update(&self.bytes[old_length..]);
        self.write_header();
    }

    /// Drops all commands, and keeps the memory for the next ones.
    pub fn clear(&mut self) {
        self.bytes.truncate(HEADER);
        (self.count, self.crc, self.coder) = (0, Hasher::new(), Coder::default());
        self.write_header();
    }

    /// The commands, in the order they were appended.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = RenderCommand> + FusedIterator {
        Commands { rest: &self.bytes[HEADER..], left: self.count, coder: Coder::default() }
    }

    /// How many commands.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there is no command.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// What to store or to send.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The same without a copy.
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    fn write_header(&mut self) {
        let count = self.count as u64;
        let checksum = checksum(&self.crc, count);
        self.bytes[..4].copy_from_slice(&MARK);
        self.bytes[4..8].copy_from_slice(&checksum.to_le_bytes());
        self.bytes[8..HEADER].copy_from_slice(&count.to_le_bytes());
    }
}

/// The checksum of the header: the CRC-32 of the commands, continued by their count.
fn checksum(commands: &Hasher, count: u64) -> u32 {
    let mut crc = commands.clone();
    crc.update(&count.to_le_bytes());
    crc.finalize()
}

impl Default for DeltaCommands {
    fn default() -> Self {
        Self::new()
    }
}

struct Commands<'a> {
    rest: &'a [u8],
    left: usize,
    coder: Coder,
}

impl Iterator for Commands<'_> {
    type Item = RenderCommand;

    #[inline]
    fn next(&mut self) -> Option<RenderCommand> {
        self.left = self.left.checked_sub(1)?;
        // All bytes were coded here or checked.
        self.coder.decode(&mut self.rest).ok()
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.left, Some(self.left))
    }
}

impl ExactSizeIterator for Commands<'_> {}
impl FusedIterator for Commands<'_> {}
