//! The items of an engine's own in draw order, which all views of a frame share, and which of them a view sees.

use std::ops::Range;

use drawloom_jobs::internal::ChunkedArray;
use parking_lot::RwLock;

use super::{BoundingSphere, BoundingSpheres, Frustum, RenderView};
use crate::bit_set::{BITS_PER_WORD, set_bits};
use crate::command::{BlockBits, ItemList};
use crate::leaked_guards::unlock;
use crate::scene::LayerMask;

/// The columns of items, as an engine lends them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ItemColumns<'a> {
    /// Empty if all items are always drawn.
    pub(crate) bounds: &'a [BoundingSphere],
    /// Empty if all items are in all layers.
    pub(crate) layers: &'a [LayerMask],
}

/// Items in draw order. An item's place in that order is its rank.
///
/// It is kept from frame to frame. If no key changed, the order holds.
#[derive(Debug, Default)]
pub(crate) struct ItemTable {
    order: RwLock<DrawOrder>,
    /// The keys that items are ordered by; empty if they keep the order in which they are lent.
    keys: Vec<u64>,
    /// By rank. Items that are left out have [`BoundingSphere::EMPTY`].
    bounds: Vec<RwLock<Box<BoundingSpheres>>>,
    length: usize,
}

#[derive(Debug, Default)]
struct DrawOrder {
    /// The item of each rank.
    items: Vec<u32>,
    /// Whether it is the order of the table's keys.
    is_current: bool,
}

impl ItemTable {
    /// The number of ranks in a block.
    pub(crate) const BLOCK_SIZE: usize = ItemList::BLOCK_SIZE;
    const WORDS: usize = Self::BLOCK_SIZE / BITS_PER_WORD;

    /// Begins a frame of items with these keys, which are ordered by them, or as they are lent.
    pub(crate) fn begin_frame(&mut self, keys: &[u64], sorts: bool) {
        unlock(&mut self.order);
        self.bounds.iter_mut().for_each(unlock);
        let sorted_by = if sorts { keys } else { &[] };
        if self.length != keys.len() || self.keys != sorted_by {
            self.order.get_mut().is_current = false;
            self.length = keys.len();
            self.keys.clear();
            self.keys.extend_from_slice(sorted_by);
        }
        self.bounds.resize_with(self.length.div_ceil(Self::BLOCK_SIZE), RwLock::default);
    }

    /// Finds the order, if it does not hold. Items of equal keys keep the order in which they are lent.
    pub(crate) fn sort(&self) {
        let mut order = self.order.write();
        if !order.is_current {
            order.items.clear();
            order.items.extend(0..self.length as u32);
            if !self.keys.is_empty() {
                order.items.sort_unstable_by_key(|&item| (self.keys[item as usize], item));
            }
            order.is_current = true;
        }
    }

    /// The number of items.
    pub(crate) fn len(&self) -> usize {
        self.length
    }

    /// The number of blocks of ranks.
    pub(crate) fn block_count(&self) -> usize {
        self.bounds.len()
    }

    /// Copies the bounds of a block's items. Calls `reject` with each item whose bounds are invalid, and leaves it out.
    pub(crate) fn copy_bounds(&self, columns: &ItemColumns<'_>, block: usize, mut reject: impl FnMut(u32)) {
        if columns.bounds.is_empty() {
            return;
        }
        let (order, mut spheres) = (self.order.read(), self.bounds[block].write());
        for (entry, &item) in order.items[self.ranks_of(block)].iter().enumerate() {
            let sphere = columns.bounds[item as usize];
            // An infinite radius is one of an item that is always drawn.
            let is_valid = sphere.center.is_finite() && sphere.radius >= 0.0;
            if !is_valid {
                reject(item);
            }
            spheres.set(entry, if is_valid { sphere } else { BoundingSphere::EMPTY });
        }
    }

    fn ranks_of(&self, block: usize) -> Range<usize> {
        let first = block * Self::BLOCK_SIZE;
        first..(first + Self::BLOCK_SIZE).min(self.length)
    }

    /// Finds which items of a block a view sees: those whose bounds intersect its frustum, unless `culls` is false, and
    /// that are in one of its layers.
    pub(crate) fn cull(
        &self,
        columns: &ItemColumns<'_>,
        (view, culls): (&RenderView, bool),
        block: usize,
        visible: &ItemVisibility,
    ) {
        let (ranks, order) = (self.ranks_of(block), self.order.read());
        let spheres = (!columns.bounds.is_empty()).then(|| self.bounds[block].read());
        let mut words = [0; Self::WORDS];
        for (word, bits) in words.iter_mut().enumerate() {
            let first = word * BITS_PER_WORD;
            let count = ranks.len().saturating_sub(first).min(BITS_PER_WORD);
            if count == 0 {
                break;
            }
            let all = u64::MAX >> (BITS_PER_WORD - count);
            *bits =
                all & spheres.as_ref().map_or(u64::MAX, |spheres| intersecting(&view.frustum, spheres, first, culls));
            if !columns.layers.is_empty() {
                let of_word = &order.items[ranks.start + first..];
                let is_hidden = |bit: &usize| !columns.layers[of_word[*bit] as usize].intersects(view.camera.layers);
                *bits &= !set_bits(*bits).filter(is_hidden).fold(0, |hidden, bit| hidden | 1 << bit);
            }
        }
        visible.put(block, words);
    }

    /// Makes a list what a view sees, with at most `per_bundle` items in a bundle.
    pub(crate) fn list(&self, visible: &ItemVisibility, per_bundle: usize, list: &mut ItemList) {
        list.fill(&self.order.read().items, |block| visible.words(block), per_bundle);
    }
}

// A block of ranks is one of spheres.
const _: () = assert!(ItemTable::BLOCK_SIZE == BoundingSpheres::COUNT);

/// The spheres of a word that a frustum intersects; without culling all that are not [`BoundingSphere::EMPTY`].
fn intersecting(frustum: &Frustum, spheres: &BoundingSpheres, first: usize, culls: bool) -> u64 {
    if culls {
        return frustum.intersects_spheres(spheres, first);
    }
    let radii = &spheres.radii()[first..first + BITS_PER_WORD];
    (0..).zip(radii).fold(0, |bits, (bit, radius)| bits | u64::from(*radius >= 0.0) << bit)
}

/// Which items a view sees: a bit for each rank.
#[derive(Debug, Default)]
pub(crate) struct ItemVisibility {
    words: ChunkedArray<u64>,
}

impl ItemVisibility {
    /// Makes room for this many items.
    pub(crate) fn begin_frame(&mut self, items: usize) {
        self.words.grow(items.div_ceil(ItemTable::BLOCK_SIZE) * ItemTable::WORDS, 0);
    }

    fn put(&self, block: usize, words: BlockBits) {
        let (chunk, first) = Self::place_of(block);
        self.words.write(chunk)[first..][..ItemTable::WORDS].copy_from_slice(&words);
    }

    /// The words of a block.
    fn words(&self, block: usize) -> BlockBits {
        let (chunk, first) = Self::place_of(block);
        *self.words.read(chunk)[first..].first_chunk().expect("blocks do not straddle chunks")
    }

    /// Where the words of a block are: their chunk, and the first in it.
    fn place_of(block: usize) -> (usize, usize) {
        let (first, chunk) = (block * ItemTable::WORDS, ChunkedArray::<u64>::BLOCK_SIZE);
        (first / chunk, first % chunk)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::scene::Camera;

    fn view() -> RenderView {
        RenderView::new(&Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z))
    }

    /// A frame of these items in one view, item by item.
    fn naive((keys, columns): (&[u64], &ItemColumns<'_>), view: &RenderView, sorts: bool) -> Vec<u32> {
        let mut items: Vec<_> = (0..keys.len()).collect();
        if sorts {
            items.sort_by_key(|item| keys[*item]);
        }
        let is_seen = |item: &usize| {
            let is_near = columns.bounds.get(*item).is_none_or(|sphere| {
                let is_valid = sphere.center.is_finite() && sphere.radius >= 0.0;
                is_valid
                    && (sphere.radius.is_infinite() || view.frustum.intersects_sphere(sphere.center, sphere.radius))
            });
            is_near && columns.layers.get(*item).is_none_or(|layers| layers.intersects(view.camera.layers))
        };
        items.into_iter().filter(is_seen).map(|item| item as u32).collect()
    }

    fn frame(
        table: &mut ItemTable,
        (visible, list): (&mut ItemVisibility, &mut ItemList),
        (keys, columns): (&[u64], &ItemColumns<'_>),
        view: &RenderView,
        (sorts, per_bundle): (bool, usize),
    ) -> usize {
        let mut rejected = 0;
        table.begin_frame(keys, sorts);
        table.sort();
        visible.begin_frame(table.len());
        for block in 0..table.block_count() {
            table.copy_bounds(columns, block, |_| rejected += 1);
            table.cull(columns, (view, true), block, visible);
        }
        table.list(visible, per_bundle, list);
        rejected
    }

    fn any_sphere() -> impl Strategy<Value = BoundingSphere> {
        let radius = prop_oneof![
            8 => 0.0..3.0_f32,
            1 => Just(f32::INFINITY),
            1 => prop_oneof![Just(f32::NAN), Just(-1.0), Just(f32::NEG_INFINITY)],
        ];
        let coordinate = prop_oneof![30 => -20.0..20.0_f64, 1 => Just(f64::NAN), 1 => Just(f64::INFINITY)];
        (prop::array::uniform3(coordinate), radius)
            .prop_map(|(center, radius)| BoundingSphere { center: center.into(), radius })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(60))]

        /// Frames of one table, whose items, keys and bounds change.
        #[test]
        fn lists_have_what_a_loop_over_all_items_finds(
            frames in prop::collection::vec(
                (0_usize..2_000, 0_u64..4, any::<[bool; 3]>(), 1_usize..600, any::<u64>()),
                1..5,
            ),
            spheres in prop::collection::vec(any_sphere(), 2_000),
            layers in prop::collection::vec(any::<bool>(), 2_000),
        ) {
            let (mut table, mut visible, mut list) =
                (ItemTable::default(), ItemVisibility::default(), ItemList::default());
            let camera = Camera { layers: LayerMask::layer(3), ..view().camera };
            let view = RenderView::new(&camera);
            let layers: Vec<_> = layers.iter().map(|own| LayerMask::layer(if *own { 3 } else { 4 })).collect();
            for (count, key_bits, [sorts, has_bounds, has_layers], per_bundle, seed) in frames {
                let key = |item: usize| (item as u64 ^ seed).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> (64 - 1 - key_bits);
                let keys: Vec<_> = (0..count).map(key).collect();
                let columns = ItemColumns {
                    bounds: if has_bounds { &spheres[..count] } else { &[] },
                    layers: if has_layers { &layers[..count] } else { &[] },
                };
                let rejected = frame(&mut table, (&mut visible, &mut list), (&keys, &columns), &view, (sorts, per_bundle));
                prop_assert_eq!(list.items(), naive((&keys, &columns), &view, sorts));
                let is_invalid = |sphere: &&BoundingSphere| !sphere.center.is_finite() || sphere.radius < 0.0 || sphere.radius.is_nan();
                prop_assert_eq!(rejected, columns.bounds.iter().filter(is_invalid).count());
                let bundled: Vec<_> = (0..list.bundle_count()).flat_map(|bundle| list.bundle_range(bundle)).collect();
                prop_assert_eq!(bundled, (0..list.items().len()).collect::<Vec<_>>());
                let mut slots: Vec<_> = (0..list.bundle_count()).map(|bundle| list.bundle_slot(bundle)).collect();
                for bundle in 0..list.bundle_count() {
                    let length = list.bundle_range(bundle).len();
                    prop_assert!((1..=per_bundle.min(ItemList::ITEMS_PER_BUNDLE)).contains(&length), "{length}");
                    prop_assert!(list.bundle_slot(bundle) < list.slot_count());
                }
                slots.dedup();
                prop_assert_eq!(slots.len(), list.bundle_count());
            }
        }
    }

    #[test]
    fn an_item_that_comes_into_view_changes_one_bundle() {
        let far = BoundingSphere { center: DVec3::Z * 50.0, radius: 1.0 };
        let mut bounds = vec![BoundingSphere { center: DVec3::NEG_Z * 5.0, radius: 1.0 }; 3_000];
        bounds[700] = far;
        let (mut table, mut visible, mut list) = (ItemTable::default(), ItemVisibility::default(), ItemList::default());
        let mut bundles = Vec::new();
        for sphere in [far, bounds[0]] {
            bounds[700] = sphere;
            let columns = ItemColumns { bounds: &bounds, layers: &[] };
            frame(&mut table, (&mut visible, &mut list), (&[0; 3_000], &columns), &view(), (true, usize::MAX));
            let of_slot = |bundle| (list.bundle_slot(bundle), list.items()[list.bundle_range(bundle)].to_vec());
            bundles.push((0..list.bundle_count()).map(of_slot).collect::<Vec<_>>());
        }
        assert_eq!(bundles[0].len(), 12);
        let changed = bundles[0].iter().zip(&bundles[1]).filter(|(one, other)| one != other);
        assert_eq!(changed.map(|(one, _)| one.0).collect::<Vec<_>>(), [700 / 256]);
    }

    #[test]
    fn bundles_of_few_visible_items_span_several_blocks() {
        let bounds: Vec<_> = (0..25_600)
            .map(|item| DVec3::Z * if item % 16 == 0 { -5.0 } else { 50.0 })
            .map(|center| BoundingSphere { center, radius: 1.0 })
            .collect();
        let (mut table, mut visible, mut list) = (ItemTable::default(), ItemVisibility::default(), ItemList::default());
        let columns = ItemColumns { bounds: &bounds, layers: &[] };
        frame(&mut table, (&mut visible, &mut list), (&[0; 25_600], &columns), &view(), (true, usize::MAX));
        assert_eq!((list.items().len(), list.bundle_count()), (1_600, 13));
        assert!((0..12).all(|bundle| list.bundle_range(bundle).len() == 128));
    }
}
