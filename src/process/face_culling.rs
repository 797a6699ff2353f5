//! Which faces of objects a process draws.

use crate::command::Cull;

/// Which faces of objects a process draws.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum FaceCulling {
    /// Front faces; back faces too if the material is double-sided.
    #[default]
    ByMaterial,
    /// Back faces only. Of double-sided materials both are drawn. For outlines that are drawn as inverted hulls, for
    /// thickness, and for shadow maps with less bias.
    Reversed,
    /// Both faces: nothing is culled.
    Nothing,
}

impl FaceCulling {
    /// The faces to cull of an object whose draw state culls these.
    pub fn applied_to(self, cull: Cull) -> Cull {
        match (self, cull) {
            (Self::ByMaterial, cull) => cull,
            (Self::Nothing, _) | (Self::Reversed, Cull::Nothing) => Cull::Nothing,
            (Self::Reversed, Cull::Back) => Cull::Front,
            (Self::Reversed, Cull::Front) => Cull::Back,
        }
    }
}
