//! Textures that are streamed: they come to the device by background jobs, and make room for others.

use super::buffers::CountedQueue;
use super::residents::{Placed, Unplaced};
use super::texture_arrays::{ResidentTextures, TextureLocation};
use super::texture_layers::can_hold;

/// The device that arrays are on, and what they may take there.
#[derive(Clone, Copy)]
pub(crate) struct ArrayBudget<'a> {
    device: &'a wgpu::Device,
    uploads: &'a CountedQueue,
    /// Of all arrays.
    bytes: u64,
    /// Of each array.
    max_layers: u64,
}

impl<'a> ArrayBudget<'a> {
    /// The bytes that it takes, and the limit of the device.
    pub(crate) fn new(device: &'a wgpu::Device, uploads: &'a CountedQueue, bytes: u64) -> Self {
        Self { device, uploads, bytes, max_layers: u64::from(device.limits().max_texture_array_layers) }
    }
}

/// How much an array must gain, or give up, before it is copied for it.
///
/// Arrays grow and shrink as a whole. If one gave up each layer as soon as it is free, two arrays could be copied in
/// turn for every texture that comes.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Copying {
    /// A part of its layers, so that copies of a layer are no more than a few for each texture.
    Seldom,
    /// A single layer: where nothing else makes room.
    AnyTime,
}

impl Copying {
    /// The fewest layers that an array of this length grows by.
    fn min_growth(self, capacity: u64) -> u64 {
        if self == Self::Seldom { (capacity / 8).max(1) } else { 1 }
    }

    /// The layers that an array gives up for another one, by its length and the number of its free layers.
    fn surplus(self, capacity: u64, free: u64) -> u64 {
        let is_enough = free > 0 && (self == Self::AnyTime || free >= capacity / 4);
        if is_enough { free } else { 0 }
    }
}

impl ResidentTextures {
    /// The array of the texture in a slot.
    pub(crate) fn array_of(&self, texture: u32) -> Option<usize> {
        self.memory.array_of(texture)
    }

    /// Finds a layer for a texture in this array, or moves the array to a larger one if the budget allows.
    pub(crate) fn place_beside(
        &mut self,
        index: usize,
        budget: ArrayBudget<'_>,
    ) -> Result<Placed<(TextureLocation, wgpu::Texture)>, Unplaced> {
        if !can_hold(budget.device, self.memory.arrays[index].class) {
            return Err(Unplaced::LayerLimit);
        }
        let bytes = self.memory.layer_bytes(index);
        if bytes > budget.bytes {
            return Err(Unplaced::TooLarge { bytes, limit: "texture_bytes", allowed: budget.bytes });
        }
        let location = self.take_layer(index, budget, Copying::Seldom)?;
        self.placed(location)
    }

    /// The same where candidates make room, the first ones first: those that have a layer of the same array, or enough
    /// of the others. `evictions` counts them.
    pub(crate) fn place_instead<C: Iterator<Item = u32>>(
        &mut self,
        index: usize,
        budget: ArrayBudget<'_>,
        candidates: impl Fn() -> C,
        evictions: &mut usize,
    ) -> Result<Placed<(TextureLocation, wgpu::Texture)>, Unplaced> {
        let evicted = self.evict_for(index, budget, Copying::Seldom, candidates());
        *evictions += evicted;
        let copying = if evicted > 0 { Copying::Seldom } else { Copying::AnyTime };
        let mut found = self.take_layer(index, budget, copying);
        if found == Err(Unplaced::Full) && evicted == 0 {
            *evictions += self.evict_for(index, budget, Copying::AnyTime, candidates());
            found = self.take_layer(index, budget, Copying::AnyTime);
        }
        if found == Err(Unplaced::Full) && self.memory.arrays[index].layers.capacity() as u64 == budget.max_layers {
            found = Err(Unplaced::LayerLimit);
        }
        self.placed(found?)
    }

    fn placed(&self, location: TextureLocation) -> Result<Placed<(TextureLocation, wgpu::Texture)>, Unplaced> {
        let on_device = self.memory.arrays[location.array as usize].layers.texture().cloned().ok_or(Unplaced::Full)?;
        let last_reader = self.lifetimes.last_reader(|retired| *retired == location);
        Ok(Placed { target: (location, on_device), last_reader })
    }

    /// Takes a free layer, or one of a larger array.
    fn take_layer(
        &mut self,
        index: usize,
        budget: ArrayBudget<'_>,
        copying: Copying,
    ) -> Result<TextureLocation, Unplaced> {
        if self.memory.arrays[index].layers.free_count() == 0 {
            self.grow(index, budget, copying)?;
        }
        let layer = self.memory.arrays[index].layers.take().ok_or(Unplaced::Full)?;
        Ok(TextureLocation { array: index as u32, layer })
    }

    /// Moves an array to a larger one within the budget. If there is not enough of it, the other arrays give up what
    /// they do not use.
    fn grow(&mut self, index: usize, budget: ArrayBudget<'_>, copying: Copying) -> Result<(), Unplaced> {
        let (bytes, array) = (self.memory.layer_bytes(index), &self.memory.arrays[index]);
        let capacity = array.layers.capacity() as u64;
        // A new array has no more layers than there are textures for it.
        let first = u64::from(array.textures).clamp(1, MAX_FIRST_LAYERS);
        let wanted = (capacity * 2).max(first).min(budget.max_layers);
        let growth = copying.min_growth(capacity).min(wanted - capacity);
        let rest = budget.bytes.saturating_sub(self.resident_bytes());
        if growth == 0 || self.surplus_bytes(index, copying, |_| 0) + rest < growth * bytes {
            return Err(Unplaced::Full);
        }
        let gives_up = rest < growth * bytes;
        let donors: Vec<_> = (0..self.memory.arrays.len())
            .filter(|other| gives_up && *other != index && self.surplus(*other, copying, 0) > 0)
            .collect();
        // What jobs upload stays where it is.
        if donors.iter().chain([&index]).any(|array| self.in_flight().any(|busy| busy.array as usize == *array)) {
            return Err(Unplaced::Awaited);
        }
        for other in donors {
            let live = self.live_layers(other).count();
            self.move_array(budget.device, budget.uploads, other, live as u32);
        }
        let affordable = capacity + budget.bytes.saturating_sub(self.resident_bytes()) / bytes;
        self.move_array(budget.device, budget.uploads, index, wanted.min(affordable) as u32);
        Ok(())
    }

    /// What an array gives up for another one if `evicted` more of its layers are free.
    fn surplus(&self, array: usize, copying: Copying, evicted: u64) -> u64 {
        let layers = &self.memory.arrays[array].layers;
        copying.surplus(layers.capacity() as u64, layers.free_count() as u64 + evicted)
    }

    /// What all arrays but one give up for it, in bytes.
    fn surplus_bytes(&self, index: usize, copying: Copying, evicted: impl Fn(usize) -> u64) -> u64 {
        let others = (0..self.memory.arrays.len()).filter(|other| *other != index);
        others.map(|other| self.surplus(other, copying, evicted(other)) * self.memory.layer_bytes(other)).sum()
    }

    /// Evicts candidates until there is a free layer in an array, or the array can grow; none if there are not enough.
    /// Returns how many.
    fn evict_for(
        &mut self,
        index: usize,
        budget: ArrayBudget<'_>,
        copying: Copying,
        candidates: impl Iterator<Item = u32>,
    ) -> usize {
        let capacity = self.memory.arrays[index].layers.capacity() as u64;
        let may_grow = capacity < budget.max_layers;
        let needed = copying.min_growth(capacity).min(budget.max_layers - capacity) * self.memory.layer_bytes(index);
        let rest = budget.bytes.saturating_sub(self.resident_bytes());
        let (mut counts, mut chosen) = (vec![0; self.memory.arrays.len()], Vec::new());
        for slot in candidates {
            let Some(location) = self.location(slot) else { continue };
            if location.array as usize == index {
                self.take_off(slot);
                return 1;
            }
            if !may_grow {
                continue;
            }
            counts[location.array as usize] += 1;
            chosen.push((slot, location.array as usize));
            if rest + self.surplus_bytes(index, copying, |array| counts[array]) >= needed {
                // Those of arrays that give up nothing would make room in vain.
                chosen.retain(|(_, array)| self.surplus(*array, copying, counts[*array]) > 0);
                chosen.iter().for_each(|(slot, _)| self.take_off(*slot));
                return chosen.len();
            }
        }
        0
    }
}

/// The most layers of a new array.
const MAX_FIRST_LAYERS: u64 = 8;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::wgpu::noop_device::noop_device;
    use crate::backend::wgpu::resources::EndOfUpload;
    use crate::scene::{Assets, Sampler, Texture, TextureClass, TextureFormat};
    use crate::view::TextureSets;

    /// Arrays, and the textures in them, those that were used longest ago first.
    struct Arrays {
        arrays: ResidentTextures,
        assets: Assets,
        sets: TextureSets,
        device: wgpu::Device,
        uploads: CountedQueue,
        by_use: Vec<u32>,
    }

    /// A layer of 256.
    const LAYER: u64 = 4 * (256 * 256 * 4 - 1) / 3;

    fn layer_bytes(side: u32) -> u64 {
        let mip_levels = side.ilog2() + 1;
        let sampler = Sampler::REPEAT;
        TextureClass { width: side, height: side, format: TextureFormat::Rgba8Srgb, mip_levels, sampler }.bytes()
    }
    /// A layer of 512 takes four bytes more than four of 256.
    const SLACK: u64 = 64;

    impl Arrays {
        fn new() -> Self {
            let (device, queue) = noop_device();
            let (arrays, uploads) = (ResidentTextures::default(), CountedQueue::new(queue));
            Self {
                arrays,
                assets: Assets::default(),
                sets: TextureSets::default(),
                device,
                uploads,
                by_use: Vec::new(),
            }
        }

        /// Places a new texture, which is on the device at once; the first `candidates` by use may make room.
        fn place(&mut self, side: u32, (layers, max_layers): (u64, u64), candidates: usize) -> Result<usize, Unplaced> {
            let texture = Texture::new("plain", side, side, vec![255; (side * side * 4) as usize]).unwrap();
            let handle = self.assets.add(texture.clone()).unwrap();
            self.sets.update(&self.assets, 256);
            self.arrays.set_arrays(&self.sets);
            let array = self.arrays.array_of(handle.index()).unwrap();
            self.arrays.begin_frame(&self.assets.textures, (0, |_, _| true), true);
            let (device, uploads) = (&self.device, &self.uploads);
            let budget = ArrayBudget { device, uploads, bytes: layers * LAYER + SLACK, max_layers };
            let (by_use, mut evictions) = (self.by_use[..candidates].to_vec(), 0);
            let mut placed = self.arrays.place_beside(array, budget);
            if matches!(placed, Err(Unplaced::Full)) {
                placed = self.arrays.place_instead(array, budget, || by_use.iter().copied(), &mut evictions);
            }
            self.by_use.retain(|slot| self.arrays.is_resident(*slot));
            let (location, _) = placed.inspect_err(|_| assert_eq!(evictions, 0, "nothing is evicted in vain"))?.target;
            assert!(self.arrays.resident_bytes() <= budget.bytes);
            let (_, revision, _) = self.assets.textures.entry(handle.index()).unwrap();
            let upload = self.arrays.begin_upload((handle, revision), location);
            let end = self.arrays.end_upload(&upload, &self.assets.textures, |_, _| true, true);
            assert_eq!(end, EndOfUpload::Resident);
            self.by_use.push(handle.index());
            Ok(evictions)
        }
    }

    #[test]
    fn at_the_limit_of_layers_only_textures_of_the_same_array_make_room() {
        let mut arrays = Arrays::new();
        let limits = (1000, 8);
        // The larger ones were used longest ago.
        for side in [512, 512, 512, 256, 256, 256, 256, 256, 256, 256, 256] {
            assert_eq!(arrays.place(side, limits, 0), Ok(0));
        }
        assert_eq!(arrays.place(256, limits, 3), Err(Unplaced::LayerLimit), "larger ones would make room in vain");
        assert_eq!(arrays.place(512, limits, 0), Ok(0), "the other array is not at its limit");
        assert_eq!(arrays.place(256, limits, 4), Ok(1));
        assert_eq!(arrays.by_use[..4], [0, 1, 2, 4], "the oldest one of its array");
    }

    #[test]
    fn where_the_budget_is_full_too_few_candidates_make_no_room() {
        let mut arrays = Arrays::new();
        let limits = (8, 256);
        for _ in 0..8 {
            assert_eq!(arrays.place(256, limits, 0), Ok(0));
        }
        // One of 512 takes the room of four of 256.
        assert_eq!(arrays.place(512, limits, 3), Err(Unplaced::Full));
        assert_eq!(arrays.place(512, limits, 5), Ok(4));
        assert_eq!(
            arrays.place(2048, limits, 5),
            Err(Unplaced::TooLarge { bytes: layer_bytes(2048), limit: "texture_bytes", allowed: 8 * LAYER + SLACK })
        );
    }

    #[test]
    fn arrays_that_grow_and_shrink_in_turn_are_copied_seldom() {
        let mut arrays = Arrays::new();
        let mut random = fastrand::Rng::with_seed(4);
        let limits = (256, 2048);
        let (mut placed, mut share) = (0, 0.5);
        let mut after_filling = 0;
        for step in 0..1200 {
            if step % 50 == 0 {
                // What is in sight has other sizes than before.
                share = random.f64();
            }
            if step == 200 {
                after_filling = arrays.arrays.memory.moves;
            }
            let side = if random.f64() < share { 512 } else { 256 };
            placed += usize::from(arrays.place(side, limits, arrays.by_use.len()).is_ok());
        }
        assert_eq!(placed, 1200);
        let moves = arrays.arrays.memory.moves - after_filling;
        assert!(moves < 150, "{moves} copies of arrays for 1000 textures");
    }
}
