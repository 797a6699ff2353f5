//! The bounds of all blocks of objects: a hierarchy above those of their words.

use std::ops::Range;

use drawloom_jobs::internal::block_ranges;

use super::bounds4::{Bounds4, Overlap};
use super::frustum::Frustum;

/// Bounds of blocks, and of groups of [`Bounds4::GROUPS`] blocks. Each level tests four groups at once.
#[derive(Debug, Default)]
pub(crate) struct BlockBounds {
    /// The blocks, in groups.
    blocks: Vec<Bounds4>,
    /// The groups of blocks, in groups.
    groups: Vec<Bounds4>,
}

impl BlockBounds {
    /// Makes room for some blocks. New ones have no objects.
    pub(super) fn resize(&mut self, blocks: usize) {
        let groups = blocks.div_ceil(Bounds4::GROUPS);
        self.blocks.resize_with(groups, Bounds4::default);
        self.groups.resize_with(groups.div_ceil(Bounds4::GROUPS), Bounds4::default);
    }

    /// Replaces the bounds of a block by those around its words.
    pub(super) fn set(&mut self, block: usize, words: &Bounds4) {
        let group = block / Bounds4::GROUPS;
        self.blocks[group].set_union(block % Bounds4::GROUPS, words);
        self.groups[group / Bounds4::GROUPS].set_union(group % Bounds4::GROUPS, &self.blocks[group]);
    }

    /// Calls `visit` with the blocks of a range, in order, and how they lie; not with those that lie outside a frustum
    /// as a whole.
    pub(crate) fn visit_overlapping(
        &self,
        frustum: &Frustum,
        blocks: Range<usize>,
        mut visit: impl FnMut(usize, Overlap),
    ) {
        const BLOCKS: usize = Bounds4::GROUPS;
        for (index, blocks) in block_ranges(blocks, BLOCKS * Bounds4::GROUPS) {
            let overlaps_of_groups = frustum.overlaps(&self.groups[index]);
            for (group, blocks) in block_ranges(blocks, BLOCKS) {
                if overlaps_of_groups[group % Bounds4::GROUPS] == Overlap::Outside {
                    continue;
                }
                let overlaps = frustum.overlaps(&self.blocks[group]);
                for block in blocks.filter(|block| overlaps[block % BLOCKS] != Overlap::Outside) {
                    visit(block, overlaps[block % BLOCKS]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use proptest::prelude::*;

    use super::*;
    use crate::scene::Camera;
    use crate::view::{BoundingSphere, BoundingSpheres};

    fn bounds_of(sphere: BoundingSphere) -> Bounds4 {
        let mut table = BoundingSpheres::default();
        table.set(0, sphere);
        let mut words = Bounds4::default();
        words.set_word(0, &table);
        words
    }

    proptest! {
        /// Blocks of one object each: those that the sphere's own test finds are visited, and few others.
        #[test]
        fn no_block_with_a_visible_object_is_left_out(
            before in prop::collection::vec(prop::array::uniform3(-20.0..20.0_f64), 0..40),
            centers in prop::collection::vec(prop::array::uniform3(-20.0..20.0_f64), 1..70),
            range in (0_usize..70, 0_usize..70),
        ) {
            let frustum = Frustum::new(&Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z));
            let spheres = centers.iter().map(|&center| BoundingSphere { center: center.into(), radius: 0.5 });
            let mut bounds = BlockBounds::default();
            // Earlier objects lie somewhere else.
            bounds.resize(before.len());
            for (block, &center) in before.iter().enumerate() {
                bounds.set(block, &bounds_of(BoundingSphere { center: center.into(), radius: 0.5 }));
            }
            bounds.resize(centers.len());
            let mut expected = Vec::new();
            let range = range.0.min(centers.len())..range.1.min(centers.len());
            for (block, sphere) in spheres.enumerate() {
                bounds.set(block, &bounds_of(sphere));
                if range.contains(&block) && frustum.intersects_sphere(sphere.center, sphere.radius) {
                    expected.push(block);
                }
            }
            let mut visited = Vec::new();
            bounds.visit_overlapping(&frustum, range, |block, _| visited.push(block));
            prop_assert!(visited.is_sorted() && expected.iter().all(|block| visited.contains(block)));
            prop_assert!(visited.len() <= expected.len() + 2 + centers.len() / 10, "{visited:?} {expected:?}");
        }
    }
}
