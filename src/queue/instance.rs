//! Instance: equal runs become one draw (M 10.5, "Sorting and Instancing").

use super::{Batch, DrawPart};
use crate::command::RenderCommand;

/// Merges the part's sorted commands into batches: neighbours with the same mesh and state become one instanced draw,
/// or, where the mesh in a slot is not one that `merges`, each of them a draw of its own.
///
/// Neighbours of different materials share a batch, because shaders find materials by object. Redundant state is
/// filtered by the same stroke: what stays the same from one batch to the next is not set again when they are recorded.
pub fn instance(part: &mut DrawPart, merges: impl Fn(u32) -> bool) {
    part.batches.clear();
    part.objects.clear();
    part.objects.extend(part.commands.iter().map(|command| command.object));
    let mut first = 0;
    let is_same = |one: &RenderCommand, next: &RenderCommand| {
        (one.state, one.mesh) == (next.state, next.mesh) && merges(one.mesh)
    };
    for run in part.commands.chunk_by(is_same) {
        let RenderCommand { mesh, state, .. } = run[0];
        let count = run.len() as u32;
        part.batches.push(Batch { mesh, state, first, count });
        first += count;
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::blocks::Blocks;
    use crate::command::{Cull, DrawState, SortKey};
    use crate::queue::{DrawList, Part, SortMemory, sort};
    use crate::scene::{Blend, Topology};

    fn any_command() -> impl Strategy<Value = Option<RenderCommand>> {
        (0_u32..4, 0_u32..4, 0_u32..3, 0.0..100.0_f32, 0_u32..10).prop_map(|(mesh, material, kind, depth, drawn)| {
            let blend = [Blend::None, Blend::Alpha, Blend::None][kind as usize];
            let cull = [Cull::Back, Cull::Back, Cull::Nothing][kind as usize];
            let state = DrawState::new(Topology::TriangleList, cull, blend);
            let key = match blend {
                Blend::None => SortKey::opaque(state, mesh, depth.to_bits() << 1),
                _ => SortKey::blended(depth.to_bits() << 1),
            };
            (drawn > 0).then_some(RenderCommand { key, object: 0, mesh, material, state })
        })
    }

    proptest! {
        #[test]
        fn batches_draw_every_command_once_and_in_order(
            commands in prop::collection::vec(any_command(), 0..1500),
            merges in prop::bool::weighted(0.8),
            cuts in prop::collection::vec(any_command(), 0..3),
        ) {
            let commands: Vec<_> = (0..)
                .zip(commands)
                .map(|(object, command)| command.map_or(RenderCommand::NOTHING, |command| RenderCommand { object, ..command }))
                .collect();
            let mut slots = Blocks::new();
            slots.reserve(commands.len(), RenderCommand::NOTHING);
            for (index, &command) in commands.iter().enumerate() {
                slots.write(index / 256)[index % 256] = command;
            }
            let mut starts: Vec<_> = cuts.iter().flatten().map(|command| command.key).collect();
            starts.sort();
            let edges: Vec<_> = [SortKey::FIRST].into_iter().chain(starts).chain([SortKey::LAST]).collect();
            let mut memory = SortMemory::default();
            let sorted = |pair: &[SortKey]| {
                let mut part = DrawPart::default();
                sort(&slots, commands.len(), Part::between(pair[0], pair[1]), &mut memory, &mut part.commands);
                instance(&mut part, |_| merges);
                part
            };
            let mut parts: Vec<_> = edges.windows(2).map(sorted).collect();
            let mut list = DrawList::default();
            list.clear();
            parts.iter_mut().for_each(|part| list.append(part, |_| merges));

            let mut expected: Vec<_> = commands.into_iter().filter(|command| command.key != SortKey::LAST).collect();
            expected.sort_by_key(|command| (command.key, command.object));
            prop_assert!(list.commands().eq(&expected));

            let drawn = list.batches.iter().flat_map(|batch| {
                let objects = &list.objects[batch.first as usize..(batch.first + batch.count) as usize];
                objects.iter().map(|&object| (batch.mesh, batch.state, object))
            });
            let wanted = expected.iter().map(|command| (command.mesh, command.state, command.object));
            prop_assert!(drawn.eq(wanted));
            let merged = list.batches.windows(2).all(|pair| (pair[0].mesh, pair[0].state) != (pair[1].mesh, pair[1].state));
            prop_assert!(merged || !merges, "two neighbours that could have been one");
            prop_assert!(merges || list.batches.len() == expected.len(), "two that were to stay two");
            let bundled: usize = (0..list.bundle_count()).map(|bundle| list.bundle(bundle).len()).sum();
            prop_assert_eq!(bundled, list.batches.len());
        }
    }
}
