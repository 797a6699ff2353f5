//! Materials and their textures on the CPU.

use std::sync::Arc;

use glam::Vec3;

use crate::backend::texels::{SIDES, array_for, linear, mip_chain};
use crate::process::{MaterialValues, Materials};
use crate::raster::{Real, Vector, Vector2, Vector3, Vector4};
use crate::scene::{Assets, Blend, Material};
use crate::view::{RejectionReason, Rejections};

/// Keeps the materials of the last frame, and the mip levels of the textures that they carry.
#[derive(Default)]
pub(super) struct MaterialCache {
    /// By texture slot: its revision and its levels.
    chains: Vec<Option<(u64, Arc<MipChain>)>>,
    /// Whose textures the levels are.
    identity: u64,
    /// Identities and revisions of what the table holds.
    current: Option<[(u64, u64); 2]>,
    table: Arc<MaterialTable>,
    /// The materials whose texture was removed: counted in every frame.
    stale: Vec<usize>,
}

impl MaterialCache {
    /// The materials that a frame of these assets draws with. Only textures that changed since the last frame, and that a
    /// material carries, are scaled again; where nothing changed it is the table of before.
    pub(super) fn update(&mut self, assets: &Assets, rejections: &Rejections) -> Arc<MaterialTable> {
        let wanted = [
            (assets.materials.identity(), assets.materials.revision()),
            (assets.textures.identity(), assets.textures.revision()),
        ];
        if self.current != Some(wanted) {
            self.rebuild(assets);
            self.current = Some(wanted);
        }
        for &material in &self.stale {
            rejections.count(RejectionReason::StaleTexture, material);
        }
        Arc::clone(&self.table)
    }

    fn rebuild(&mut self, assets: &Assets) {
        if self.identity != assets.textures.identity() {
            self.chains.clear();
            self.identity = assets.textures.identity();
        }
        self.chains.resize(assets.textures.slot_count(), None);
        for (slot, chain) in (0..).zip(&mut self.chains) {
            let revision = assets.textures.revised_at(slot).map(|(revision, _)| revision);
            chain.take_if(|(kept, _)| Some(*kept) != revision);
        }
        self.stale.clear();
        let mut slots = vec![None; assets.materials.slot_count()];
        for (handle, material) in assets.iter::<Material>() {
            let slot = handle.index() as usize;
            let chain = material.texture.and_then(|texture| {
                if assets.get(texture).is_err() {
                    self.stale.push(slot);
                    return None;
                }
                self.chain(assets, texture.index())
            });
            slots[slot] = Some(TableEntry::new(material, chain));
        }
        self.table = Arc::new(MaterialTable { slots, light: light_of_bytes() });
    }

    fn chain(&mut self, assets: &Assets, slot: u32) -> Option<Arc<MipChain>> {
        let (revision, texture) = assets.textures.revised_at(slot)?;
        let (_, chain) = self.chains.get_mut(slot as usize)?.get_or_insert_with(|| {
            let side = SIDES[array_for(texture)];
            (revision, Arc::new(MipChain { side: side as usize, levels: mip_chain(texture, side) }))
        });
        Some(Arc::clone(chain))
    }
}

/// The materials of a frame. It stays valid while assets change for later frames.
pub(super) struct MaterialTable {
    /// By material slot.
    slots: Vec<Option<TableEntry>>,
    /// What the bytes of red, green and blue stand for.
    light: [f64; 256],
}

impl Default for MaterialTable {
    fn default() -> Self {
        Self { slots: Vec::new(), light: light_of_bytes() }
    }
}

fn light_of_bytes() -> [f64; 256] {
    std::array::from_fn(|byte| linear(byte as f64 / 255.0))
}

#[derive(Clone)]
struct TableEntry {
    diffuse: Vec3,
    opacity: f32,
    emission: Vec3,
    double_sided: bool,
    blend: Blend,
    chain: Option<Arc<MipChain>>,
}

impl TableEntry {
    fn new(material: &Material, chain: Option<Arc<MipChain>>) -> Self {
        let Material { diffuse, opacity, emission, double_sided, blend, .. } = *material;
        Self { diffuse, opacity, emission, double_sided, blend, chain }
    }
}

impl<R: Real> Materials<R> for MaterialTable {
    /// Black, where the slot is free: what refers to that is not drawn.
    fn get(&self, slot: u32) -> MaterialValues<R> {
        let Some(Some(entry)) = self.slots.get(slot as usize) else {
            let (diffuse, emission) = (Vector3::zero(), Vector3::zero());
            return MaterialValues { diffuse, opacity: R::zero(), emission, double_sided: false, blend: Blend::None };
        };
        MaterialValues {
            diffuse: Vector3::of_single(entry.diffuse),
            opacity: R::of(f64::from(entry.opacity)),
            emission: Vector3::of_single(entry.emission),
            double_sided: entry.double_sided,
            blend: entry.blend,
        }
    }

    fn texel(&self, slot: u32, uv: Vector2<R>, across: Vector2<R>, down: Vector2<R>) -> Vector4<R> {
        let entry = self.slots.get(slot as usize).and_then(Option::as_ref);
        match entry.and_then(|entry| entry.chain.as_ref()) {
            Some(chain) => chain.trilinear(&self.light, uv, across, down),
            None => Vector::splat(R::one()),
        }
    }
}

/// All mip levels of a texture, as [`mip_chain`] has them.
struct MipChain {
    /// Of the first level, in pixels: a power of two.
    side: usize,
    levels: Vec<Vec<u8>>,
}

impl MipChain {
    /// The level of detail is where a step to the next column, or to the next row if that is longer, is as long as a pixel (Vulkan,
    /// "Level-of-Detail Operation"). Between two levels, both are blended.
    fn trilinear<R: Real>(
        &self,
        light: &[f64; 256],
        uv: Vector2<R>,
        across: Vector2<R>,
        down: Vector2<R>,
    ) -> Vector4<R> {
        // What is no number stands for 0, as on devices; it would lead to no pixel at all.
        let finite = |value: R| if value.is_finite() { value } else { R::zero() };
        let uv = uv.map(finite);
        let longest = finite(across.dot(across).max(down.dot(down)).sqrt() * R::of(self.side as f64));
        let last = self.levels.len() - 1;
        let level = longest.max(R::one()).log2().min(R::of(last as f64));
        let finer = level.floor();
        let share = level - finer;
        let finer = finer.as_f64() as usize;
        let one = self.bilinear(light, finer, uv);
        if share == R::zero() {
            return one;
        }
        one.with(self.bilinear(light, finer + 1, uv), |one, other| one + (other - one) * share)
    }

    /// Of the four pixels around a place, each by how near its middle is. The picture repeats beyond its border.
    fn bilinear<R: Real>(&self, light: &[f64; 256], level: usize, uv: Vector2<R>) -> Vector4<R> {
        let side = self.side >> level;
        // Taken to between 0 and 1 first, so that far places keep what f32 has of them.
        let place = uv.map(|value| (value - value.floor()) * R::of(side as f64) - R::of(0.5));
        let [x, y] = place.map(R::floor).0;
        let [right, lower] = (place - Vector([x, y])).0;
        let wrapped = |first: R, step: i64| (first.as_f64() as i64 + step).rem_euclid(side as i64) as usize;
        let columns = [(wrapped(x, 0), R::one() - right), (wrapped(x, 1), right)];
        let rows = [(wrapped(y, 0), R::one() - lower), (wrapped(y, 1), lower)];
        let mut sum = Vector::zero();
        for (row, row_weight) in rows {
            for (column, weight) in columns {
                sum = sum + self.pixel(light, level, row * side + column) * (weight * row_weight);
            }
        }
        sum
    }

    fn pixel<R: Real>(&self, light: &[f64; 256], level: usize, index: usize) -> Vector4<R> {
        let bytes = &self.levels[level][index * 4..index * 4 + 4];
        let of_light = |byte: u8| R::of(light[usize::from(byte)]);
        Vector([of_light(bytes[0]), of_light(bytes[1]), of_light(bytes[2]), R::of(f64::from(bytes[3]) / 255.0)])
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::scene::Texture;

    /// How far f32 rounds, as a share of the value.
    const UNIT: f64 = 1.0 / 16_777_216.0;

    fn noise(side: u32) -> Texture {
        let mut state = 1_u32;
        let byte = |_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 24) as u8
        };
        Texture::new("noise", side, side, (0..side * side * 4).map(byte).collect()).unwrap()
    }

    fn table(texture: Texture) -> Arc<MaterialTable> {
        let mut assets = Assets::default();
        let texture = assets.add(texture).unwrap();
        assets.add(Material { texture: Some(texture), ..Material::default() }).unwrap();
        MaterialCache::default().update(&assets, &Rejections::default())
    }

    fn texel<R: Real>(table: &MaterialTable, uv: [f64; 2], gradients: [[f64; 2]; 2]) -> [f64; 4] {
        let [uv, across, down] = [uv, gradients[0], gradients[1]].map(|vector| Vector(vector.map(R::of)));
        Materials::<R>::texel(table, 0, uv, across, down).0.map(R::as_f64)
    }

    /// Of every pixel of a level, those by a tent as wide as two pixels around the place, wherever it repeats.
    fn expected(levels: &[Vec<u8>], level: usize, uv: [f64; 2]) -> [f64; 4] {
        let side = 256_usize >> level;
        let tent = |index: usize, place: f64| {
            let distance = (index as f64 + 0.5) / side as f64 - place;
            (1.0 - (distance - distance.round()).abs() * side as f64).max(0.0)
        };
        // A level of one pixel is its own neighbour.
        let weight = |index: usize, place: f64| if side == 1 { 1.0 } else { tent(index, place) };
        let mut sum = [0.0; 4];
        for (index, pixel) in levels[level].chunks_exact(4).enumerate() {
            let weight = weight(index % side, uv[0]) * weight(index / side, uv[1]);
            let color = |byte: u8| {
                let value = f64::from(byte) / 255.0;
                if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
            };
            for channel in 0..3 {
                sum[channel] += weight * color(pixel[channel]);
            }
            sum[3] += weight * f64::from(pixel[3]) / 255.0;
        }
        sum
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        /// In f32, the place in a level's pixels is off by u·(|uv| + 2·side), and so is each weight; a step of one pixel changes what
        /// is found by 1 at most in each direction. The level is off by 8u and a few u of its logarithm, whose logarithm is 9 at most:
        /// 20u; sums and products add 10u.
        #[test]
        fn it_is_trilinear(
            uv in prop::array::uniform2(-3.0..3.0_f32),
            longest in -2.0..10.0_f64,
            around in 0.0..6.3_f64,
            shorter in 0.0..1.0_f64,
            is_down in any::<bool>(),
        ) {
            let texture = noise(256);
            let levels = mip_chain(&texture, 256);
            let table = table(texture);
            let uv = uv.map(f64::from);
            let length = longest.exp2() / 256.0;
            let long = [around.cos() * length, around.sin() * length].map(|value| f64::from(value as f32));
            let mut gradients = [long, [shorter * long[1], -shorter * long[0]].map(|value| f64::from(value as f32))];
            if is_down {
                gradients.swap(0, 1);
            }
            let level = (long[0].hypot(long[1]) * 256.0).log2().clamp(0.0, 8.0);
            let [finer, coarser] = [level.floor(), level.ceil()].map(|level| expected(&levels, level as usize, uv));
            let double = texel::<f64>(&table, uv, gradients);
            let single = texel::<f32>(&table, uv, gradients);
            for channel in 0..4 {
                let between = finer[channel] + (coarser[channel] - finer[channel]) * level.fract();
                prop_assert!((double[channel] - between).abs() < 1e-9, "{level} {double:?} {between}");
                let bound = UNIT * (2.0 * (3.0 * 256.0 + 2.0 * 256.0) + 30.0);
                prop_assert!((single[channel] - double[channel]).abs() <= bound, "{single:?} {double:?}");
            }
        }
    }

    #[test]
    fn the_middle_of_a_pixel_is_that_pixel() {
        let texture = noise(256);
        let table = table(texture.clone());
        let pixels: Vec<_> = texture.pixels().chunks_exact(4).collect();
        for [x, y] in [[0, 0], [255, 0], [17, 200], [255, 255]] {
            let uv = [x, y].map(|place| (place as f64 + 0.5) / 256.0 - 2.0);
            let found = texel::<f64>(&table, uv, [[0.0; 2]; 2]);
            let [red, .., alpha] = pixels[y * 256 + x] else { unreachable!() };
            assert_eq!([found[0], found[3]], [table.light[usize::from(*red)], f64::from(*alpha) / 255.0]);
        }
    }

    #[test]
    fn what_is_no_number_finds_a_colour_all_the_same() {
        let table = table(noise(8));
        for strange in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e38, -1e38, -1e-30] {
            for [uv, across] in [[[strange, 0.3], [0.0; 2]], [[0.3, 0.3], [strange, 0.1]]] {
                let found =
                    [texel::<f32>(&table, uv, [across, [0.0; 2]]), texel::<f64>(&table, uv, [across, [0.0; 2]])];
                assert!(found.iter().flatten().all(|value| (0.0..=1.0).contains(value)), "{strange} {found:?}");
            }
        }
    }

    #[test]
    fn only_what_changed_is_made_again() {
        let mut assets = Assets::default();
        let textures = [10, 20].map(|side| assets.add(noise(side)).unwrap());
        let materials =
            textures.map(|texture| assets.add(Material { texture: Some(texture), ..Material::default() }).unwrap());
        let mut cache = MaterialCache::default();
        let chains = |table: &MaterialTable| {
            [0, 1].map(|slot: usize| table.slots[slot].as_ref().and_then(|entry| entry.chain.as_ref().map(Arc::as_ptr)))
        };
        let first = cache.update(&assets, &Rejections::default());
        assert!(Arc::ptr_eq(&first, &cache.update(&assets, &Rejections::default())));

        assets.replace(textures[1], noise(30)).unwrap();
        let second = cache.update(&assets, &Rejections::default());
        assert_eq!(chains(&second)[0], chains(&first)[0]);
        assert_ne!(chains(&second)[1], chains(&first)[1]);

        let plain = Material { diffuse: Vec3::new(1.0, 0.5, 0.25), double_sided: true, ..Material::default() };
        assets.replace(materials[0], plain).unwrap();
        let third = cache.update(&assets, &Rejections::default());
        assert_eq!([chains(&third)[0], chains(&third)[1]], [None, chains(&second)[1]]);
        let values: MaterialValues<f32> = third.get(0);
        assert!(values.double_sided && values.diffuse == Vector([1.0, 0.5, 0.25]) && values.opacity == 1.0);
        assert_eq!(texel::<f32>(&third, [0.1, 0.2], [[0.0; 2]; 2]), [1.0; 4]);
        assert!(chains(&first)[0].is_some(), "a frame keeps what it began with");

        let other = Assets::default();
        assert!(cache.update(&other, &Rejections::default()).slots.is_empty());
        let free: MaterialValues<f32> = cache.update(&other, &Rejections::default()).get(7);
        assert_eq!(free.opacity, 0.0);
    }

    #[test]
    fn a_removed_texture_is_counted_in_every_frame_and_white() {
        let mut assets = Assets::default();
        let texture = assets.add(noise(4)).unwrap();
        assets.add(Material::default()).unwrap();
        assets.add(Material { texture: Some(texture), ..Material::default() }).unwrap();
        let mut cache = MaterialCache::default();
        let mut rejected = |assets: &Assets| {
            let rejections = Rejections::default();
            let table = cache.update(assets, &rejections);
            let counts: Vec<_> = rejections
                .list()
                .iter()
                .map(|rejection| (rejection.reason, rejection.count, rejection.first))
                .collect();
            (counts, Materials::<f32>::texel(&*table, 1, Vector::zero(), Vector::zero(), Vector::zero()))
        };
        assert!(rejected(&assets).0.is_empty());
        assets.remove(texture).unwrap();
        for _ in 0..2 {
            let (counts, color) = rejected(&assets);
            assert_eq!(counts, [(RejectionReason::StaleTexture, 1, 1)]);
            assert_eq!(color, Vector::splat(1.0));
        }
    }
}
