//! The static groups of a scene, recorded once and kept (L 3.2): what each process draws of them, for all views.
//!
//! ```text
//!             no object changed              the frame succeeded
//!   changed ────────────────────▶ recording ─────────────────────▶ recorded
//!      ▲                                                              │
//!      └──────────────────────────────────────────────────────────────┘
//!         an object, mesh or material of it changed, or a frame failed
//! ```
//!
//! Only recorded static groups are executed. Before the jobs of a frame run, the table decides which these are, so
//! views know which objects to leave out of their tests.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::ops::Range;

use parking_lot::{MappedRwLockReadGuard, RwLock, RwLockReadGuard};

use crate::bit_set::{BitSet, BitWord};
use crate::command::{Batch, BinnedSegment, DrawList, Selection, Version};
use crate::scene::{Assets, Changes, SceneError, SceneRef, StaticGroup};
use crate::view::{Bounds4, DrawFilter, IssueReason, ObjectTable, SceneIssues, bin_objects, recordable_objects};

/// What a frame did with the scene's [static groups](crate::scene::StaticGroup), which is the number of static groups.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StaticGroupStatistics {
    /// That were recorded by earlier frames, so that views may execute them.
    pub executable: usize,
    /// That this frame records.
    pub recorded: usize,
    /// With an object that is reported as changed.
    pub changed: usize,
}

/// The static groups of a scene.
#[derive(Debug, Default)]
pub(super) struct StaticGroupTable {
    /// By index in the scene.
    static_groups: Vec<KnownStaticGroup>,
    /// By object: the index of its static group, or [`NO_STATIC_GROUP`].
    owners: Vec<u32>,
    /// The objects of recorded static groups that need no test.
    recorded_objects: BitSet,
    /// The bounds of the static groups, in groups.
    bounds: Vec<Bounds4>,
    /// What the recorded lists are of: all selections that passes with bins have had.
    selections: Vec<Selection>,
    /// What else all lists depend on.
    conditions: Option<ListConditions>,
    /// Identity and revision of the meshes and materials in the frame before.
    assets: [(u64, u64); 2],
    /// The indices of the static groups that this frame records.
    recording: Vec<u32>,
    /// What processes draw of all static groups: one for each selection.
    joined: Vec<RwLock<JoinedStaticGroups>>,
    /// The number of objects of all static groups, and whether the frame has all of them.
    object_count: usize,
    has_unknown_objects: bool,
    /// The number of recorded static groups.
    recorded_count: usize,
    /// The static groups with an object that changed in this frame, by index.
    changed: Vec<u32>,
    /// Counts how often another object became, or ceased to be, one of a recorded static group.
    revision: u64,
    /// Counts how often the lists of recorded static groups changed.
    lists_revision: u64,
}

/// What all lists of static groups depend on, beside their objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ListConditions {
    pub(super) culls_triangles: bool,
    pub(super) chooses_levels: bool,
    /// Whether objects have layers of their own.
    pub(super) has_layers: bool,
    /// Counts the [divisions](crate::view::TextureSets::divisions) of materials into sets of textures.
    pub(super) texture_divisions: u64,
}

/// A static group, and what is recorded of it.
#[derive(Debug)]
struct KnownStaticGroup {
    static_group: StaticGroup,
    is_recorded: bool,
    /// Whether an object of it changed in this frame.
    has_changed: bool,
    /// Boxed, because every frame looks at all static groups, and at few of these.
    recorded: Box<RwLock<RecordedStaticGroup>>,
}

/// What a process draws of all recorded static groups: their objects by draw state, by mesh, and by static group, so
/// that static groups which follow each other and are executed together become one batch for each mesh.
#[derive(Debug, Default)]
struct JoinedStaticGroups {
    version: Version,
    objects: Vec<u32>,
    /// In draw order, each with its static group.
    batches: Vec<(Batch, u32)>,
}

impl KnownStaticGroup {
    fn new(static_group: &StaticGroup) -> Self {
        Self { static_group: static_group.clone(), is_recorded: false, has_changed: false, recorded: Box::default() }
    }

    /// It is not recorded any more. Returns whether it was.
    fn lose(&mut self, recorded_objects: &mut BitSet) -> bool {
        let was_recorded = std::mem::take(&mut self.is_recorded);
        if was_recorded {
            // The scene may have fewer objects than before.
            self.recorded.get_mut().words.iter().for_each(|word| recorded_objects.remove_word(*word));
        }
        was_recorded
    }

    /// What is drawn of it, by the index of the selection.
    fn list(&self, selection: usize) -> Option<MappedRwLockReadGuard<'_, DrawList>> {
        RwLockReadGuard::try_map(self.recorded.read(), |recorded| recorded.lists.get(selection)).ok()
    }
}

const NO_STATIC_GROUP: u32 = u32::MAX;

/// More selections than this are forgotten, because most of them are of passes that are gone.
const MAX_SELECTIONS: usize = 32;

impl StaticGroupTable {
    /// Begins a frame of `objects` objects, in which passes with bins have these selections: decides which static
    /// groups are recorded, and which ones this frame records.
    ///
    /// # Errors
    /// If two static groups have the same name or share an object.
    pub(super) fn begin_frame(
        &mut self,
        scene: &SceneRef<'_>,
        objects: usize,
        conditions: ListConditions,
        selections: impl Iterator<Item = Selection>,
    ) -> Result<(), SceneError> {
        self.complete();
        if scene.static_groups.is_empty() && self.static_groups.is_empty() {
            return Ok(());
        }
        for static_group in self.changed.drain(..) {
            self.static_groups[static_group as usize].has_changed = false;
        }
        if let Err(error) = self.sync(scene.static_groups, objects) {
            *self = Self { revision: self.revision + 1, lists_revision: self.lists_revision + 1, ..Self::default() };
            return Err(error);
        }
        if self.conditions.replace(conditions) != Some(conditions) {
            self.invalidate();
        }
        self.add_selections(selections);
        self.find_changed_objects(scene.changes);
        self.find_changed_assets(scene);
        if scene.changes != Changes::Unknown && self.recorded_count < self.static_groups.len() {
            let is_due = |(_, known): &(u32, &KnownStaticGroup)| !known.is_recorded && !known.has_changed;
            self.recording.extend((0..).zip(&self.static_groups).filter(is_due).map(|(index, _)| index));
        }
        Ok(())
    }

    /// Makes all static groups be recorded anew.
    pub(super) fn invalidate(&mut self) {
        self.recording.clear();
        (0..self.static_groups.len()).for_each(|static_group| self.lose(static_group));
    }

    /// What the frame before recorded is recorded: it succeeded.
    fn complete(&mut self) {
        if self.recording.is_empty() {
            return;
        }
        self.revision += 1;
        self.lists_revision += 1;
        for index in std::mem::take(&mut self.recording) {
            let known = &mut self.static_groups[index as usize];
            known.is_recorded = true;
            self.recorded_count += 1;
            let recorded = known.recorded.get_mut();
            let (group, place) = (index as usize / Bounds4::GROUPS, index as usize % Bounds4::GROUPS);
            self.bounds[group].set_union(place, &recorded.bounds);
            recorded.words.iter().for_each(|word| self.recorded_objects.insert_word(*word));
        }
    }

    /// A static group is not recorded any more.
    fn lose(&mut self, static_group: usize) {
        if self.static_groups[static_group].lose(&mut self.recorded_objects) {
            self.revision += 1;
            self.recorded_count -= 1;
        }
    }

    /// An object of a static group changed.
    fn change(&mut self, static_group: usize) {
        if !std::mem::replace(&mut self.static_groups[static_group].has_changed, true) {
            self.changed.push(static_group as u32);
            self.lose(static_group);
        }
    }

    /// Takes over the static groups of a scene with this number of objects. Those that it had keep what is recorded.
    fn sync(&mut self, static_groups: &[StaticGroup], objects: usize) -> Result<(), SceneError> {
        let before = self.owners.len();
        for static_group in 0..self.static_groups.len() {
            // Objects that are gone, or new at indices that it lists.
            if self.has_object_in(static_group, before.min(objects)..before.max(objects)) {
                self.change(static_group);
            }
        }
        self.owners.resize(objects, NO_STATIC_GROUP);
        self.recorded_objects.resize(objects);
        if self.static_groups.iter().map(|known| &known.static_group).eq(static_groups) {
            if before != objects {
                (0..self.static_groups.len()).try_for_each(|static_group| self.claim(static_group, before..objects))?;
                self.find_unknown_objects(objects);
            }
            return Ok(());
        }
        let mut known: HashMap<_, _> =
            self.static_groups.drain(..).map(|known| (known.static_group.name.clone(), known)).collect();
        self.owners.fill(NO_STATIC_GROUP);
        let mut names = HashMap::new();
        for (index, static_group) in static_groups.iter().enumerate() {
            if names.insert(static_group.name.as_str(), index).is_some() {
                return Err(SceneError::RepeatedStaticGroup { static_group: static_group.name.clone() });
            }
            let next = match known.entry(static_group.name.clone()) {
                Entry::Occupied(known) if known.get().static_group.objects == static_group.objects => known.remove(),
                _ => KnownStaticGroup::new(static_group),
            };
            self.static_groups.push(next);
            self.claim(index, 0..objects)?;
        }
        for mut gone in known.into_values() {
            gone.lose(&mut self.recorded_objects);
        }
        self.object_count = self.static_groups.iter().map(|known| known.static_group.objects.len()).sum();
        self.find_unknown_objects(objects);
        self.recorded_count = self.static_groups.iter().filter(|known| known.is_recorded).count();
        let changed = (0..).zip(&self.static_groups).filter(|(_, known)| known.has_changed).map(|(index, _)| index);
        self.changed.clear();
        self.changed.extend(changed);
        self.bounds.clear();
        self.bounds.resize_with(self.static_groups.len().div_ceil(Bounds4::GROUPS), Bounds4::default);
        for (index, known) in self.static_groups.iter_mut().enumerate().filter(|(_, known)| known.is_recorded) {
            let bounds = &known.recorded.get_mut().bounds;
            self.bounds[index / Bounds4::GROUPS].set_union(index % Bounds4::GROUPS, bounds);
        }
        // The indices of static groups changed.
        self.revision += 1;
        self.lists_revision += 1;
        Ok(())
    }

    fn has_object_in(&self, static_group: usize, objects: Range<usize>) -> bool {
        !objects.is_empty()
            && self.static_groups[static_group]
                .static_group
                .objects
                .iter_from(objects.start)
                .next()
                .is_some_and(|object| (object as usize) < objects.end)
    }

    fn find_unknown_objects(&mut self, objects: usize) {
        self.has_unknown_objects =
            self.static_groups.iter().any(|known| known.static_group.objects.iter_from(objects).next().is_some());
    }

    /// Counts the objects of static groups that a scene with this number of objects does not have, each once.
    pub(super) fn count_unknown_objects(&self, objects: usize, scene_issues: &SceneIssues) {
        let static_groups = if self.has_unknown_objects { &self.static_groups[..] } else { &[] };
        for index in static_groups.iter().flat_map(|known| known.static_group.objects.iter_from(objects)) {
            scene_issues.count_once(IssueReason::UnknownObject, index as usize);
        }
    }

    /// Notes a static group's objects among a range of the scene's.
    fn claim(&mut self, static_group: usize, objects: Range<usize>) -> Result<(), SceneError> {
        let of_static_group = self.static_groups[static_group]
            .static_group
            .objects
            .iter_from(objects.start)
            .map(|object| object as usize);
        for object in of_static_group.take_while(|object| *object < objects.end) {
            let other = std::mem::replace(&mut self.owners[object], static_group as u32);
            if other != NO_STATIC_GROUP {
                let static_groups = [other as usize, static_group]
                    .map(|static_group| self.static_groups[static_group].static_group.name.clone());
                return Err(SceneError::SharedObject { object, static_groups });
            }
        }
        Ok(())
    }

    /// If a selection is new, all static groups are recorded for it.
    fn add_selections(&mut self, selections: impl Iterator<Item = Selection>) {
        let mut is_new = false;
        for selection in selections {
            if !self.selections.contains(&selection) {
                if self.selections.len() == MAX_SELECTIONS && !is_new {
                    self.selections.clear();
                }
                is_new = true;
                self.selections.push(selection);
            }
        }
        if is_new {
            self.joined.resize_with(self.selections.len(), RwLock::default);
            self.invalidate();
        }
    }

    fn find_changed_objects(&mut self, changes: Changes<'_>) {
        match changes {
            Changes::Unknown => self.invalidate(),
            Changes::Objects(objects) => objects.iter().for_each(|&object| self.change_object(object as usize)),
            Changes::Ranges(ranges) => {
                for range in ranges {
                    (range.start as usize..(range.end as usize).min(self.owners.len()))
                        .for_each(|object| self.change_object(object));
                }
            }
        }
    }

    fn change_object(&mut self, object: usize) {
        if let Some(owner) = self.owner(object) {
            self.change(owner as usize);
        }
    }

    /// Finds the static groups with a mesh or material that changed.
    fn find_changed_assets(&mut self, scene: &SceneRef<'_>) {
        let (meshes, materials) = (&scene.assets.meshes, &scene.assets.materials);
        let now = [(meshes.identity(), meshes.revision()), (materials.identity(), materials.revision())];
        let before = std::mem::replace(&mut self.assets, now);
        if before == now {
            return;
        }
        let are_others = before.map(|(identity, _)| identity) != now.map(|(identity, _)| identity);
        for static_group in 0..self.static_groups.len() {
            let are_same = self.static_groups[static_group].recorded.get_mut().has_assets_of(scene.assets);
            if are_others || !are_same {
                self.lose(static_group);
            }
        }
    }

    /// The number of static groups.
    pub(super) fn len(&self) -> usize {
        self.static_groups.len()
    }

    /// Whether the scene has no static groups.
    pub(super) fn is_empty(&self) -> bool {
        self.static_groups.is_empty()
    }

    /// Counts how often another object became, or ceased to be, one of a recorded static group.
    pub(super) fn revision(&self) -> u64 {
        self.revision
    }

    /// The recorded static groups, by index.
    pub(super) fn recorded(&self) -> impl Iterator<Item = usize> {
        (0..self.static_groups.len()).filter(|static_group| self.static_groups[*static_group].is_recorded)
    }

    /// The bounds of all static groups, in groups of [`Bounds4::GROUPS`].
    pub(super) fn bounds(&self) -> &[Bounds4] {
        &self.bounds
    }

    /// The objects that are executed if all recorded static groups are.
    pub(super) fn recorded_objects(&self) -> &BitSet {
        &self.recorded_objects
    }

    /// Calls `visit` with the objects of a recorded static group that are executed.
    pub(super) fn visit_words(&self, static_group: usize, visit: impl FnMut(&BitWord)) {
        self.static_groups[static_group].recorded.read().words.iter().for_each(visit);
    }

    /// The index of the static group that has an object.
    pub(super) fn owner(&self, object: usize) -> Option<u32> {
        self.owners.get(object).copied().filter(|owner| *owner != NO_STATIC_GROUP)
    }

    /// The number of objects of all static groups.
    pub(super) fn listed_objects(&self) -> usize {
        self.object_count
    }

    /// The number of static groups that this frame records.
    pub(super) fn recording_count(&self) -> usize {
        self.recording.len()
    }

    /// The number of objects that are executed with a static group.
    pub(super) fn object_count(&self, static_group: u32) -> usize {
        self.static_groups[static_group as usize].recorded.read().count
    }

    /// What the frame did with static groups.
    pub(super) fn statistics(&self) -> StaticGroupStatistics {
        StaticGroupStatistics {
            executable: self.recorded_count,
            recorded: self.recording.len(),
            changed: self.changed.len(),
        }
    }

    /// The name of one of the static groups that this frame records, by index among them.
    pub(super) fn recorded_name(&self, index: usize) -> &str {
        &self.static_groups[self.recording[index] as usize].static_group.name
    }

    /// Records one of the static groups that this frame records, by index among them. `is_recordable` says whether
    /// objects with the mesh in a slot may be recorded, and `can_merge` whether they become one draw.
    pub(super) fn record(
        &self,
        index: usize,
        scene: &SceneRef<'_>,
        table: &ObjectTable,
        is_recordable: impl Fn(u32) -> bool,
        can_merge: impl Fn(u32) -> bool,
    ) {
        let known = &self.static_groups[self.recording[index] as usize];
        known.recorded.write().record(&known.static_group, &self.selections, (scene, table), is_recordable, can_merge);
    }

    /// The version of what a process with a selection draws of static groups.
    pub(super) fn version(&self, selection: Selection) -> Version {
        let index = self.selections.iter().position(|known| *known == selection).unwrap_or(self.selections.len());
        Version { frame: self.lists_revision + 1, index }
    }

    /// Makes a draw list have what a process with a selection draws of the static groups that a view executes, whose
    /// version is `executed`.
    pub(super) fn execute(
        &self,
        selection: Selection,
        (executes, executed): (impl Fn(u32) -> bool, Version),
        can_merge: impl Fn(u32) -> bool,
        list: &mut DrawList,
    ) {
        let version = self.version(selection);
        let Some(joined) = self.joined.get(version.index) else { return list.clear() };
        if joined.read().version != version {
            self.join(version, &mut joined.write());
        }
        let joined = joined.read();
        list.set_static_group_objects(version, &joined.objects);
        let batches =
            joined.batches.iter().filter(|(_, static_group)| executes(*static_group)).map(|(batch, _)| *batch);
        list.execute_static_groups(executed, batches, can_merge);
    }

    /// Joins what a selection's lists have of the recorded static groups, unless another job has done it.
    fn join(&self, version: Version, joined: &mut JoinedStaticGroups) {
        if joined.version == version {
            return;
        }
        let JoinedStaticGroups { objects, batches, .. } = joined;
        batches.clear();
        for static_group in self.recorded() {
            if let Some(list) = self.static_groups[static_group].list(version.index) {
                batches.extend(list.batches.iter().map(|batch| (*batch, static_group as u32)));
            }
        }
        batches.sort_by_key(|(batch, static_group)| (batch.state, batch.mesh, *static_group));
        objects.clear();
        for (batch, static_group) in batches {
            if let Some(list) = self.static_groups[*static_group as usize].list(version.index) {
                let of_batch = batch.first as usize..(batch.first + batch.count) as usize;
                batch.first = objects.len() as u32;
                objects.extend_from_slice(&list.objects[of_batch]);
            }
        }
        joined.version = version;
    }
}

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
