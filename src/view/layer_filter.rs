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
}

impl<'a> LayerFilter<'a> {
    pub(crate) fn new(scene: &SceneRef<'a>, selection: Selection) -> Self {
        let drawn = selection.layers;
        Self { layers: if drawn == LayerMask::ALL { &[] } else { scene.layers }, drawn }
    }

    /// Whether it lets all objects pass.
    pub(crate) fn passes_all(&self) -> bool {
        self.layers.is_empty() && self.drawn != LayerMask::NONE
    }

    /// Whether it lets an object pass.
    #[inline]
    pub(crate) fn passes(&self, object: usize) -> bool {
        match self.layers.get(object) {
            Some(layers) => layers.intersects(self.drawn),
            None => self.drawn != LayerMask::NONE,
        }
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
