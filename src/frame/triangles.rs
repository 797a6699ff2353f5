//! Triangles that nobody sees: left out of what a pass draws of the meshes that ask for it (S 9.6).

use parking_lot::Mutex;

use crate::queue::DrawList;
use crate::raster::CulledTriangles;
use crate::scene::{Assets, SceneRef};
use crate::view::RenderView;

/// The meshes that ask for it.
#[derive(Debug, Default)]
pub(super) struct AskingMeshes {
    /// Whose they are, and as of when.
    seen: Option<(u64, u64)>,
    /// For each slot, up to the last that asks.
    asks: Vec<bool>,
}

impl AskingMeshes {
    /// Takes in what has changed.
    pub(super) fn follow(&mut self, assets: &Assets) {
        let seen = (assets.meshes.identity(), assets.meshes.revision());
        if self.seen == Some(seen) {
            return;
        }
        self.seen = Some(seen);
        self.asks.clear();
        for (handle, ..) in assets.meshes.iter_revised().filter(|(.., mesh)| mesh.culls_triangles()) {
            self.asks.resize(handle.index() as usize, false);
            self.asks.push(true);
        }
    }

    /// Whether there are any.
    pub(super) fn any(&self) -> bool {
        !self.asks.is_empty()
    }

    /// Whether the mesh in a slot asks.
    pub(super) fn contains(&self, slot: u32) -> bool {
        self.asks.get(slot as usize).is_some_and(|asks| *asks)
    }
}

/// What a pass draws of meshes that ask.
#[derive(Debug, Default)]
pub(super) struct PassTriangles {
    /// The places of their batches in the list.
    batches: Vec<u32>,
    /// One for each; behind them there may be memory for more.
    kept: Vec<Mutex<Vec<u32>>>,
    culled: Mutex<CulledTriangles>,
}

impl PassTriangles {
    /// Finds the batches of a list that are to be looked at. Subdivided ones are not: a matrix alone does not place those.
    pub(super) fn find(&mut self, list: &DrawList, asking: &AskingMeshes) {
        self.clear();
        let is_asking = |place: &u32| {
            let batch = &list.batches[*place as usize];
            batch.state.halvings() == 0 && asking.contains(batch.mesh)
        };
        self.batches.extend((0..list.batches.len() as u32).filter(is_asking));
        if self.kept.len() < self.batches.len() {
            self.kept.resize_with(self.batches.len(), Mutex::default);
        }
    }

    /// Leaves nothing to look at, and keeps the memory.
    pub(super) fn clear(&mut self) {
        self.batches.clear();
        *self.culled.get_mut() = CulledTriangles::default();
    }

    /// How many batches are to be looked at.
    pub(super) fn len(&self) -> usize {
        self.batches.len()
    }

    /// Looks at the triangles of one of these batches, which draws one object.
    pub(super) fn look_at(&self, number: usize, view: &RenderView, scene: &SceneRef<'_>, list: &DrawList) {
        let batch = &list.batches[self.batches[number] as usize];
        let mut kept = self.kept[number].lock();
        kept.clear();
        let culled = view.cull_triangles(scene, list.objects[batch.first as usize] as usize, &mut kept);
        *self.culled.lock() += culled;
    }

    /// Puts what is left into the list.
    pub(super) fn put(&self, list: &mut DrawList) {
        for (&batch, kept) in self.batches.iter().zip(&self.kept) {
            list.keep_triangles(batch, &kept.lock());
        }
    }

    /// How many there were, and were left out.
    pub(super) fn culled(&self) -> CulledTriangles {
        *self.culled.lock()
    }
}
