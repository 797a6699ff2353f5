//! Triangles that nobody sees: left out of what a pass draws of the meshes that ask for it (S 9.6).

use std::ops::Range;

use parking_lot::Mutex;

use crate::command::DrawList;
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
        for (handle, ..) in assets.meshes.iter_with_revision().filter(|(.., mesh)| mesh.culls_triangles()) {
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
    items: Vec<Item>,
    /// The indices of what remains of each; behind them there may be memory for more.
    remaining: Vec<Mutex<Vec<u32>>>,
    culled: Mutex<CulledTriangles>,
}

/// Some triangles of a batch that draws one object: so few that a large mesh is shared out too.
#[derive(Debug)]
struct Item {
    /// The batch's place in the list.
    batch: u32,
    triangles: Range<usize>,
}

/// Triangles of an item, at most.
const LARGEST_ITEM: usize = 256;

/// Triangles that a pass looks at, at most: their indices take 128 MiB, half of what every device allows a buffer.
const MOST_TRIANGLES: usize = (1 << 25) / 3;

impl PassTriangles {
    /// Finds what is to be looked at of a list: what there is room for, in the list's order.
    pub(super) fn find(&mut self, list: &DrawList, asking: &AskingMeshes, assets: &Assets) {
        self.clear();
        let mut room = MOST_TRIANGLES;
        let asking = (0..).zip(&list.batches).filter(|(_, batch)| asking.contains(batch.mesh));
        for (batch, drawn) in asking {
            let count = assets.meshes.get_with_revision(drawn.mesh).map_or(0, |(_, mesh)| mesh.triangle_count());
            let Some(left) = room.checked_sub(count) else { continue };
            room = left;
            let starts = (0..count).step_by(LARGEST_ITEM);
            self.items.extend(starts.map(|start| Item { batch, triangles: start..count.min(start + LARGEST_ITEM) }));
        }
        // A little more is kept than was needed, for the next frame.
        self.remaining.truncate(self.items.len() * 2);
        if self.remaining.len() < self.items.len() {
            self.remaining.resize_with(self.items.len(), Mutex::default);
        }
    }

    /// Leaves nothing to look at, and keeps the memory until the next frame finds what it needs of it.
    pub(super) fn clear(&mut self) {
        self.items.clear();
        *self.culled.get_mut() = CulledTriangles::default();
    }

    /// How many items are to be looked at.
    pub(super) fn len(&self) -> usize {
        self.items.len()
    }

    /// Looks at some of the items.
    pub(super) fn look_at(&self, items: Range<usize>, view: &RenderView, scene: &SceneRef<'_>, list: &DrawList) {
        let mut culled = CulledTriangles::default();
        for (item, remaining) in self.items[items.clone()].iter().zip(&self.remaining[items]) {
            let object = list.objects[list.batches[item.batch as usize].first as usize] as usize;
            let mut remaining = remaining.lock();
            remaining.clear();
            culled += view.cull_triangle_range(scene, object, item.triangles.clone(), &mut remaining);
        }
        *self.culled.lock() += culled;
    }

    /// Has the list draw what remains. A batch of which everything does stays whole.
    pub(super) fn put(&self, list: &mut DrawList) {
        let mut first = 0;
        for items in self.items.chunk_by(|one, next| one.batch == next.batch) {
            let remaining = &self.remaining[first..first + items.len()];
            first += items.len();
            let all: usize = items.iter().map(|item| item.triangles.len() * 3).sum();
            let count: usize = remaining.iter().map(|remaining| remaining.lock().len()).sum();
            if count < all {
                list.make_partial(items[0].batch, |indices| {
                    remaining.iter().for_each(|remaining| indices.extend_from_slice(&remaining.lock()));
                });
            }
        }
    }

    /// How many there were, and were left out.
    pub(super) fn culled(&self) -> CulledTriangles {
        *self.culled.lock()
    }
}
