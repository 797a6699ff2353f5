//! Instance: equal runs become one draw (M 10.5, "Sorting and Instancing").

use super::{Batch, DrawList};
use crate::command::RenderCommand;

/// Merges the list's sorted commands into batches: neighbours with the same mesh and state become one instanced draw.
///
/// Neighbours of different materials share a batch, because shaders find materials by object. Redundant state is
/// filtered by the same stroke: what stays the same from one batch to the next is not set again when they are recorded.
pub fn instance(list: &mut DrawList) {
    list.batches.clear();
    list.objects.clear();
    list.objects.extend(list.commands.iter().map(|command| command.object));
    let mut first = 0;
    for run in list.commands.chunk_by(|one, next| (one.state, one.mesh) == (next.state, next.mesh)) {
        let RenderCommand { mesh, state, .. } = run[0];
        let count = run.len() as u32;
        list.batches.push(Batch { mesh, state, first, count });
        first += count;
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::blocks::Blocks;
    use crate::command::{Cull, DrawState, SortKey};
    use crate::queue::sort;
    use crate::scene::{Blend, Topology};

    fn any_command() -> impl Strategy<Value = RenderCommand> {
        (0_u32..4, 0_u32..4, 0_u32..3, 0.0..100.0_f32, 0_u32..1000).prop_map(|(mesh, material, kind, depth, object)| {
            let blend = [Blend::None, Blend::Alpha, Blend::None][kind as usize];
            let cull = [Cull::Back, Cull::Back, Cull::Nothing][kind as usize];
            let state = DrawState::new(Topology::TriangleList, cull, blend);
            let key = match blend {
                Blend::None => SortKey::opaque(state, material, mesh, depth),
                _ => SortKey::blended(depth),
            };
            if object < 100 { RenderCommand::NOTHING } else { RenderCommand { key, object, mesh, material, state } }
        })
    }

    proptest! {
        #[test]
        fn batches_draw_every_command_once_and_in_order(commands in prop::collection::vec(any_command(), 0..700)) {
            let mut slots = Blocks::new();
            slots.reserve(commands.len(), RenderCommand::NOTHING);
            for (index, &command) in commands.iter().enumerate() {
                slots.write(index / 256)[index % 256] = command;
            }
            let mut list = DrawList::default();
            sort(&slots, commands.len(), &mut list.commands);
            instance(&mut list);

            let mut expected: Vec<_> = commands.into_iter().filter(|command| command.key != SortKey::LAST).collect();
            expected.sort_by_key(|command| (command.key, command.object));
            prop_assert_eq!(&list.commands, &expected);

            let drawn = list.batches.iter().flat_map(|batch| {
                let objects = &list.objects[batch.first as usize..(batch.first + batch.count) as usize];
                objects.iter().map(|&object| (batch.mesh, batch.state, object))
            });
            let wanted = expected.iter().map(|command| (command.mesh, command.state, command.object));
            prop_assert!(drawn.eq(wanted));
            let merged = list.batches.windows(2).all(|pair| (pair[0].mesh, pair[0].state) != (pair[1].mesh, pair[1].state));
            prop_assert!(merged, "two neighbours that could have been one");
            let bundled: usize = (0..list.bundle_count()).map(|bundle| list.bundle(bundle).len()).sum();
            prop_assert_eq!(bundled, list.batches.len());
        }
    }
}
