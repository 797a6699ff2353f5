//! The bounds of groups of spheres, and of blocks of objects: what lies outside or inside a frustum as a whole needs no
//! test of its spheres.

// Loops over the indices of arrays of a fixed length compile to vector instructions; chains of iterators do not always.
#![allow(clippy::needless_range_loop)]

use std::ops::Range;

use drawloom_jobs::internal::block_ranges;
use multiversion::multiversion;

use super::frustum::{Frustum, ROUNDING_TOLERANCE};
use super::{BoundingSphere, BoundingSpheres};
use crate::bit_set::BITS_PER_WORD;

/// The bounds of [`Bounds4::GROUPS`] groups of spheres: for each an axis-aligned box around the centres, and the
/// largest radius. A group is a word of spheres, a block, or a group of blocks.
///
/// They are a hierarchy of bounding volumes (Clark, "Hierarchical Geometric Models for Visible Surface Algorithms",
/// 1976). The groups are tested together, in about the time of four spheres.
#[derive(Clone, Debug)]
pub(crate) struct Bounds4 {
    /// The corners of the boxes in the world, in metres.
    lows: [PerGroup; 3],
    highs: [PerGroup; 3],
    /// In metres; negative infinity for a group without spheres.
    radii: PerGroup,
}

/// One number of each group.
type PerGroup = [f64; Bounds4::GROUPS];

/// One number of each sphere of a word.
type Word<T> = [T; BITS_PER_WORD];

/// How the spheres of a group lie relative to a frustum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Overlap {
    /// [`Frustum::intersects_spheres`] finds none of them.
    Outside,
    /// They have to be tested.
    #[default]
    Partial,
    /// [`Frustum::intersects_spheres`] finds all of them, and that they are entirely inside.
    Inside,
}

impl Bounds4 {
    pub(crate) const GROUPS: usize = BoundingSpheres::COUNT / BITS_PER_WORD;

    /// Computes the bounds of a word of spheres. Empty spheres make no difference.
    #[inline(always)]
    pub(super) fn set_word(&mut self, word: usize, spheres: &BoundingSpheres) {
        let radii = word_of(spheres.radii(), word);
        let has_empty = radii.iter().fold(false, |found, radius| found | (*radius < 0.0));
        self.radii[word] = f64::from(reduce(radii, |one, other| if other > one { other } else { one }));
        for (axis, coordinates) in spheres.coordinates().iter().enumerate() {
            let coordinates = word_of(coordinates, word);
            let [low, high] = if has_empty { filled_extent(coordinates, radii) } else { extent(coordinates) };
            self.lows[axis][word] = low;
            self.highs[axis][word] = high;
        }
    }

    /// Extends the bounds of a word by one sphere.
    pub(super) fn extend_word(&mut self, word: usize, sphere: BoundingSphere) {
        if sphere.radius >= 0.0 {
            self.radii[word] = self.radii[word].max(f64::from(sphere.radius));
            for (axis, coordinate) in sphere.center.to_array().into_iter().enumerate() {
                self.lows[axis][word] = self.lows[axis][word].min(coordinate);
                self.highs[axis][word] = self.highs[axis][word].max(coordinate);
            }
        }
    }

    /// Replaces the bounds of a group by those around all groups of another level.
    pub(crate) fn set_union(&mut self, group: usize, parts: &Self) {
        self.radii[group] = parts.radii.into_iter().fold(f64::NEG_INFINITY, f64::max);
        for axis in 0..3 {
            self.lows[axis][group] = parts.lows[axis].into_iter().fold(f64::INFINITY, f64::min);
            self.highs[axis][group] = parts.highs[axis].into_iter().fold(f64::NEG_INFINITY, f64::max);
        }
    }
}

/// The entries of a word.
#[inline(always)]
fn word_of<T>(column: &[T; BoundingSpheres::COUNT], word: usize) -> &Word<T> {
    column[word * BITS_PER_WORD..].first_chunk().expect("a column is of whole words")
}

/// The least and the greatest of some coordinates.
#[inline(always)]
fn extent(coordinates: &Word<f64>) -> [f64; 2] {
    let least = reduce(coordinates, |one, other| if other < one { other } else { one });
    let greatest = reduce(coordinates, |one, other| if other > one { other } else { one });
    [least, greatest]
}

/// The least and the greatest coordinate of the spheres that are not empty.
#[cold]
fn filled_extent(coordinates: &Word<f64>, radii: &Word<f32>) -> [f64; 2] {
    let filled = coordinates.iter().zip(radii).filter(|(_, radius)| **radius >= 0.0);
    filled.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (&coordinate, _)| {
        [low.min(coordinate), high.max(coordinate)]
    })
}

/// One number made of all of them, in the order of a tournament: each round makes one number of two, all of which
/// compile to a few vector instructions. `choose` must not depend on the order.
#[inline(always)]
fn reduce<T: Copy + Default>(numbers: &Word<T>, choose: impl Fn(T, T) -> T) -> T {
    const HALF: usize = BITS_PER_WORD / 2;
    let mut chosen = [T::default(); HALF];
    for index in 0..HALF {
        chosen[index] = choose(numbers[index], numbers[index + HALF]);
    }
    for half in [16, 8, 4, 2, 1] {
        for index in 0..half {
            chosen[index] = choose(chosen[index], chosen[index + half]);
        }
    }
    chosen[0]
}

impl Default for Bounds4 {
    fn default() -> Self {
        let (low, high) = ([f64::INFINITY; Self::GROUPS], [f64::NEG_INFINITY; Self::GROUPS]);
        Self { lows: [low; 3], highs: [high; 3], radii: high }
    }
}

impl Frustum {
    /// How the spheres of each group lie.
    ///
    /// A verdict other than [`Overlap::Partial`] is that of [`Frustum::intersects_spheres`] on each sphere. That
    /// computes the distance of a centre c from a plane with an error of at most 12uN + 2u|o|, where N = ‖c‖₁ and o is
    /// the plane's offset, and compares it with the radius r and a tolerance of 16u(N + r) and some roundings of that.
    /// Here everything is computed in f64, whose rounding errors are negligible, and the margin of 64u(N + r) + 4u|o|,
    /// of the largest N and r in the group, exceeds all of it.
    pub(crate) fn overlaps(&self, bounds: &Bounds4) -> [Overlap; Bounds4::GROUPS] {
        overlaps(self, bounds)
    }

    /// Whether a sphere of a group may lie beyond the far plane as a whole, so that [`Frustum::intersects_spheres`]
    /// does not find it.
    pub(crate) fn may_end_before(&self, bounds: &Bounds4, group: usize) -> bool {
        if self.far.is_infinite() {
            return false;
        }
        let (low, high) = (bounds.lows.map(|axis| axis[group]), bounds.highs.map(|axis| axis[group]));
        let (mut farthest, mut norm) = (0.0, 0.0);
        for axis in 0..3 {
            let corners = [low[axis], high[axis]].map(|corner| corner - self.origin.to_array()[axis]);
            let forward = f64::from(self.forward.to_array()[axis]);
            farthest += f64::max(corners[0] * forward, corners[1] * forward);
            norm += f64::max(corners[0].abs(), corners[1].abs());
        }
        let tolerance = 4.0 * f64::from(ROUNDING_TOLERANCE) * (norm + bounds.radii[group].abs());
        farthest > f64::from(self.far) * (1.0 - f64::from(ROUNDING_TOLERANCE)) - tolerance
    }
}

#[multiversion(targets("x86_64+avx2"))]
fn overlaps(frustum: &Frustum, bounds: &Bounds4) -> [Overlap; Bounds4::GROUPS] {
    const MARGIN: f64 = 4.0 * ROUNDING_TOLERANCE as f64;
    const OFFSET_MARGIN: f64 = 0.25 * ROUNDING_TOLERANCE as f64;
    let origin = frustum.origin.to_array();
    let (mut middles, mut half_extents) = ([[0.0; Bounds4::GROUPS]; 3], [[0.0; Bounds4::GROUPS]; 3]);
    let mut margins = [0.0; Bounds4::GROUPS];
    for axis in 0..3 {
        for group in 0..Bounds4::GROUPS {
            let (low, high) = (bounds.lows[axis][group] - origin[axis], bounds.highs[axis][group] - origin[axis]);
            middles[axis][group] = (low + high) * 0.5;
            half_extents[axis][group] = (high - low) * 0.5;
            margins[group] += middles[axis][group].abs() + half_extents[axis][group];
        }
    }
    for group in 0..Bounds4::GROUPS {
        margins[group] = MARGIN * (margins[group] + bounds.radii[group].abs()) + f64::from(f32::MIN_POSITIVE);
    }
    // Of all planes, the least distances of the box's farthest and nearest corners; positive inside.
    let (mut farthest, mut nearest) = ([f64::INFINITY; Bounds4::GROUPS], [f64::INFINITY; Bounds4::GROUPS]);
    for &(normal, offset) in &frustum.planes {
        for group in 0..Bounds4::GROUPS {
            let (mut distance, mut extent) = (offset, 0.0);
            for axis in 0..3 {
                distance += normal[axis] * middles[axis][group];
                extent += normal[axis].abs() * half_extents[axis][group];
            }
            let margin = OFFSET_MARGIN * offset.abs();
            let (far, near) = (distance + extent + margin, distance - extent - margin);
            farthest[group] = if far < farthest[group] { far } else { farthest[group] };
            nearest[group] = if near < nearest[group] { near } else { nearest[group] };
        }
    }
    let mut overlaps = [Overlap::Partial; Bounds4::GROUPS];
    for group in 0..Bounds4::GROUPS {
        let reach = bounds.radii[group] + margins[group];
        overlaps[group] = if bounds.radii[group] < 0.0 || farthest[group] < -reach {
            Overlap::Outside
        } else if nearest[group] >= reach {
            Overlap::Inside
        } else {
            Overlap::Partial
        };
    }
    overlaps
}

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
    use crate::view::frustum::tests::any_camera;
    use crate::view::{BoundingSphere, BoundingSpheres};

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn a_group_that_ends_before_the_far_plane_has_no_sphere_beyond_it(
            camera in any_camera(),
            spheres in prop::collection::vec((prop::array::uniform3(-1.0..1.0_f64), 0.0..0.3_f64), 1..20),
            along in -0.5..1.5_f64,
        ) {
            let scale = if camera.far.is_finite() { f64::from(camera.far) } else { 10.0 };
            let middle = camera.position + (camera.orientation * glam::Vec3::NEG_Z).as_dvec3() * (along * scale);
            let mut bounds = Bounds4::default();
            let spheres: Vec<_> = spheres
                .into_iter()
                .map(|(offset, radius)| (middle + DVec3::from(offset) * (0.3 * scale), (radius * scale) as f32))
                .collect();
            spheres.iter().for_each(|&(center, radius)| bounds.extend_word(2, BoundingSphere { center, radius }));
            let frustum = Frustum::new(&camera);
            let forward = (camera.orientation * glam::Vec3::NEG_Z).as_dvec3();
            let is_beyond = |&(center, radius): &(DVec3, f32)| {
                (center - camera.position).dot(forward) - f64::from(radius) > f64::from(camera.far)
            };
            if spheres.iter().any(is_beyond) {
                prop_assert!(frustum.may_end_before(&bounds, 2));
            }
            let relative_box = relative_box(spheres.iter().map(|(center, _)| *center), &camera);
            let [_, farthest] = extent_along(relative_box, forward);
            let radius = spheres.iter().map(|(_, radius)| f64::from(*radius)).fold(0.0, f64::max);
            let tolerance = 2.0 * f64::from(ROUNDING_TOLERANCE);
            // A box clearly before the far plane has nothing beyond it.
            if farthest + 4.0 * tolerance * (norm(relative_box) + radius) < f64::from(camera.far) * (1.0 - tolerance) {
                prop_assert!(!frustum.may_end_before(&bounds, 2));
            }
        }

        #[test]
        fn a_verdict_on_a_group_is_that_on_each_of_its_spheres(
            camera in any_camera(),
            place in prop::array::uniform3(-1.0..1.0_f64),
            distance in -3.0..7.0_f64,
            extent in -3.0..7.0_f64,
            radius in -3.0..5.0_f32,
            spheres in prop::collection::vec((prop::array::uniform3(-1.0..1.0_f64), 0.0..1.0_f32, 0..5), 0..64),
        ) {
            check(&camera, place, distance, extent, radius, &spheres)?;
        }
    }

    /// The corners of a box around some points, relative to a camera.
    fn relative_box(points: impl Iterator<Item = DVec3>, camera: &Camera) -> [DVec3; 2] {
        points
            .map(|point| point - camera.position)
            .fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], point| [low.min(point), high.max(point)])
    }

    /// The least and the greatest coordinate of a box along an axis.
    fn extent_along([low, high]: [DVec3; 2], axis: DVec3) -> [f64; 2] {
        [(low * axis).min(high * axis), (low * axis).max(high * axis)].map(DVec3::element_sum)
    }

    /// The largest ‖p‖₁ of the points in a box.
    fn norm([low, high]: [DVec3; 2]) -> f64 {
        low.abs().max(high.abs()).element_sum()
    }

    fn check(
        camera: &Camera,
        place: [f64; 3],
        distance: f64,
        extent: f64,
        radius: f32,
        spheres: &[([f64; 3], f32, i32)],
    ) -> Result<(), TestCaseError> {
        let middle = camera.position + DVec3::from(place) * 10_f64.powf(distance);
        let mut table = BoundingSpheres::default();
        for (entry, &(offset, share, kind)) in spheres.iter().enumerate() {
            let center = middle + DVec3::from(offset) * 10_f64.powf(extent);
            let sphere = BoundingSphere { center, radius: share * 10_f32.powf(radius) };
            table.set(BITS_PER_WORD + entry, if kind == 0 { BoundingSphere::EMPTY } else { sphere });
        }
        let mut bounds = Bounds4::default();
        bounds.set_word(1, &table);
        let mut extended = Bounds4::default();
        (0..BITS_PER_WORD).for_each(|entry| extended.extend_word(1, table.get(BITS_PER_WORD + entry)));
        let mut union = Bounds4::default();
        union.set_union(2, &bounds);
        let frustum = Frustum::new(camera);
        let found = frustum.classify_spheres(&table, BITS_PER_WORD);
        let valid = (0..BITS_PER_WORD)
            .fold(0, |mask, entry| mask | u64::from(table.get(BITS_PER_WORD + entry).radius >= 0.0) << entry);
        let overlap = frustum.overlaps(&bounds)[1];
        prop_assert_eq!([frustum.overlaps(&extended)[1], frustum.overlaps(&union)[2]], [overlap; 2]);
        match overlap {
            Overlap::Outside => prop_assert_eq!(found.intersecting, 0),
            Overlap::Inside => prop_assert_eq!((found.intersecting, found.inside & valid), (valid, valid)),
            Overlap::Partial => {}
        }
        // More than twice the margin outside or inside, the box around the centres suffices.
        let filled: Vec<_> = (0..BITS_PER_WORD)
            .map(|entry| table.get(BITS_PER_WORD + entry))
            .filter(|sphere| sphere.radius >= 0.0)
            .collect();
        let relative_box = relative_box(filled.iter().map(|sphere| sphere.center), camera);
        let radius = filled.iter().map(|sphere| f64::from(sphere.radius)).fold(0.0, f64::max);
        let finite = frustum.planes.iter().filter(|(_, offset)| offset.is_finite());
        let distances = finite.map(|&(normal, offset)| {
            let margin =
                2.0 * f64::from(ROUNDING_TOLERANCE) * (4.0 * (norm(relative_box) + radius) + 0.25 * offset.abs());
            let [nearest, farthest] = extent_along(relative_box, DVec3::from(normal));
            (nearest + offset - margin - 1e-37, farthest + offset + margin + 1e-37)
        });
        let distances: Vec<_> = distances.collect();
        if !filled.is_empty() && distances.iter().any(|(_, farthest)| *farthest < -radius) {
            prop_assert_eq!(overlap, Overlap::Outside);
        } else if !filled.is_empty() && distances.iter().all(|(nearest, _)| *nearest > radius) {
            prop_assert_eq!(overlap, Overlap::Inside);
        }
        Ok(())
    }

    #[test]
    fn most_groups_need_no_test() {
        let camera = Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z);
        let frustum = Frustum::new(&camera);
        let verdict = |center: DVec3| {
            let mut table = BoundingSpheres::default();
            for entry in 0..BITS_PER_WORD {
                let offset = DVec3::new(entry as f64 % 8.0, entry as f64 / 8.0, 0.0) * 0.1;
                table.set(entry, BoundingSphere { center: center + offset, radius: 0.1 });
            }
            let mut bounds = Bounds4::default();
            bounds.set_word(0, &table);
            frustum.overlaps(&bounds)
        };
        assert_eq!(
            verdict(DVec3::new(0.0, 0.0, -20.0)),
            [Overlap::Inside, Overlap::Outside, Overlap::Outside, Overlap::Outside]
        );
        assert_eq!(verdict(DVec3::new(0.0, 0.0, 20.0))[0], Overlap::Outside);
        assert_eq!(verdict(DVec3::ZERO)[0], Overlap::Partial);
    }

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
