//! The sort key of commands.

use super::DrawState;

/// The 64-bit sort key of a command within its pass (M 10.5, "Sorting and Instancing"); smaller keys are drawn first.
/// Commands with equal keys are ordered by object index.
///
/// ```text
/// bit    63 62 | 61 … 55 | 54 … 47     | 46 … 23 | 22 … 20         | 19 … 0
/// opaque  0  0 | state   | texture set | mesh    | level of detail | depth, near to far
///
/// bit    63 62 | 61 … 30             | 29 … 0
/// blended 0 1  | depth, far to near  | 0
/// ordered 0 1  | number              | 0
/// empty   1 1  | 1 … 1               | 1 … 1
/// ```
///
/// Commands of a process with a [draw order](super::DrawOrder) of its own are all ordered by a number, opaque or not.
///
/// The picture depends on bits 63 and 62 (blended after opaque), on the depth of blended commands and on those numbers.
/// All other bits only save state changes and overdraw. Depths are codes of a
/// [`DepthPrecision`](crate::quality::DepthPrecision): the upper 20 bits for opaque commands, all 32 for blended ones.
/// A [`DepthPrecision`](crate::quality::DepthPrecision) with fewer bits leaves the lower ones equal in all keys, and
/// the sort skips bits that are equal.
///
/// Materials have no bits: shaders find them by object, so a change of material is no change of state, and sorting by
/// material would split batches. Of the texture set's number a key has the lower 8 bits, and of the mesh's the lower 24:
/// draws of others in between only split batches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SortKey(u64);

impl SortKey {
    /// The smallest key.
    pub const FIRST: Self = Self(0);

    /// The largest key, of empty commands.
    pub const LAST: Self = Self(u64::MAX);

    /// The key of an opaque command: by state, texture set, mesh and level of detail, then front to back. `depth` is a
    /// [quantised](crate::quality::DepthPrecision::quantize) depth.
    pub fn opaque(state: DrawState, mesh: u32, depth: u32) -> Self {
        let (bits, level) = (u64::from(state.bits()), u64::from(state.level_of_detail()));
        // Subdivision level, mask, culling and topology.
        let fixed = (bits >> 5 & 0b1111) << 3 | bits & 0b111;
        let (set, mesh) = (u64::from(state.texture_set() & 0xff), u64::from(mesh & 0xff_ffff));
        Self(fixed << 55 | set << 47 | mesh << 23 | level << 20 | u64::from(depth >> 12))
    }

    /// The key of a blended command: back to front, exact to the last bit of `depth`, a
    /// [quantised](crate::quality::DepthPrecision::quantize) depth.
    pub fn blended(depth: u32) -> Self {
        Self(1 << 62 | u64::from(!depth) << 30)
    }

    /// The key of a command in an order that a process chose: by `number`, the smallest first.
    pub fn ordered(number: u32) -> Self {
        Self(1 << 62 | u64::from(number) << 30)
    }

    /// The 64 bits.
    pub fn bits(self) -> u64 {
        self.0
    }

    /// The key with these 64 bits.
    pub fn from_bits(bits: u64) -> Self {
        Self(bits)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::command::Cull;
    use crate::quality::Quality;
    use crate::scene::{Blend, Topology};

    /// As [`Quality::exact`] has them, in a view from 5 cm to infinity.
    fn opaque_code(depth: f32) -> u32 {
        Quality::exact().opaque_order.quantize(depth, 0.05, f32::INFINITY)
    }

    fn blended_code(depth: f32) -> u32 {
        Quality::exact().blended_order.quantize(depth, 0.05, f32::INFINITY)
    }

    proptest! {
        #[test]
        fn blended_commands_go_strictly_back_to_front(first in any::<f32>(), second in any::<f32>()) {
            prop_assume!(!first.is_nan() && !second.is_nan());
            let key = |depth| SortKey::blended(blended_code(depth));
            prop_assert_eq!(Some(key(first).cmp(&key(second))), second.partial_cmp(&first));
        }

        #[test]
        fn opaque_commands_never_go_back_to_front(first in 0.0..f32::MAX, second in 0.0..f32::MAX) {
            let key = |depth| SortKey::opaque(DrawState::PLAIN, 4, opaque_code(depth));
            if first <= second {
                prop_assert!(key(first) <= key(second));
            }
            if first * 1.0005 < second && second > 0.05 {
                prop_assert!(key(first) < key(second), "{first} {second}");
            }
        }

        #[test]
        fn opaque_commands_go_by_texture_set_then_by_mesh_then_by_depth(
            first in (0..256_u32, 0..1_u32 << 24, any::<u32>()),
            second in (0..256_u32, 0..1_u32 << 24, any::<u32>()),
        ) {
            let key = |(set, mesh, depth)| SortKey::opaque(DrawState::PLAIN.with_texture_set(set), mesh, depth);
            if (first.0, first.1) < (second.0, second.1) {
                prop_assert!(key(first) < key(second));
            }
            prop_assert!(key(first) < SortKey::blended(u32::MAX), "whatever the set");
        }
    }

    #[test]
    fn opaque_keys_come_before_blended_ones_and_those_before_empty_ones() {
        let state = DrawState::new(Topology::TriangleStrip, Cull::Nothing, Blend::Subtractive);
        let last_opaque = SortKey::opaque(state, u32::MAX, u32::MAX);
        assert!(last_opaque < SortKey::blended(u32::MAX));
        assert!(SortKey::blended(0) < SortKey::LAST);
        assert_eq!(SortKey::blended(blended_code(-0.0)), SortKey::blended(blended_code(0.0)));
        assert_eq!(opaque_code(-0.0), opaque_code(0.0));
    }
}
