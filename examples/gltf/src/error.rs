//! What can be wrong with a file.

use std::path::PathBuf;

use drawloom::scene::SceneError;
use drawloom_output::path_text;

/// A file that cannot be loaded, and why.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path_text(file))]
pub struct LoadError {
    /// The file that was to be loaded.
    pub file: PathBuf,
    /// What is wrong with it.
    #[source]
    pub problem: Box<Problem>,
}

/// What is wrong with a file. Elements are named as glTF numbers them, such as `accessor 3`.
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
    /// More of something than the loader accepts.
    #[error("{element} has {count} {what}; {limit} are accepted")]
    TooMany {
        /// The element.
        element: String,
        /// What it has too many of.
        what: &'static str,
        /// How many it has.
        count: u64,
        /// How many the loader accepts.
        limit: u64,
    },
    /// It is not glTF 2.0.
    #[error("it is not glTF 2.0: {reason}")]
    Malformed {
        /// What the parser says.
        reason: String,
    },
    /// A required extension is unknown.
    #[error("it requires the extension {name}, which this loader does not know")]
    Extension {
        /// The name of the extension.
        name: String,
    },
    /// A URI that leads nowhere.
    #[error("{element} has a URI that cannot be followed: {reason}")]
    Uri {
        /// The element.
        element: String,
        /// Why not.
        reason: String,
    },
    /// A buffer has fewer bytes than the file says.
    #[error("buffer {buffer} has {bytes} bytes, but the file says {expected}")]
    ShortBuffer {
        /// The index of the buffer.
        buffer: usize,
        /// How many it has.
        bytes: usize,
        /// How many it should have.
        expected: usize,
    },
    /// A buffer without a URI in a file without a binary chunk.
    #[error("buffer {buffer} has neither a URI nor a binary chunk")]
    MissingBuffer {
        /// The index of the buffer.
        buffer: usize,
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
    #[error("accessor {accessor} is {found}, but {purpose} is {expected}")]
    WrongType {
        /// The index of the accessor.
        accessor: usize,
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
        what: String,
        /// How many there are.
        count: usize,
        /// How many there should be.
        expected: usize,
        /// What says so.
        expected_by: String,
    },
    /// A number that is NaN or infinite.
    #[error("{element} is not finite at index {index}")]
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
    /// The nodes are not a forest.
    #[error("node {node} {reason}")]
    Hierarchy {
        /// The index of the node.
        node: usize,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// The transform of a node cannot be drawn.
    #[error("node {node} has a transform that {reason}")]
    Transform {
        /// The index of the node.
        node: usize,
        /// What is wrong with it.
        reason: &'static str,
    },
    /// An image that cannot be decoded.
    #[error("image {image} cannot be decoded: {reason}")]
    Image {
        /// The index of the image.
        image: usize,
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
    pub(crate) fn invalid(element: impl Into<String>, reason: impl Into<String>) -> Self {
        Self::Invalid { element: element.into(), reason: reason.into() }
    }

    /// For what Drawloom refuses of an element.
    pub(crate) fn of_scene(element: &str) -> impl FnOnce(SceneError) -> Self {
        move |error| Self::Scene { element: element.to_owned(), error }
    }
}
