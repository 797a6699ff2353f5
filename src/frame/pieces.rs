//! The pieces of a scene, recorded once and kept (L 3.2): what each process draws of them, for all views.
//!
//! ```text
//!             no object changed              the frame succeeded
//!   changed ────────────────────▶ recording ─────────────────────▶ recorded
//!      ▲                                                              │
//!      └──────────────────────────────────────────────────────────────┘
//!         an object, mesh or material of it changed, or a frame failed
//! ```
//!
//! Only recorded pieces are executed. Before the jobs of a frame run, the table decides which these are, so views know
//! which objects to leave out of their tests.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::ops::Range;

use parking_lot::{MappedRwLockReadGuard, RwLock, RwLockReadGuard};

use super::piece_statistics::PieceStatistics;
use super::recorded_piece::RecordedPiece;
use crate::command::{Batch, DrawList, Selection, Version};
use crate::scene::{Changes, Piece, SceneError, SceneRef};
use crate::view::{GroupBounds, ObjectTable, ObjectWord, RejectionReason, Rejections};

/// The pieces of a scene.
#[derive(Debug, Default)]
pub(super) struct PieceTable {
    /// By index in the scene.
    pieces: Vec<KnownPiece>,
    /// By object: the index of its piece, or [`NO_PIECE`].
    owners: Vec<u32>,
    /// The objects of recorded pieces that need no test: a mask for each word.
    recorded_words: Vec<u64>,
    /// The bounds of the pieces, in groups.
    bounds: Vec<GroupBounds>,
    /// What the recorded lists are of: all selections that passes with bins have had.
    selections: Vec<Selection>,
    /// What else all lists depend on.
    conditions: Option<ListConditions>,
    /// Identity and revision of the meshes and materials in the frame before.
    assets: [(u64, u64); 2],
    /// The indices of the pieces that this frame records.
    recording: Vec<u32>,
    /// What processes draw of all pieces: one for each selection.
    joined: Vec<RwLock<JoinedPieces>>,
    /// The number of objects of all pieces, and whether the frame has all of them.
    object_count: usize,
    has_unknown_objects: bool,
    /// The number of recorded pieces.
    recorded_count: usize,
    /// The pieces with an object that changed in this frame, by index.
    changed: Vec<u32>,
    /// Counts how often another object became, or ceased to be, one of a recorded piece.
    revision: u64,
    /// Counts how often the lists of recorded pieces changed.
    lists_revision: u64,
}

/// What all lists of pieces depend on, beside their objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct ListConditions {
    pub(super) culls_triangles: bool,
    pub(super) chooses_levels: bool,
    /// Whether objects have layers of their own.
    pub(super) has_layers: bool,
}

/// A piece, and what is recorded of it.
#[derive(Debug)]
struct KnownPiece {
    piece: Piece,
    is_recorded: bool,
    /// Whether an object of it changed in this frame.
    has_changed: bool,
    /// Boxed, because every frame looks at all pieces, and at few of these.
    recorded: Box<RwLock<RecordedPiece>>,
}

/// What a process draws of all recorded pieces: their objects by draw state, by mesh, and by piece, so that pieces
/// which follow each other and are executed together become one batch for each mesh.
#[derive(Debug, Default)]
struct JoinedPieces {
    version: Version,
    objects: Vec<u32>,
    /// In draw order, each with its piece.
    batches: Vec<(Batch, u32)>,
}

impl KnownPiece {
    fn new(piece: &Piece) -> Self {
        Self { piece: piece.clone(), is_recorded: false, has_changed: false, recorded: Box::default() }
    }

    /// It is not recorded any more. Returns whether it was.
    fn lose(&mut self, recorded_words: &mut [u64]) -> bool {
        let was_recorded = std::mem::take(&mut self.is_recorded);
        if was_recorded {
            for &(word, mask) in &self.recorded.get_mut().words {
                // The scene may have fewer objects than before.
                if let Some(recorded) = recorded_words.get_mut(word) {
                    *recorded &= !mask;
                }
            }
        }
        was_recorded
    }

    /// What is drawn of it, by the index of the selection.
    fn list(&self, selection: usize) -> Option<MappedRwLockReadGuard<'_, DrawList>> {
        RwLockReadGuard::try_map(self.recorded.read(), |recorded| recorded.lists.get(selection)).ok()
    }
}

const NO_PIECE: u32 = u32::MAX;

/// More selections than this are forgotten, because most of them are of passes that are gone.
const MAX_SELECTIONS: usize = 32;

impl PieceTable {
    /// Begins a frame of `objects` objects, in which passes with bins have these selections: decides which pieces are
    /// recorded, and which ones this frame records.
    ///
    /// # Errors
    /// If two pieces have the same name or share an object.
    pub(super) fn begin_frame(
        &mut self,
        scene: &SceneRef<'_>,
        objects: usize,
        conditions: ListConditions,
        selections: impl Iterator<Item = Selection>,
    ) -> Result<(), SceneError> {
        self.complete();
        if scene.pieces.is_empty() && self.pieces.is_empty() {
            return Ok(());
        }
        for piece in self.changed.drain(..) {
            self.pieces[piece as usize].has_changed = false;
        }
        if let Err(error) = self.sync(scene.pieces, objects) {
            *self = Self { revision: self.revision + 1, lists_revision: self.lists_revision + 1, ..Self::default() };
            return Err(error);
        }
        if self.conditions.replace(conditions) != Some(conditions) {
            self.invalidate();
        }
        self.add_selections(selections);
        self.find_changed_objects(scene.changes);
        self.find_changed_assets(scene);
        if scene.changes != Changes::Unknown && self.recorded_count < self.pieces.len() {
            let is_due = |(_, known): &(u32, &KnownPiece)| !known.is_recorded && !known.has_changed;
            self.recording.extend((0..).zip(&self.pieces).filter(is_due).map(|(index, _)| index));
        }
        Ok(())
    }

    /// Makes all pieces be recorded anew.
    pub(super) fn invalidate(&mut self) {
        self.recording.clear();
        (0..self.pieces.len()).for_each(|piece| self.lose(piece));
    }

    /// What the frame before recorded is recorded: it succeeded.
    fn complete(&mut self) {
        if self.recording.is_empty() {
            return;
        }
        self.revision += 1;
        self.lists_revision += 1;
        for index in std::mem::take(&mut self.recording) {
            let known = &mut self.pieces[index as usize];
            known.is_recorded = true;
            self.recorded_count += 1;
            let recorded = known.recorded.get_mut();
            let (group, place) = (index as usize / GroupBounds::GROUPS, index as usize % GroupBounds::GROUPS);
            self.bounds[group].set_union(place, &recorded.bounds);
            for &(word, mask) in &recorded.words {
                self.recorded_words[word] |= mask;
            }
        }
    }

    /// A piece is not recorded any more.
    fn lose(&mut self, piece: usize) {
        if self.pieces[piece].lose(&mut self.recorded_words) {
            self.revision += 1;
            self.recorded_count -= 1;
        }
    }

    /// An object of a piece changed.
    fn change(&mut self, piece: usize) {
        if !std::mem::replace(&mut self.pieces[piece].has_changed, true) {
            self.changed.push(piece as u32);
            self.lose(piece);
        }
    }

    /// Takes over the pieces of a scene with this number of objects. Those that it had keep what is recorded.
    fn sync(&mut self, pieces: &[Piece], objects: usize) -> Result<(), SceneError> {
        let before = self.owners.len();
        for piece in 0..self.pieces.len() {
            // Objects that are gone, or new at indices that it lists.
            if self.has_object_in(piece, before.min(objects)..before.max(objects)) {
                self.change(piece);
            }
        }
        self.owners.resize(objects, NO_PIECE);
        self.recorded_words.resize(objects.div_ceil(WORD), 0);
        if self.pieces.iter().map(|known| &known.piece).eq(pieces) {
            if before != objects {
                (0..self.pieces.len()).try_for_each(|piece| self.claim(piece, before..objects))?;
                self.find_unknown_objects(objects);
            }
            return Ok(());
        }
        let mut known: HashMap<_, _> = self.pieces.drain(..).map(|known| (known.piece.name.clone(), known)).collect();
        self.owners.fill(NO_PIECE);
        let mut names = HashMap::new();
        for (index, piece) in pieces.iter().enumerate() {
            if names.insert(piece.name.as_str(), index).is_some() {
                return Err(SceneError::RepeatedPiece { piece: piece.name.clone() });
            }
            let next = match known.entry(piece.name.clone()) {
                Entry::Occupied(known) if known.get().piece.objects == piece.objects => known.remove(),
                _ => KnownPiece::new(piece),
            };
            self.pieces.push(next);
            self.claim(index, 0..objects)?;
        }
        for mut gone in known.into_values() {
            gone.lose(&mut self.recorded_words);
        }
        self.object_count = self.pieces.iter().map(|known| known.piece.objects.len()).sum();
        self.find_unknown_objects(objects);
        self.recorded_count = self.pieces.iter().filter(|known| known.is_recorded).count();
        let changed = (0..).zip(&self.pieces).filter(|(_, known)| known.has_changed).map(|(index, _)| index);
        self.changed.clear();
        self.changed.extend(changed);
        self.bounds.clear();
        self.bounds.resize_with(self.pieces.len().div_ceil(GroupBounds::GROUPS), GroupBounds::default);
        for (index, known) in self.pieces.iter_mut().enumerate().filter(|(_, known)| known.is_recorded) {
            let bounds = &known.recorded.get_mut().bounds;
            self.bounds[index / GroupBounds::GROUPS].set_union(index % GroupBounds::GROUPS, bounds);
        }
        // The indices of pieces changed.
        self.revision += 1;
        self.lists_revision += 1;
        Ok(())
    }

    fn has_object_in(&self, piece: usize, objects: Range<usize>) -> bool {
        !objects.is_empty()
            && self.pieces[piece]
                .piece
                .objects
                .iter_from(objects.start)
                .next()
                .is_some_and(|object| (object as usize) < objects.end)
    }

    fn find_unknown_objects(&mut self, objects: usize) {
        self.has_unknown_objects =
            self.pieces.iter().any(|known| known.piece.objects.iter_from(objects).next().is_some());
    }

    /// Counts the objects of pieces that a scene with this number of objects does not have, each once.
    pub(super) fn count_unknown_objects(&self, objects: usize, rejections: &Rejections) {
        let pieces = if self.has_unknown_objects { &self.pieces[..] } else { &[] };
        for index in pieces.iter().flat_map(|known| known.piece.objects.iter_from(objects)) {
            rejections.count_once(RejectionReason::UnknownObject, index as usize);
        }
    }

    /// Notes a piece's objects among a range of the scene's.
    fn claim(&mut self, piece: usize, objects: Range<usize>) -> Result<(), SceneError> {
        let of_piece = self.pieces[piece].piece.objects.iter_from(objects.start).map(|object| object as usize);
        for object in of_piece.take_while(|object| *object < objects.end) {
            let other = std::mem::replace(&mut self.owners[object], piece as u32);
            if other != NO_PIECE {
                let pieces = [other as usize, piece].map(|piece| self.pieces[piece].piece.name.clone());
                return Err(SceneError::SharedObject { object, pieces });
            }
        }
        Ok(())
    }

    /// If a selection is new, all pieces are recorded for it.
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

    /// Finds the pieces with a mesh or material that changed.
    fn find_changed_assets(&mut self, scene: &SceneRef<'_>) {
        let (meshes, materials) = (&scene.assets.meshes, &scene.assets.materials);
        let now = [(meshes.identity(), meshes.revision()), (materials.identity(), materials.revision())];
        let before = std::mem::replace(&mut self.assets, now);
        if before == now {
            return;
        }
        let are_others = before.map(|(identity, _)| identity) != now.map(|(identity, _)| identity);
        for piece in 0..self.pieces.len() {
            let are_same = self.pieces[piece].recorded.get_mut().has_assets_of(scene.assets);
            if are_others || !are_same {
                self.lose(piece);
            }
        }
    }

    /// The number of pieces.
    pub(super) fn len(&self) -> usize {
        self.pieces.len()
    }

    /// Whether the scene has no pieces.
    pub(super) fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Counts how often another object became, or ceased to be, one of a recorded piece.
    pub(super) fn revision(&self) -> u64 {
        self.revision
    }

    /// The recorded pieces, by index.
    pub(super) fn recorded(&self) -> impl Iterator<Item = usize> {
        (0..self.pieces.len()).filter(|piece| self.pieces[*piece].is_recorded)
    }

    /// The bounds of all pieces, in groups of [`GroupBounds::GROUPS`].
    pub(super) fn bounds(&self) -> &[GroupBounds] {
        &self.bounds
    }

    /// The objects that are executed if all recorded pieces are: a mask for each word.
    pub(super) fn recorded_words(&self) -> &[u64] {
        &self.recorded_words
    }

    /// Calls `visit` with the objects of a recorded piece that are executed.
    pub(super) fn visit_words(&self, piece: usize, visit: impl FnMut(&ObjectWord)) {
        self.pieces[piece].recorded.read().words.iter().for_each(visit);
    }

    /// The index of the piece that has an object.
    pub(super) fn owner(&self, object: usize) -> Option<u32> {
        self.owners.get(object).copied().filter(|owner| *owner != NO_PIECE)
    }

    /// The number of objects of all pieces.
    pub(super) fn listed_objects(&self) -> usize {
        self.object_count
    }

    /// The number of pieces that this frame records.
    pub(super) fn recording_count(&self) -> usize {
        self.recording.len()
    }

    /// The number of objects that are executed with a piece.
    pub(super) fn object_count(&self, piece: u32) -> usize {
        self.pieces[piece as usize].recorded.read().count
    }

    /// What the frame did with pieces.
    pub(super) fn statistics(&self) -> PieceStatistics {
        PieceStatistics { executable: self.recorded_count, recorded: self.recording.len(), changed: self.changed.len() }
    }

    /// The name of one of the pieces that this frame records, by index among them.
    pub(super) fn recorded_name(&self, index: usize) -> &str {
        &self.pieces[self.recording[index] as usize].piece.name
    }

    /// Records one of the pieces that this frame records, by index among them. `is_recordable` says whether objects
    /// with the mesh in a slot may be recorded, and `can_merge` whether they become one draw.
    pub(super) fn record(
        &self,
        index: usize,
        scene: &SceneRef<'_>,
        table: &ObjectTable,
        is_recordable: impl Fn(u32) -> bool,
        can_merge: impl Fn(u32) -> bool,
    ) {
        let known = &self.pieces[self.recording[index] as usize];
        known.recorded.write().record(&known.piece, &self.selections, (scene, table), is_recordable, can_merge);
    }

    /// The version of what a process with a selection draws of pieces.
    pub(super) fn version(&self, selection: Selection) -> Version {
        let index = self.selections.iter().position(|known| *known == selection).unwrap_or(self.selections.len());
        Version { frame: self.lists_revision + 1, index }
    }

    /// Makes a draw list have what a process with a selection draws of the pieces that a view executes, whose version
    /// is `executed`.
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
        list.set_piece_objects(version, &joined.objects);
        let batches = joined.batches.iter().filter(|(_, piece)| executes(*piece)).map(|(batch, _)| *batch);
        list.execute_pieces(executed, batches, can_merge);
    }

    /// Joins what a selection's lists have of the recorded pieces, unless another job has done it.
    fn join(&self, version: Version, joined: &mut JoinedPieces) {
        if joined.version == version {
            return;
        }
        let JoinedPieces { objects, batches, .. } = joined;
        batches.clear();
        for piece in self.recorded() {
            if let Some(list) = self.pieces[piece].list(version.index) {
                batches.extend(list.batches.iter().map(|batch| (*batch, piece as u32)));
            }
        }
        batches.sort_by_key(|(batch, piece)| (batch.state, batch.mesh, *piece));
        objects.clear();
        for (batch, piece) in batches {
            if let Some(list) = self.pieces[*piece as usize].list(version.index) {
                let of_batch = batch.first as usize..(batch.first + batch.count) as usize;
                batch.first = objects.len() as u32;
                objects.extend_from_slice(&list.objects[of_batch]);
            }
        }
        joined.version = version;
    }
}

const WORD: usize = u64::BITS as usize;
