//! A partition of a pass's commands into parts of a given number.

use super::{RenderCommand, SortKey};
use crate::chunked_array::ChunkedArray;

/// The commands of a pass, divided into parts of equal size. All commands of a part come before those of the next. The
/// job of a part sorts it, and reads nothing else.
///
/// Dividing takes as long as sorting where parts are small, so this is for a granularity that asks for it:
/// [`Splitters`](super::Splitters) take less time.
#[derive(Debug, Default)]
pub(crate) struct Partition {
    /// The key of each command, and its index, by which equal keys are ordered.
    entries: Vec<(SortKey, u32)>,
    part_size: usize,
}

impl Partition {
    /// Divides the first `count` commands into parts of `part_size`, of which the last may be smaller. Empty commands are left
    /// out.
    pub(crate) fn divide(&mut self, commands: &ChunkedArray<RenderCommand>, count: usize, part_size: usize) {
        self.part_size = part_size;
        self.entries.clear();
        for (block, indices) in ChunkedArray::<RenderCommand>::block_ranges(0..count) {
            let commands = commands.read(block);
            let keys = commands.iter().map(|command| command.key);
            let drawn = (indices.start as u32..).zip(keys.take(indices.len())).filter(|(_, key)| *key != SortKey::LAST);
            self.entries.extend(drawn.map(|(index, key)| (key, index)));
        }
        divide(&mut self.entries, part_size);
    }

    /// The number of parts, at least 1.
    pub(crate) fn part_count(&self) -> usize {
        self.entries.len().div_ceil(self.part_size.max(1)).max(1)
    }

    /// Sorts the commands of a part: by key, and equal keys by object. They lie in the order of their objects.
    pub(crate) fn sort(&self, part: usize, commands: &ChunkedArray<RenderCommand>, sorted: &mut Vec<RenderCommand>) {
        let start = self.entries.len().min(part * self.part_size);
        let end = self.entries.len().min(start.saturating_add(self.part_size));
        sorted.clear();
        sorted.extend(self.entries[start..end].iter().map(|&(_, index)| {
            let (block, entry) = (index as usize / BLOCK_SIZE, index as usize % BLOCK_SIZE);
            commands.read(block)[entry]
        }));
        sorted.sort_unstable_by_key(|command| (command.key, command.object));
    }
}

const BLOCK_SIZE: usize = ChunkedArray::<RenderCommand>::BLOCK_SIZE;

/// Moves entries until those of each part of `part_size` come before those of the next.
fn divide(entries: &mut [(SortKey, u32)], part_size: usize) {
    let parts = entries.len().div_ceil(part_size);
    if parts > 1 {
        let middle = parts / 2 * part_size;
        entries.select_nth_unstable(middle);
        let (before, after) = entries.split_at_mut(middle);
        divide(before, part_size);
        divide(after, part_size);
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::command::DrawState;
    use crate::command::sort::tests::blocks_of;

    proptest! {
        #[test]
        fn parts_in_sequence_are_all_commands_in_order(
            keys in prop::collection::vec(prop::option::weighted(0.9, 0_u64..300), 0..900),
            part_size in prop_oneof![Just(1), Just(usize::MAX), 1_usize..1_000],
        ) {
            let command = |(object, key): (usize, &Option<u64>)| match key {
                Some(key) => RenderCommand {
                    key: SortKey::from_bits(*key), object: object as u32, mesh: 1, material: 2, state: DrawState::PLAIN,
                },
                None => RenderCommand::EMPTY,
            };
            let commands: Vec<_> = keys.iter().enumerate().map(command).collect();
            let mut expected = commands.clone();
            expected.retain(|command| *command != RenderCommand::EMPTY);
            expected.sort_by_key(|command| command.key);
            let blocks = blocks_of(&commands);
            let mut partition = Partition::default();
            partition.divide(&blocks, commands.len(), part_size);
            prop_assert_eq!(partition.part_count(), expected.len().div_ceil(part_size).max(1));
            let (mut all, mut sorted) = (Vec::new(), vec![RenderCommand::EMPTY]);
            for part in 0..partition.part_count() {
                partition.sort(part, &blocks, &mut sorted);
                prop_assert!(sorted.len() == part_size || part + 1 == partition.part_count());
                all.append(&mut sorted);
            }
            prop_assert!(all == expected);
        }
    }
}
