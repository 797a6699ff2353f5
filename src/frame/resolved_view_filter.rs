//! The filter of a view within a frame.

use crate::bit_set::{BITS_PER_WORD, BitSet, set_bits};
use crate::scene::{Assets, FilteredObjects, Material, MaterialPredicate, SceneRef, ViewFilter};
use crate::task::{JobPanic, catch};
use crate::view::{IssueReason, ObjectBlock, SceneIssues};

/// The filter of a view, with what its predicate said of the scene's materials.
#[derive(Debug, Default)]
pub(super) struct ResolvedViewFilter {
    objects: FilteredObjects,
    /// `None` if all materials pass.
    materials: Option<PassingMaterials>,
    revision: u64,
}

/// The materials that a predicate contains.
#[derive(Debug)]
struct PassingMaterials {
    predicate: MaterialPredicate,
    /// The materials of which it was asked: the identity of their collection, and its revision.
    version: (u64, u64),
    /// Their slots.
    slots: BitSet,
}

impl ResolvedViewFilter {
    /// Makes it this filter for these materials. Asks the predicate if it is another one than before, or a material may
    /// have changed.
    ///
    /// # Errors
    /// If the predicate panics; then nothing changes.
    pub(super) fn update(&mut self, filter: &ViewFilter, assets: &Assets) -> Result<(), JobPanic> {
        let materials = &assets.materials;
        let version = (materials.identity(), materials.revision());
        let mut changed = self.objects != filter.objects;
        match (&filter.materials, &mut self.materials) {
            (None, known) => changed |= known.take().is_some(),
            (Some(predicate), Some(known)) if known.predicate == *predicate && known.version == version => {}
            (Some(predicate), known) => {
                let slots = catch(|| passing_slots(predicate, assets))?;
                changed |= known.as_ref().is_none_or(|known| known.slots != slots);
                *known = Some(PassingMaterials { predicate: predicate.clone(), version, slots });
            }
        }
        if changed {
            self.objects.clone_from(&filter.objects);
            self.revision += 1;
        }
        Ok(())
    }

    /// Counts the changes after which other objects may pass.
    pub(super) fn revision(&self) -> u64 {
        self.revision
    }

    /// Whether no material is left out.
    pub(super) fn passes_all_materials(&self) -> bool {
        self.materials.is_none()
    }

    /// The list of objects.
    pub(super) fn objects(&self) -> &FilteredObjects {
        &self.objects
    }

    /// Those of a word's objects that pass. The word is in this block, and its objects are drawable.
    #[inline]
    pub(super) fn pass(&self, objects: u64, word: usize, block: &ObjectBlock) -> u64 {
        match (&self.objects, &self.materials, objects) {
            (FilteredObjects::All, None, _) | (_, _, 0) => objects,
            _ => self.pass_by_material(objects & self.objects.mask(word), word, block),
        }
    }

    /// Those that pass by their materials.
    fn pass_by_material(&self, objects: u64, word: usize, block: &ObjectBlock) -> u64 {
        let Some(PassingMaterials { slots, .. }) = &self.materials else { return objects };
        let first = word * BITS_PER_WORD % ObjectBlock::SIZE;
        let passes = |bit: &usize| slots.contains(block.draws[first + bit].material as usize);
        set_bits(objects).filter(passes).fold(0, |passing, bit| passing | 1 << bit)
    }
}

/// The slots whose material the predicate contains.
fn passing_slots(predicate: &MaterialPredicate, assets: &Assets) -> BitSet {
    let mut slots = BitSet::default();
    slots.resize(assets.materials.slot_count());
    let passing = assets.iter::<Material>().filter(|(_, material)| predicate.contains(material));
    passing.for_each(|(handle, _)| slots.insert(handle.index() as usize));
    slots
}

/// Counts the indices that the cameras' filters list and at which the scene has no object, each once.
pub(super) fn count_unknown_objects(scene: &SceneRef<'_>, scene_issues: &SceneIssues) {
    for set in scene.cameras.iter().filter_map(|camera| camera.filter.objects.set()) {
        for index in set.iter_from(scene.object_count()) {
            scene_issues.count_once(IssueReason::UnknownObject, index as usize);
        }
    }
}
