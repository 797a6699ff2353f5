//! The order of commands.

use super::DrawState;

/// The 64-bit order of a command within its view (M 10.5, "Sorting and Instancing"); smaller comes first. Commands with
/// equal keys are ordered by their object's index.
///
/// ```text
/// bit    63 62 | 61 … 54 | 53 52 | 51 … 20 | 19 … 0
/// opaque  0  0 | state   | 0     | mesh    | depth, near to far
///
/// bit    63 62 | 61 … 30             | 29 … 0
/// blended 0 1  | depth, far to near  | 0
/// nothing 1 1  | 1 … 1               | 1 … 1
/// ```
///
/// Bits that the picture depends on: 63 and 62 (blended after opaque), and the depth of blended commands, which is the
/// whole f32. All others only save state changes and overdraw. The depth of opaque commands is the upper 20 bits of the f32
/// below its sign: steps of 2⁻¹² to 2⁻¹¹ of the distance, at any distance.
///
/// Materials have no bits: shaders find them by object, so another material is no change of state, and were commands
/// ordered by it, fewer of them would become one draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct SortKey(u64);

impl SortKey {
    /// Before every other, or the same.
    pub const FIRST: Self = Self(0);

    /// Behind every other.
    pub const LAST: Self = Self(u64::MAX);

    /// The key of an opaque command: by state and mesh, then front to back.
    ///
    /// `depth` is the distance along the view's axis in metres; what lies behind the camera counts as 0.
    pub fn opaque(state: DrawState, mesh: u32, depth: f32) -> Self {
        let state = (state.index() as u64 & 0xff) << 54;
        let mesh = u64::from(mesh) << 20;
        // The bits of a positive float grow with it. `max` also turns a NaN into 0, and the sum a −0, whose sign would be a
        // bit of the mesh.
        let depth = u64::from((depth.max(0.0) + 0.0).to_bits() >> 11);
        Self(state | mesh | depth)
    }

    /// The key of a blended command: strictly back to front, to the last bit of `depth`, the distance along the view's axis
    /// in metres.
    pub fn blended(depth: f32) -> Self {
        let near_to_far = u64::from(ordered_bits(depth));
        Self(1 << 62 | (u64::from(u32::MAX) - near_to_far) << 30)
    }

    /// The 64 bits.
    pub fn bits(self) -> u64 {
        self.0
    }

    /// The key with these 64 bits.
    pub fn from_bits(bits: u64) -> Self {
        Self(bits)
    }

    /// The state and the mesh's slot that the key of an opaque command repeats; `None` of any other key.
    pub(super) fn repeated(self) -> Option<(DrawState, u32)> {
        (self.0 >> 62 == 0).then(|| (DrawState::from_byte((self.0 >> 54) as u8), (self.0 >> 20) as u32))
    }
}

/// Maps a float to a number of the same order: negative ones have all their bits turned, the others only their sign.
fn ordered_bits(value: f32) -> u32 {
    // Both zeros are one depth.
    let bits = (value + 0.0).to_bits();
    if bits >> 31 == 1 { !bits } else { bits | 1 << 31 }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::command::Cull;
    use crate::scene::{Blend, Topology};

    proptest! {
        #[test]
        fn blended_commands_go_strictly_back_to_front(first in any::<f32>(), second in any::<f32>()) {
            prop_assume!(!first.is_nan() && !second.is_nan());
            let expected = second.partial_cmp(&first);
            prop_assert_eq!(Some(SortKey::blended(first).cmp(&SortKey::blended(second))), expected);
        }

        #[test]
        fn opaque_commands_never_go_back_to_front(first in 0.0..f32::MAX, second in 0.0..f32::MAX) {
            let key = |depth| SortKey::opaque(DrawState::PLAIN, 4, depth);
            if first <= second {
                prop_assert!(key(first) <= key(second));
            }
            if first * 1.0005 < second {
                prop_assert!(key(first) < key(second), "{first} {second}");
            }
        }

        #[test]
        fn opaque_commands_go_by_mesh_before_depth(
            first in (any::<u32>(), 0.0..1e9_f32),
            second in (any::<u32>(), 0.0..1e9_f32),
        ) {
            let key = |(mesh, depth)| SortKey::opaque(DrawState::PLAIN, mesh, depth);
            if first.0 < second.0 {
                prop_assert!(key(first) < key(second));
            }
        }

        #[test]
        fn only_an_opaque_key_repeats_state_and_mesh(byte in any::<u8>(), mesh in any::<u32>(), depth in any::<f32>()) {
            let state = DrawState::from_byte(byte);
            prop_assert_eq!(SortKey::opaque(state, mesh, depth).repeated(), Some((state, mesh)));
            prop_assert_eq!(SortKey::blended(depth).repeated(), None);
            prop_assert_eq!(SortKey::LAST.repeated(), None);
        }
    }

    #[test]
    fn opaque_comes_before_blended_comes_before_nothing() {
        let state = DrawState::new(Topology::TriangleStrip, Cull::Nothing, Blend::Subtractive);
        let last_opaque = SortKey::opaque(state, u32::MAX, f32::INFINITY);
        assert!(last_opaque < SortKey::blended(f32::INFINITY));
        assert!(SortKey::blended(f32::NEG_INFINITY) < SortKey::LAST);
        assert!(SortKey::opaque(state, 0, f32::NAN) < SortKey::blended(0.0));
        assert_eq!(SortKey::blended(-0.0), SortKey::blended(0.0));
        assert_eq!(SortKey::opaque(state, 2, -0.0), SortKey::opaque(state, 2, 0.0));
    }
}
