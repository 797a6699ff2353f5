//! The draw states of meshes and materials, in small tables: which of them can be drawn, and which meshes objects have.

use glam::Vec3;

use super::{GpuObject, TextureSets};
use crate::bit_set::{BITS_PER_WORD, BitWord};
use crate::command::{Cull, DrawState, Selection};
use crate::handle::Handle;
use crate::scene::{Assets, Material, MaterialLayout, MaterialValues, Mesh, SceneRef, Topology};

/// What meshes and materials add to the draw states of objects, by slot. An object's two entries lie in two cache
/// lines; the assets themselves are much larger.
#[derive(Debug, Default)]
pub(super) struct DrawStates {
    /// The meshes and materials that the tables are of; `None` before the first update.
    version: Option<AssetVersion>,
    meshes: Vec<Option<MeshEntry>>,
    materials: Vec<Option<MaterialEntry>>,
    /// The type of each material, by slot; empty if none has one.
    types: Vec<Option<MaterialLayout>>,
    /// Each type once.
    layouts: Vec<MaterialLayout>,
    /// Counts how often `types` changed.
    types_revision: u64,
    texture_sets: TextureSets,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct MeshEntry {
    mesh: Handle<Mesh>,
    topology: Topology,
    revision: u64,
    is_drawable: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct MaterialEntry {
    material: Handle<Material>,
    /// Those of objects with triangle lists, unmirrored and mirrored.
    states: [DrawState; 2],
    /// Whether the arrays of materials reach to it.
    is_in_arrays: bool,
}

/// The meshes and materials of a scene at one time: of each the identity of the collection, and its revision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct AssetVersion {
    meshes: (u64, u64),
    materials: (u64, u64),
    /// Counts the handles whose meshes and materials were loaded after they were made.
    arrivals: u64,
    /// That of the limits.
    limits: u64,
    /// That of the texture sets.
    texture_sets: u64,
}

impl DrawStates {
    /// Updates the tables from the assets. Returns whether a mesh or material changed, or was removed, that was there
    /// before, or was loaded after its handle was made: no object can have been described with another one that is new.
    pub(super) fn update(&mut self, assets: &Assets, limits: &TableLimits<'_>) -> bool {
        let Assets { meshes, materials, .. } = assets;
        self.texture_sets.update(assets, limits.texture_layers);
        let version = AssetVersion {
            meshes: (meshes.identity(), meshes.revision()),
            materials: (materials.identity(), materials.revision()),
            arrivals: meshes.arrivals() + materials.arrivals(),
            limits: limits.revision,
            texture_sets: self.texture_sets.revision(),
        };
        if self.version == Some(version) {
            return false;
        }
        let before = self.version.replace(version);
        let has_arrivals = before.is_some_and(|before| before.arrivals != version.arrivals);
        let has_same_limits = before.is_some_and(|before| before.limits == version.limits);
        let mut new_meshes = vec![None; meshes.slot_count()];
        for (mesh, revision, content) in meshes.iter_with_revision() {
            let slot = mesh.index() as usize;
            let is_same = |known: &&MeshEntry| has_same_limits && (known.mesh, known.revision) == (mesh, revision);
            let known = self.meshes.get(slot).and_then(Option::as_ref).filter(is_same);
            let is_drawable = known.map_or_else(|| (limits.can_draw)(content), |known| known.is_drawable);
            new_meshes[slot] = Some(MeshEntry { mesh, topology: content.topology(), revision, is_drawable });
        }
        let mut new_materials = vec![None; materials.slot_count()];
        let mut types = Vec::new();
        for (handle, material) in materials.iter() {
            let slot = handle.index() as usize;
            let layout = material.values.as_ref().map(MaterialValues::layout);
            let is_in_arrays = limits.reach_material(slot, layout.map_or(0, |layout| layout.stride));
            let set = self.texture_sets.set_of(handle.index());
            let states = states_of(material).map(|state| state.with_texture_set(set));
            new_materials[slot] = Some(MaterialEntry { material: handle, states, is_in_arrays });
            if layout.is_some() {
                types.resize(materials.slot_count(), None);
                types[slot] = layout;
            }
        }
        self.set_types(types);
        let changed = has_changed(&self.meshes, &new_meshes) || has_changed(&self.materials, &new_materials);
        (self.meshes, self.materials) = (new_meshes, new_materials);
        changed || has_arrivals
    }

    fn set_types(&mut self, types: Vec<Option<MaterialLayout>>) {
        if types == self.types {
            return;
        }
        self.types_revision += 1;
        self.layouts.clear();
        for layout in types.iter().copied().flatten() {
            if !self.layouts.contains(&layout) {
                self.layouts.push(layout);
            }
        }
        self.types = types;
    }

    pub(super) fn texture_sets(&self) -> &TextureSets {
        &self.texture_sets
    }

    /// The type of each material, by slot; empty if none has one.
    pub(super) fn types(&self) -> &[Option<MaterialLayout>] {
        &self.types
    }

    /// The material types, each once.
    pub(super) fn layouts(&self) -> &[MaterialLayout] {
        &self.layouts
    }

    /// Counts how often the type of a material changed.
    pub(super) fn types_revision(&self) -> u64 {
        self.types_revision
    }

    /// The state of an object; `None` if a handle is stale, or the object cannot be drawn with its mesh or material.
    #[inline(always)]
    pub(super) fn get(&self, mesh: Handle<Mesh>, material: Handle<Material>, scale: Vec3) -> Option<DrawState> {
        let MeshEntry { mesh: known_mesh, topology, is_drawable, .. } = (*self.meshes.get(mesh.index() as usize)?)?;
        let MaterialEntry { material: known_material, states, is_in_arrays } =
            (*self.materials.get(material.index() as usize)?)?;
        let is_mirrored = (scale.x.to_bits() ^ scale.y.to_bits() ^ scale.z.to_bits()) >> 31 == 1;
        let [as_is, mirrored] = states;
        let state = if is_mirrored { mirrored } else { as_is };
        let is_drawn = (known_mesh == mesh) & (known_material == material) & is_drawable & is_in_arrays;
        is_drawn.then(|| state.with_topology(topology))
    }

    /// The revision of the limits that the tables are of.
    pub(super) fn limits_revision(&self) -> u64 {
        self.version.map_or(0, |version| version.limits)
    }

    /// Whether the mesh in a slot can be drawn; false for an empty slot.
    pub(super) fn is_drawable(&self, slot: usize) -> bool {
        self.meshes.get(slot).copied().flatten().is_some_and(|entry| entry.is_drawable)
    }

    /// Whether the arrays of materials reach to a slot.
    pub(super) fn has_material(&self, slot: usize) -> bool {
        self.materials.get(slot).copied().flatten().is_some_and(|entry| entry.is_in_arrays)
    }
}

/// The states of objects with triangle lists and this material, unmirrored and mirrored.
fn states_of(material: &Material) -> [DrawState; 2] {
    let culls = if material.double_sided { [Cull::Nothing; 2] } else { [Cull::Back, Cull::Front] };
    culls.map(|cull| DrawState::new(Topology::TriangleList, cull, material.blend).with_mask(material.is_masked()))
}

/// The states that selected objects with these meshes and materials may have, each once: without subdivision, at level
/// of detail 0, and not mirrored.
pub(crate) fn possible_draw_states(selection: Selection, assets: &Assets) -> Vec<DrawState> {
    let mut states = Vec::new();
    let mut topologies = [Topology::TriangleList, Topology::TriangleStrip].to_vec();
    topologies.retain(|topology| assets.meshes.iter().any(|(_, mesh)| mesh.topology() == *topology));
    for (handle, material) in assets.materials.iter() {
        let is_of_type = selection.material_types.contains(material.values.as_ref().map(MaterialValues::layout));
        if is_of_type && selection.contains(material.blend, handle.index()) {
            let [state, _] = states_of(material);
            states.extend(topologies.iter().map(|topology| state.with_topology(*topology)));
        }
    }
    states.sort_unstable();
    states.dedup();
    states
}

/// Whether an entry of `before` is not the same in `now`.
fn has_changed<T: PartialEq>(before: &[Option<T>], now: &[Option<T>]) -> bool {
    before.iter().enumerate().any(|(slot, entry)| entry.is_some() && now.get(slot) != Some(entry))
}

/// What a frame can hold of a scene's objects, and which meshes and materials they may have.
pub(crate) struct TableLimits<'a> {
    /// Objects from this index on are left out.
    pub(crate) objects: usize,
    /// The bytes of an array of materials, or of their values, that a shader can read.
    pub(crate) material_bytes: u64,
    /// The most textures in an array.
    pub(crate) texture_layers: u32,
    /// Whether a mesh can be drawn.
    pub(crate) can_draw: &'a dyn Fn(&Mesh) -> bool,
    /// Another one after `material_bytes` or `can_draw` changed.
    pub(crate) revision: u64,
}

impl TableLimits<'_> {
    /// The most objects that commands can name.
    pub(crate) const MAX_OBJECTS: usize = u32::MAX as usize;

    /// Without limits but that.
    pub(crate) const NONE: TableLimits<'static> = TableLimits {
        objects: Self::MAX_OBJECTS,
        material_bytes: u64::MAX,
        texture_layers: 256,
        can_draw: &|_| true,
        revision: 0,
    };

    /// Whether arrays reach to the material in a slot, which has `value_bytes` bytes of the engine's own values. In
    /// every backend a material takes at most as much as an object.
    pub(crate) fn reach_material(&self, slot: usize, value_bytes: usize) -> bool {
        let stride = value_bytes.max(size_of::<GpuObject>()) as u64;
        (slot as u64 + 1).checked_mul(stride).is_some_and(|end| end <= self.material_bytes)
    }
}

/// The meshes that an object of the scene has, or had in an earlier frame: what a backend uploads. A mesh that no
/// object has any more stays among them until it is removed from the assets, so that an object that comes back finds it
/// on the device.
///
/// A frame looks at the objects that changed, and at none while all meshes of the assets are used.
#[derive(Debug, Default)]
pub struct UsedMeshes {
    /// The identity and revision of the meshes, and that of the draw states; `None` before the first update.
    version: Option<(u64, u64, u64)>,
    /// By slot: each mesh of the assets that can be drawn.
    meshes: Vec<Option<Handle<Mesh>>>,
    /// By slot: whether there is a mesh that is not used. A frame in which all objects changed looks here for each of
    /// them.
    is_unused: Vec<bool>,
    /// The number of meshes that are not used.
    unused: usize,
    revision: u64,
}

impl UsedMeshes {
    /// Whether a mesh is used. None is that has been removed.
    pub fn contains(&self, mesh: Handle<Mesh>) -> bool {
        let slot = mesh.index() as usize;
        self.meshes.get(slot) == Some(&Some(mesh)) && !self.is_unused[slot]
    }

    /// Whether the mesh in a slot is used.
    #[cfg(any(feature = "occlusion", feature = "wgpu"))]
    pub(crate) fn contains_slot(&self, slot: u32) -> bool {
        let slot = slot as usize;
        self.meshes.get(slot).is_some_and(Option::is_some) && !self.is_unused[slot]
    }

    /// Whether there is a mesh in a slot that can be drawn, used or not.
    #[cfg(feature = "wgpu")]
    pub(crate) fn can_be_used(&self, slot: u32) -> bool {
        self.meshes.get(slot as usize).is_some_and(Option::is_some)
    }

    /// A counter that grows whenever a mesh becomes used.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Adds the meshes of the objects that changed. Those of the others are among the used ones already: an object that
    /// has not changed cannot have a mesh that is new.
    pub(super) fn update(
        &mut self,
        scene: &SceneRef<'_>,
        changed: impl Iterator<Item = BitWord>,
        draw_states: &DrawStates,
    ) {
        self.update_assets(scene.assets, draw_states);
        let unused_before = self.unused;
        for word in changed {
            if self.unused == 0 {
                break;
            }
            if word.mask == u64::MAX {
                let meshes = &scene.meshes[word.index() * BITS_PER_WORD..][..BITS_PER_WORD];
                meshes.iter().for_each(|mesh| self.add(*mesh));
            } else {
                word.indices().for_each(|object| self.add(scene.meshes[object]));
            }
        }
        self.revision += u64::from(self.unused < unused_before);
    }

    fn update_assets(&mut self, assets: &Assets, draw_states: &DrawStates) {
        let version = Some((assets.meshes.identity(), assets.meshes.revision(), draw_states.limits_revision()));
        if self.version == version {
            return;
        }
        let mut meshes = vec![None; assets.meshes.slot_count()];
        let mut is_unused = vec![false; assets.meshes.slot_count()];
        for (mesh, _) in assets.iter::<Mesh>() {
            let slot = mesh.index() as usize;
            if !draw_states.is_drawable(slot) {
                continue;
            }
            meshes[slot] = Some(mesh);
            is_unused[slot] = !self.contains(mesh);
        }
        self.unused = is_unused.iter().filter(|is_unused| **is_unused).count();
        (self.version, self.meshes, self.is_unused) = (version, meshes, is_unused);
    }

    #[inline(always)]
    fn add(&mut self, mesh: Handle<Mesh>) {
        let slot = mesh.index() as usize;
        if self.is_unused.get(slot) == Some(&true) && self.meshes[slot] == Some(mesh) {
            self.is_unused[slot] = false;
            self.unused -= 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Blend, MaterialType, Scene, Vertex};

    #[test]
    fn states_of_selected_materials_and_present_topologies_are_possible() {
        const GLOW: MaterialType<[f32; 4]> = MaterialType::new("glow");
        let mut scene = Scene::new();
        let add_mesh = |scene: &mut Scene, topology| {
            let mesh = Mesh::new("triangle", topology, vec![Vertex::default(); 3], vec![0, 1, 2]).unwrap();
            scene.add(mesh).unwrap();
        };
        scene.add(Material::default()).unwrap();
        scene.add(Material { double_sided: true, blend: Blend::Alpha, ..Material::default() }).unwrap();
        scene.add(Material { double_sided: true, values: Some(GLOW.values([0.0; 4])), ..Material::default() }).unwrap();
        scene.add(Material { alpha_cutoff: Some(0.5), ..Material::default() }).unwrap();
        // Blending comes before the mask.
        let blend = Blend::Alpha;
        scene.add(Material { double_sided: true, blend, alpha_cutoff: Some(0.5), ..Material::default() }).unwrap();
        let plain = (Cull::Back, Blend::None, false);
        let [blended, glowing] = [(Cull::Nothing, blend, false), (Cull::Nothing, Blend::None, false)];
        let masked = (Cull::Back, Blend::None, true);
        let state =
            |topology| move |(cull, blend, is_masked)| DrawState::new(topology, cull, blend).with_mask(is_masked);
        let (list, strip) = (state(Topology::TriangleList), state(Topology::TriangleStrip));
        let of = |scene: &Scene, selection| possible_draw_states(selection, scene.assets());
        assert_eq!(of(&scene, Selection::ALL), [], "there is no mesh");
        add_mesh(&mut scene, Topology::TriangleStrip);
        assert_eq!(of(&scene, Selection::BLENDED), [blended].map(strip));
        assert_eq!(of(&scene, Selection::OPAQUE.of_shipped_materials()), [plain, masked].map(strip));
        assert_eq!(of(&scene, Selection::OPAQUE.of_material_type(GLOW)), [glowing].map(strip));
        add_mesh(&mut scene, Topology::TriangleList);
        let mut all: Vec<_> =
            [plain, blended, glowing, masked].into_iter().flat_map(|state| [list(state), strip(state)]).collect();
        all.sort_unstable();
        assert_eq!(of(&scene, Selection::ALL), all);
    }
}
