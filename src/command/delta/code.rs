//! How one command is coded, after another.

use crate::command::{DrawState, RenderCommand, SortKey};

/// Bytes of the longest command: its first byte, key, object, second byte, mesh, material and state.
pub(super) const LONGEST: usize = 1 + 8 + 4 + 1 + 4 + 4 + 1;

/// Room that [`Coder::encode`] needs behind the longest command, as it writes whole words.
pub(super) const SLACK: usize = 8;

// Never longer than the fixed form.
const _: () = assert!(LONGEST <= size_of::<RenderCommand>());

/// What the next command is coded against.
///
/// ```text
/// first byte   bit 7    | 6 … 4       | 3 … 0
///              surprise | object's    | key's length
/// second byte  bit 7    | 6     | 5 … 3      | 2 … 0
/// if surprise  0        | state | material's | mesh's length
/// ```
///
/// Lengths are in bytes. A key's length over 8 means 8 less, of a difference whose lowest three bytes are 0 and left out: keys
/// of blended commands end in 30 zeros. An object's length of 5 means no byte, and the same difference as last time: copies of an
/// object are evenly apart.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coder {
    last: RenderCommand,
    /// By how much the last object differs from the one before.
    step: u32,
}

/// Why bytes are no command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    Truncated,
    Malformed,
}

const KEY_WITHOUT_ZEROS: u8 = 8;
const ZEROS: u32 = 24;
const SAME_STEP: u8 = 5;
const SURPRISE: u8 = 1 << 7;
const STATE: u8 = 1 << 6;

impl Default for Coder {
    fn default() -> Self {
        let last = RenderCommand { key: SortKey::from_bits(0), ..RenderCommand::EMPTY };
        Self { last, step: 0 }
    }
}

impl Coder {
    /// Writes a command to `bytes` from `start`, and says where it ends; it may write beyond that.
    #[inline]
    pub(super) fn encode(&mut self, command: &RenderCommand, bytes: &mut [u8], start: usize) -> usize {
        let mut end = start + 1;
        let mut put = |value: u64, length: u8| {
            bytes[end..end + SLACK].copy_from_slice(&value.to_le_bytes());
            end += usize::from(length);
        };
        let difference = command.key.bits().wrapping_sub(self.last.key.bits());
        let key_length = length(difference);
        let without_zeros = difference != 0 && difference.trailing_zeros() >= ZEROS;
        let mut first = if without_zeros {
            let shorter = key_length - ZEROS as u8 / 8;
            put(difference >> ZEROS, shorter);
            KEY_WITHOUT_ZEROS + shorter
        } else {
            put(difference, key_length);
            key_length
        };
        let step = command.object.wrapping_sub(self.last.object);
        first |= if step == self.step {
            SAME_STEP
        } else {
            let folded = fold(step);
            put(folded, length(folded));
            length(folded)
        } << 4;

        let expected = self.expected(command.key);
        let is_expected =
            (command.mesh, command.material, command.state) == (expected.mesh, expected.material, expected.state);
        if !is_expected {
            first |= SURPRISE;
            let mesh = fold(command.mesh.wrapping_sub(expected.mesh));
            let material = fold(command.material.wrapping_sub(expected.material));
            let state = if command.state == expected.state { 0 } else { STATE };
            put(u64::from(length(mesh) | length(material) << 3 | state), 1);
            put(mesh, length(mesh));
            put(material, length(material));
            put(u64::from(command.state.byte()), state >> 6);
        }
        bytes[start] = first;
        *self = Self { last: *command, step };
        end
    }

    /// Takes the next command off the front of `rest`.
    ///
    /// # Errors
    /// If there is none.
    #[inline]
    pub(super) fn decode(&mut self, rest: &mut &[u8]) -> Result<RenderCommand, Fault> {
        let first = take(rest, 1)? as u8;
        let (key_length, zeros) = match first & 0xf {
            code @ ..=KEY_WITHOUT_ZEROS => (code, 0),
            code @ ..=13 => (code - KEY_WITHOUT_ZEROS, ZEROS),
            _ => return Err(Fault::Malformed),
        };
        let difference = take(rest, key_length)? << zeros;
        let key = SortKey::from_bits(self.last.key.bits().wrapping_add(difference));
        let step = match (first & !SURPRISE) >> 4 {
            SAME_STEP => self.step,
            code => unfold(take(rest, at_most_4(code)?)?),
        };
        let object = self.last.object.wrapping_add(step);

        let Expected { mut mesh, mut material, mut state } = self.expected(key);
        if first & SURPRISE != 0 {
            let second = take(rest, 1)? as u8;
            if second & SURPRISE != 0 {
                return Err(Fault::Malformed);
            }
            mesh = mesh.wrapping_add(unfold(take(rest, at_most_4(second & 7)?)?));
            material = material.wrapping_add(unfold(take(rest, at_most_4(second >> 3 & 7)?)?));
            if second & STATE != 0 {
                state = DrawState::from_byte(take(rest, 1)? as u8);
            }
        }
        let command = RenderCommand { key, object, mesh, material, state };
        *self = Self { last: command, step };
        Ok(command)
    }

    /// What a command with this key is likely to draw.
    fn expected(&self, key: SortKey) -> Expected {
        let RenderCommand { mesh, material, state, .. } = self.last;
        let (state, mesh) = key.state_and_mesh().unwrap_or((state, mesh));
        Expected { mesh, material, state }
    }
}

struct Expected {
    mesh: u32,
    material: u32,
    state: DrawState,
}

/// A number of so many bytes, 8 at most.
#[inline]
fn take(rest: &mut &[u8], length: u8) -> Result<u64, Fault> {
    const MASKS: [u64; 9] =
        [0, 0xff, 0xffff, 0xff_ffff, u32::MAX as u64, u64::MAX >> 24, u64::MAX >> 16, u64::MAX >> 8, u64::MAX];
    let word = rest.first_chunk().copied().unwrap_or_else(|| {
        let mut word = [0; 8];
        word[..rest.len()].copy_from_slice(rest);
        word
    });
    *rest = rest.get(usize::from(length)..).ok_or(Fault::Truncated)?;
    Ok(u64::from_le_bytes(word) & MASKS[usize::from(length)])
}

fn at_most_4(length: u8) -> Result<u8, Fault> {
    if length <= 4 { Ok(length) } else { Err(Fault::Malformed) }
}

/// How many bytes hold the value.
fn length(value: u64) -> u8 {
    (u64::BITS - value.leading_zeros()).div_ceil(8) as u8
}

/// Small numbers for small differences in both directions: 0, −1, 1, −2 ... become 0, 1, 2, 3 ...
fn fold(difference: u32) -> u64 {
    let signed = difference as i32;
    u64::from((signed << 1 ^ signed >> 31) as u32)
}

fn unfold(folded: u64) -> u32 {
    let folded = folded as u32;
    folded >> 1 ^ (folded & 1).wrapping_neg()
}
