//! The bounding volumes that culling tests.

/// What stands for an object when it is asked whether a view sees it: the smaller it is, the fewer objects are drawn that nobody
/// sees, and the longer it takes to ask.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum CullingVolume {
    /// Everything is drawn.
    None,
    /// The ball around it.
    #[default]
    Sphere,
    /// The box around it along the world's axes. An object whose bounds an engine made larger than its mesh has them as its box.
    Box,
    /// The box around its mesh along its own axes.
    OrientedBox,
}
