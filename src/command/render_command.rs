//! One draw.

use super::{DrawState, SortKey};

/// One draw of one object in one pass, independent of any device (M 10.3). It refers to what it needs and owns nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RenderCommand {
    /// Its position in the pass's order.
    pub key: SortKey,
    /// The object's index in the scene.
    pub object: u32,
    /// Its mesh's slot.
    pub mesh: u32,
    /// Its material's slot.
    pub material: u32,
    /// Its fixed-function state.
    pub state: DrawState,
}

// Views of a hundred thousand commands are sorted and read several times a frame: their size is memory traffic.
const _: () = assert!(size_of::<RenderCommand>() <= 32);

impl RenderCommand {
    /// The placeholder for an object that the process does not draw. It sorts behind all others.
    pub const EMPTY: Self = Self { key: SortKey::LAST, object: 0, mesh: 0, material: 0, state: DrawState::PLAIN };
}
