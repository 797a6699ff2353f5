//! The cache of materials and their textures.

use std::array;
use std::collections::HashMap;
use std::sync::Arc;

use bytemuck::Zeroable;

use super::buffers::CountedQueue;
use super::snapshot_lifetimes::SnapshotToken;
use super::texture_arrays::{ArrayViews, ResidentTextures, TextureLocation};
use crate::backend::{BackendError, SceneLimits};
use crate::handle::Handle;
use crate::scene::{AddressMode, Assets, Filter, Material, MaterialLayout, Sampler, Texture};
use crate::view::{GpuObject, IssueReason, SceneIssues, TextureSet, TextureSets};

/// The materials of a frame, and their textures. It stays valid while they change for later frames.
#[derive(Clone)]
pub(crate) struct MaterialSnapshot {
    /// Keeps the layers of its textures from being overwritten.
    pub(crate) token: Arc<SnapshotToken>,
    /// A [`GpuMaterial`] for each slot.
    pub(crate) materials: Arc<[u8]>,
    pub(crate) textures: Arc<MaterialTextures>,
    /// The values of each material type that processes read: an element for each slot.
    pub(crate) values: Vec<(MaterialLayout, Arc<[u8]>)>,
}

impl MaterialSnapshot {
    /// The values of a type, for each slot.
    pub(crate) fn values(&self, layout: MaterialLayout) -> Option<&[u8]> {
        self.values.iter().find(|(known, _)| *known == layout).map(|(_, values)| &**values)
    }
}

/// The textures of materials, and their samplers: what `@group(1)` binds behind the materials, in that order.
pub(crate) struct MaterialTextures {
    pub(crate) sets: Vec<BoundSet>,
    /// That of targets.
    pub(crate) target_sampler: wgpu::Sampler,
}

/// The arrays of a set, each with its sampler.
pub(crate) struct BoundSet {
    pub(crate) arrays: [wgpu::TextureView; TextureSet::MAX_ARRAYS],
    pub(crate) samplers: [wgpu::Sampler; TextureSet::MAX_ARRAYS],
}

/// Keeps materials, and textures on the device. Materials are uploaded by the buffers of a frame.
#[derive(Default)]
pub(crate) struct MaterialCache {
    pub(crate) textures: ResidentTextures,
    /// By material slot, whether one of its textures is not on the device.
    pub(crate) lacks_texture: Arc<[bool]>,
    current: Option<Current>,
    /// With how often arrays had moved, or been divided into other sets.
    bound_textures: Option<(u64, Arc<MaterialTextures>)>,
    /// What sets bind. It is kept, so that the sets whose arrays stay where they are keep their bind groups.
    views: Option<ArrayViews>,
    samplers: HashMap<Sampler, wgpu::Sampler>,
    /// Scene issues that making the snapshot found. Every frame that uses the snapshot reports them.
    rejected_textures: Vec<(IssueReason, usize)>,
    rejected_materials: Vec<(IssueReason, usize)>,
}

struct Current {
    /// Identity and revision of the snapshot's materials.
    materials: (u64, u64),
    /// How often textures, their arrays and their sets had changed.
    textures: u64,
    limits: SceneLimits,
    snapshot: MaterialSnapshot,
}

impl MaterialCache {
    /// Begins a frame with the assets' textures, which are divided into these sets. Without streaming, uploads those that are new or changed.
    ///
    /// # Errors
    /// If the device has no room for a texture, or is lost. What is in the cache is undefined then, so drop it.
    pub(crate) fn begin_frame(
        &mut self,
        device: &wgpu::Device,
        uploads: &CountedQueue,
        (assets, sets): (&Assets, &TextureSets),
        is_streamed: bool,
    ) -> Result<(), BackendError> {
        self.textures.set_arrays(sets);
        if !self.textures.begin_frame(&assets.textures, (0, |_, _| true), is_streamed) {
            return Ok(());
        }
        // Its layers may be written now, unless a frame in flight has it too.
        self.current = None;
        self.rejected_textures.clear();
        if !is_streamed {
            self.textures.upload_missing(device, uploads, assets, &mut self.rejected_textures)?;
        }
        Ok(())
    }

    /// The snapshot of these materials, with the values of these types, and of the textures on the device: the latest
    /// one if nothing changed.
    pub(crate) fn snapshot(
        &mut self,
        device: &wgpu::Device,
        (assets, sets): (&Assets, &TextureSets),
        types: &[MaterialLayout],
        (limits, scene_issues): (SceneLimits, &SceneIssues),
    ) -> MaterialSnapshot {
        let materials = (assets.materials.identity(), assets.materials.revision());
        // All of them only grow, so their sum is new when one of them is.
        let textures = self.textures.changes() + self.textures.memory.moves + sets.revision();
        let before = self.current.take().filter(|current| (current.limits, current.textures) == (limits, textures));
        let mut snapshot = match before {
            Some(current) if current.materials == materials => current.snapshot,
            Some(current) => MaterialSnapshot {
                materials: self.materials(assets, sets, limits),
                values: Vec::new(),
                ..current.snapshot
            },
            None => {
                let token = self.textures.lifetimes.begin_snapshot();
                let (materials, textures) = (self.materials(assets, sets, limits), self.bound_textures(device, sets));
                MaterialSnapshot { token, materials, textures, values: Vec::new() }
            }
        };
        for layout in types {
            if snapshot.values(*layout).is_none() {
                snapshot.values.push((*layout, values_of(assets, *layout, limits)));
            }
        }
        self.current = Some(Current { materials, textures, limits, snapshot: snapshot.clone() });
        for &(reason, index) in self.rejected_textures.iter().chain(&self.rejected_materials) {
            scene_issues.count(reason, index);
        }
        snapshot
    }

    fn bound_textures(&mut self, device: &wgpu::Device, sets: &TextureSets) -> Arc<MaterialTextures> {
        let moves = self.textures.memory.moves + sets.revision();
        if let Some((_, textures)) = self.bound_textures.as_ref().filter(|(of, _)| *of == moves) {
            return Arc::clone(textures);
        }
        let (views, samplers) = (self.views.get_or_insert_with(|| ArrayViews::new(device)), &mut self.samplers);
        views.update(self.textures.arrays());
        let mut sampler_of = |sampler: Sampler| -> wgpu::Sampler {
            samplers.entry(sampler).or_insert_with(|| new_sampler(device, "textures", sampler)).clone()
        };
        let target_sampler = sampler_of(Sampler::CLAMP);
        let mut bound = |set: &TextureSet| {
            let array = |position: usize| set.arrays().get(position).map(|array| *array as usize);
            let view = |position| views.of_array(array(position)).clone();
            let mut sampler = |position| {
                sampler_of(array(position).map_or(Sampler::REPEAT, |array| sets.arrays()[array].class.sampler))
            };
            BoundSet { arrays: array::from_fn(view), samplers: array::from_fn(&mut sampler) }
        };
        let textures =
            Arc::new(MaterialTextures { sets: sets.sets().iter().map(&mut bound).collect(), target_sampler });
        self.bound_textures = Some((moves, Arc::clone(&textures)));
        textures
    }

    /// A [`GpuMaterial`] for each slot within the limits.
    fn materials(&mut self, assets: &Assets, sets: &TextureSets, limits: SceneLimits) -> Arc<[u8]> {
        self.rejected_materials.clear();
        let mut materials = vec![GpuMaterial::zeroed(); element_count(assets, size_of::<GpuMaterial>(), limits)];
        let mut lacks_texture = vec![false; assets.materials.slot_count()];
        for (handle, material) in assets.iter::<Material>() {
            let set = sets.sets().get(sets.set_of(handle.index()) as usize);
            let mut on_device = GpuMaterial::new(material);
            for (place, texture) in material.all_textures() {
                let Some(location) = self.texture_location(assets, handle.index(), texture) else {
                    lacks_texture[handle.index() as usize] |= assets.get(texture).is_ok();
                    continue;
                };
                if let Some(position) = set.and_then(|set| set.position(location.array)) {
                    on_device.textures[place] = (position as u32) << 24 | location.layer;
                }
            }
            if let Some(slot) = materials.get_mut(handle.index() as usize) {
                *slot = on_device;
            }
        }
        self.lacks_texture = lacks_texture.into();
        bytemuck::cast_slice(&materials).into()
    }

    fn texture_location(&mut self, assets: &Assets, slot: u32, texture: Handle<Texture>) -> Option<TextureLocation> {
        if assets.get(texture).is_err() {
            let is_pending = assets.is_pending(texture);
            let reason = if is_pending { IssueReason::TextureNotResident } else { IssueReason::StaleTexture };
            self.rejected_materials.push((reason, slot as usize));
            return None;
        }
        self.textures.location(texture.index())
    }
}

/// The values of a type, for each slot within the limits; all zeros for materials of another type.
fn values_of(assets: &Assets, layout: MaterialLayout, limits: SceneLimits) -> Arc<[u8]> {
    let count = element_count(assets, layout.stride, limits);
    let mut bytes = vec![0; count * layout.stride];
    for (handle, material) in assets.iter::<Material>().filter(|(handle, _)| (handle.index() as usize) < count) {
        if let Some(values) = material.values.as_ref().filter(|values| values.layout() == layout) {
            bytes[handle.index() as usize * layout.stride..][..layout.stride].copy_from_slice(values.bytes());
        }
    }
    bytes.into()
}

/// How many elements of `stride` bytes an array has that has one for each slot of the materials, within the limits. No
/// object is drawn with a material that is beyond them.
fn element_count(assets: &Assets, stride: usize, limits: SceneLimits) -> usize {
    let allowed = usize::try_from(limits.binding_bytes / stride.max(1) as u64).unwrap_or(usize::MAX);
    assets.materials.slot_count().min(allowed).max(1)
}

fn new_sampler(device: &wgpu::Device, label: &str, sampler: Sampler) -> wgpu::Sampler {
    let [address_mode_u, address_mode_v] = sampler.address_modes.map(|mode| match mode {
        AddressMode::Repeat => wgpu::AddressMode::Repeat,
        AddressMode::Mirror => wgpu::AddressMode::MirrorRepeat,
        AddressMode::Clamp => wgpu::AddressMode::ClampToEdge,
    });
    let filter = |filter| match filter {
        Filter::Nearest => wgpu::FilterMode::Nearest,
        Filter::Linear => wgpu::FilterMode::Linear,
    };
    device.create_sampler(&wgpu::SamplerDescriptor {
        label: Some(label),
        address_mode_u,
        address_mode_v,
        mag_filter: filter(sampler.mag_filter),
        min_filter: filter(sampler.min_filter),
        mipmap_filter: match sampler.mip_filter {
            Some(Filter::Linear) => wgpu::MipmapFilterMode::Linear,
            Some(Filter::Nearest) | None => wgpu::MipmapFilterMode::Nearest,
        },
        // A quarter of a level, so that a device tells what is reduced from what is magnified (Vulkan,
        // `VkSamplerCreateInfo`).
        lod_max_clamp: if sampler.mip_filter.is_some() {
            wgpu::SamplerDescriptor::default().lod_max_clamp
        } else {
            0.25
        },
        anisotropy_clamp: sampler.effective_anisotropy(),
        ..wgpu::SamplerDescriptor::default()
    })
}

/// A material as shaders read it: `Material` in `drawloom.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct GpuMaterial {
    diffuse: [f32; 3],
    opacity: f32,
    emission: [f32; 3],
    alpha_cutoff: f32,
    double_sided: u32,
    blend: u32,
    /// By place: the array's position in the set in the upper 8 bits, and the layer in the others; [`NO_TEXTURE`] for
    /// none.
    textures: [u32; Material::MAX_TEXTURES],
}

// Limits of materials count on it.
const _: () = assert!(size_of::<GpuMaterial>() <= size_of::<GpuObject>());

const NO_TEXTURE: u32 = u32::MAX;

impl GpuMaterial {
    /// Without its textures.
    fn new(material: &Material) -> Self {
        Self {
            diffuse: material.diffuse.to_array(),
            opacity: material.opacity,
            emission: material.emission.to_array(),
            alpha_cutoff: material.min_alpha(),
            double_sided: u32::from(material.double_sided),
            blend: material.blend as u32,
            textures: [NO_TEXTURE; Material::MAX_TEXTURES],
        }
    }
}
