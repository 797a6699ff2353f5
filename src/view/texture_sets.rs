//! Which textures are bound together: arrays of equal textures, and the sets of arrays that materials need.

use std::collections::HashMap;

use crate::command::DrawState;
use crate::handle::Handle;
use crate::scene::{Assets, Material, Texture, TextureClass};

/// The arrays that textures lie in, and the sets of arrays that are bound together.
///
/// Textures of one [class](TextureClass) are layers of an array. A shader samples any layer of the arrays that are
/// bound, so objects whose materials need no more than [`TextureSet::MAX_ARRAYS`] arrays between them are drawn without
/// a change of bindings, whatever their materials. Where a scene has more arrays, materials are divided into sets; a
/// set is a part of an object's [`DrawState`].
///
/// A texture that is replaced by one of another class may be drawn as it was until the new one is on the device, so a
/// set has the former array too.
#[derive(Debug, Default)]
pub struct TextureSets {
    /// What they were made of; `None` before the first update.
    version: Option<Version>,
    arrays: Vec<TextureArray>,
    /// For each class, the array that the latest texture of it came to.
    latest: HashMap<TextureClass, u32>,
    /// By slot.
    textures: Vec<Option<ArrayOfTexture>>,
    sets: Vec<TextureSet>,
    /// By slot.
    set_of_material: Vec<u32>,
    revision: u64,
    divisions: u64,
}

/// The materials and textures of a scene at one time: of each the identity of the collection, its revision, and how
/// many were loaded after their handles were made; and the limit of layers.
type Version = [(u64, u64, u64); 3];

/// One array of textures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextureArray {
    /// What its layers have in common.
    pub class: TextureClass,
    /// The number of textures that have a layer, or may have one still.
    pub textures: u32,
}

/// The arrays that are bound together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TextureSet {
    arrays: [u32; Self::MAX_ARRAYS],
    count: usize,
}

/// Where a texture is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct ArrayOfTexture {
    texture: Handle<Texture>,
    array: u32,
    /// Where it was before it was replaced by one of another class.
    former: Option<u32>,
}

impl TextureSet {
    /// The most arrays that are bound together, so that every material finds those of all its textures. Of the 16
    /// textures and samplers that every device can bind, 10 and 9 are left for a process's own.
    pub const MAX_ARRAYS: usize = Material::MAX_TEXTURES;

    /// The arrays, by index among [`TextureSets::arrays`].
    pub fn arrays(&self) -> &[u32] {
        &self.arrays[..self.count]
    }

    /// The position of an array in the set.
    pub fn position(&self, array: u32) -> Option<usize> {
        self.arrays().iter().position(|other| *other == array)
    }

    /// Adds an array, unless it is there already. Returns whether it has room.
    fn add(&mut self, array: u32) -> bool {
        if self.position(array).is_some() {
            return true;
        }
        let has_room = self.count < Self::MAX_ARRAYS;
        if has_room {
            self.arrays[self.count] = array;
            self.count += 1;
        }
        has_room
    }

    /// This set with all arrays of another one, if they have room.
    fn union(mut self, other: &Self) -> Option<Self> {
        other.arrays().iter().all(|array| self.add(*array)).then_some(self)
    }
}

impl TextureSets {
    /// The arrays. One that is empty keeps its index, for textures of its class that may come.
    pub fn arrays(&self) -> &[TextureArray] {
        &self.arrays
    }

    /// The array of the texture in a slot; `None` if there is none.
    pub fn array_of(&self, texture: u32) -> Option<u32> {
        self.textures.get(texture as usize)?.map(|known| known.array)
    }

    /// The number of slots that textures have.
    pub fn texture_slots(&self) -> u32 {
        self.textures.len() as u32
    }

    /// The sets, by the number that [draw states](DrawState::texture_set) have.
    pub fn sets(&self) -> &[TextureSet] {
        &self.sets
    }

    /// The set of the material in a slot.
    pub fn set_of(&self, material: u32) -> u32 {
        self.set_of_material.get(material as usize).copied().unwrap_or(0)
    }

    /// Grows whenever an array, a set, or what is in them changes.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Counts how often a material came into another set than it was in.
    pub fn divisions(&self) -> u64 {
        self.divisions
    }

    /// Brings them up to date with the assets. An array has at most `max_layers` textures.
    pub(crate) fn update(&mut self, assets: &Assets, max_layers: u32) {
        let Assets { materials, textures, .. } = assets;
        let version = [
            (materials.identity(), materials.revision(), materials.arrivals()),
            (textures.identity(), textures.revision(), textures.arrivals()),
            (u64::from(max_layers), 0, 0),
        ];
        let before = self.version.replace(version);
        if before == Some(version) {
            return;
        }
        let is_other = |before: Version| (before[1].0, before[2]) != (version[1].0, version[2]);
        if before.is_some_and(is_other) {
            let (version, revision, divisions) = (self.version, self.revision + 1, self.divisions + 1);
            *self = Self { version, revision, divisions, ..Self::default() };
        }
        if self.update_textures(assets, max_layers) | self.update_sets(assets) {
            self.revision += 1;
        }
    }

    /// Returns whether an array changed.
    fn update_textures(&mut self, assets: &Assets, max_layers: u32) -> bool {
        let mut has_changed = false;
        let mut known = std::mem::take(&mut self.textures);
        self.textures.resize(assets.textures.slot_count(), None);
        // What is gone makes room first.
        for entry in &mut known {
            if entry.is_some_and(|entry| assets.get(entry.texture).is_err()) {
                has_changed = true;
                entry.take().iter().for_each(|entry| self.leave(entry));
            }
        }
        for (handle, texture) in assets.textures.iter() {
            let (slot, class) = (handle.index() as usize, texture.class());
            let before = known.get_mut(slot).and_then(Option::take);
            let entry = match before {
                Some(entry) if self.arrays[entry.array as usize].class == class => entry,
                Some(entry) => {
                    if let Some(former) = entry.former {
                        self.arrays[former as usize].textures -= 1;
                    }
                    ArrayOfTexture { array: self.join(class, max_layers), former: Some(entry.array), ..entry }
                }
                None => ArrayOfTexture { texture: handle, array: self.join(class, max_layers), former: None },
            };
            has_changed |= before != Some(entry);
            self.textures[slot] = Some(entry);
        }
        has_changed
    }

    fn leave(&mut self, entry: &ArrayOfTexture) {
        for array in [Some(entry.array), entry.former].into_iter().flatten() {
            self.arrays[array as usize].textures -= 1;
        }
    }

    /// Adds a texture to an array of its class. Returns which.
    fn join(&mut self, class: TextureClass, max_layers: u32) -> u32 {
        let has_room = |array: &TextureArray| array.class == class && array.textures < max_layers;
        let latest = self.latest.get(&class).copied().filter(|latest| has_room(&self.arrays[*latest as usize]));
        let found = latest.or_else(|| self.arrays.iter().position(has_room).map(|found| found as u32));
        let array = found.unwrap_or_else(|| {
            self.arrays.push(TextureArray { class, textures: 0 });
            self.arrays.len() as u32 - 1
        });
        self.latest.insert(class, array);
        self.arrays[array as usize].textures += 1;
        array
    }

    /// Divides the materials into sets, each into the first one that has room for it. Returns whether that is another
    /// division.
    fn update_sets(&mut self, assets: &Assets) -> bool {
        let mut sets = vec![TextureSet::default()];
        let mut set_of_material = vec![0; assets.materials.slot_count()];
        let mut found = HashMap::new();
        for (handle, material) in assets.materials.iter() {
            let needed = self.needed_arrays(assets, material);
            if needed.arrays().is_empty() {
                continue;
            }
            set_of_material[handle.index() as usize] = *found.entry(needed.arrays).or_insert_with(|| {
                let with_room = (0..).zip(&sets).find_map(|(index, set)| Some((index, set.union(&needed)?)));
                match with_room {
                    Some((index, union)) => {
                        sets[index] = union;
                        index as u32
                    }
                    // The textures of what is beyond the last set are left out.
                    None if sets.len() > DrawState::MAX_TEXTURE_SET as usize => 0,
                    None => {
                        sets.push(needed);
                        sets.len() as u32 - 1
                    }
                }
            });
        }
        // A material that gets a texture of an array that is bound already changes no binding.
        for (array, index) in self.arrays.iter().zip(0..) {
            let is_bound = |set: &TextureSet| set.position(index).is_some();
            if array.textures > 0 && !sets.iter().any(is_bound) {
                _ = sets.iter_mut().any(|set| set.add(index));
            }
        }
        let has_changed = (&self.sets, &self.set_of_material) != (&sets, &set_of_material);
        let mut known = self.set_of_material.iter().zip(&set_of_material);
        self.divisions += u64::from(known.any(|(before, now)| before != now));
        (self.sets, self.set_of_material) = (sets, set_of_material);
        has_changed
    }

    /// The arrays of a material's textures: those that they are in, and, where there is room, those that they were in.
    fn needed_arrays(&self, assets: &Assets, material: &Material) -> TextureSet {
        let mut needed = TextureSet { arrays: [u32::MAX; TextureSet::MAX_ARRAYS], count: 0 };
        let known = || {
            let loaded = material.all_textures().filter(|(_, texture)| assets.get(*texture).is_ok());
            loaded.filter_map(|(_, texture)| self.textures[texture.index() as usize])
        };
        known().for_each(|texture| _ = needed.add(texture.array));
        known().filter_map(|texture| texture.former).for_each(|former| _ = needed.add(former));
        needed
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::scene::TextureFormat;

    const MAX_LAYERS: u32 = 3;

    fn texture(class: u32) -> Texture {
        let format = if class.is_multiple_of(2) { TextureFormat::R8Unorm } else { TextureFormat::Rg8Unorm };
        let width = class / 2 + 1;
        Texture::with_levels("texture", format, [width, 1], vec![vec![0; (width * format.block_bytes()) as usize]])
            .unwrap()
    }

    /// What must hold of them, whatever was changed.
    fn check(sets: &TextureSets, assets: &Assets) -> Result<(), TestCaseError> {
        let mut counts = vec![0; sets.arrays().len()];
        for (handle, texture) in assets.textures.iter() {
            let array = sets.array_of(handle.index());
            let array = array.ok_or_else(|| TestCaseError::fail("a texture without an array"))? as usize;
            prop_assert_eq!(sets.arrays()[array].class, texture.class());
            counts[array] += 1;
        }
        for (array, count) in sets.arrays().iter().zip(counts) {
            prop_assert!(count <= array.textures && array.textures <= MAX_LAYERS, "{array:?} has {count}");
        }
        for (handle, material) in assets.materials.iter() {
            let set = &sets.sets()[sets.set_of(handle.index()) as usize];
            prop_assert!(set.arrays().len() <= TextureSet::MAX_ARRAYS);
            for (_, texture) in material.all_textures().filter(|(_, texture)| assets.get(*texture).is_ok()) {
                let array = sets.array_of(texture.index()).unwrap_or(u32::MAX);
                prop_assert!(set.position(array).is_some(), "{set:?} lacks {array}");
            }
        }
        Ok(())
    }

    proptest! {
        #[test]
        fn every_material_has_the_arrays_of_its_textures_in_its_set(
            steps in prop::collection::vec((0..6_u8, any::<usize>(), 0..14_u32), 1..120),
        ) {
            let (mut assets, mut sets) = (Assets::default(), TextureSets::default());
            let (mut textures, mut materials) = (Vec::new(), Vec::new());
            for (kind, index, class) in steps {
                match kind {
                    0 | 1 => textures.push(assets.add(texture(class)).unwrap()),
                    2 if !textures.is_empty() => {
                        let handle = textures[index % textures.len()];
                        assets.replace(handle, texture(class)).unwrap();
                    }
                    3 if textures.len() > 1 => {
                        assets.remove(textures.swap_remove(index % textures.len())).unwrap();
                    }
                    4 if !materials.is_empty() => {
                        assets.remove(materials.swap_remove(index % materials.len())).unwrap();
                    }
                    _ => {
                        let texture_of = |step| textures.get((index + step) % textures.len().max(1)).copied();
                        let textures = (0..class as usize % 6).map(|step| texture_of(3 * step)).collect();
                        let material = Material { texture: texture_of(1), textures, ..Material::default() };
                        materials.push(assets.add(material).unwrap());
                    }
                }
                let revision = sets.revision();
                sets.update(&assets, MAX_LAYERS);
                check(&sets, &assets)?;
                let after = sets.revision();
                sets.update(&assets, MAX_LAYERS);
                prop_assert!(after >= revision && sets.revision() == after, "nothing changed since");
            }
        }
    }

    #[test]
    fn materials_of_six_arrays_share_a_set_and_a_seventh_has_another_one() {
        let (mut assets, mut sets) = (Assets::default(), TextureSets::default());
        let mut add = |class| {
            let texture = assets.add(texture(class)).unwrap();
            let material = assets.add(Material { texture: Some(texture), ..Material::default() }).unwrap();
            sets.update(&assets, 256);
            sets.set_of(material.index())
        };
        assert_eq!([0, 1, 2, 3, 0, 4, 5, 3].map(&mut add), [0; 8]);
        assert_eq!([6, 0, 7, 6].map(&mut add), [1, 0, 1, 1]);
    }

    #[test]
    fn the_array_that_a_texture_was_in_stays_bound_after_another_size_replaces_it() {
        let (mut assets, mut sets) = (Assets::default(), TextureSets::default());
        let handle = assets.add(texture(0)).unwrap();
        let material = assets.add(Material { texture: Some(handle), ..Material::default() }).unwrap();
        let mut arrays = |assets: &Assets| {
            sets.update(assets, 256);
            let set = sets.sets()[sets.set_of(material.index()) as usize];
            (sets.array_of(handle.index()), set.arrays().to_vec(), sets.revision())
        };
        assert_eq!(arrays(&assets), (Some(0), vec![0], 1));
        assets.replace(handle, texture(0)).unwrap();
        assert_eq!(arrays(&assets), (Some(0), vec![0], 1), "the same size");
        assets.replace(handle, texture(1)).unwrap();
        assert_eq!(arrays(&assets), (Some(1), vec![1, 0], 2));
        assets.replace(handle, texture(2)).unwrap();
        assert_eq!(arrays(&assets), (Some(2), vec![2, 1], 3));
    }
}
