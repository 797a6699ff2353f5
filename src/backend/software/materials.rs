//! Materials and their textures, kept over frames.

use std::sync::Arc;

use glam::Vec3;

use super::mip_chain::MipChain;
use crate::process::{Materials, ShaderMaterial};
use crate::raster::{Real, Vector, Vector2, Vector3, Vector4};
use crate::scene::{Assets, Blend, Material, MaterialValues};
use crate::view::{IssueReason, SceneIssues};

/// Keeps the materials of the last frame, and the mip chains of their textures.
#[derive(Default)]
pub(super) struct MaterialCache {
    /// By texture slot: its revision and its mip chain.
    chains: Vec<Option<(u64, Arc<MipChain>)>>,
    /// The identity of the collection that the textures are of.
    identity: u64,
    /// Identities and revisions of the materials and textures in the table.
    current: Option<[(u64, u64); 2]>,
    table: Arc<MaterialTable>,
    /// What every frame reports: the materials whose texture was removed or is yet to arrive, and the textures that are
    /// compressed.
    rejected: Vec<(IssueReason, usize)>,
}

impl MaterialCache {
    /// The materials of these assets. Mip chains are built only for textures that a material uses and that changed
    /// since the last frame; if nothing changed, the same table is returned.
    pub(super) fn update(&mut self, assets: &Assets, scene_issues: &SceneIssues) -> Arc<MaterialTable> {
        let wanted = [
            (assets.materials.identity(), assets.materials.revision()),
            (assets.textures.identity(), assets.textures.revision()),
        ];
        if self.current != Some(wanted) {
            self.rebuild(assets);
            self.current = Some(wanted);
        }
        for &(reason, slot) in &self.rejected {
            scene_issues.count(reason, slot);
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
            let revision = assets.textures.get_with_revision(slot).map(|(revision, _)| revision);
            chain.take_if(|(kept, _)| Some(*kept) != revision);
        }
        self.rejected.clear();
        let compressed = assets.textures.iter().filter(|(_, texture)| texture.class().format.is_compressed());
        let compressed = compressed.map(|(handle, _)| (IssueReason::TextureLimit, handle.index() as usize));
        self.rejected.extend(compressed);
        let mut slots = vec![None; assets.materials.slot_count()];
        for (handle, material) in assets.iter::<Material>() {
            let slot = handle.index() as usize;
            let mut chains = [const { None }; Material::MAX_TEXTURES];
            for (place, texture) in material.all_textures() {
                if assets.get(texture).is_err() {
                    let is_pending = assets.is_pending(texture);
                    let reason = if is_pending { IssueReason::TextureNotResident } else { IssueReason::StaleTexture };
                    self.rejected.push((reason, slot));
                } else {
                    chains[place] = self.chain(assets, texture.index());
                }
            }
            slots[slot] = Some(TableEntry::new(material, chains));
        }
        self.table = Arc::new(MaterialTable { slots });
    }

    fn chain(&mut self, assets: &Assets, slot: u32) -> Option<Arc<MipChain>> {
        let (revision, texture) = assets.textures.get_with_revision(slot)?;
        let known = self.chains.get_mut(slot as usize)?;
        if known.is_none() {
            *known = MipChain::of(texture).map(|chain| (revision, Arc::new(chain)));
        }
        known.as_ref().map(|(_, chain)| Arc::clone(chain))
    }
}

/// The materials of a frame. It stays valid while assets change for later frames.
#[derive(Default)]
pub(super) struct MaterialTable {
    /// By material slot.
    slots: Vec<Option<TableEntry>>,
}

#[derive(Clone)]
struct TableEntry {
    diffuse: Vec3,
    opacity: f32,
    alpha_cutoff: f32,
    emission: Vec3,
    double_sided: bool,
    blend: Blend,
    values: Option<MaterialValues>,
    /// By place.
    chains: [Option<Arc<MipChain>>; Material::MAX_TEXTURES],
}

impl TableEntry {
    fn new(material: &Material, chains: [Option<Arc<MipChain>>; Material::MAX_TEXTURES]) -> Self {
        let Material { diffuse, opacity, emission, double_sided, blend, .. } = *material;
        let (alpha_cutoff, values) = (material.min_alpha(), material.values.clone());
        Self { diffuse, opacity, alpha_cutoff, emission, double_sided, blend, values, chains }
    }
}

impl<R: Real> Materials<R> for MaterialTable {
    /// Black if the slot is free: an object that refers to it is not drawn.
    fn get(&self, slot: u32) -> ShaderMaterial<R> {
        let Some(Some(entry)) = self.slots.get(slot as usize) else {
            let (black, zero) = (Vector3::zero(), R::zero());
            let (diffuse, emission, opacity, alpha_cutoff) = (black, black, zero, zero);
            let (double_sided, blend) = (false, Blend::None);
            return ShaderMaterial { diffuse, opacity, alpha_cutoff, emission, double_sided, blend };
        };
        ShaderMaterial {
            diffuse: Vector3::of_single(entry.diffuse),
            opacity: R::of(f64::from(entry.opacity)),
            alpha_cutoff: R::of(f64::from(entry.alpha_cutoff)),
            emission: Vector3::of_single(entry.emission),
            double_sided: entry.double_sided,
            blend: entry.blend,
        }
    }

    fn values(&self, slot: u32) -> Option<&MaterialValues> {
        self.slots.get(slot as usize)?.as_ref()?.values.as_ref()
    }

    fn texture_at(&self, slot: u32, place: usize, uv: Vector2<R>, [dpdx, dpdy]: [Vector2<R>; 2]) -> Vector4<R> {
        let entry = self.slots.get(slot as usize).and_then(Option::as_ref);
        match entry.and_then(|entry| entry.chains.get(place)?.as_ref()) {
            Some(chain) => chain.sample(uv, dpdx, dpdy),
            None => Vector::splat(R::one()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::backend::software::mip_chain::tests::noise;

    fn texel(table: &MaterialTable, uv: [f32; 2]) -> [f32; 4] {
        Materials::<f32>::texture_at(table, 0, 0, Vector(uv), [Vector::zero(); 2]).0
    }

    #[test]
    fn only_what_changed_is_made_again() {
        let mut assets = Assets::default();
        let textures = [10, 20].map(|side| assets.add(noise(side)).unwrap());
        let materials =
            textures.map(|texture| assets.add(Material { texture: Some(texture), ..Material::default() }).unwrap());
        let mut cache = MaterialCache::default();
        let chains = |table: &MaterialTable| {
            [0, 1].map(|slot: usize| {
                table.slots[slot].as_ref().and_then(|entry| entry.chains[0].as_ref().map(Arc::as_ptr))
            })
        };
        let first = cache.update(&assets, &SceneIssues::default());
        assert!(Arc::ptr_eq(&first, &cache.update(&assets, &SceneIssues::default())));

        assets.replace(textures[1], noise(30)).unwrap();
        let second = cache.update(&assets, &SceneIssues::default());
        assert_eq!(chains(&second)[0], chains(&first)[0]);
        assert_ne!(chains(&second)[1], chains(&first)[1]);

        let plain = Material { diffuse: Vec3::new(1.0, 0.5, 0.25), double_sided: true, ..Material::default() };
        assets.replace(materials[0], plain).unwrap();
        let third = cache.update(&assets, &SceneIssues::default());
        assert_eq!([chains(&third)[0], chains(&third)[1]], [None, chains(&second)[1]]);
        let values: ShaderMaterial<f32> = third.get(0);
        assert!(values.double_sided && values.diffuse == Vector([1.0, 0.5, 0.25]) && values.opacity == 1.0);
        assert_eq!(texel(&third, [0.1, 0.2]), [1.0; 4]);
        assert!(chains(&first)[0].is_some(), "a frame keeps what it began with");

        let other = Assets::default();
        assert!(cache.update(&other, &SceneIssues::default()).slots.is_empty());
        let free: ShaderMaterial<f32> = cache.update(&other, &SceneIssues::default()).get(7);
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
            let scene_issues = SceneIssues::default();
            let table = cache.update(assets, &scene_issues);
            let counts: Vec<_> =
                scene_issues.list().iter().map(|issue| (issue.reason, issue.count, issue.first)).collect();
            (counts, Materials::<f32>::texture_at(&*table, 1, 0, Vector::zero(), [Vector::zero(); 2]))
        };
        assert!(rejected(&assets).0.is_empty());
        assets.remove(texture).unwrap();
        for _ in 0..2 {
            let (counts, color) = rejected(&assets);
            assert_eq!(counts, [(IssueReason::StaleTexture, 1, 1)]);
            assert_eq!(color, Vector::splat(1.0));
        }
    }
}
