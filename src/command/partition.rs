//! A partition of a pass's commands into parts of a given number.

use drawloom_jobs::internal::ChunkedArray;

use super::{RenderCommand, SortKey};

/// The commands of a pass, divided into parts of equal size. All commands of a part come before those of the next, so
/// the parts can be sorted independently.
///
/// Dividing is one job, and where parts are small it takes as long as sorting. So this is for a granularity that asks
/// for it: [`Splitters`](super::Splitters) take less time.
#[derive(Debug, Default)]
pub(crate) struct Partition {
    commands: Vec<RenderCommand>,
    part_size: usize,
}

impl Partition {
    /// Divides the first `count` commands into parts of `part_size`, of which the last may be smaller. Empty commands
    /// are left out.
    pub(crate) fn divide(&mut self, commands: &ChunkedArray<RenderCommand>, count: usize, part_size: usize) {
        self.part_size = part_size;
        self.commands.clear();
        for (block, indices) in ChunkedArray::<RenderCommand>::block_ranges(0..count) {
            let block = commands.read(block);
            self.commands.extend(block[..indices.len()].iter().filter(|command| command.key != SortKey::LAST));
        }
        divide(&mut self.commands, part_size);
    }

    /// The number of parts, at least 1.
    pub(crate) fn part_count(&self) -> usize {
        self.commands.len().div_ceil(self.part_size.max(1)).max(1)
    }

    /// Sorts a copy of a part's commands into `sorted`: by key, and equal keys by object.
    pub(crate) fn sort(&self, part: usize, sorted: &mut Vec<RenderCommand>) {
        let start = self.commands.len().min(part * self.part_size);
        let end = self.commands.len().min(start.saturating_add(self.part_size));
        sorted.clear();
        sorted.extend_from_slice(&self.commands[start..end]);
        sorted.sort_unstable_by_key(order);
    }
}

fn order(command: &RenderCommand) -> (SortKey, u32) {
    (command.key, command.object)
}

/// Moves commands until those of each part of `part_size` come before those of the next.
fn divide(commands: &mut [RenderCommand], part_size: usize) {
    let parts = commands.len().div_ceil(part_size);
    if parts > 1 {
        let middle = parts / 2 * part_size;
        commands.select_nth_unstable_by_key(middle, order);
        let (before, after) = commands.split_at_mut(middle);
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
                partition.sort(part, &mut sorted);
                prop_assert!(sorted.len() == part_size || part + 1 == partition.part_count());
                all.append(&mut sorted);
            }
            prop_assert!(all == expected);
        }
    }
}
