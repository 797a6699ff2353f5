//! Sort: commands by key, equal keys by object.

use crate::blocks::Blocks;
use crate::command::{RenderCommand, SortKey};

/// Collects the first `count` commands, leaves out those that draw nothing, and sorts the others. The order is total, so
/// it depends on neither the algorithm nor on who filled the commands.
pub fn sort(commands: &Blocks<RenderCommand>, count: usize, sorted: &mut Vec<RenderCommand>) {
    sorted.clear();
    for (block, part) in Blocks::<RenderCommand>::parts(0..count) {
        let filled = commands.read(block);
        sorted.extend(filled[..part.len()].iter().filter(|command| command.key != SortKey::LAST));
    }
    sorted.sort_unstable_by_key(|command| (command.key, command.object));
}
