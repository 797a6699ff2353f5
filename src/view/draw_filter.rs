//! Which objects a process draws by their layers and material types.

use super::ObjectTable;
use crate::bit_set::set_bits;
use crate::command::{MaterialTypes, Selection};
use crate::handle::Handle;
use crate::scene::{LayerMask, Material, MaterialLayout, SceneRef};

/// Which objects a process draws by their layers and material types.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DrawFilter<'a> {
    /// Of each object; empty if all have the same answer.
    layers: &'a [LayerMask],
    drawn: LayerMask,
    excluded: LayerMask,
    visible: LayerMask,
    /// Of each object.
    materials: &'a [Handle<Material>],
    /// Of each material, by slot; empty if all have the same answer.
    types: &'a [Option<MaterialLayout>],
    drawn_types: MaterialTypes,
}

impl<'a> DrawFilter<'a> {
    pub(crate) fn new(table: &'a ObjectTable, scene: &SceneRef<'a>, selection: Selection) -> Self {
        let (drawn, excluded, visible) = (selection.layers, selection.excluded_layers, selection.visible_layers);
        let is_of_all = (drawn, excluded, visible) == (LayerMask::ALL, LayerMask::NONE, LayerMask::ALL);
        let drawn_types = selection.material_types;
        Self {
            layers: if is_of_all { &[] } else { scene.layers },
            drawn,
            excluded,
            visible,
            materials: scene.materials,
            types: if drawn_types == MaterialTypes::Any { &[] } else { table.material_type_of_slots() },
            drawn_types,
        }
    }

    /// Whether it lets all objects pass.
    pub(crate) fn passes_all(&self) -> bool {
        self.ignores_layers() && self.types.is_empty() && self.drawn_types.contains(None)
    }

    /// Whether layers do not decide.
    pub(crate) fn ignores_layers(&self) -> bool {
        self.layers.is_empty() && self.passes_object_in_all_layers()
    }

    /// Whether it lets an object pass.
    #[inline]
    pub(crate) fn passes(&self, object: usize) -> bool {
        self.passes_layers(object) && self.passes_type(object)
    }

    #[inline]
    fn passes_layers(&self, object: usize) -> bool {
        match self.layers.get(object) {
            Some(layers) => {
                let is_drawn = self.drawn == LayerMask::ALL || layers.intersects(self.drawn);
                let is_excluded = self.excluded == LayerMask::ALL || layers.intersects(self.excluded);
                let is_visible = self.visible == LayerMask::ALL || layers.intersects(self.visible);
                is_drawn && is_visible && !is_excluded
            }
            None => self.passes_object_in_all_layers(),
        }
    }

    #[inline]
    fn passes_type(&self, object: usize) -> bool {
        if self.types.is_empty() {
            return self.drawn_types.contains(None);
        }
        let material = self.materials[object].index() as usize;
        self.drawn_types.contains(self.types.get(material).copied().flatten())
    }

    /// Whether it lets an object that belongs to all layers pass.
    fn passes_object_in_all_layers(&self) -> bool {
        self.drawn != LayerMask::NONE && self.visible != LayerMask::NONE && self.excluded == LayerMask::NONE
    }

    /// Those of up to 64 objects that pass: bit 0 is object `first`.
    #[inline]
    pub(super) fn pass(&self, first: usize, objects: u64) -> u64 {
        if self.passes_all() {
            return objects;
        }
        set_bits(objects).filter(|bit| self.passes(first + bit)).fold(0, |passed, bit| passed | 1 << bit)
    }
}
