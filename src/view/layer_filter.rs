//! Which objects a process draws by their layers.

use super::set_bits;
use crate::command::Selection;
use crate::scene::{LayerMask, SceneRef};

/// Which objects a process draws by their layers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayerFilter<'a> {
    /// Of each object; empty if all have the same answer.
    layers: &'a [LayerMask],
    drawn: LayerMask,
    excluded: LayerMask,
}

impl<'a> LayerFilter<'a> {
    pub(crate) fn new(scene: &SceneRef<'a>, selection: Selection) -> Self {
        let (drawn, excluded) = (selection.layers, selection.excluded_layers);
        let is_of_all = drawn == LayerMask::ALL && excluded == LayerMask::NONE;
        Self { layers: if is_of_all { &[] } else { scene.layers }, drawn, excluded }
    }

    /// Whether it lets all objects pass.
    pub(crate) fn passes_all(&self) -> bool {
        self.layers.is_empty() && self.passes_every_layer()
    }

    /// Whether it lets an object pass.
    #[inline]
    pub(crate) fn passes(&self, object: usize) -> bool {
        match self.layers.get(object) {
            Some(layers) => {
                let is_drawn = self.drawn == LayerMask::ALL || layers.intersects(self.drawn);
                let is_excluded = self.excluded == LayerMask::ALL || layers.intersects(self.excluded);
                is_drawn && !is_excluded
            }
            None => self.passes_every_layer(),
        }
    }

    /// Whether it lets objects that belong to all layers pass.
    fn passes_every_layer(&self) -> bool {
        self.drawn != LayerMask::NONE && self.excluded == LayerMask::NONE
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
