//! The fixed-function state of a draw, in one byte.

use crate::scene::{Blend, Topology};

/// Topology, culling, blending, and how often the mesh's edges are halved, quantised into a byte (M listing 10.1). Together
/// with the process that draws, it says which pipeline a command needs, and together with the mesh which triangles.
///
/// ```text
/// bit   7  6  5     | 4  3 | 2  1 | 0
///       subdivision | blend| cull | topology
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DrawState(u8);

impl DrawState {
    /// A single-sided opaque triangle list.
    pub const PLAIN: Self = Self(0);

    /// How many states there can be: every state's [`DrawState::index`] is below it.
    pub const COUNT: usize = 1 << 8;

    /// How often a mesh's edges can be halved.
    pub const FINEST: u32 = 7;

    /// The state with these parts.
    pub fn new(topology: Topology, cull: Cull, blend: Blend) -> Self {
        Self(topology as u8 | (cull as u8) << 1 | (blend as u8) << 3)
    }

    /// The same with the mesh's edges halved so often: at most [`DrawState::FINEST`] times.
    pub fn subdivided(self, halvings: u32) -> Self {
        Self(self.0 & 0b1_1111 | (halvings.min(Self::FINEST) as u8) << 5)
    }

    /// How often the mesh's edges are halved.
    pub fn halvings(self) -> u32 {
        u32::from(self.0 >> 5)
    }

    /// What of the state the pipeline depends on. A subdivided mesh is a triangle list, whatever it was before.
    pub fn of_pipeline(self) -> Self {
        match self.halvings() {
            0 => self,
            _ => Self::new(Topology::TriangleList, self.cull(), self.blend()),
        }
    }

    /// The byte, as a number to index by.
    pub fn index(self) -> usize {
        usize::from(self.0)
    }

    /// The state of this byte.
    pub(super) fn from_byte(byte: u8) -> Self {
        Self(byte)
    }

    /// The byte.
    pub(super) fn byte(self) -> u8 {
        self.0
    }

    /// How indices make triangles.
    pub fn topology(self) -> Topology {
        if self.0 & 1 == 0 { Topology::TriangleList } else { Topology::TriangleStrip }
    }

    /// Which triangles are left out.
    pub fn cull(self) -> Cull {
        match (self.0 >> 1) & 3 {
            0 => Cull::Back,
            1 => Cull::Front,
            _ => Cull::Nothing,
        }
    }

    /// How it mixes with what is behind it.
    pub fn blend(self) -> Blend {
        match (self.0 >> 3) & 3 {
            0 => Blend::None,
            1 => Blend::Alpha,
            2 => Blend::Additive,
            _ => Blend::Subtractive,
        }
    }
}

/// Which triangles are left out, by the way they are wound in the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Cull {
    /// Those that face away.
    #[default]
    Back = 0,
    /// Those that face the viewer: what faces away of a mirrored object.
    Front = 1,
    /// None.
    Nothing = 2,
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;

    #[test]
    fn every_part_survives_the_byte() {
        let mut seen = std::collections::BTreeSet::new();
        for topology in [Topology::TriangleList, Topology::TriangleStrip] {
            for cull in [Cull::Back, Cull::Front, Cull::Nothing] {
                for blend in [Blend::None, Blend::Alpha, Blend::Additive, Blend::Subtractive] {
                    let state = DrawState::new(topology, cull, blend);
                    assert_eq!((state.topology(), state.cull(), state.blend()), (topology, cull, blend));
                    assert!(state.index() < DrawState::COUNT);
                    let subdivided = state.subdivided(9);
                    assert_eq!((state.halvings(), subdivided.halvings()), (0, DrawState::FINEST));
                    assert_eq!(subdivided.subdivided(0), state);
                    assert_eq!(state.of_pipeline(), state);
                    assert_eq!(subdivided.of_pipeline(), DrawState::new(Topology::TriangleList, cull, blend));
                    assert!(seen.insert(state));
                }
            }
        }
    }
}
