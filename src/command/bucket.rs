//! A bucket of a pass's commands, and the batches they merge into (M 10.5, "Sorting and Instancing").

use super::{DrawState, SortKey};

/// One draw of one object in one pass, independent of any device (M 10.3). It refers to what it needs and owns nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RenderCommand {
    /// Its position in the pass's order.
    pub key: SortKey,
    /// The object's index in the scene.
    pub object: u32,
    /// Its mesh's slot.
    pub mesh: u32,
    /// Its material's slot.
    pub material: u32,
    /// Its fixed-function state.
    pub state: DrawState,
}

// Views of a hundred thousand commands are sorted and read several times a frame: their size is memory traffic.
const _: () = assert!(size_of::<RenderCommand>() <= 32);

impl RenderCommand {
    /// The placeholder for an object that the process does not draw. It sorts behind all others.
    pub const EMPTY: Self = Self { key: SortKey::LAST, object: 0, mesh: 0, material: 0, state: DrawState::PLAIN };
}

/// The commands of a pass whose keys lie in one range. One job sorts and instances them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Bucket {
    /// The commands in draw order.
    pub commands: Vec<RenderCommand>,
    /// The batches in draw order. [`Batch::first`] counts from the bucket's first object.
    pub batches: Vec<Batch>,
    /// The object index of each command.
    pub objects: Vec<u32>,
}

/// One instanced draw: consecutive commands with the same mesh and state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Batch {
    /// The mesh's slot.
    pub mesh: u32,
    /// The fixed-function state.
    pub state: DrawState,
    /// The index of its first object in [`DrawList::objects`](super::DrawList::objects).
    pub first: u32,
    /// The number of objects.
    pub count: u32,
}

/// Merges the bucket's sorted commands into batches: neighbours with the same mesh and state become one instanced draw.
/// Where `can_merge` does not hold for a mesh's slot, each command of that mesh is a batch of its own.
///
/// Neighbours with different materials share a batch, because shaders find materials by object.
pub(crate) fn instance(bucket: &mut Bucket, can_merge: impl Fn(u32) -> bool) {
    bucket.batches.clear();
    bucket.objects.clear();
    bucket.objects.extend(bucket.commands.iter().map(|command| command.object));
    let mut first = 0;
    let is_same = |one: &RenderCommand, next: &RenderCommand| {
        (one.state, one.mesh) == (next.state, next.mesh) && can_merge(one.mesh)
    };
    for run in bucket.commands.chunk_by(is_same) {
        let RenderCommand { mesh, state, .. } = run[0];
        let count = run.len() as u32;
        bucket.batches.push(Batch { mesh, state, first, count });
        first += count;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::command::sort::tests::blocks_of;
    use crate::command::splitters::KeyRange;
    use crate::command::{Cull, DrawList, DrawState, SortKey, SortScratch, sort};
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
                .map(|(object, command)| command.map_or(RenderCommand::EMPTY, |command| RenderCommand { object, ..command }))
                .collect();
            let slots = blocks_of(&commands);
            let mut starts: Vec<_> = cuts.iter().flatten().map(|command| command.key).collect();
            starts.sort();
            let edges: Vec<_> = [SortKey::FIRST].into_iter().chain(starts).chain([SortKey::LAST]).collect();
            let mut scratch = SortScratch::default();
            let sorted = |pair: &[SortKey]| {
                let mut bucket = Bucket::default();
                sort(&slots, commands.len(), KeyRange::between(pair[0], pair[1]), &mut scratch, &mut bucket.commands);
                instance(&mut bucket, |_| merges);
                bucket
            };
            let mut buckets: Vec<_> = edges.windows(2).map(sorted).collect();
            let mut list = DrawList::default();
            list.clear();
            buckets.iter_mut().for_each(|bucket| list.append(bucket, |_| merges));

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
            prop_assert!(merged || !merges, "two neighbours that should be one batch");
            prop_assert!(merges || list.batches.len() == expected.len(), "a batch of two commands that may not merge");
            let bundled: usize = (0..list.bundle_count()).map(|bundle| list.bundle(bundle).len()).sum();
            prop_assert_eq!(bundled, list.batches.len());
        }
    }
}
