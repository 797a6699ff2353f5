//! Sort: commands by key, equal keys by object.

use drawloom_jobs::internal::ChunkedArray;

use super::key_packer::KeyPacker;
use super::radix_sort::{DIGIT_VALUES, radix_sort};
use super::splitters::KeyRange;
use super::{RenderCommand, SortKey};

/// Scratch memory for sorting. Each worker keeps one.
#[derive(Debug, Default)]
pub(crate) struct SortScratch {
    commands: Vec<RenderCommand>,
    /// For each command its packed key, and in the bits below that its index in `commands`.
    entries: Vec<u64>,
    swapped_entries: Vec<u64>,
    digit_counts: Vec<[u32; DIGIT_VALUES]>,
}

/// Sorts the first `count` commands whose keys lie in `range` into `sorted`, and leaves out empty commands. Equal keys
/// are ordered by object, so the order is total: it depends neither on the algorithm nor on which worker filled which
/// command, and the buckets in sequence are the same whatever their number.
///
/// The commands lie in the order of their objects, as [`Fill`](crate::view::Fill) writes them.
pub(crate) fn sort(
    commands: &ChunkedArray<RenderCommand>,
    count: usize,
    range: KeyRange,
    scratch: &mut SortScratch,
    sorted: &mut Vec<RenderCommand>,
) {
    collect(commands, count, range, &mut scratch.commands);
    sorted.clear();
    let Some(first) = scratch.commands.first() else { return };
    let differing = scratch.commands.iter().fold(0, |bits, command| bits | (command.key.bits() ^ first.key.bits()));
    let packer = KeyPacker::new(differing);
    let index_width = usize::BITS - (scratch.commands.len() - 1).leading_zeros();
    if packer.width() + index_width > u64::BITS {
        sorted.extend_from_slice(&scratch.commands);
        sorted.sort_unstable_by_key(|command| (command.key, command.object));
        return;
    }
    let entry = |(index, command): (u64, &RenderCommand)| packer.pack(command.key).unbounded_shl(index_width) | index;
    scratch.entries.clear();
    scratch.entries.extend((0..).zip(&scratch.commands).map(entry));
    if scratch.entries.len() < RADIX_SORT_THRESHOLD {
        scratch.entries.sort_unstable();
    } else {
        let SortScratch { entries, swapped_entries, digit_counts, .. } = scratch;
        radix_sort(entries, swapped_entries, digit_counts, index_width, packer.width());
    }
    let index_mask = u64::MAX.unbounded_shr(u64::BITS - index_width);
    sorted.extend(scratch.entries.iter().map(|entry| scratch.commands[(entry & index_mask) as usize]));
}

/// Below this number of commands a comparison sort is faster than counting digits.
const RADIX_SORT_THRESHOLD: usize = 512;

fn collect(commands: &ChunkedArray<RenderCommand>, count: usize, range: KeyRange, output: &mut Vec<RenderCommand>) {
    output.clear();
    let mut selected = [RenderCommand::EMPTY; ChunkedArray::<RenderCommand>::BLOCK_SIZE];
    for (block_index, entries) in ChunkedArray::<RenderCommand>::block_ranges(0..count) {
        let block = &commands.read(block_index)[..entries.len()];
        if range.is_all() && block.iter().all(|command| command.key != SortKey::LAST) {
            output.extend_from_slice(block);
            continue;
        }
        // Branchless: a mispredicted branch costs more than a wasted store.
        let mut selected_count = 0;
        for command in block {
            selected[selected_count] = *command;
            selected_count += usize::from(range.contains(command.key));
        }
        output.extend_from_slice(&selected[..selected_count]);
    }
}

#[cfg(test)]
pub(super) mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::command::DrawState;

    /// Commands in the blocks in which [`sort`] reads them.
    pub(in crate::command) fn blocks_of(commands: &[RenderCommand]) -> ChunkedArray<RenderCommand> {
        let mut blocks = ChunkedArray::new();
        blocks.grow(commands.len(), RenderCommand::EMPTY);
        for (index, commands) in commands.chunks(ChunkedArray::<RenderCommand>::BLOCK_SIZE).enumerate() {
            blocks.write(index)[..commands.len()].copy_from_slice(commands);
        }
        blocks
    }

    #[test]
    fn keys_that_differ_in_all_bits_are_compared() {
        let command = |(object, bits)| RenderCommand { key: SortKey::from_bits(bits), object, ..RenderCommand::EMPTY };
        let commands = blocks_of(&[(0, 0xaaaa_aaaa_aaaa_aaaa), (1, 0x5555_5555_5555_5555)].map(command));
        let mut sorted = Vec::new();
        sort(&commands, 2, KeyRange::ALL, &mut SortScratch::default(), &mut sorted);
        assert_eq!(sorted.iter().map(|command| command.object).collect::<Vec<_>>(), [1, 0]);
    }

    proptest! {
        /// Where keys differ in all of their bits, no index fits beside them. Whole blocks may be empty.
        #[test]
        fn commands_are_sorted_by_key_and_then_by_object(
            keys in prop::collection::vec(prop::option::weighted(0.9, 0..u64::MAX), 0..2 * RADIX_SORT_THRESHOLD),
            differing in prop_oneof![Just(u64::MAX), Just(0), Just(0xf0_0000_000f), any::<u64>()],
            empty_block in 0_usize..6,
        ) {
            let command = |(object, key): (usize, &Option<u64>)| match key {
                Some(key) if object / ChunkedArray::<RenderCommand>::BLOCK_SIZE != empty_block => RenderCommand {
                    key: SortKey::from_bits(key & differing),
                    object: object as u32,
                    mesh: 1,
                    material: 2,
                    state: DrawState::PLAIN,
                },
                _ => RenderCommand::EMPTY,
            };
            let commands: Vec<_> = keys.iter().enumerate().map(command).collect();
            let mut expected = commands.clone();
            expected.retain(|command| *command != RenderCommand::EMPTY);
            expected.sort_by_key(|command| command.key);
            let mut sorted = vec![RenderCommand::EMPTY; 3];
            sort(&blocks_of(&commands), keys.len(), KeyRange::ALL, &mut SortScratch::default(), &mut sorted);
            prop_assert!(sorted == expected);
        }
    }
}
