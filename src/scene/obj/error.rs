//! What can go wrong with an OBJ file, and what was made the best of.

use std::io;

use crate::scene::SceneError;

/// Why an OBJ file gave no scene. Every message names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ObjError {
    /// It is missing, a directory, or may not be read.
    #[error("cannot read `{file}`: {source}")]
    Unreadable {
        /// The file.
        file: String,
        /// What the system said.
        source: io::Error,
    },
    /// It is not UTF-8 text.
    #[error("`{file}` is not UTF-8 text: byte {offset} is wrong")]
    NotText {
        /// The file.
        file: String,
        /// The first byte that is wrong, counted from 0.
        offset: usize,
    },
    /// A line that cannot be understood.
    #[error("`{file}`, line {line}: {reason}")]
    Malformed {
        /// The file.
        file: String,
        /// The line, counted from 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// Every line was understood, but the whole was refused.
    #[error("`{file}`: {reason}")]
    Refused {
        /// The file.
        file: String,
        /// Why.
        reason: String,
    },
    /// Nothing in it can be drawn.
    #[error(
        "`{file}` has no triangle to draw ({degenerate_triangles} degenerate triangles, {points} points, {lines} lines)"
    )]
    NoTriangles {
        /// The file.
        file: String,
        /// Triangles without area.
        degenerate_triangles: usize,
        /// Points, which are not drawn.
        points: usize,
        /// Lines, which are not drawn.
        lines: usize,
    },
    /// The scene refused what the file brought.
    #[error("`{file}`: {source}")]
    Scene {
        /// The file.
        file: String,
        /// What it refused.
        source: SceneError,
    },
}

/// Something in an OBJ file that could not be taken as it is; the scene was made without it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ObjWarning {
    /// A `.mtl` file that cannot be read. Its materials are undefined then.
    #[error("material library `{library}` cannot be read: {reason}")]
    MissingLibrary {
        /// As the OBJ file names it.
        library: String,
        /// What the system said.
        reason: String,
    },
    /// A line of a `.mtl` file that was left out, or not taken as it is.
    #[error("material library `{library}`, line {line}: {reason}")]
    LibraryLine {
        /// As the OBJ file names it.
        library: String,
        /// The line, counted from 1.
        line: usize,
        /// What is wrong with it, and what was done.
        reason: String,
    },
    /// A material that is used but nowhere defined. Objects that use it get the default one.
    #[error("material `{material}` is not defined, and the default one takes its place")]
    UndefinedMaterial {
        /// As `usemtl` names it.
        material: String,
    },
    /// Nearly every material would be invisible, which is what an exporter writes that takes opacity for transparency.
    /// All are taken for opaque.
    #[error("{invisible} of {materials} materials have opacity 0, so all are taken for opaque")]
    InvertedOpacity {
        /// Materials of opacity 0.
        invisible: usize,
        /// Materials that have an opacity.
        materials: usize,
    },
    /// A texture that is missing or cannot be decoded. The material keeps its plain colour.
    #[error("texture `{texture}` of material `{material}` cannot be used: {reason}")]
    UnusableTexture {
        /// Its path, relative to the OBJ file.
        texture: String,
        /// The material.
        material: String,
        /// What the system or the decoder said.
        reason: String,
    },
    /// A texture larger than [`Texture::LARGEST`](crate::scene::Texture::LARGEST), scaled down to it.
    #[error("texture `{texture}` of {width}x{height} pixels was scaled down")]
    ScaledTexture {
        /// Its path, relative to the OBJ file.
        texture: String,
        /// In pixels, as it was.
        width: u32,
        /// In pixels, as it was.
        height: u32,
    },
    /// A model of which no triangle is left.
    #[error("model `{model}` has no triangle to draw ({degenerate_triangles} degenerate), and was left out")]
    EmptyModel {
        /// Its name.
        model: String,
        /// Triangles without area.
        degenerate_triangles: usize,
    },
    /// Elements that are no polygons, and were left out.
    #[error("{points} points, {lines} lines and {surfaces} free-form curves or surfaces were left out")]
    NotDrawn {
        /// Points.
        points: usize,
        /// Lines.
        lines: usize,
        /// Curves and surfaces.
        surfaces: usize,
    },
    /// Normals that are zero or not finite. The faces' own take their place.
    #[error("{normals} normals are zero or not finite, and the faces' own take their place")]
    ReplacedNormals {
        /// How many.
        normals: usize,
    },
    /// Texture coordinates that are not finite. Zero takes their place.
    #[error("{coordinates} texture coordinates are not finite, and 0 takes their place")]
    ReplacedTextureCoordinates {
        /// How many.
        coordinates: usize,
    },
    /// Corners of faces that refer to a normal or texture coordinate that the file does not have. They have none then.
    #[error("{corners} corners of faces refer to a normal or texture coordinate that is not there")]
    DanglingCorners {
        /// How many.
        corners: usize,
    },
    /// Polygons that cross themselves, or are not convex and have more than 256 corners. They were cut into a fan.
    #[error("model `{model}` has {polygons} polygons that cross themselves or are too large, and may look wrong")]
    FannedPolygons {
        /// Its name.
        model: String,
        /// How many.
        polygons: usize,
    },
}
