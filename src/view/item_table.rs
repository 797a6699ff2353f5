//! The items of an engine's own in draw order, which all views of a frame share, and which of them a view sees.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

use parking_lot::RwLock;

use super::bounds4::{Bounds4, Overlap};
use super::{BoundingSphere, BoundingSpheres, Frustum, RenderView};
use crate::bit_set::{BITS_PER_WORD, set_bits};
use crate::command::{BlockBits, ItemList, ListChanges, Version};
use crate::leaked_guards::unlock;
use crate::scene::{Changes, LayerMask};

/// The columns of items, as an engine lends them.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ItemColumns<'a> {
    pub(crate) keys: &'a [u64],
    /// Empty if all items are always drawn.
    pub(crate) bounds: &'a [BoundingSphere],
    /// Empty if all items are in all layers.
    pub(crate) layers: &'a [LayerMask],
    /// Empty if nothing is known about the commands of items.
    pub(crate) versions: &'a [u64],
    /// What changed in them.
    pub(crate) changes: Changes<'a>,
}

/// Items in draw order. An item's place in that order is its rank.
///
/// It is kept from frame to frame: order, bounds, and what views see of them hold as long as nothing changes that they
/// depend on. Where the engine does not say what changed, it is found by comparison.
#[derive(Debug, Default)]
pub(crate) struct ItemTable {
    order: RwLock<DrawOrder>,
    /// Whether the items are ordered by their keys, or as they are lent.
    sorts: bool,
    keys: Vec<u64>,
    layers: Vec<LayerMask>,
    versions: Vec<u64>,
    /// Whether the table has the columns that were lent last.
    is_current: bool,
    /// The version of the frame that began with this set of items.
    set: Version,
    /// The version of what this frame changes.
    frame: Version,
    /// The versions of the order, and of the items' keys and versions.
    order_version: Version,
    contents_version: Version,
    /// How many items have another version than in the frame before.
    changed_versions: usize,
    has_bounds: bool,
    blocks: Vec<RwLock<ItemBlock>>,
}

#[derive(Debug, Default)]
struct DrawOrder {
    /// The item of each rank.
    items: Vec<u32>,
    /// The rank of each item; empty until a frame needs it.
    ranks: Vec<u32>,
    /// Whether it is the order of the table's keys.
    is_current: bool,
}

/// What views need to know about the items of a block of ranks.
#[derive(Debug, Default)]
struct ItemBlock {
    /// By rank. Items that are left out have [`BoundingSphere::EMPTY`].
    spheres: Box<BoundingSpheres>,
    /// Of each word of spheres.
    bounds: Bounds4,
    /// Whether bounds may have changed since they were copied.
    is_outdated: bool,
    /// Whether items are left out. Each frame counts them.
    has_rejected: bool,
    /// The version of all that decides which of the items a view sees.
    version: Version,
}

impl ItemTable {
    /// The number of ranks in a block.
    pub(crate) const BLOCK_SIZE: usize = ItemList::BLOCK_SIZE;
    const WORDS: usize = Self::BLOCK_SIZE / BITS_PER_WORD;

    /// Makes it the table of another set of items from this frame on.
    pub(crate) fn begin_set(&mut self, frame: Version) {
        self.set = frame;
        self.invalidate();
    }

    /// Makes the next frame find out itself what changed.
    pub(crate) fn invalidate(&mut self) {
        self.is_current = false;
    }

    /// Begins a frame of items, which are ordered by their keys, or as they are lent. The version is one that no other
    /// frame and no other table gets.
    pub(crate) fn begin_frame(&mut self, columns: &ItemColumns<'_>, sorts: bool, version: Version) {
        unlock(&mut self.order);
        self.blocks.iter_mut().for_each(unlock);
        (self.frame, self.changed_versions) = (version, 0);
        let is_reported = self.is_current
            && self.sorts == sorts
            && self.has_bounds != columns.bounds.is_empty()
            && self.keys.len() == columns.keys.len()
            && self.layers.len() == columns.layers.len()
            && self.versions.len() == columns.versions.len();
        let is_updated = is_reported
            && match columns.changes {
                Changes::Unknown => false,
                Changes::Objects(items) => self.update(columns, || items.iter().copied()),
                Changes::Ranges(ranges) => self.update(columns, || ranges.iter().cloned().flatten()),
            };
        if !is_updated {
            self.compare(columns, sorts);
        }
        self.is_current = true;
    }

    /// Takes over what changed of some items. Returns false, and does nothing, if keys did.
    fn update<I: Iterator<Item = u32>>(&mut self, columns: &ItemColumns<'_>, changed: impl Fn() -> I) -> bool {
        let changed = || changed().map(|item| item as usize).filter(|item| *item < columns.keys.len());
        if changed().any(|item| self.keys[item] != columns.keys[item]) || !self.order.get_mut().is_current {
            return false;
        }
        if changed().next().is_none() {
            return true;
        }
        let order = self.order.get_mut();
        order.find_ranks();
        for item in changed() {
            let block = self.blocks[order.ranks[item] as usize / Self::BLOCK_SIZE].get_mut();
            block.is_outdated = true;
            if let Some((layers, new)) = self.layers.get_mut(item).zip(columns.layers.get(item)) {
                *layers = *new;
                block.version = self.frame;
            }
            if let Some((own, new)) = self.versions.get_mut(item).zip(columns.versions.get(item))
                && *own != *new
            {
                *own = *new;
                self.changed_versions += 1;
                self.contents_version = self.frame;
            }
        }
        true
    }

    /// Takes over what changed of any item, but bounds: they are compared when they are copied.
    fn compare(&mut self, columns: &ItemColumns<'_>, sorts: bool) {
        let has_same_keys = self.keys == columns.keys;
        let keeps_order = self.sorts == sorts && self.keys.len() == columns.keys.len() && (has_same_keys || !sorts);
        let has_bounds = !columns.bounds.is_empty();
        let keeps_columns = self.has_bounds == has_bounds && self.layers == columns.layers;
        (self.sorts, self.has_bounds) = (sorts, has_bounds);
        if !has_same_keys {
            columns.keys.clone_into(&mut self.keys);
            self.contents_version = self.frame;
        }
        if self.versions != columns.versions {
            let changed = self.versions.iter().zip(columns.versions).filter(|(one, other)| one != other);
            self.changed_versions = changed.count();
            columns.versions.clone_into(&mut self.versions);
            self.contents_version = self.frame;
        }
        self.blocks.resize_with(self.len().div_ceil(Self::BLOCK_SIZE), RwLock::default);
        if !keeps_order {
            self.order.get_mut().is_current = false;
            self.order_version = self.frame;
        }
        if !keeps_columns {
            columns.layers.clone_into(&mut self.layers);
        }
        for block in &mut self.blocks {
            let block = block.get_mut();
            block.is_outdated = true;
            if !(keeps_order && keeps_columns) {
                block.version = self.frame;
            }
        }
    }

    /// An item that changed although the engine did not report it; `None` if there is none.
    pub(crate) fn unreported_change(&mut self, columns: &ItemColumns<'_>) -> Option<usize> {
        let order = self.order.get_mut();
        if !order.is_current {
            return None;
        }
        let ranks = order.items.chunks(Self::BLOCK_SIZE).zip(&mut self.blocks);
        let has_other_bounds = ranks.flat_map(|(items, block)| {
            let block = block.get_mut();
            let is_copied = self.has_bounds && !block.is_outdated && !block.has_rejected;
            let is_other =
                move |entry: &usize| is_copied && block.spheres.get(*entry) != columns.bounds[items[*entry] as usize];
            (0..items.len()).filter(is_other).map(|entry| items[entry] as usize)
        });
        let is_other = |item: &usize| {
            self.keys[*item] != columns.keys[*item]
                || self.layers.get(*item) != columns.layers.get(*item)
                || self.versions.get(*item) != columns.versions.get(*item)
        };
        has_other_bounds.chain((0..columns.keys.len()).filter(is_other)).min()
    }

    /// Finds the order, if it does not hold. Items of equal keys keep the order in which they are lent.
    pub(crate) fn sort(&self) {
        let mut order = self.order.write();
        if !order.is_current {
            order.ranks.clear();
            order.items.clear();
            order.items.extend(0..self.len() as u32);
            if self.sorts {
                order.items.sort_unstable_by_key(|&item| (self.keys[item as usize], item));
            }
            order.is_current = true;
        }
    }

    /// The number of items.
    pub(crate) fn len(&self) -> usize {
        self.keys.len()
    }

    /// The number of blocks of ranks.
    pub(crate) fn block_count(&self) -> usize {
        self.blocks.len()
    }

    /// Copies the bounds of a block's items, where they changed. Calls `reject` with each item whose bounds are
    /// invalid, and leaves it out.
    pub(crate) fn copy_bounds(&self, columns: &ItemColumns<'_>, block: usize, mut reject: impl FnMut(u32)) {
        if columns.bounds.is_empty() {
            return;
        }
        let mut own = self.blocks[block].write();
        if !own.is_outdated && !own.has_rejected {
            return;
        }
        let order = self.order.read();
        let items = &order.items[self.ranks_of(block)];
        own.is_outdated = false;
        if !own.has_rejected && own.holds(items, columns.bounds) {
            return;
        }
        (own.version, own.has_rejected) = (self.frame, false);
        for (entry, &item) in items.iter().enumerate() {
            let sphere = columns.bounds[item as usize];
            // An infinite radius is one of an item that is always drawn.
            let is_valid = sphere.center.is_finite() && sphere.radius >= 0.0;
            if !is_valid {
                own.has_rejected = true;
                reject(item);
            }
            own.spheres.set(entry, if is_valid { sphere } else { BoundingSphere::EMPTY });
        }
        // The last block may have had more items.
        (items.len()..Self::BLOCK_SIZE).for_each(|entry| own.spheres.set(entry, BoundingSphere::EMPTY));
        let ItemBlock { bounds, spheres, .. } = &mut *own;
        (0..Self::WORDS).for_each(|word| bounds.set_word(word, spheres));
    }

    fn ranks_of(&self, block: usize) -> Range<usize> {
        let first = block * Self::BLOCK_SIZE;
        first..(first + Self::BLOCK_SIZE).min(self.len())
    }

    /// Finds which items of a block a view sees: those whose bounds intersect its frustum, unless `culls` is false, and
    /// that are in one of its layers. What was found in an earlier frame holds as long as the block and the view do not
    /// change.
    pub(crate) fn cull(
        &self,
        columns: &ItemColumns<'_>,
        (view, culls): (&RenderView, bool),
        block: usize,
        visible: &ItemVisibility,
    ) {
        let (own, mut found) = (self.blocks[block].read(), visible.blocks[block].write());
        if found.tested == own.version {
            return;
        }
        let (ranks, order) = (self.ranks_of(block), self.order.read());
        let spheres = (!columns.bounds.is_empty()).then_some(&*own.spheres);
        let mut overlaps = [Overlap::Partial; Self::WORDS];
        if culls && spheres.is_some() {
            overlaps = view.frustum.overlaps(&own.bounds);
        }
        let mut words = [0; Self::WORDS];
        for (word, bits) in words.iter_mut().enumerate() {
            let first = word * BITS_PER_WORD;
            let count = ranks.len().saturating_sub(first).min(BITS_PER_WORD);
            if count == 0 {
                break;
            }
            let all = u64::MAX >> (BITS_PER_WORD - count);
            *bits = all
                & match (spheres, overlaps[word]) {
                    (_, Overlap::Outside) => 0,
                    (Some(spheres), overlap) if overlap == Overlap::Partial || own.has_rejected => {
                        intersecting(&view.frustum, spheres, first, culls)
                    }
                    _ => u64::MAX,
                };
            if !columns.layers.is_empty() {
                let of_word = &order.items[ranks.start + first..];
                let is_hidden = |bit: &usize| !columns.layers[of_word[*bit] as usize].intersects(view.camera.layers);
                *bits &= !set_bits(*bits).filter(is_hidden).fold(0, |hidden, bit| hidden | 1 << bit);
            }
        }
        let differences = words.iter().zip(found.words).map(|(new, old)| (new ^ old).count_ones() as usize);
        let changed: usize = differences.sum();
        if changed > 0 {
            // Relaxed: it is read after all blocks.
            visible.changed.fetch_add(changed, Ordering::Relaxed);
        }
        *found = BlockVisibility { words, tested: own.version };
    }

    /// Makes a list what a view sees, with at most `per_bundle` items in a bundle, or as many as change little, unless
    /// it is that already. Every list of a frame has another index.
    pub(crate) fn list(&self, visible: &ItemVisibility, per_bundle: Option<usize>, index: usize, list: &mut ItemList) {
        let version = Version { index, ..self.frame };
        (list.set, list.contents_version) = (self.set, self.contents_version);
        let changes = ListChanges {
            // Relaxed: all blocks have been culled.
            seen: (!visible.is_resized).then(|| visible.changed.load(Ordering::Relaxed)),
            versions: (!self.versions.is_empty()).then_some(self.changed_versions),
        };
        let order = (&*self.order.read().items, self.order_version);
        list.update(order, |block| visible.words(block), per_bundle, changes, version);
    }
}

impl DrawOrder {
    /// Finds the rank of each item, unless it has it already.
    fn find_ranks(&mut self) {
        if self.ranks.len() != self.items.len() {
            self.ranks.resize(self.items.len(), 0);
            for (rank, &item) in (0..).zip(&self.items) {
                self.ranks[item as usize] = rank;
            }
        }
    }
}

impl ItemBlock {
    /// Whether its spheres are those of these items.
    fn holds(&self, items: &[u32], bounds: &[BoundingSphere]) -> bool {
        let ([x, y, z], radii) = (self.spheres.coordinates(), self.spheres.radii());
        items.iter().zip(x).zip(y).zip(z).zip(radii).all(|((((item, x), y), z), radius)| {
            let lent = &bounds[*item as usize];
            // Without branches but one: nearly always all are equal.
            (lent.center.x == *x) & (lent.center.y == *y) & (lent.center.z == *z) & (lent.radius == *radius)
        })
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

/// Which items a view sees. It is kept from frame to frame.
#[derive(Debug, Default)]
pub(crate) struct ItemVisibility {
    blocks: Vec<RwLock<BlockVisibility>>,
    /// The view's frustum and layers, and whether it culls.
    tested_with: Option<(Frustum, LayerMask, bool)>,
    /// How many ranks come into view or leave it in this frame.
    changed: AtomicUsize,
    /// Whether the number of blocks is another one than in the frame before.
    is_resized: bool,
}

/// Which items of a block a view sees.
#[derive(Clone, Copy, Debug, Default)]
struct BlockVisibility {
    words: BlockBits,
    /// The version of the block that was tested.
    tested: Version,
}

impl ItemVisibility {
    /// Begins a frame of a view and these items.
    pub(crate) fn begin_frame(&mut self, table: &ItemTable, view: &RenderView, culls: bool) {
        self.blocks.iter_mut().for_each(unlock);
        *self.changed.get_mut() = 0;
        self.is_resized = self.blocks.len() != table.block_count();
        self.blocks.resize_with(table.block_count(), RwLock::default);
        let layers = view.camera.layers;
        let is_same = |(frustum, had_layers, culled): &(Frustum, LayerMask, bool)| {
            (frustum, *had_layers, *culled) == (&view.frustum, layers, culls)
        };
        if !self.tested_with.as_ref().is_some_and(is_same) {
            self.tested_with = Some((view.frustum.clone(), layers, culls));
            self.blocks.iter_mut().for_each(|block| block.get_mut().tested = Version::default());
        }
    }

    fn words(&self, block: usize) -> BlockBits {
        self.blocks[block].read().words
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
    fn naive(columns: &ItemColumns<'_>, view: &RenderView, sorts: bool) -> Vec<u32> {
        let mut items: Vec<_> = (0..columns.keys.len()).collect();
        if sorts {
            items.sort_by_key(|item| columns.keys[*item]);
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

    /// What is kept from frame to frame, for one view.
    #[derive(Default)]
    struct Kept {
        table: ItemTable,
        visible: ItemVisibility,
        list: ItemList,
        frames: u64,
    }

    impl Kept {
        /// Runs a frame, and returns the number of items that were rejected.
        fn frame(
            &mut self,
            columns: &ItemColumns<'_>,
            view: &RenderView,
            (sorts, per_bundle): (bool, Option<usize>),
        ) -> usize {
            let Self { table, visible, list, frames } = self;
            *frames += 1;
            let mut rejected = 0;
            table.begin_frame(columns, sorts, Version { frame: *frames, index: 0 });
            assert_eq!(table.unreported_change(columns), None);
            visible.begin_frame(table, view, true);
            table.sort();
            for block in 0..table.block_count() {
                table.copy_bounds(columns, block, |_| rejected += 1);
                table.cull(columns, (view, true), block, visible);
            }
            table.list(visible, per_bundle, 0, list);
            rejected
        }
    }

    /// Keys, bounds, layers and versions.
    type OwnColumns = (Vec<u64>, Vec<BoundingSphere>, Vec<LayerMask>, Vec<u64>);

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

        /// Frames of two tables, of which each changes one of its inputs, or none. One table is told what changes.
        #[test]
        fn lists_have_what_a_loop_over_all_items_finds(
            frames in prop::collection::vec(
                (0..15, 0_usize..2_000, 0_u64..4, 1_usize..600, any::<u64>(), 0_usize..2_000),
                1..16,
            ),
            spheres in prop::collection::vec(any_sphere(), 2_000),
            layers in prop::collection::vec(any::<bool>(), 2_000),
            has_invalid: bool,
            is_small: bool,
        ) {
            let (mut kept, mut told) = (Kept::default(), Kept::default());
            let camera = |turns, layer| {
                let target = if turns { DVec3::new(0.5, 0.0, -1.0) } else { DVec3::NEG_Z };
                Camera { layers: LayerMask::layer(layer), ..Camera::looking_at("main", DVec3::ZERO, target) }
            };
            let is_invalid =
                |sphere: &BoundingSphere| !sphere.center.is_finite() || sphere.radius.is_nan() || sphere.radius < 0.0;
            let mut spheres = spheres;
            if is_small {
                // Some words lie inside or outside as a whole.
                for (index, sphere) in spheres.iter_mut().enumerate() {
                    let z = if index / 500 % 2 == 0 { -30.0 } else { 30.0 };
                    sphere.center = sphere.center * 0.1 + DVec3::Z * z;
                }
            }
            if !has_invalid {
                let valid = BoundingSphere { center: DVec3::NEG_Z, radius: 1.0 };
                spheres.iter_mut().filter(|sphere| is_invalid(sphere)).for_each(|sphere| *sphere = valid);
            }
            let mut layers: Vec<_> = layers.iter().map(|own| LayerMask::layer(if *own { 3 } else { 4 })).collect();
            let (mut count, mut key_bits, mut per_bundle, mut seed) = (1_000, 2, None, 0);
            let (mut sorts, mut has_bounds, mut has_layers, mut turns) = (true, true, false, false);
            let (mut changed_key, mut versions, mut layer) = (0, vec![0; 2_000], 3);
            let mut before: Option<OwnColumns> = None;
            for (changed, new_count, new_bits, new_per_bundle, new_seed, moved) in frames {
                match changed {
                    0 => count = new_count,
                    1 => key_bits = new_bits,
                    2 => per_bundle = Some(new_per_bundle).filter(|count| count % 2 == 0),
                    3 => seed = new_seed,
                    4 => sorts ^= true,
                    5 => has_bounds ^= true,
                    6 => has_layers ^= true,
                    7 => turns ^= true,
                    8 => spheres.rotate_left(moved),
                    9 => spheres[moved] = spheres[new_count],
                    10 => layers[moved] = layers[new_count],
                    11 => versions[moved] = new_seed,
                    12 => changed_key = moved,
                    // A frame that fails before it begins.
                    13 => told.table.invalidate(),
                    14 => layer = 7 - layer,
                    _ => {}
                }
                let view = RenderView::new(&camera(turns, layer));
                let key = |item: usize| {
                    let hash = (item as u64 ^ seed).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> (64 - 1 - key_bits);
                    hash ^ u64::from(item == changed_key)
                };
                let keys: Vec<_> = (0..count).map(key).collect();
                let columns = ItemColumns {
                    keys: &keys,
                    versions: &versions[..count],
                    bounds: if has_bounds { &spheres[..count] } else { &[] },
                    layers: if has_layers { &layers[..count] } else { &[] },
                    changes: Changes::Unknown,
                };
                let is_other = |item: &u32| before.as_ref().is_none_or(|(keys, spheres, layers, versions)| {
                    let item = *item as usize;
                    keys.get(item) != columns.keys.get(item)
                        || spheres.get(item) != columns.bounds.get(item)
                        || layers.get(item) != columns.layers.get(item)
                        || versions.get(item) != columns.versions.get(item)
                });
                let mut others: Vec<_> = (0..count as u32).filter(is_other).collect();
                // Others may be reported too, and items that there are not.
                others.extend([moved as u32, u32::MAX]);
                let ranges: Vec<_> = others.iter().map(|item| *item..item.saturating_add(1)).collect();
                let reported = if changed == 13 {
                    Changes::NONE
                } else if moved % 2 == 0 {
                    Changes::Objects(&others)
                } else {
                    Changes::Ranges(&ranges)
                };
                let has_same_contents =
                    before.as_ref().is_some_and(|(keys, _, _, versions)| (&keys[..], &versions[..]) == (columns.keys, columns.versions));
                for (kept, changes) in [(&mut kept, Changes::Unknown), (&mut told, reported)] {
                    let columns = ItemColumns { changes, ..columns };
                    let contents_version = kept.list.versions()[1];
                    let rejected = kept.frame(&columns, &view, (sorts, per_bundle));
                    let list = &kept.list;
                    prop_assert_eq!(list.items(), naive(&columns, &view, sorts));
                    prop_assert_eq!(list.versions()[1] == contents_version, has_same_contents);
                    prop_assert_eq!(rejected, columns.bounds.iter().filter(|sphere| is_invalid(sphere)).count());
                    check_bundles(list, per_bundle)?;
                }
                before = Some((keys.clone(), columns.bounds.to_vec(), columns.layers.to_vec(), columns.versions.to_vec()));
            }
        }
    }

    /// Bundles divide the list, and each has a slot of its own.
    fn check_bundles(list: &ItemList, per_bundle: Option<usize>) -> Result<(), TestCaseError> {
        let bundled: Vec<_> = (0..list.bundle_count()).flat_map(|bundle| list.bundle_range(bundle)).collect();
        prop_assert_eq!(bundled, (0..list.items().len()).collect::<Vec<_>>());
        let mut slots: Vec<_> = (0..list.bundle_count()).map(|bundle| list.bundle_slot(bundle)).collect();
        for bundle in 0..list.bundle_count() {
            let length = list.bundle_range(bundle).len();
            prop_assert!((1..=per_bundle.unwrap_or(ItemList::ITEMS_PER_BUNDLE)).contains(&length), "{length}");
            prop_assert!(list.bundle_slot(bundle) < list.slot_count());
        }
        slots.dedup();
        prop_assert_eq!(slots.len(), list.bundle_count());
        Ok(())
    }

    #[test]
    fn an_item_that_comes_into_view_changes_one_bundle() {
        let far = BoundingSphere { center: DVec3::Z * 50.0, radius: 1.0 };
        let mut bounds = vec![BoundingSphere { center: DVec3::NEG_Z * 5.0, radius: 1.0 }; 3_000];
        bounds[700] = far;
        let mut kept = Kept::default();
        let mut bundles = Vec::new();
        for sphere in [far, bounds[0]] {
            bounds[700] = sphere;
            let columns = ItemColumns { keys: &[0; 3_000], bounds: &bounds, ..ItemColumns::default() };
            kept.frame(&columns, &view(), (true, None));
            let list = &kept.list;
            let of_slot = |bundle| (list.bundle_slot(bundle), list.items()[list.bundle_range(bundle)].to_vec());
            bundles.push((0..list.bundle_count()).map(of_slot).collect::<Vec<_>>());
        }
        assert_eq!(bundles[0].len(), 12);
        let changed = bundles[0].iter().zip(&bundles[1]).filter(|(one, other)| one != other);
        // A slot is that of a group's first rank, of 32.
        assert_eq!(changed.map(|(one, _)| one.0).collect::<Vec<_>>(), [512 / 32]);
    }

    #[test]
    fn bundles_are_the_larger_the_fewer_items_change() {
        const COUNT: usize = 102_400;
        let mut bounds: Vec<_> = (0..COUNT)
            .map(|item| DVec3::Z * if item % 4 == 0 { -5.0 } else { 50.0 })
            .map(|center| BoundingSphere { center, radius: 1.0 })
            .collect();
        let (mut versions, none) = (vec![0; COUNT], vec![0; COUNT]);
        let mut kept = Kept::default();
        let (mut moved, mut changed) = (0, 0);
        // The number of bundles behind some frames, in each of which so many items go and others have a new version, and
        // how often the size changed.
        let mut frames = |frames: usize, (goes, changes): (usize, usize), per_bundle| {
            let mut group_sizes = vec![kept.list.group_size()];
            for _ in 0..frames {
                bounds
                    .iter_mut()
                    .step_by(4)
                    .skip(moved)
                    .step_by(7)
                    .take(goes)
                    .for_each(|sphere| sphere.center.z = 50.0);
                versions[changed..][..changes].iter_mut().for_each(|version| *version += 1);
                (moved, changed) = (moved + 7 * goes, changed + changes);
                let columns =
                    ItemColumns { keys: &none, versions: &versions, bounds: &bounds, ..ItemColumns::default() };
                kept.frame(&columns, &view(), (true, per_bundle));
                check_bundles(&kept.list, per_bundle).unwrap();
                group_sizes.push(kept.list.group_size());
            }
            group_sizes.dedup();
            (kept.list.bundle_count(), group_sizes.len() - 1)
        };
        assert_eq!(frames(1, (0, 0), None), (100, 1));
        assert_eq!(frames(100, (0, 0), None), (100, 0), "another size costs more than it has saved");
        assert_eq!(frames(100, (0, 0), None), (25, 1));
        assert_eq!(frames(1, (1, 0), None), (25, 0), "it may go on resting");
        // One of 100 goes.
        assert_eq!(frames(5, (256, 0), None), (800, 1));
        assert_eq!(frames(1, (0, 0), Some(100)), (244, 1));
        assert_eq!(frames(1, (0, 0), None), (800, 1), "groups as before");
        assert_eq!(frames(100, (0, 0), None), (25, 1));
        // One of 100 has a new version.
        assert_eq!(frames(5, (0, 1024), None), (800, 1));
    }

    #[test]
    fn bundles_whose_items_have_no_versions_keep_their_size() {
        let mut kept = Kept::default();
        let keys = vec![0; 25_600];
        let counts = (0..300).map(|_| {
            kept.frame(&ItemColumns { keys: &keys, ..ItemColumns::default() }, &view(), (true, None));
            kept.list.bundle_count()
        });
        assert!(counts.into_iter().all(|count| count == 100));
    }

    #[test]
    fn a_list_is_kept_until_the_view_sees_other_items() {
        let near = BoundingSphere { center: DVec3::NEG_Z * 5.0, radius: 1.0 };
        let (mut bounds, mut keys, mut versions) = (vec![near; 1_000], vec![1; 1_000], vec![0; 1_000]);
        let mut kept = Kept::default();
        let frame = |kept: &mut Kept, (keys, bounds, versions): (&[u64], &[BoundingSphere], &[u64])| {
            let columns = ItemColumns { keys, bounds, versions, ..ItemColumns::default() };
            kept.frame(&columns, &view(), (true, None));
            kept.list.versions()
        };
        let first = frame(&mut kept, (&keys, &bounds, &versions));
        assert_eq!(frame(&mut kept, (&keys, &bounds, &versions)), first);
        bounds[700].center.x += 0.1;
        assert_eq!(frame(&mut kept, (&keys, &bounds, &versions)), first, "it sees the same items");
        versions[3] = 1;
        let with_version = frame(&mut kept, (&keys, &bounds, &versions));
        assert_eq!(with_version[0], first[0]);
        assert_ne!(with_version[1], first[1]);
        bounds[700].center.z = 50.0;
        let without_item = frame(&mut kept, (&keys, &bounds, &versions));
        assert_ne!(without_item[0], first[0]);
        assert_eq!(without_item[1], with_version[1]);
        keys[5] = 0;
        let in_other_order = frame(&mut kept, (&keys, &bounds, &versions));
        assert!(in_other_order[0] != without_item[0] && in_other_order[1] != without_item[1]);
        assert_eq!(kept.list.items()[0], 5);
        let none = frame(&mut kept, (&[], &[], &[]));
        assert!(none[0] != in_other_order[0] && kept.list.items().is_empty());
    }
}
