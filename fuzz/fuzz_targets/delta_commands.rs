//! Delta coding: commands come back as they were, in whatever portions they are appended, and bytes are commands or an error.

#![no_main]

use arbitrary::Arbitrary;
use drawloom::command::{Cull, DeltaCommands, DeltaError, DrawState, RenderCommand, SortKey};
use drawloom::scene::{Blend, Topology};
use libfuzzer_sys::fuzz_target;

#[derive(Arbitrary, Debug)]
struct Input {
    /// The commands in portions, as they are appended.
    portions: Vec<Vec<Command>>,
    /// Coded commands, whether they are valid or not.
    body: Vec<u8>,
}

/// A command, relative to the one before.
#[derive(Arbitrary, Debug)]
struct Command {
    key: Key,
    object: Slot,
    mesh: Slot,
    material: Slot,
    state: State,
}

#[derive(Arbitrary, Debug)]
enum Key {
    Same,
    Next(u8),
    Opaque(u32),
    Blended(u32),
    Ordered(u32),
    Bits(u64),
}

#[derive(Arbitrary, Debug)]
enum Slot {
    Same,
    Step(i8),
    Any(u32),
}

#[derive(Arbitrary, Clone, Copy, Debug)]
struct State {
    is_strip: bool,
    cull: u8,
    blend: u8,
    subdivision: u8,
    level: u8,
}

impl Slot {
    fn after(&self, before: u32) -> u32 {
        match *self {
            Self::Same => before,
            Self::Step(step) => before.wrapping_add_signed(step.into()),
            Self::Any(slot) => slot,
        }
    }
}

impl State {
    fn build(self) -> DrawState {
        let topology = if self.is_strip { Topology::TriangleStrip } else { Topology::TriangleList };
        let cull = [Cull::Nothing, Cull::Back, Cull::Front][usize::from(self.cull) % 3];
        let blend = [Blend::None, Blend::Alpha, Blend::Additive][usize::from(self.blend) % 3];
        DrawState::new(topology, cull, blend)
            .with_mask(self.cull >> 7 == 1)
            .with_subdivision_level(u32::from(self.subdivision) % (DrawState::MAX_SUBDIVISION_LEVEL + 1))
            .with_level_of_detail(u32::from(self.level) % (DrawState::MAX_LEVEL_OF_DETAIL + 1))
    }
}

impl Command {
    fn after(&self, before: &RenderCommand) -> RenderCommand {
        let (mesh, state) = (self.mesh.after(before.mesh), self.state.build());
        let key = match self.key {
            Key::Same => before.key,
            Key::Next(step) => SortKey::from_bits(before.key.bits().wrapping_add(step.into())),
            Key::Opaque(depth) => SortKey::opaque(state, mesh, depth),
            Key::Blended(depth) => SortKey::blended(depth),
            Key::Ordered(number) => SortKey::ordered(number),
            Key::Bits(bits) => SortKey::from_bits(bits),
        };
        let (object, material) = (self.object.after(before.object), self.material.after(before.material));
        RenderCommand { key, object, mesh, material, state }
    }
}

fuzz_target!(|input: Input| {
    check_commands(&input.portions);
    check_body(&input.body);
});

fn check_commands(portions: &[Vec<Command>]) {
    let (mut commands, mut before) = (Vec::new(), RenderCommand::EMPTY);
    let mut coded = DeltaCommands::new();
    for portion in portions {
        let first = commands.len();
        for command in portion {
            before = command.after(&before);
            commands.push(before);
        }
        coded.extend_from_slice(&commands[first..]);
    }
    assert_eq!((coded.len(), coded.is_empty()), (commands.len(), commands.is_empty()));
    assert!(coded.iter().eq(commands.iter().copied()));
    assert!(coded.bytes().len() <= DeltaCommands::new().bytes().len() + size_of_val(commands.as_slice()));
    assert_eq!(coded.bytes(), DeltaCommands::encode(&commands).bytes());
    let mut decoded = DeltaCommands::from_bytes(coded.into_bytes()).unwrap();
    assert!(decoded.iter().eq(commands.iter().copied()));
    // What was decoded goes on as what was encoded.
    decoded.push(RenderCommand::EMPTY);
    commands.push(RenderCommand::EMPTY);
    assert_eq!(decoded.bytes(), DeltaCommands::encode(&commands).bytes());
}

/// Gives a body the header that fits it, from what the errors say, and decodes it.
fn check_body(body: &[u8]) {
    let mut bytes = DeltaCommands::new().into_bytes();
    let header = bytes.len();
    bytes[8..].fill(0xff);
    bytes.extend_from_slice(body);
    let error = |bytes: &[u8]| DeltaCommands::from_bytes(bytes.to_vec()).map(drop).unwrap_err();
    let (DeltaError::Truncated { index: count, .. } | DeltaError::Malformed { index: count }) = error(&bytes) else {
        panic!("{}", error(&bytes));
    };
    bytes[8..header].copy_from_slice(&count.to_le_bytes());
    let valid = DeltaCommands::from_bytes(bytes.clone());
    if let Err(DeltaError::TooLong { bytes: excess }) = valid {
        bytes.truncate(bytes.len() - excess);
    }
    match DeltaCommands::from_bytes(bytes.clone()) {
        Err(DeltaError::Damaged { found, .. }) => bytes[4..8].copy_from_slice(&found.to_le_bytes()),
        // Not a single command.
        Ok(coded) => assert!(coded.is_empty()),
        Err(error) => panic!("{error}"),
    }
    let coded = DeltaCommands::from_bytes(bytes).unwrap();
    let commands: Vec<_> = coded.iter().collect();
    assert_eq!(commands.len() as u64, count);
    assert!(DeltaCommands::encode(&commands).iter().eq(commands));
}
