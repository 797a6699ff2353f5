//! The triangles that a pass tests: culling on the CPU, of meshes with triangle culling enabled (S 9.6).

use std::ops::Range;

use parking_lot::Mutex;

use super::culling_tables::CullingTables;
use crate::command::DrawList;
use crate::raster::CulledTriangles;
use crate::scene::{Assets, SceneRef};
use crate::view::RenderView;

/// The triangles of a pass that are tested.
#[derive(Debug, Default)]
pub(in crate::frame) struct PassTriangles {
    items: Vec<Item>,
    /// The indices of the triangles that remain of each item; longer than `items`, to keep memory.
    remaining: Vec<Mutex<Vec<u32>>>,
    culled: Mutex<CulledTriangles>,
}

/// Some triangles of a batch of one object. A large mesh makes several items, so that several workers cull it.
#[derive(Debug)]
struct Item {
    /// The batch's index in the draw list.
    batch: u32,
    triangles: Range<usize>,
}

/// The most triangles in an item.
const MAX_ITEM_TRIANGLES: usize = 256;

/// The most triangles that a pass tests. Their indices take 128 MiB, half of what every device allows in a buffer.
const MAX_PASS_TRIANGLES: usize = (1 << 25) / 3;

impl PassTriangles {
    /// Begins a frame. One that culls no triangles gives the memory back.
    pub(in crate::frame) fn begin_frame(&mut self, culls_triangles: bool) {
        if culls_triangles {
            self.clear();
        } else {
            *self = Self::default();
        }
    }

    /// Lists the triangles of cullable meshes in a draw list, in its order, up to [`MAX_PASS_TRIANGLES`].
    pub(in crate::frame) fn find(&mut self, list: &DrawList, tables: &CullingTables, assets: &Assets) {
        self.clear();
        let mut room = MAX_PASS_TRIANGLES;
        let cullable_batches = (0..).zip(&list.batches).filter(|(_, batch)| tables.is_cullable(batch.mesh));
        for (batch, drawn) in cullable_batches {
            let level = drawn.state.level_of_detail();
            let mesh = assets.meshes.get_with_revision(drawn.mesh);
            let count = mesh.map_or(0, |(_, mesh)| mesh.triangle_count_of(level));
            let Some(left) = room.checked_sub(count) else { continue };
            room = left;
            let starts = (0..count).step_by(MAX_ITEM_TRIANGLES);
            self.items
                .extend(starts.map(|start| Item { batch, triangles: start..count.min(start + MAX_ITEM_TRIANGLES) }));
        }
        // Keeps the memory of up to twice as many items for the next frame.
        self.remaining.truncate(self.items.len() * 2);
        if self.remaining.len() < self.items.len() {
            self.remaining.resize_with(self.items.len(), Mutex::default);
        }
    }

    /// Removes all items. The memory stays until the next [`PassTriangles::find`].
    fn clear(&mut self) {
        self.items.clear();
        *self.culled.get_mut() = CulledTriangles::default();
    }

    /// The number of items.
    pub(in crate::frame) fn len(&self) -> usize {
        self.items.len()
    }

    /// Culls the triangles of some items.
    pub(in crate::frame) fn cull(&self, items: Range<usize>, view: &RenderView, scene: &SceneRef<'_>, list: &DrawList) {
        let mut culled = CulledTriangles::default();
        for (item, remaining) in self.items[items.clone()].iter().zip(&self.remaining[items]) {
            let batch = &list.batches[item.batch as usize];
            let drawn = (list.objects[batch.first as usize] as usize, batch.state.level_of_detail());
            let mut remaining = remaining.lock();
            remaining.clear();
            culled += view.cull_triangle_range(scene, drawn, item.triangles.clone(), &mut remaining);
        }
        *self.culled.lock() += culled;
    }

    /// Makes the draw list draw what remains. A batch that lost no triangle stays whole.
    pub(in crate::frame) fn apply(&self, list: &mut DrawList) {
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

    /// How many triangles were tested and culled.
    pub(in crate::frame) fn culled(&self) -> CulledTriangles {
        *self.culled.lock()
    }
}
