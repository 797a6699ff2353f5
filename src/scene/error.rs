//! What can be wrong with a scene.

use crate::handle::StaleHandle;

/// Why something was refused by a scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A mesh without a triangle.
    #[error("mesh `{mesh}` has no triangle")]
    EmptyMesh {
        /// Its name.
        mesh: String,
    },
    /// A triangle list whose last triangle is not whole.
    #[error("mesh `{mesh}`: {indices} indices are no whole number of triangles")]
    PartialTriangle {
        /// Its name.
        mesh: String,
        /// How many indices it has.
        indices: usize,
    },
    /// An index that points past the vertices.
    #[error("mesh `{mesh}`: index {index} points past its {vertices} vertices")]
    IndexOutOfRange {
        /// Its name.
        mesh: String,
        /// The index.
        index: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A NaN or an infinity in a vertex.
    #[error("mesh `{mesh}`: vertex {vertex} is not finite")]
    NonFiniteVertex {
        /// Its name.
        mesh: String,
        /// Which vertex.
        vertex: usize,
    },
    /// A mesh that no sphere of a finite radius holds.
    #[error("mesh `{mesh}` is too large for a bounding sphere")]
    MeshTooLarge {
        /// Its name.
        mesh: String,
    },
    /// Colours that are negative or not finite, or an opacity outside 0 to 1.
    #[error("material `{material}` has a colour that is negative or not finite, or an opacity outside 0 to 1")]
    InvalidMaterial {
        /// Its name.
        material: String,
    },
    /// A texture of a size that cannot be, or that its bytes do not have.
    #[error("texture `{texture}`: {width}x{height} pixels in {bytes} bytes")]
    InvalidTexture {
        /// Its name.
        texture: String,
        /// In pixels.
        width: u32,
        /// In pixels.
        height: u32,
        /// Bytes given.
        bytes: usize,
    },
    /// An object whose position, orientation or scale is not finite, or whose orientation is no rotation.
    #[error("object {object}: its transform is not finite, or its orientation is not of unit length")]
    InvalidTransform {
        /// Its index.
        object: usize,
    },
    /// A light that cannot be.
    #[error("light {light}: {reason}")]
    InvalidLight {
        /// Its index.
        light: usize,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// A camera that cannot be.
    #[error("camera `{camera}`: {reason}")]
    InvalidCamera {
        /// Its name.
        camera: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// An ambient light or a background that is negative or not finite.
    #[error("the scene's {name} is negative or not finite")]
    InvalidColor {
        /// Which of the two.
        name: &'static str,
    },
    /// Slices of a [`SceneRef`](super::SceneRef) whose lengths differ.
    #[error("the scene has {positions} positions but {count} {slice}")]
    UnequalSlices {
        /// Which slice differs.
        slice: &'static str,
        /// Its length.
        count: usize,
        /// The length of `positions`.
        positions: usize,
    },
    /// A handle to what was removed.
    #[error(transparent)]
    StaleHandle(#[from] StaleHandle),
}
