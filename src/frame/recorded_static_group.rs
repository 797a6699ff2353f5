//! What is recorded of one static group.

use crate::bit_set::{BitSet, BitWord};
use crate::command::{BinnedSegment, DrawList, Selection};
use crate::scene::{Assets, SceneRef, StaticGroup};
use crate::view::{Bounds4, DrawFilter, ObjectTable, bin_objects, recordable_objects};

/// What is recorded of a static group.
#[derive(Debug, Default)]
pub(super) struct RecordedStaticGroup {
    /// The objects that are recorded; others are drawn as if they were in no static group.
    pub(super) words: Vec<BitWord>,
    /// Their number.
    pub(super) count: usize,
    pub(super) bounds: Bounds4,
    /// One for each selection.
    pub(super) lists: Vec<DrawList>,
    /// The revisions of the meshes and materials that its objects have, by slot; `None` for an empty slot.
    meshes: Vec<SlotRevision>,
    materials: Vec<SlotRevision>,
    scratch: BinnedSegment,
}

/// A slot of an asset, and the revision of what is in it.
type SlotRevision = (u32, Option<u64>);

impl RecordedStaticGroup {
    /// Records a static group for these selections. `is_recordable` says whether objects with the mesh in a slot may be
    /// recorded, and `can_merge` whether they become one draw.
    pub(super) fn record(
        &mut self,
        static_group: &StaticGroup,
        selections: &[Selection],
        (scene, table): (&SceneRef<'_>, &ObjectTable),
        is_recordable: impl Fn(u32) -> bool,
        can_merge: impl Fn(u32) -> bool,
    ) {
        let Self { words, count, bounds, lists, meshes, materials, scratch } = self;
        *bounds = recordable_objects(table, &static_group.objects, is_recordable, words);
        *count = words.iter().map(|word| word.mask.count_ones() as usize).sum();
        lists.resize_with(selections.len(), DrawList::default);
        for (&selection, list) in selections.iter().zip(lists) {
            bin_objects(table, words, selection, DrawFilter::new(table, scene, selection), scratch);
            list.clear();
            list.join_bins(&mut [&mut *scratch], &table.bins(), &can_merge);
        }
        let objects =
            || static_group.objects.iter().map(|object| object as usize).take_while(|object| *object < table.len());
        collect_slots(meshes, objects().map(|object| scene.meshes[object].index()), |slot| {
            scene.assets.meshes.get_with_revision(slot).map(|(revision, _)| revision)
        });
        collect_slots(materials, objects().map(|object| scene.materials[object].index()), |slot| {
            scene.assets.materials.get_with_revision(slot).map(|(revision, _)| revision)
        });
    }

    /// Whether its meshes and materials are those that it was recorded with.
    pub(super) fn has_assets_of(&self, assets: &Assets) -> bool {
        let revision_of_mesh = |slot| assets.meshes.get_with_revision(slot).map(|(revision, _)| revision);
        let revision_of_material = |slot| assets.materials.get_with_revision(slot).map(|(revision, _)| revision);
        self.meshes.iter().all(|&(slot, revision)| revision_of_mesh(slot) == revision)
            && self.materials.iter().all(|&(slot, revision)| revision_of_material(slot) == revision)
    }
}

/// Makes `slots` the different ones of some slots, with their revisions.
fn collect_slots(
    slots: &mut Vec<SlotRevision>,
    all: impl Iterator<Item = u32>,
    revision_of: impl Fn(u32) -> Option<u64>,
) {
    slots.clear();
    let mut seen = BitSet::default();
    for slot in all {
        if slot as usize >= seen.room() {
            seen.resize(slot as usize + 1);
        }
        seen.insert(slot as usize);
    }
    slots.extend(seen.iter().map(|slot| (slot as u32, revision_of(slot as u32))));
}
