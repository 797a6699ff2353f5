//! The state of a draw, in four bytes.

use crate::scene::{Blend, LevelOfDetail, Topology};

/// Topology, culling, blending, mask, subdivision level, level of detail and texture set in four bytes (M listing 10.1).
/// With the process that draws, it determines a command's pipeline and bind groups; with the mesh, its triangles.
///
/// ```text
/// bit   27 … 12     | 11 10  9        | 8  7  6     | 5    | 4  3 | 2  1 | 0
///       texture set | level of detail | subdivision | mask | blend| cull | topology
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct DrawState(u32);

impl DrawState {
    /// A single-sided opaque triangle list.
    pub const PLAIN: Self = Self(0);

    /// The number of states with texture set 0: their [`DrawState::index`] is less.
    pub const COUNT: usize = 1 << 12;

    /// The highest texture set.
    pub const MAX_TEXTURE_SET: u32 = u16::MAX as u32;

    /// The highest subdivision level: a mesh's edges can be halved 7 times.
    pub const MAX_SUBDIVISION_LEVEL: u32 = 7;

    /// The coarsest level of detail: see [`Mesh::levels`](crate::scene::Mesh::levels).
    pub const MAX_LEVEL_OF_DETAIL: u32 = LevelOfDetail::MAX_COUNT as u32;

    /// A state without a mask, of subdivision level 0, level of detail 0 and texture set 0.
    pub fn new(topology: Topology, cull: Cull, blend: Blend) -> Self {
        Self(topology as u32 | (cull as u32) << 1 | (blend as u32) << 3)
    }

    /// The same state with another topology.
    pub(crate) fn with_topology(self, topology: Topology) -> Self {
        Self(self.0 & !1 | topology as u32)
    }

    /// The same state of an object whose material [is a mask](crate::scene::Material::is_masked), or is not.
    pub fn with_mask(self, is_masked: bool) -> Self {
        Self(self.0 & !(1 << 5) | u32::from(is_masked) << 5)
    }

    /// Whether the object's material is a mask.
    pub fn is_masked(self) -> bool {
        self.0 & 1 << 5 != 0
    }

    /// The same state with another subdivision level, at most [`DrawState::MAX_SUBDIVISION_LEVEL`].
    pub fn with_subdivision_level(self, level: u32) -> Self {
        Self(self.0 & !(0b111 << 6) | level.min(Self::MAX_SUBDIVISION_LEVEL) << 6)
    }

    /// How often the mesh's edges are halved.
    pub fn subdivision_level(self) -> u32 {
        self.0 >> 6 & 0b111
    }

    /// The same state with another level of detail, at most [`DrawState::MAX_LEVEL_OF_DETAIL`].
    pub fn with_level_of_detail(self, level: u32) -> Self {
        Self(self.0 & !(0b111 << 9) | level.min(Self::MAX_LEVEL_OF_DETAIL) << 9)
    }

    /// Which of the mesh's levels is drawn: 0 for the mesh itself.
    pub fn level_of_detail(self) -> u32 {
        self.0 >> 9 & 0b111
    }

    /// The same state with another texture set, at most [`DrawState::MAX_TEXTURE_SET`].
    pub(crate) fn with_texture_set(self, set: u32) -> Self {
        Self(self.0 & 0xfff | set.min(Self::MAX_TEXTURE_SET) << 12)
    }

    /// Which [set of textures](crate::view::TextureSets) is bound while it is drawn.
    pub fn texture_set(self) -> u32 {
        self.0 >> 12
    }

    /// The part of the state that selects the pipeline, on which level of detail and texture set have no influence. A
    /// subdivided mesh is a triangle list, whatever its own topology is.
    pub fn pipeline_state(self) -> Self {
        match self.subdivision_level() {
            0 => self.with_level_of_detail(0).with_texture_set(0),
            _ => Self::new(Topology::TriangleList, self.cull(), self.blend()).with_mask(self.is_masked()),
        }
    }

    /// The bits as an index: [`DrawState::from_bits`] is the inverse.
    pub fn index(self) -> usize {
        self.0 as usize
    }

    /// The state with these bits, which are its [index](DrawState::index); `None` if there is none.
    pub fn from_bits(bits: u32) -> Option<Self> {
        (bits >> 28 == 0).then_some(Self(bits))
    }

    /// The bits.
    pub(super) fn bits(self) -> u32 {
        self.0
    }

    /// How indices form triangles.
    pub fn topology(self) -> Topology {
        if self.0 & 1 == 0 { Topology::TriangleList } else { Topology::TriangleStrip }
    }

    /// Which triangles are culled.
    pub fn cull(self) -> Cull {
        match (self.0 >> 1) & 3 {
            0 => Cull::Back,
            1 => Cull::Front,
            _ => Cull::Nothing,
        }
    }

    /// How it blends with the target.
    pub fn blend(self) -> Blend {
        match (self.0 >> 3) & 3 {
            0 => Blend::None,
            1 => Blend::Alpha,
            2 => Blend::Additive,
            _ => Blend::Subtractive,
        }
    }
}

/// Which triangles are culled, by their winding in the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Cull {
    /// Triangles that face away.
    #[default]
    Back = 0,
    /// Triangles that face the viewer: a mirrored object's back faces.
    Front = 1,
    /// None.
    Nothing = 2,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_field_survives_the_bits() {
        let mut seen = std::collections::BTreeSet::new();
        for topology in [Topology::TriangleList, Topology::TriangleStrip] {
            for cull in [Cull::Back, Cull::Front, Cull::Nothing] {
                for blend in [Blend::None, Blend::Alpha, Blend::Additive, Blend::Subtractive] {
                    for is_masked in [false, true] {
                        let state = DrawState::new(topology, cull, blend).with_mask(is_masked);
                        assert_eq!((state.topology(), state.cull(), state.blend()), (topology, cull, blend));
                        assert_eq!((state.is_masked(), state.with_mask(false).is_masked()), (is_masked, false));
                        assert!(state.index() < DrawState::COUNT);
                        assert_eq!(DrawState::from_bits(state.bits()), Some(state));
                        let subdivided = state.with_subdivision_level(9);
                        assert_eq!(
                            (state.subdivision_level(), subdivided.subdivision_level()),
                            (0, DrawState::MAX_SUBDIVISION_LEVEL)
                        );
                        assert_eq!(subdivided.with_subdivision_level(0), state);
                        assert_eq!(state.pipeline_state(), state);
                        let list = DrawState::new(Topology::TriangleList, cull, blend).with_mask(is_masked);
                        assert_eq!(subdivided.pipeline_state(), list);
                        let coarse = subdivided.with_level_of_detail(9);
                        assert_eq!(
                            (state.level_of_detail(), coarse.level_of_detail(), coarse.subdivision_level()),
                            (0, DrawState::MAX_LEVEL_OF_DETAIL, DrawState::MAX_SUBDIVISION_LEVEL)
                        );
                        assert_eq!(coarse.with_level_of_detail(0), subdivided);
                        assert_eq!(state.with_level_of_detail(3).with_texture_set(5).pipeline_state(), state);
                        let textured = coarse.with_texture_set(1 << 20);
                        assert_eq!(
                            (textured.texture_set(), textured.level_of_detail(), textured.cull()),
                            (DrawState::MAX_TEXTURE_SET, DrawState::MAX_LEVEL_OF_DETAIL, cull)
                        );
                        assert_eq!((textured.with_texture_set(0), coarse.texture_set()), (coarse, 0));
                        assert_eq!(DrawState::from_bits(textured.bits()), Some(textured));
                        assert!(seen.insert(state));
                    }
                }
            }
        }
    }

    #[test]
    fn no_state_has_more_bits_than_all_fields_together() {
        assert!(DrawState::from_bits((1 << 28) - 1).is_some());
        assert_eq!(DrawState::from_bits(1 << 28), None);
    }
}
