//! Errors and warnings about OBJ files.

use std::io;

use crate::scene::SceneError;

/// Why an OBJ file could not be loaded. Every message names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ObjError {
    /// The file is missing, is a directory, or may not be read.
    #[error("cannot read `{file}`: {source}")]
    Unreadable {
        /// The file.
        file: String,
        /// The error of the operating system.
        source: io::Error,
    },
    /// The file is not UTF-8 text.
    #[error("`{file}` is not UTF-8 text: byte {offset} is invalid")]
    NotText {
        /// The file.
        file: String,
        /// The first invalid byte, counted from 0.
        offset: usize,
    },
    /// A malformed line.
    #[error("`{file}`, line {line}: {reason}")]
    Malformed {
        /// The file.
        file: String,
        /// The line, counted from 1.
        line: usize,
        /// Why it is malformed.
        reason: String,
    },
    /// tobj could not parse the file although every line is well-formed.
    #[error("`{file}`: {reason}")]
    Refused {
        /// The file.
        file: String,
        /// The error of tobj.
        reason: String,
    },
    /// The file has nothing to draw.
    #[error(
        "`{file}` has no triangle to draw ({degenerate_triangles} degenerate triangles, {points} points, {lines} lines)"
    )]
    NoTriangles {
        /// The file.
        file: String,
        /// The number of triangles without area.
        degenerate_triangles: usize,
        /// The number of points, which are not drawn.
        points: usize,
        /// The number of lines, which are not drawn.
        lines: usize,
    },
    /// An asset or object of the file is invalid.
    #[error("`{file}`: {source}")]
    Scene {
        /// The file.
        file: String,
        /// The error of the scene.
        source: SceneError,
    },
}

/// Something in an OBJ file that was left out or replaced.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ObjWarning {
    /// A `.mtl` file that cannot be read. Its materials are then undefined.
    #[error("material library `{library}` cannot be read: {reason}")]
    MissingLibrary {
        /// Its name in the OBJ file.
        library: String,
        /// The error of the operating system.
        reason: String,
    },
    /// A line of a `.mtl` file that was left out or changed.
    #[error("material library `{library}`, line {line}: {reason}")]
    LibraryLine {
        /// Its name in the OBJ file.
        library: String,
        /// The line, counted from 1.
        line: usize,
        /// What is wrong with it, and what was done about it.
        reason: String,
    },
    /// A material that is used but not defined. Objects that use it get the default material.
    #[error("material `{material}` is not defined and was replaced by the default material")]
    UndefinedMaterial {
        /// Its name in `usemtl`.
        material: String,
    },
    /// Nearly every material has opacity 0, because the exporter wrote transparency as opacity. All materials are opaque
    /// instead.
    #[error("{invisible} of {materials} materials have opacity 0, so all are treated as opaque")]
    InvertedOpacity {
        /// The number of materials with opacity 0.
        invisible: usize,
        /// The number of materials with an opacity.
        materials: usize,
    },
    /// A texture that is missing or cannot be decoded. The material keeps its plain colour.
    #[error("texture `{texture}` of material `{material}` cannot be used: {reason}")]
    UnusableTexture {
        /// Its path, relative to the OBJ file.
        texture: String,
        /// The material.
        material: String,
        /// The error of the operating system or the decoder.
        reason: String,
    },
    /// A texture larger than [`Texture::MAX_SIZE`](crate::scene::Texture::MAX_SIZE), which was scaled down to it.
    #[error("texture `{texture}` of {width}x{height} pixels was scaled down")]
    ScaledTexture {
        /// Its path, relative to the OBJ file.
        texture: String,
        /// Its original width in pixels.
        width: u32,
        /// Its original height in pixels.
        height: u32,
    },
    /// A model without a triangle that can be drawn.
    #[error("model `{model}` has no triangle to draw ({degenerate_triangles} degenerate) and was left out")]
    EmptyModel {
        /// Its name.
        model: String,
        /// The number of triangles without area.
        degenerate_triangles: usize,
    },
    /// Elements other than polygons, which were left out.
    #[error("{points} points, {lines} lines and {surfaces} free-form curves or surfaces were left out")]
    NotDrawn {
        /// The number of points.
        points: usize,
        /// The number of lines.
        lines: usize,
        /// The number of curves and surfaces.
        surfaces: usize,
    },
    /// Normals that are zero or not finite. They were replaced by face normals.
    #[error("{normals} normals are zero or not finite and were replaced by face normals")]
    ReplacedNormals {
        /// Their number.
        normals: usize,
    },
    /// Texture coordinates that are not finite. They were replaced by 0.
    #[error("{coordinates} texture coordinates are not finite and were replaced by 0")]
    ReplacedTextureCoordinates {
        /// Their number.
        coordinates: usize,
    },
    /// Corners of faces that refer to a normal or texture coordinates that the file does not contain. The reference was
    /// dropped.
    #[error("{corners} corners of faces refer to a missing normal or missing texture coordinates")]
    DanglingCorners {
        /// Their number.
        corners: usize,
    },
    /// Polygons that intersect themselves, or are concave with more than 256 corners. They became triangle fans.
    #[error("model `{model}` has {polygons} polygons that intersect themselves or are too large, and may look wrong")]
    FannedPolygons {
        /// Its name.
        model: String,
        /// Their number.
        polygons: usize,
    },
}
