//! The encoding of a command relative to the previous one.

use drawloom::command::{DrawState, RenderCommand, SortKey};

/// The maximum length of a coded command: its first byte, key, object, second byte, mesh, material and state.
pub(super) const MAX_LENGTH: usize = 1 + 8 + 4 + 1 + 4 + 4 + 4;

/// The number of bytes that [`Coder::encode`] needs after the longest command, because it writes whole words.
pub(super) const SLACK: usize = 8;

// A coded command is hardly ever longer than a `RenderCommand`.
const _: () = assert!(MAX_LENGTH <= size_of::<RenderCommand>() + 2);

/// The state of encoding or decoding: what the next command is coded relative to.
///
/// ```text
/// first byte   bit 7    | 6 … 4         | 3 … 0
///              explicit | object length | key length
/// second byte  bit 7    | 6     | 5 … 3           | 2 … 0
/// if explicit  0        | state | material length | mesh length
/// ```
///
/// "Explicit": mesh, material or state differ from the prediction, and follow. Lengths are those of the differences, in
/// bytes. Key length n from 9 to 13: n − 8 bytes, which are the difference shifted right by 24 bits, because keys of
/// blended commands end in 30 zeros. Object length 5: no bytes, and the same difference as last time, because copies of
/// an object often have indices at equal distances.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coder {
    last: RenderCommand,
    /// The difference between the last two objects.
    step: u32,
}

/// Why bytes are not a coded command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fault {
    Truncated,
    Malformed,
}

const SHIFTED_KEY: u8 = 8;
const KEY_SHIFT: u32 = 24;
const SAME_STEP: u8 = 5;
const EXPLICIT: u8 = 1 << 7;
const STATE: u8 = 1 << 6;

impl Default for Coder {
    fn default() -> Self {
        let last = RenderCommand { key: SortKey::from_bits(0), ..RenderCommand::EMPTY };
        Self { last, step: 0 }
    }
}

impl Coder {
    /// Writes a command to `bytes` at `start`, and returns its end. It may overwrite up to [`SLACK`] bytes after the
    /// end.
    #[inline]
    pub(super) fn encode(&mut self, command: &RenderCommand, bytes: &mut [u8], start: usize) -> usize {
        let mut end = start + 1;
        let mut put = |value: u64, length: u8| {
            bytes[end..end + SLACK].copy_from_slice(&value.to_le_bytes());
            end += usize::from(length);
        };
        let difference = command.key.bits().wrapping_sub(self.last.key.bits());
        let key_length = length(difference);
        let is_shifted = difference != 0 && difference.trailing_zeros() >= KEY_SHIFT;
        let mut first = if is_shifted {
            let shorter = key_length - KEY_SHIFT as u8 / 8;
            put(difference >> KEY_SHIFT, shorter);
            SHIFTED_KEY + shorter
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

        let prediction = self.predicted(command.key);
        let is_predicted =
            (command.mesh, command.material, command.state) == (prediction.mesh, prediction.material, prediction.state);
        if !is_predicted {
            first |= EXPLICIT;
            let mesh = fold(command.mesh.wrapping_sub(prediction.mesh));
            let material = fold(command.material.wrapping_sub(prediction.material));
            let state = if command.state == prediction.state { 0 } else { STATE };
            put(u64::from(length(mesh) | length(material) << 3 | state), 1);
            put(mesh, length(mesh));
            put(material, length(material));
            put(command.state.index() as u64, state >> 4);
        }
        bytes[start] = first;
        *self = Self { last: *command, step };
        end
    }

    /// Reads the next command from the front of `rest`, and removes it.
    ///
    /// # Errors
    /// If `rest` does not begin with a coded command.
    #[inline]
    pub(super) fn decode(&mut self, rest: &mut &[u8]) -> Result<RenderCommand, Fault> {
        let first = take(rest, 1)? as u8;
        let (key_length, shift) = match first & 0xf {
            length @ ..=SHIFTED_KEY => (length, 0),
            length @ ..=13 => (length - SHIFTED_KEY, KEY_SHIFT),
            _ => return Err(Fault::Malformed),
        };
        let difference = take(rest, key_length)? << shift;
        let key = SortKey::from_bits(self.last.key.bits().wrapping_add(difference));
        let step = match (first & !EXPLICIT) >> 4 {
            SAME_STEP => self.step,
            length => unfold(take(rest, at_most_4(length)?)?),
        };
        let object = self.last.object.wrapping_add(step);

        let Prediction { mut mesh, mut material, mut state } = self.predicted(key);
        if first & EXPLICIT != 0 {
            let second = take(rest, 1)? as u8;
            if second & EXPLICIT != 0 {
                return Err(Fault::Malformed);
            }
            mesh = mesh.wrapping_add(unfold(take(rest, at_most_4(second & 7)?)?));
            material = material.wrapping_add(unfold(take(rest, at_most_4(second >> 3 & 7)?)?));
            if second & STATE != 0 {
                state = DrawState::from_bits(take(rest, 4)? as u32).ok_or(Fault::Malformed)?;
            }
        }
        let command = RenderCommand { key, object, mesh, material, state };
        *self = Self { last: command, step };
        Ok(command)
    }

    /// Predicts mesh, material and state of a command with this key.
    fn predicted(&self, key: SortKey) -> Prediction {
        let RenderCommand { mesh, material, state, .. } = self.last;
        let (state, mesh) = state_and_mesh(key).unwrap_or((state, mesh));
        Prediction { mesh, material, state }
    }
}

/// The state and the mesh slot in the key of an opaque command (see [`SortKey`]); `None` for other keys.
#[inline]
pub(super) fn state_and_mesh(key: SortKey) -> Option<(DrawState, u32)> {
    let field = |shift: u32, bits: u32| (key.bits() >> shift) as u32 & ((1 << bits) - 1);
    let state = DrawState::from_bits(field(55, 3) | field(58, 4) << 5 | field(20, 3) << 9 | field(47, 8) << 12);
    state.filter(|_| key.bits() >> 62 == 0).map(|state| (state, field(23, 24)))
}

struct Prediction {
    mesh: u32,
    material: u32,
    state: DrawState,
}

/// Reads a number of `length` bytes, at most 8, from the front of `rest`, and removes it.
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

/// The number of bytes that the value needs.
fn length(value: u64) -> u8 {
    (u64::BITS - value.leading_zeros()).div_ceil(8) as u8
}

/// Zigzag coding, which maps small differences of either sign to small numbers: 0, −1, 1, −2 ... become 0, 1, 2, 3 ...
fn fold(difference: u32) -> u64 {
    let signed = difference as i32;
    u64::from((signed << 1 ^ signed >> 31) as u32)
}

fn unfold(folded: u64) -> u32 {
    let folded = folded as u32;
    folded >> 1 ^ (folded & 1).wrapping_neg()
}
