//! Errors of scenes.

use super::TextureFormat;
use crate::handle::StaleHandle;

/// Why a scene, or a part of it, is invalid.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A mesh without a triangle.
    #[error("mesh `{mesh}` has no triangle")]
    EmptyMesh {
        /// Its name.
        mesh: String,
    },
    /// A triangle list whose number of indices, or of vertices if it has none, is not a multiple of 3.
    #[error("mesh `{mesh}`: its triangle list has {corners} corners, which is not a multiple of 3")]
    PartialTriangle {
        /// Its name.
        mesh: String,
        /// The number of indices or vertices.
        corners: usize,
    },
    /// Values of a [vertex attribute](super::VertexAttribute) that a mesh cannot have.
    #[error("mesh `{mesh}`: its attribute {attribute:?} {problem}")]
    InvalidAttribute {
        /// The name of the mesh.
        mesh: String,
        /// The name of the attribute.
        attribute: &'static str,
        /// What is wrong with it.
        problem: String,
    },
    /// [Buffers of the engine's own](super::Mesh::from_buffers) that no mesh can have.
    #[error("mesh `{mesh}`: {problem}")]
    InvalidMeshBuffers {
        /// The name of the mesh.
        mesh: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A [level of detail](super::LevelOfDetail) that a mesh cannot have.
    #[error("mesh `{mesh}`: its level of detail {level} {problem}")]
    InvalidLevel {
        /// The name of the mesh.
        mesh: String,
        /// The number of the level, counted from 1.
        level: usize,
        /// What is wrong with it.
        problem: String,
    },
    /// An index that points past the vertices.
    #[error("mesh `{mesh}`: index {index} points past its {vertices} vertices")]
    IndexOutOfRange {
        /// Its name.
        mesh: String,
        /// The index.
        index: u32,
        /// The number of vertices.
        vertices: usize,
    },
    /// An object that changed since the last frame, although [`SceneRef::changes`](super::SceneRef::changes) does not
    /// report it. It is found with debug assertions only.
    #[error("object {object} changed since the last frame, but the scene's changes do not report it")]
    UnreportedChange {
        /// The index of the first such object.
        object: usize,
    },
    /// A value of a [column](super::ObjectColumn) that changed since the last frame, although
    /// [`SceneRef::changes`](super::SceneRef::changes) does not report its object. It is found with debug assertions
    /// only.
    #[error(
        "the column {column:?} of object {object} changed since the last frame, but the scene's changes do not report it"
    )]
    UnreportedColumnChange {
        /// The name of the column.
        column: &'static str,
        /// The index of the first such object.
        object: usize,
    },
    /// A NaN or an infinity in a vertex.
    #[error("mesh `{mesh}`: vertex {vertex} is not finite")]
    NonFiniteVertex {
        /// Its name.
        mesh: String,
        /// The index of the vertex.
        vertex: usize,
    },
    /// A mesh whose bounding sphere has no finite radius.
    #[error("mesh `{mesh}` is too large for a bounding sphere")]
    MeshTooLarge {
        /// Its name.
        mesh: String,
    },
    /// Colours that are negative or not finite, an opacity or alpha cutoff outside 0 to 1, or too many textures.
    #[error(
        "material `{material}` has a colour that is negative or not finite, an opacity or alpha cutoff outside 0 to 1, or \
         more than 6 textures"
    )]
    InvalidMaterial {
        /// Its name.
        material: String,
    },
    /// A texture with an invalid size, or with mip levels that do not fit its size and format.
    #[error(
        "texture `{texture}` has {width}x{height} texels of {format:?} in levels of {bytes:?} bytes; both sides must be 1 \
         to 32768 and multiples of {side}, each level must be half as wide and high as the one before, and a block of \
         {side}x{side} texels has {block} bytes",
        side = format.block_side(),
        block = format.block_bytes()
    )]
    InvalidTexture {
        /// Its name.
        texture: String,
        /// Its format.
        format: TextureFormat,
        /// Its width in texels.
        width: u32,
        /// Its height in texels.
        height: u32,
        /// The number of bytes of each level.
        bytes: Vec<usize>,
    },
    /// An object whose position, orientation or scale is not finite, or whose orientation is not of unit length.
    #[error("object {object}: its transform is not finite, or its orientation is not of unit length")]
    InvalidTransform {
        /// Its index.
        object: usize,
    },
    /// An invalid light.
    #[error("light {light}: {reason}")]
    InvalidLight {
        /// Its index.
        light: usize,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// An invalid camera.
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
        /// `ambient` or `background`.
        name: &'static str,
    },
    /// Slices of a [`SceneRef`](super::SceneRef) whose lengths differ.
    #[error("the scene has {positions} positions but {count} {slice}")]
    UnequalSlices {
        /// The name of the slice.
        slice: &'static str,
        /// Its length.
        count: usize,
        /// The length of `positions`.
        positions: usize,
    },
    /// A [column](super::ObjectColumn) that has not one value for each object.
    #[error("the scene has {positions} objects but {count} values of the column {column:?}")]
    UnequalColumn {
        /// The name of the column.
        column: &'static str,
        /// The number of its values.
        count: usize,
        /// The number of objects.
        positions: usize,
    },
    /// Two [columns](super::ObjectColumn) of the same name.
    #[error("the scene has two columns {column:?}")]
    RepeatedColumn {
        /// Their name.
        column: &'static str,
    },
    /// Two [static groups](super::StaticGroup) of the same name.
    #[error("the scene has two static groups {static_group:?}")]
    RepeatedStaticGroup {
        /// Their name.
        static_group: String,
    },
    /// An object that is in two [static groups](super::StaticGroup).
    #[error("object {object} is in the static groups {:?} and {:?}, and can be in one only", static_groups[0], static_groups[1])]
    SharedObject {
        /// Its index.
        object: usize,
        /// The names of the static groups.
        static_groups: [String; 2],
    },
    /// A stale handle.
    #[error(transparent)]
    StaleHandle(#[from] StaleHandle),
}
