//! What can be wrong with a file.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use drawloom::scene::SceneError;
use drawloom::text::{self, path_text};

/// A file that cannot be loaded, and why.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path_text(file))]
#[non_exhaustive]
pub struct LoadError {
    /// The file that was to be loaded.
    pub file: PathBuf,
    /// What is wrong with it.
    #[source]
    pub problem: Box<Problem>,
    /// What the loader had left out by then, as [`World::warnings`](crate::World::warnings).
    pub warnings: Vec<String>,
    /// How many more warnings there are, as [`World::unlisted_warnings`](crate::World::unlisted_warnings).
    pub unlisted_warnings: u64,
}

impl LoadError {
    pub(crate) fn new(file: &Path, problem: Problem, warnings: Vec<String>, unlisted_warnings: u64) -> Self {
        Self { file: file.to_owned(), problem: Box::new(problem), warnings, unlisted_warnings }
    }
}

/// What is wrong with a file, or with an element of it. Elements are named as glTF numbers them, and by their names, in
/// which control characters are escaped: `mesh 3 (wheel) primitive 0`.
///
/// A problem of an element loses that element only, and is one of the [warnings](crate::World::warnings).
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Problem {
    /// A folder, a pipe or a device.
    #[error("{} is not a regular file", path_text(path))]
    NotARegularFile {
        /// The file, or one that it refers to.
        path: PathBuf,
    },
    /// The file cannot be read.
    #[error("{} cannot be read: {error}", path_text(path))]
    Unreadable {
        /// The file, or one that it refers to.
        path: PathBuf,
        /// Why not.
        error: std::io::Error,
    },
    /// More of something than a limit allows.
    #[error("{element} takes {}{}, and `GltfLimits::{field}` is {limit}", at_least(*amount, field), already_taken(*taken))]
    OverLimit {
        /// The element.
        element: String,
        /// How much it takes.
        amount: u64,
        /// How much is taken already.
        taken: u64,
        /// The field of [`GltfLimits`](crate::GltfLimits).
        field: &'static str,
        /// Its value.
        limit: u64,
    },
    /// It is not glTF 2.0.
    #[error("it is not glTF 2.0: {reason}")]
    Malformed {
        /// Why not.
        reason: String,
    },
    /// Another version of glTF.
    #[error("it has {found}, and only glTF 2.0 is read")]
    Version {
        /// The member or the header, and the version in it.
        found: String,
    },
    /// A required extension is unknown.
    #[error("it requires the extension {name}, which this loader does not know")]
    Extension {
        /// The name of the extension.
        name: String,
    },
    /// A mesh or a buffer view is compressed.
    #[error("{element} is compressed with {extension}, which this loader does not know, and has no other data")]
    Compressed {
        /// The element.
        element: String,
        /// The name of the extension.
        extension: &'static str,
    },
    /// All that the scene has to draw is left out.
    #[error("nothing of it can be drawn; first of all, {first}")]
    NothingToDraw {
        /// The first warning about what would be drawn.
        first: String,
    },
    /// A URI that leads nowhere.
    #[error("{element} has a URI that cannot be followed: {reason}")]
    Uri {
        /// The element.
        element: String,
        /// Why not.
        reason: String,
    },
    /// A buffer that was found to be unreadable before.
    #[error("{reason}")]
    Unavailable {
        /// What is wrong with it.
        reason: String,
    },
    /// It reads beyond the end of what it reads.
    #[error("{element} is out of range: it ends at byte {end} of {container}, which has {bytes}")]
    OutOfRange {
        /// The accessor or the buffer view.
        element: String,
        /// Where it ends.
        end: u128,
        /// The buffer view or the buffer.
        container: String,
        /// How many bytes that has.
        bytes: usize,
    },
    /// An accessor of a type that does not serve its purpose.
    #[error("{accessor} is {found}, but {purpose} must be {expected}")]
    WrongType {
        /// The accessor.
        accessor: String,
        /// What it is used as.
        purpose: String,
        /// Its type.
        found: String,
        /// The types that serve.
        expected: String,
    },
    /// Two things that belong together differ in number.
    #[error("{element} has {count} {what}, but {expected} {expected_by}")]
    UnequalCounts {
        /// The element.
        element: String,
        /// What is counted.
        what: &'static str,
        /// How many there are.
        count: usize,
        /// How many there should be.
        expected: usize,
        /// What says so.
        expected_by: String,
    },
    /// A number that is NaN or infinite.
    #[error("{element} has a number that is not finite at index {index}")]
    NotFinite {
        /// The element.
        element: String,
        /// The index of the value.
        index: usize,
    },
    /// An index beyond the end.
    #[error("{element} has the index {index} of {count} {what}")]
    IndexOutOfRange {
        /// The element.
        element: String,
        /// The index.
        index: u64,
        /// How many there are.
        count: usize,
        /// What it is an index of.
        what: &'static str,
    },
    /// The transform of a node cannot be drawn.
    #[error("{node} has a transform that {reason}")]
    Transform {
        /// The node.
        node: String,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// An image that cannot be decoded.
    #[error("{image} cannot be decoded: {reason}")]
    Image {
        /// The image.
        image: String,
        /// What the decoder says.
        reason: String,
    },
    /// An element with a value that it cannot have.
    #[error("{element} {reason}")]
    Invalid {
        /// The element.
        element: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Drawloom refuses a part of the scene.
    #[error("{element} cannot be drawn: {error}")]
    Scene {
        /// The element.
        element: String,
        /// What Drawloom says.
        error: SceneError,
    },
}

impl Problem {
    /// An element with a value that it cannot have.
    pub(crate) fn invalid(element: impl Display, reason: impl Into<String>) -> Self {
        Self::Invalid { element: element.to_string(), reason: reason.into() }
    }

    /// For what Drawloom refuses of an element.
    pub(crate) fn of_scene(element: &dyn Display) -> impl FnOnce(SceneError) -> Self {
        move |error| Self::Scene { element: element.to_string(), error }
    }

    /// For what the parser, or the decoder of another format, says.
    pub(crate) fn malformed(reason: impl Display) -> Self {
        Self::Malformed { reason: excerpt(&reason.to_string()) }
    }

    /// Whether the whole file is refused for it, wherever it is found.
    pub(crate) fn is_of_file(&self) -> bool {
        matches!(self, Self::OverLimit { .. })
    }
}

/// The beginning of a text of a file, as messages quote it.
pub(crate) fn excerpt(text: &str) -> String {
    text::excerpt(text, 80)
}

fn at_least(amount: u64, field: &str) -> String {
    let unit = match field {
        "objects" => "objects",
        "json_values" => "values",
        _ => "bytes",
    };
    format!("{amount} {unit} or more")
}

fn already_taken(taken: u64) -> String {
    if taken == 0 { String::new() } else { format!(", {taken} are taken") }
}
