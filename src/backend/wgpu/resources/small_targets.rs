//! Small targets that many views keep, as the layers of few textures.

use std::collections::{HashMap, HashSet};

use super::target_texture::{TextureKind, new_texture};
use crate::backend::BackendError;
use crate::process::{FramePlan, PlannedTarget};

/// Textures whose layers are targets of different views. Each encoder and bundle of wgpu-core holds some bytes for
/// every texture of the device, so with a texture for each of thousands of views, memory would grow with the square of
/// their number.
#[derive(Clone, Default)]
pub(super) struct SmallTargets {
    textures: Vec<(TextureKind, wgpu::Texture)>,
}

/// A target that wants to be a layer.
pub(super) struct SmallTarget {
    pub(super) kind: TextureKind,
    /// The texture and the layer that the view has had before.
    pub(super) kept: Option<(wgpu::Texture, u32)>,
}

impl SmallTargets {
    /// The most pixels of a small target. Larger ones cost more themselves than what wgpu-core holds for them.
    const MAX_PIXELS: u64 = 64 * 64;

    /// The most layers of a texture, all of which stay as long as one is in use.
    const MAX_LAYERS: usize = 64;

    /// Whether a target of this kind can be a layer. A raw pass may use a whole texture.
    pub(super) fn accepts(plan: &FramePlan, planned: &PlannedTarget, kind: TextureKind) -> bool {
        let [width, height] = kind.size.map(u64::from);
        width * height <= Self::MAX_PIXELS
            && !(planned.layered || planned.multisampled || planned.mipmapped || planned.copy_of.is_some())
            && !plan.has_raw_access(planned)
    }

    /// A texture and a layer for each of these targets, in their order, with the textures of the frame before as far as
    /// possible.
    ///
    /// # Errors
    /// If the device cannot have a texture.
    pub(super) fn assign(
        &self,
        device: &wgpu::Device,
        wanted: &[SmallTarget],
    ) -> Result<(Self, Vec<(wgpu::Texture, u32)>), BackendError> {
        let mut textures = self.textures.clone();
        let mut taken = HashSet::new();
        let mut positions: Vec<Option<(usize, u32)>> = Vec::with_capacity(wanted.len());
        let mut missing: HashMap<TextureKind, usize> = HashMap::new();
        for SmallTarget { kind, kept } in wanted {
            let index_of = |wanted: &wgpu::Texture| self.textures.iter().position(|(_, texture)| texture == wanted);
            let kept = kept.as_ref().and_then(|(texture, layer)| Some((index_of(texture)?, *layer)));
            let kept = kept.filter(|(texture, _)| textures[*texture].0 == *kind).filter(|kept| taken.insert(*kept));
            if kept.is_none() {
                *missing.entry(*kind).or_default() += 1;
            }
            positions.push(kept);
        }

        let mut free: HashMap<TextureKind, Vec<(usize, u32)>> = HashMap::new();
        let layers_of = |index: usize, texture: &wgpu::Texture| {
            (0..texture.depth_or_array_layers()).rev().map(move |layer| (index, layer))
        };
        for (index, (kind, texture)) in textures.iter().enumerate().filter(|(_, (kind, _))| missing.contains_key(kind))
        {
            let free = free.entry(*kind).or_default();
            free.extend(layers_of(index, texture).filter(|position| !taken.contains(position)));
        }
        for (SmallTarget { kind, .. }, position) in
            wanted.iter().zip(&mut positions).filter(|(_, position)| position.is_none())
        {
            let (free, missing) = (free.entry(*kind).or_default(), missing.entry(*kind).or_default());
            if free.is_empty() {
                // At least doubles the layers, so that views that come one at a time share few textures.
                let of_kind = self.textures.iter().filter(|(other, _)| other == kind);
                let layers: usize = of_kind.map(|(_, texture)| texture.depth_or_array_layers() as usize).sum();
                let layers = layers.max(*missing).min(Self::MAX_LAYERS) as u32;
                let texture = new_texture(device, "small targets", *kind, layers)?;
                free.extend(layers_of(textures.len(), &texture));
                textures.push((*kind, texture));
            }
            *missing -= 1;
            *position = free.pop();
            taken.extend(*position);
        }

        let of_position = |(texture, layer): (usize, u32)| (textures[texture].1.clone(), layer);
        let assigned = positions.into_iter().flatten().map(of_position).collect();
        let used: HashSet<usize> = taken.into_iter().map(|(texture, _)| texture).collect();
        let used = textures.iter().enumerate().filter(|(index, _)| used.contains(index));
        let textures = used.map(|(_, texture)| texture.clone()).collect();
        Ok((Self { textures }, assigned))
    }

    /// The textures, each with its kind.
    pub(super) fn textures(&self) -> impl Iterator<Item = &(TextureKind, wgpu::Texture)> {
        self.textures.iter()
    }
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;

    use super::*;
    use crate::backend::wgpu::noop_device::noop_device;
    use crate::process::Format;

    fn kind(format: Format, size: [u32; 2]) -> TextureKind {
        TextureKind { format, multisampled: false, stored: false, mipmapped: false, size }
    }

    #[test]
    #[expect(clippy::mutable_key_type, reason = "textures are equal if they are the same")]
    fn each_target_has_a_layer_of_its_own_and_keeps_it() {
        let (device, _) = noop_device();
        let kind =
            |index: usize| kind([Format::Rgba8Srgb, Format::Depth32Float][index % 2], [[8, 8], [16, 8]][index / 2]);
        for seed in 0..40 {
            let mut random = Rng::with_seed(seed);
            let mut small = SmallTargets::default();
            let mut known: HashMap<usize, (TextureKind, (wgpu::Texture, u32))> = HashMap::new();
            for _ in 0..12 {
                let share = random.usize(1..10);
                let mut names: Vec<_> = (0..200).filter(|_| random.usize(0..10) < share).collect();
                random.shuffle(&mut names);
                // Some change their kind.
                let kinds: Vec<_> = names
                    .iter()
                    .map(|name| kind(if random.usize(0..20) == 0 { random.usize(0..4) } else { name % 4 }))
                    .collect();
                let wanted: Vec<_> = names
                    .iter()
                    .zip(&kinds)
                    .map(|(name, kind)| SmallTarget {
                        kind: *kind,
                        kept: known.get(name).map(|(_, kept)| kept.clone()),
                    })
                    .collect();
                let (next, assigned) = small.assign(&device, &wanted).unwrap();
                assert_eq!(assigned.len(), wanted.len());
                assert_eq!(assigned.iter().collect::<HashSet<_>>().len(), wanted.len(), "two targets have one layer");
                for ((name, kind), (texture, layer)) in names.iter().zip(&kinds).zip(&assigned) {
                    let found = next.textures().find(|(_, known)| known == texture).unwrap();
                    assert_eq!(found.0, *kind);
                    assert!(*layer < texture.depth_or_array_layers());
                    if let Some((_, kept)) = known.get(name).filter(|(before, _)| before == kind) {
                        assert_eq!(kept, &(texture.clone(), *layer), "a target has moved");
                    }
                }
                let used: HashSet<_> = assigned.iter().map(|(texture, _)| texture).collect();
                assert_eq!(used.len(), next.textures().count(), "a texture is not used");
                known = names.into_iter().zip(kinds.into_iter().zip(assigned)).collect();
                small = next;
            }
        }
    }

    #[test]
    fn layers_are_used_again_before_there_are_more_textures() {
        let (device, _) = noop_device();
        let kind = kind(Format::Rgba8Srgb, [8, 8]);
        let new = |count: usize| (0..count).map(|_| SmallTarget { kind, kept: None }).collect::<Vec<_>>();
        let (all, assigned) = SmallTargets::default().assign(&device, &new(130)).unwrap();
        let layers: Vec<_> = all.textures().map(|(_, texture)| texture.depth_or_array_layers()).collect();
        assert_eq!(layers, [64, 64, 2]);
        let kept = assigned.into_iter().step_by(2).map(|kept| SmallTarget { kind, kept: Some(kept) });
        let (again, _) = all.assign(&device, &kept.chain(new(65)).collect::<Vec<_>>()).unwrap();
        assert_eq!(again.textures().count(), 3);
    }

    #[test]
    fn targets_that_come_one_at_a_time_share_textures() {
        let (device, _) = noop_device();
        let kind = kind(Format::Rgba8Srgb, [8, 8]);
        let (mut small, mut kept) = (SmallTargets::default(), Vec::new());
        for _ in 0..300 {
            let known = kept.drain(..).map(Some).chain([None]);
            let wanted: Vec<_> = known.map(|kept| SmallTarget { kind, kept }).collect();
            (small, kept) = small.assign(&device, &wanted).unwrap();
        }
        // 1, 1, 2, 4, 8, 16 and 32 layers, then 64 at a time.
        assert_eq!(small.textures().count(), 7 + 4);
    }
}
