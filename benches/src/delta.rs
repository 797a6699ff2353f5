//! Delta coding of commands.

mod code;
#[cfg(test)]
mod tests;

use std::iter::FusedIterator;

use crc32fast::Hasher;
use drawloom::command::RenderCommand;

use self::code::{Coder, Fault, MAX_LENGTH};

/// Delta-coded commands: of each, only how it differs from the one before (M 10.3, its "bonus points"). The coding is
/// lossless for any commands, and compact for sorted ones.
///
/// ```text
/// byte 0 … 3 | 4 … 7    | 8 … 15            | 16 …
/// "DLC3"     | checksum | count of commands | the commands
/// ```
///
/// All numbers are little-endian. The checksum is the CRC-32 of the coded commands followed by their count. It detects
/// accidental damage, not tampering. A coded command is a byte with the lengths of its parts, and the parts: the
/// difference between its key and the previous one, the difference between the objects if it is not the same as last
/// time, and mesh, material and state where they differ from the prediction, which is the mesh and the state in the key
/// of an opaque command, and the previous command's values for everything else.
///
/// Delta coding is for commands that leave the frame: stored, sent, or kept for many frames. Sorted commands take 1 to
/// 6 bytes instead of 24. Encoding, checking and decoding take 3 to 8 ns each per command, so delta coding is faster
/// where bytes are transferred at less than 0.8 GB/s. Frames do not use them: they sort and read commands several
/// times, and copying a [`RenderCommand`] takes 0.5 ns, comparing it with the last frame's 1.3. (`cargo bench -p
/// drawloom-benches --bench delta`, on a virtual machine with two cores.)
///
/// ```
/// use drawloom::command::{DrawState, RenderCommand, SortKey};
/// use drawloom::quality::DepthPrecision;
/// use drawloom_benches::delta::DeltaCommands;
///
/// let depth = DepthPrecision::EXACT.quantize(12.0, 0.1, 100.0);
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
/// # Ok::<(), drawloom_benches::delta::DeltaError>(())
/// ```
#[derive(Clone, Debug)]
pub struct DeltaCommands {
    bytes: Vec<u8>,
    count: usize,
    /// The CRC-32 of the coded commands.
    crc: Hasher,
    /// The state after the last command.
    coder: Coder,
}

/// Why bytes are not [`DeltaCommands`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DeltaError {
    /// The header is not that of this version.
    #[error("not delta-coded commands, or an unsupported version")]
    Foreign,
    /// The bytes end too early.
    #[error("the bytes end within command {index} of {count}")]
    Truncated {
        /// The index of the command.
        index: u64,
        /// The number of commands in the header.
        count: u64,
    },
    /// A command has lengths that the encoder never writes.
    #[error("command {index} has an invalid encoding")]
    Malformed {
        /// The index of the command.
        index: u64,
    },
    /// There are bytes after the last command.
    #[error("{bytes} bytes follow the last command")]
    TooLong {
        /// The number of excess bytes.
        bytes: usize,
    },
    /// The checksum does not match.
    #[error("the bytes are damaged: their checksum is {found:#010x}, not {stored:#010x}")]
    Damaged {
        /// The checksum of the bytes.
        found: u32,
        /// The checksum in the header.
        stored: u32,
    },
}

/// The first bytes: the format and its version.
const MAGIC: [u8; 4] = *b"DLC3";
/// The length of the header.
const HEADER: usize = 16;
/// The number of commands that are coded on the stack before they are appended.
const CHUNK: usize = 64;

impl DeltaCommands {
    /// An empty list.
    pub fn new() -> Self {
        let mut new = Self { bytes: vec![0; HEADER], count: 0, crc: Hasher::new(), coder: Coder::default() };
        new.write_header();
        new
    }

    /// Encodes commands.
    pub fn encode(commands: &[RenderCommand]) -> Self {
        let mut new = Self::new();
        new.extend_from_slice(commands);
        new
    }

    /// The commands in bytes that [`DeltaCommands::bytes`] returned. It checks all of them, and allocates nothing, so
    /// that invalid bytes cannot exhaust memory.
    ///
    /// # Errors
    /// If the bytes are not delta-coded commands of this version, or are damaged.
    pub fn from_bytes(bytes: Vec<u8>) -> Result<Self, DeltaError> {
        let (header, body) = bytes.split_first_chunk::<HEADER>().ok_or(DeltaError::Foreign)?;
        let [m0, m1, m2, m3, s0, s1, s2, s3, count @ ..] = *header;
        if [m0, m1, m2, m3] != MAGIC {
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
        // A coded command has at least a byte, so the count fits into a usize.
        Ok(Self { bytes, count: count as usize, crc, coder })
    }

    /// Appends a command.
    pub fn push(&mut self, command: RenderCommand) {
        self.extend_from_slice(&[command]);
    }

    /// Appends commands.
    pub fn extend_from_slice(&mut self, commands: &[RenderCommand]) {
        let old_length = self.bytes.len();
        let mut coded = [0; CHUNK * MAX_LENGTH + code::SLACK];
        for chunk in commands.chunks(CHUNK) {
            let mut end = 0;
            for command in chunk {
                end = self.coder.encode(command, &mut coded, end);
            }
            self.bytes.extend_from_slice(&coded[..end]);
        }
        self.count += commands.len();
        self.crc.update(&self.bytes[old_length..]);
        self.write_header();
    }

    /// Removes all commands and keeps the memory.
    pub fn clear(&mut self) {
        self.bytes.truncate(HEADER);
        (self.count, self.crc, self.coder) = (0, Hasher::new(), Coder::default());
        self.write_header();
    }

    /// The commands, in the order they were appended.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = RenderCommand> + FusedIterator {
        Commands { rest: &self.bytes[HEADER..], left: self.count, coder: Coder::default() }
    }

    /// The number of commands.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are no commands.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The bytes to store or send.
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// The bytes to store or send, without a copy.
    pub fn into_bytes(self) -> Vec<u8> {
        self.bytes
    }

    fn write_header(&mut self) {
        let count = self.count as u64;
        let checksum = checksum(&self.crc, count);
        self.bytes[..4].copy_from_slice(&MAGIC);
        self.bytes[4..8].copy_from_slice(&checksum.to_le_bytes());
        self.bytes[8..HEADER].copy_from_slice(&count.to_le_bytes());
    }
}

/// The header's checksum: the CRC-32 of the coded commands, continued by their count.
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
        // Never an error: the bytes were encoded or checked by `DeltaCommands`.
        self.coder.decode(&mut self.rest).ok()
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.left, Some(self.left))
    }
}

impl ExactSizeIterator for Commands<'_> {}
impl FusedIterator for Commands<'_> {}
