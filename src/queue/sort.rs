//! Sort: commands by key, equal keys by object.

use super::Part;
use super::key_bits::KeyBits;
use super::radix::{DIGITS, sort_by_bits};
use crate::blocks::Blocks;
use crate::command::{RenderCommand, SortKey};

/// Memory to sort in, kept from one sort to the next: a worker has one.
#[derive(Debug, Default)]
pub struct SortMemory {
    commands: Vec<RenderCommand>,
    /// What differs of each key, and below it the place of its command.
    entries: Vec<u64>,
    swapped: Vec<u64>,
    counts: Vec<[u32; DIGITS]>,
}

/// Collects those of the first `count` commands that belong to a part, leaves out those that draw nothing, and sorts the
/// others into `sorted`. The order is total, so it depends on neither the algorithm nor on who filled the commands; nor do
/// all parts together depend on how many there are.
///
/// The commands are to lie in the order of their objects, as [`Fill`](super::Fill) leaves them.
pub fn sort(
    commands: &Blocks<RenderCommand>,
    count: usize,
    part: Part,
    memory: &mut SortMemory,
    sorted: &mut Vec<RenderCommand>,
) {
    collect(commands, count, part, &mut memory.commands);
    sorted.clear();
    let Some(first) = memory.commands.first() else { return };
    let differing = memory.commands.iter().fold(0, |bits, command| bits | (command.key.bits() ^ first.key.bits()));
    let bits = KeyBits::new(differing);
    let place_width = usize::BITS - (memory.commands.len() - 1).leading_zeros();
    if bits.width() + place_width > u64::BITS {
        sorted.extend_from_slice(&memory.commands);
        sorted.sort_unstable_by_key(|command| (command.key, command.object));
        return;
    }
    let entry = |(place, command): (u64, &RenderCommand)| bits.of(command.key).unbounded_shl(place_width) | place;
    memory.entries.clear();
    memory.entries.extend((0..).zip(&memory.commands).map(entry));
    if memory.entries.len() < FEW {
        memory.entries.sort_unstable();
    } else {
        sort_by_bits(&mut memory.entries, &mut memory.swapped, &mut memory.counts, place_width, bits.width());
    }
    let places = u64::MAX.unbounded_shr(u64::BITS - place_width);
    sorted.extend(memory.entries.iter().map(|entry| memory.commands[(entry & places) as usize]));
}

/// Fewer commands than these are compared with each other: to count digits would take longer.
const FEW: usize = 512;

fn collect(commands: &Blocks<RenderCommand>, count: usize, part: Part, collected: &mut Vec<RenderCommand>) {
    collected.clear();
    let mut held = [RenderCommand::NOTHING; Blocks::<RenderCommand>::SIZE];
    for (block, entries) in Blocks::<RenderCommand>::parts(0..count) {
        let filled = &commands.read(block)[..entries.len()];
        if part.is_all() && filled.iter().all(|command| command.key != SortKey::LAST) {
            collected.extend_from_slice(filled);
            continue;
        }
        // Which part a command belongs to is as good as random, and to guess it wrong takes longer than to write it in vain.
        let mut count = 0;
        for command in filled {
            held[count] = *command;
            count += usize::from(part.holds(command.key));
        }
        collected.extend_from_slice(&held[..count]);
    }
}
