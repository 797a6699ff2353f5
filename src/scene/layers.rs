//! Layers: sets of objects that processes draw.

/// Some of 32 layers, as bits. An object belongs to layers, and a process draws the objects of some: see
/// [`SceneRef::layers`](super::SceneRef::layers) and [`Selection::layers`](crate::command::Selection::layers).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct Layers(pub u32);

impl Layers {
    /// Every layer. A process that draws every layer draws objects of no layer too.
    pub const ALL: Self = Self(u32::MAX);

    /// Whether both have a layer in common.
    pub const fn intersect(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }
}

impl Default for Layers {
    fn default() -> Self {
        Self::ALL
    }
}
