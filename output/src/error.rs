//! Why a file cannot be written.

use std::io;
use std::path::PathBuf;

use drawloom_jobs::text::path_text;

/// Why a file cannot be written. Every message names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The folder is missing, or is a file.
    #[error("{} cannot be written: {} is no folder", path_text(path), path_text(folder))]
    NoFolder {
        /// The file.
        path: PathBuf,
        /// Where its folder should be.
        folder: PathBuf,
    },
    /// The name is that of a folder.
    #[error("{} cannot be written: it names a folder", path_text(path))]
    IsFolder {
        /// The folder.
        path: PathBuf,
    },
    /// Nothing can be written there, or writing failed.
    #[error("{} could not be written: {source}", path_text(path))]
    Failed {
        /// The file, or the folder if no file can be created in it.
        path: PathBuf,
        /// The error of the operating system, of the encoder, or of the code that makes the content.
        source: io::Error,
    },
    /// The extension of a picture is missing, unknown, or that of a format that is not written.
    #[error(
        "{} cannot be written: {}, and pictures are written as .png, .jpg, .tga or .bmp",
        path_text(path),
        extension.as_ref().map_or_else(|| "it has no extension".to_owned(), |extension| format!("it ends in .{}", path_text(extension.as_ref())))
    )]
    PictureFormat {
        /// The file.
        path: PathBuf,
        /// Its extension.
        extension: Option<String>,
    },
}

impl From<OutputError> for io::Error {
    fn from(error: OutputError) -> Self {
        let kind = match &error {
            OutputError::NoFolder { .. } => io::ErrorKind::NotADirectory,
            OutputError::IsFolder { .. } => io::ErrorKind::IsADirectory,
            OutputError::Failed { source, .. } => source.kind(),
            OutputError::PictureFormat { .. } => io::ErrorKind::Unsupported,
        };
        Self::new(kind, error)
    }
}
