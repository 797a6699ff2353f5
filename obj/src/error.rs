//! Errors and warnings about OBJ files.

use std::fmt::{self, Display, Formatter};
use std::io;

use drawloom::scene::SceneError;
use drawloom::text;

/// Why an OBJ file could not be loaded. Every message names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ObjError {
    /// The file is missing, is no regular file, is larger than
    /// [`ObjLimits::scene_bytes`](crate::ObjLimits::scene_bytes) (then the error has the kind
    /// [`io::ErrorKind::FileTooLarge`]), or may not be read.
    #[error("cannot read `{file}`: {source}")]
    Unreadable {
        /// The file.
        file: String,
        /// The error of the operating system.
        source: io::Error,
    },
    /// The file has nothing to draw, and is not text.
    #[error("`{file}` has no triangle to draw, and line {line} is not text")]
    NotText {
        /// The file.
        file: String,
        /// The first line that is not Unicode, counted from 1.
        line: usize,
        /// What was left out or replaced.
        warnings: Vec<ObjWarning>,
    },
    /// The file has nothing to draw, and a malformed line may be why.
    #[error("`{file}` has no triangle to draw; line {line}: {reason}")]
    Malformed {
        /// The file.
        file: String,
        /// The first malformed line, counted from 1.
        line: usize,
        /// Why it is malformed.
        reason: String,
        /// What was left out or replaced.
        warnings: Vec<ObjWarning>,
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
        "`{file}` has no triangle to draw ({degenerate_triangles} degenerate triangles, {points} points, {lines} lines, \
         {surfaces} curves or surfaces)"
    )]
    NoTriangles {
        /// The file.
        file: String,
        /// The triangles that were left out, as
        /// [`Imported::degenerate_triangles`](crate::Imported::degenerate_triangles) counts them.
        degenerate_triangles: usize,
        /// The number of points, which are not drawn.
        points: usize,
        /// The number of lines, which are not drawn.
        lines: usize,
        /// The number of free-form curves and surfaces, which are not drawn.
        surfaces: usize,
        /// What was left out or replaced.
        warnings: Vec<ObjWarning>,
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

impl ObjError {
    /// What was left out or replaced of a file that has nothing to draw, as
    /// [`Imported::warnings`](crate::Imported::warnings). Empty for other errors.
    pub fn warnings(&self) -> &[ObjWarning] {
        match self {
            Self::NotText { warnings, .. } | Self::Malformed { warnings, .. } | Self::NoTriangles { warnings, .. } => {
                warnings
            }
            Self::Unreadable { .. } | Self::Refused { .. } | Self::Scene { .. } => &[],
        }
    }
}

/// Something in an OBJ file that was left out or replaced.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ObjWarning {
    /// A line of the OBJ file that was left out or changed. A malformed vertex, normal or pair of texture coordinates
    /// still counts where faces refer to it by number.
    #[error("line {line}: {reason}")]
    Line {
        /// The line, counted from 1.
        line: usize,
        /// What is wrong with it, and what was done about it.
        reason: String,
    },
    /// Lines of the OBJ file or a material library that are not Unicode: invalid UTF-8, of which each byte was read as
    /// a character of Latin-1, or invalid UTF-16.
    #[error(
        "`{}`: {lines} lines are not Unicode, and names in them may look wrong; the first is line {first_line}",
        excerpt(file)
    )]
    NotUnicode {
        /// The file.
        file: String,
        /// The number of lines.
        lines: usize,
        /// The first of them, counted from 1.
        first_line: usize,
    },
    /// Lines of the OBJ file or a material library that are longer than
    /// [`ObjLimits::line_bytes`](crate::ObjLimits::line_bytes). They were left out.
    #[error(
        "`{}`: {lines} lines have more than {limit} bytes (`ObjLimits::line_bytes`) and were left out, the first is line \
         {first_line}",
        excerpt(file)
    )]
    LongLines {
        /// The file.
        file: String,
        /// The number of lines.
        lines: usize,
        /// The first of them, counted from 1.
        first_line: usize,
        /// The limit in bytes.
        limit: u64,
    },
    /// Statements of the OBJ file or a material library that are unknown, or that say what is not drawn. Those whose
    /// values change nothing, such as a black `Ks`, are not listed.
    #[error("`{}`: {} left out", excerpt(file), Keywords(keywords, *others))]
    IgnoredStatements {
        /// The file.
        file: String,
        /// The first keywords of such statements.
        keywords: Vec<IgnoredKeyword>,
        /// The number of statements with other keywords.
        others: usize,
    },
    /// Colours of vertices that are not between 0 and 1. They were clamped, and replaced by white where they are not
    /// numbers.
    #[error("the colours of {vertices} vertices are not between 0 and 1, and were clamped or replaced by white")]
    ReplacedColors {
        /// Their number.
        vertices: usize,
    },
    /// Faces of a smoothing group without normals. They are shaded flat.
    #[error("{faces} faces of smoothing groups have no normals and are shaded flat")]
    NotSmoothed {
        /// Their number.
        faces: usize,
    },
    /// A material that is used and has opacity 0.
    #[error("material `{}` has opacity 0: what it covers is invisible", excerpt(material))]
    InvisibleMaterial {
        /// Its name.
        material: String,
    },
    /// A `.mtl` file that cannot be read, or only up to an error. Its other materials are then undefined.
    #[error("material library `{}` cannot be read: {reason}", excerpt(library))]
    MissingLibrary {
        /// Its name in the OBJ file.
        library: String,
        /// The error of the operating system.
        reason: String,
    },
    /// A line of a `.mtl` file that was left out or changed.
    #[error("material library `{}`, line {line}: {reason}", excerpt(library))]
    LibraryLine {
        /// Its name in the OBJ file.
        library: String,
        /// The line, counted from 1.
        line: usize,
        /// What is wrong with it, and what was done about it.
        reason: String,
    },
    /// A material that is used but not defined. Objects that use it get the default material.
    #[error("material `{}` is not defined and was replaced by the default material", excerpt(material))]
    UndefinedMaterial {
        /// Its name in `usemtl`.
        material: String,
    },
    /// Nearly every material has opacity 0, because the exporter wrote transparency as opacity. All materials are
    /// opaque instead.
    #[error("{invisible} of {materials} materials have opacity 0, so all are treated as opaque")]
    InvertedOpacity {
        /// The number of materials with opacity 0.
        invisible: usize,
        /// The number of materials with an opacity.
        materials: usize,
    },
    /// A texture that is missing or cannot be decoded. The material keeps its plain colour.
    #[error("texture `{}` of material `{}` cannot be used: {reason}", excerpt(texture), excerpt(material))]
    UnusableTexture {
        /// Its path, relative to the OBJ file.
        texture: String,
        /// The material.
        material: String,
        /// The error of the operating system or the decoder.
        reason: String,
    },
    /// A texture larger than [`Texture::MAX_SIZE`](drawloom::scene::Texture::MAX_SIZE), which was scaled down to it; or
    /// a mask that was scaled to its colours, since [`ObjLimits`](crate::ObjLimits) or memory leave no room for colours
    /// of its size.
    #[error("texture `{}` of {width}x{height} pixels was scaled down", excerpt(texture))]
    ScaledTexture {
        /// Its path, relative to the OBJ file.
        texture: String,
        /// Its original width in pixels.
        width: u32,
        /// Its original height in pixels.
        height: u32,
    },
    /// A model without a triangle that can be drawn.
    #[error("model `{}` has no triangle to draw ({degenerate_triangles} degenerate) and was left out", excerpt(model))]
    EmptyModel {
        /// Its name.
        model: String,
        /// The triangles that were left out, as
        /// [`Imported::degenerate_triangles`](crate::Imported::degenerate_triangles) counts them.
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
    #[error(
        "model `{}` has {polygons} polygons that intersect themselves or are too large, and may look wrong",
        excerpt(model)
    )]
    FannedPolygons {
        /// Its name.
        model: String,
        /// Their number.
        polygons: usize,
    },
}

impl ObjWarning {
    /// The kind of the warning, in a few words. [`Imported::warning_counts`](crate::Imported::warning_counts) counts by
    /// it.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Line { .. } => "malformed line",
            Self::NotUnicode { .. } => "file with lines that are not Unicode",
            Self::LongLines { .. } => "file with long lines",
            Self::IgnoredStatements { .. } => "file with ignored statements",
            Self::ReplacedColors { .. } => "replaced colours",
            Self::NotSmoothed { .. } => "smoothing groups without normals",
            Self::InvisibleMaterial { .. } => "invisible material",
            Self::MissingLibrary { .. } => "missing material library",
            Self::LibraryLine { .. } => "malformed line of a material library",
            Self::UndefinedMaterial { .. } => "undefined material",
            Self::InvertedOpacity { .. } => "inverted opacity",
            Self::UnusableTexture { .. } => "unusable texture",
            Self::ScaledTexture { .. } => "scaled texture",
            Self::EmptyModel { .. } => "model without triangles",
            Self::NotDrawn { .. } => "points, lines or surfaces",
            Self::ReplacedNormals { .. } => "replaced normals",
            Self::ReplacedTextureCoordinates { .. } => "replaced texture coordinates",
            Self::DanglingCorners { .. } => "corners without normal or texture coordinates",
            Self::FannedPolygons { .. } => "model with crossing polygons",
        }
    }
}

/// The beginning of a text of a file, as messages quote it.
pub(crate) fn excerpt(text: &str) -> String {
    text::excerpt(text, 160)
}

/// A keyword whose statements were left out.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct IgnoredKeyword {
    /// The keyword.
    pub keyword: String,
    /// The number of its statements.
    pub statements: usize,
    /// The line of the first one, counted from 1.
    pub first_line: usize,
}

impl Display for IgnoredKeyword {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let Self { keyword, statements, first_line } = self;
        match statements {
            1 => write!(formatter, "`{keyword}` in line {first_line}"),
            _ => write!(formatter, "{statements} × `{keyword}` from line {first_line} on"),
        }
    }
}

/// Ignored keywords and the number of statements with others.
struct Keywords<'a>(&'a [IgnoredKeyword], usize);

impl Display for Keywords<'_> {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        for (index, keyword) in self.0.iter().enumerate() {
            let separator = if index == 0 { "" } else { ", " };
            write!(formatter, "{separator}{keyword}")?;
        }
        match self.1 {
            0 => Ok(()),
            others => write!(formatter, " and {others} statements with other keywords"),
        }
    }
}
