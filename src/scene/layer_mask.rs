//! Sets of layers, by which processes select objects.

use std::ops::BitOr;

/// Some of 32 layers, as bits. An object belongs to layers, and a process draws the objects of some: see
/// [`SceneRef::layers`](super::SceneRef::layers) and [`Selection::in_layers`](crate::command::Selection::in_layers).
///
/// ```
/// use drawloom::scene::LayerMask;
///
/// const WORLD: LayerMask = LayerMask::layer(0);
/// const OUTLINED: LayerMask = LayerMask::layer(1);
///
/// assert!((WORLD | OUTLINED).intersects(OUTLINED));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct LayerMask(pub u32);

impl LayerMask {
    /// No layer.
    pub const NONE: Self = Self(0);

    /// Every layer. A process that draws every layer draws objects of no layer too.
    pub const ALL: Self = Self(u32::MAX);

    /// One layer.
    ///
    /// # Panics
    /// If `number` is not below 32. For a constant, that is an error of the compiler.
    pub const fn layer(number: u32) -> Self {
        assert!(number < 32, "there are 32 layers");
        Self(1 << number)
    }

    /// Whether both have a layer in common.
    pub const fn intersects(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }
}

impl BitOr for LayerMask {
    type Output = Self;

    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl Default for LayerMask {
    fn default() -> Self {
        Self::ALL
    }
}
