//! What an engine says about the objects that changed since the last frame.

use std::ops::Range;

/// Which objects of a scene changed since the last [`SceneRef`](super::SceneRef) that the same renderer was given,
/// whether or not that frame succeeded.
///
/// What a frame derives from an object is kept for the next frame, so a frame costs what changed. An object counts as
/// changed if its entry in any slice of the scene is not the same as in the last frame. Objects at indices that the
/// last frame did not have need not be reported, and indices that the scene no longer has are ignored. The order of
/// indices and repeated ones make no difference. The renderer itself notices changes of cameras, lights and assets;
/// after a change of a mesh or material, or its removal, it derives everything anew once.
///
/// An object that changed although it was not reported is drawn as it was. With debug assertions, a frame with such an
/// object fails instead, and the error names the object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Changes<'a> {
    /// Any object may have changed. Always correct: the renderer derives everything anew.
    #[default]
    Unknown,
    /// These objects may have changed, by index, and no others.
    Objects(&'a [u32]),
    /// The objects at the indices in these ranges may have changed, and no others.
    Ranges(&'a [Range<u32>]),
}

impl Changes<'_> {
    /// No object changed.
    pub const NONE: Self = Self::Objects(&[]);
}
