//! Which sides of objects a process draws.

use crate::command::Cull;

/// Which sides of objects a process draws, whatever their materials say.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum FaceCulling {
    /// The front, and the back too if the material is double-sided.
    #[default]
    ByMaterial,
    /// What the material culls: the back. Double-sided objects are drawn from both sides. For outlines that are drawn as inflated hulls,
    /// for thickness, and for shadow maps without a bias.
    Reversed,
    /// Both.
    Nothing,
}

impl FaceCulling {
    /// What is culled of an object for which its material culls this.
    pub fn applied_to(self, cull: Cull) -> Cull {
        match (self, cull) {
            (Self::ByMaterial, cull) => cull,
            (Self::Nothing, _) | (Self::Reversed, Cull::Nothing) => Cull::Nothing,
            (Self::Reversed, Cull::Back) => Cull::Front,
            (Self::Reversed, Cull::Front) => Cull::Back,
        }
    }
}
