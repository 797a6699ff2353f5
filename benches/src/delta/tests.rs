use drawloom::command::{DrawState, SortKey};
use proptest::prelude::*;

use super::code::state_and_mesh;
use super::*;

/// Arbitrary commands: keys that do not match mesh and state, extreme slots, and similar values.
fn any_command() -> impl Strategy<Value = RenderCommand> {
    let key = prop_oneof![
        any::<u64>(),
        any::<u64>().prop_map(|bits| bits >> 2),
        0..64_u64,
        Just(u64::MAX),
        (0..64_u32).prop_map(|bit| 1 << bit),
        (0..64_u32).prop_map(|bit| (1 << bit) - 1),
        any::<u32>().prop_map(|depth| SortKey::blended(depth).bits()),
    ];
    let slot = || prop_oneof![any::<u32>(), 0..300_u32, Just(u32::MAX), 0xffff_0000..=u32::MAX];
    (key, slot(), slot(), slot(), 0..DrawState::COUNT as u32).prop_map(|(bits, object, mesh, material, state)| {
        RenderCommand {
            key: SortKey::from_bits(bits),
            object,
            mesh,
            material,
            state: DrawState::from_bits(state).unwrap(),
        }
    })
}

/// Sorted commands like those of frames.
fn typical_commands(max: usize) -> impl Strategy<Value = Vec<RenderCommand>> {
    let command = (0..200_u32, 0..30_u32, 0.1..100.0_f32, 0..10_u32).prop_map(|(mesh, material, depth, kind)| {
        let state = DrawState::from_bits(kind % 3).unwrap();
        let key = match kind {
            0 => SortKey::blended(depth.to_bits() << 1),
            _ => SortKey::opaque(state, mesh, depth.to_bits() << 1),
        };
        RenderCommand { key, object: 0, mesh, material, state }
    });
    prop::collection::vec(command, 0..max).prop_map(|mut commands| {
        for (object, command) in commands.iter_mut().enumerate() {
            command.object = object as u32;
        }
        commands.sort_by_key(|command| (command.key, command.object));
        commands
    })
}

fn commands() -> impl Strategy<Value = Vec<RenderCommand>> {
    prop_oneof![
        prop::collection::vec(any_command(), 0..100),
        typical_commands(100),
        // With repeated commands.
        prop::collection::vec((any_command(), 1..4_usize), 0..30).prop_map(|runs| {
            runs.into_iter().flat_map(|(command, count)| std::iter::repeat_n(command, count)).collect()
        }),
    ]
}

proptest! {
    #[test]
    fn decoding_restores_all_commands(commands in commands()) {
        let coded = DeltaCommands::encode(&commands);
        prop_assert_eq!((coded.len(), coded.is_empty()), (commands.len(), commands.is_empty()));
        prop_assert_eq!(coded.iter().len(), commands.len());
        prop_assert!(coded.bytes().len() <= HEADER + commands.len() * MAX_LENGTH);
        prop_assert_eq!(coded.iter().collect::<Vec<_>>(), &commands[..]);
        let received = DeltaCommands::from_bytes(coded.into_bytes()).unwrap();
        prop_assert_eq!(received.len(), commands.len());
        prop_assert_eq!(received.iter().collect::<Vec<_>>(), commands);
    }

    #[test]
    fn the_bytes_do_not_depend_on_how_commands_are_appended(
        (commands, parts) in (commands(), prop::collection::vec(0..100_usize, 0..6)),
        cleared in commands(),
    ) {
        let expected = DeltaCommands::encode(&commands);
        let mut coded = DeltaCommands::encode(&cleared);
        coded.clear();
        let nothing = DeltaCommands::new();
        prop_assert_eq!((coded.len(), coded.bytes()), (0, nothing.bytes()));
        let mut rest = &commands[..];
        for part in parts {
            let (now, later) = rest.split_at(part.min(rest.len()));
            coded.extend_from_slice(now);
            rest = later;
            // Received commands can be appended to as well.
            coded = DeltaCommands::from_bytes(coded.into_bytes()).unwrap();
        }
        rest.iter().for_each(|command| coded.push(*command));
        prop_assert_eq!(coded.bytes(), expected.bytes());
        prop_assert_eq!(coded.iter().collect::<Vec<_>>(), commands);
    }

    #[test]
    fn a_damaged_byte_is_detected(
        (commands, position, change) in (commands(), any::<prop::sample::Index>(), 1..=u8::MAX),
    ) {
        let mut bytes = DeltaCommands::encode(&commands).into_bytes();
        let position = position.index(bytes.len());
        bytes[position] ^= change;
        let error = DeltaCommands::from_bytes(bytes).map(|coded| coded.len()).unwrap_err();
        prop_assert_eq!(error == DeltaError::Foreign, position < MAGIC.len());
    }

    #[test]
    fn missing_and_excess_bytes_are_detected(
        (commands, position) in (commands(), any::<prop::sample::Index>()),
        excess in prop::collection::vec(any::<u8>(), 1..20),
    ) {
        let whole = DeltaCommands::encode(&commands).into_bytes();
        let error = |bytes: &[u8]| DeltaCommands::from_bytes(bytes.to_vec()).map(|coded| coded.len()).unwrap_err();
        let kept = position.index(whole.len());
        let expected_count = commands.len() as u64;
        match error(&whole[..kept]) {
            DeltaError::Foreign => prop_assert!(kept < HEADER),
            DeltaError::Truncated { index, count } => {
                prop_assert!(kept >= HEADER && index < count && count == expected_count);
            }
            other => prop_assert!(false, "{other}"),
        }
        prop_assert_eq!(error(&[&whole[..], &excess].concat()), DeltaError::TooLong { bytes: excess.len() });
    }

    /// Random bytes begin with some valid commands. With a header of their count and checksum, they are accepted.
    #[test]
    fn random_bytes_are_commands_or_an_error(
        body in prop::collection::vec(prop_oneof![any::<u8>(), 0..=13_u8, Just(0x50)], 0..300),
    ) {
        let mut bytes = [&MAGIC, &[0; 4][..], &[0xff; 8], &body].concat();
        let error = |bytes: &[u8]| DeltaCommands::from_bytes(bytes.to_vec()).map(|coded| coded.len()).unwrap_err();
        let (DeltaError::Truncated { index: count, .. } | DeltaError::Malformed { index: count }) = error(&bytes) else {
            panic!("{}", error(&bytes));
        };
        bytes[8..HEADER].copy_from_slice(&count.to_le_bytes());
        if let DeltaError::TooLong { bytes: left } = error(&bytes) {
            bytes.truncate(bytes.len() - left);
        }
        let DeltaError::Damaged { found, stored: 0 } = error(&bytes) else { panic!("{}", error(&bytes)) };
        bytes[4..8].copy_from_slice(&found.to_le_bytes());
        let coded = DeltaCommands::from_bytes(bytes).unwrap();
        let commands: Vec<_> = coded.iter().collect();
        prop_assert_eq!(commands.len() as u64, count);
        prop_assert!(DeltaCommands::encode(&commands).iter().eq(commands));
    }

    #[test]
    fn only_opaque_keys_contain_state_and_mesh(
        bits in 0..DrawState::COUNT as u32,
        set in 0..256_u32,
        mesh in 0..1_u32 << 24,
        depth in any::<u32>(),
    ) {
        // An opaque state has no blending.
        let state = DrawState::from_bits(bits & !0b1_1000 | set << 12).unwrap();
        prop_assert_eq!(state_and_mesh(SortKey::opaque(state, mesh, depth)), Some((state, mesh)));
        prop_assert_eq!(state_and_mesh(SortKey::blended(depth)), None);
        prop_assert_eq!(state_and_mesh(SortKey::ordered(depth)), None);
        prop_assert_eq!(state_and_mesh(SortKey::LAST), None);
    }

    #[test]
    fn typical_commands_are_short(commands in typical_commands(200)) {
        let coded = DeltaCommands::encode(&commands);
        let opaque = commands.iter().filter(|command| command.key < SortKey::blended(u32::MAX)).count();
        // An opaque command takes up to 12 bytes: the first byte, 7 for the key, 2 for the object, the second byte, and
        // 1 for the material. A blended one also has mesh and state. The first command of each of the three states has
        // a key of 8 bytes, and so has the first blended one, which takes 19.
        let firsts = 3 + 2;
        prop_assert!(coded.bytes().len() <= HEADER + opaque * 12 + (commands.len() - opaque) * 17 + firsts);
    }
}

#[test]
fn the_checksum_of_no_commands_is_the_crc_of_eight_zeros() {
    assert_eq!(DeltaCommands::new().bytes(), b"DLC3\x69\xdf\x22\x65\0\0\0\0\0\0\0\0");
}

#[test]
fn a_huge_count_takes_no_memory_and_no_time() {
    let mut bytes = DeltaCommands::encode(&[RenderCommand::EMPTY; 3]).into_bytes();
    bytes[8..HEADER].fill(0xff);
    let error = DeltaCommands::from_bytes(bytes).map(|coded| coded.len());
    assert_eq!(error, Err(DeltaError::Truncated { index: 3, count: u64::MAX }));
}

#[test]
fn invalid_lengths_are_detected() {
    for body in [
        &[0x0e][..],
        &[0x0f],
        &[0x60],
        &[0x70],
        &[0xd0, 0x05],
        &[0xd0, 5 << 3],
        &[0xd0, 0x80],
        &[0xd0, 0x40, 0xff, 0xff, 0xff, 0xff],
    ] {
        let mut bytes = DeltaCommands::new().into_bytes();
        bytes[8] = 1;
        // Enough bytes for any length.
        bytes.extend([body, &[0; 30]].concat());
        let error = DeltaCommands::from_bytes(bytes).map(|coded| coded.len());
        assert_eq!(error, Err(DeltaError::Malformed { index: 0 }), "{body:x?}");
    }
}

#[test]
fn copies_of_an_object_take_a_byte_each() {
    let key = SortKey::opaque(DrawState::PLAIN, 300_000, 4 << 20);
    let copy = |index: u32| RenderCommand {
        key,
        object: 5 + index * 126,
        mesh: 300_000,
        material: 70_000,
        state: DrawState::PLAIN,
    };
    let [two, many] = [2, 102].map(|count| DeltaCommands::encode(&(0..count).map(copy).collect::<Vec<_>>()));
    assert_eq!(many.bytes().len() - two.bytes().len(), 100);
}

#[test]
fn memory_is_kept_from_frame_to_frame() {
    let commands = [RenderCommand::EMPTY, RenderCommand { object: 9, ..RenderCommand::EMPTY }].repeat(1_000);
    let mut coded = DeltaCommands::encode(&commands);
    let before = (coded.bytes().as_ptr(), coded.bytes.capacity());
    coded.clear();
    coded.extend_from_slice(&commands);
    assert_eq!((coded.bytes().as_ptr(), coded.bytes.capacity()), before);
}
