//! The bounding volumes that culling tests.

/// The bounding volume of objects that is tested against view frustums. A tighter volume draws fewer invisible objects,
/// and takes longer to test.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum CullingVolume {
    /// No culling: everything is drawn.
    None,
    /// The bounding sphere.
    #[default]
    Sphere,
    /// The axis-aligned bounding box. If an engine has set larger bounds than the mesh's, it is the box around those.
    Box,
    /// The oriented bounding box, along the object's axes. As for [`CullingVolume::Box`], an engine's bounds replace
    /// it.
    OrientedBox,
}
