//! One draw.

use super::{DrawState, SortKey};

/// One draw of one object for one view, independent of any device (M 10.3). It refers to what it needs and owns nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RenderCommand {
    /// Where it comes among the view's commands.
    pub key: SortKey,
    /// The object: its index in the frame's scene.
    pub object: u32,
    /// Its mesh's slot.
    pub mesh: u32,
    /// Its material's slot.
    pub material: u32,
    /// Its fixed-function state.
    pub state: DrawState,
}

// A view of a hundred thousand commands is sorted and read several times a frame: memory traffic is its price.
const _: () = assert!(size_of::<RenderCommand>() <= 32);

impl RenderCommand {
    /// Takes the place of a command for an object that a process does not draw; it sorts behind all others.
    pub const NOTHING: Self = Self { key: SortKey::LAST, object: 0, mesh: 0, material: 0, state: DrawState::PLAIN };
}
