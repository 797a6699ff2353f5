//! A file that is written whole or not at all.

use std::fs::{self, File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::destination::{Destination, folder_of};
use crate::error::OutputError;

/// A file that can be written. It is written whole or not at all.
///
/// ```
/// use std::io::Write;
///
/// use drawloom_output::OutputFile;
///
/// let folder = tempfile::tempdir()?;
/// let report = OutputFile::new(folder.path().join("report.json"))?;
/// // Here the program does what takes long.
/// report.write(|file| writeln!(file, "{{}}"))?;
/// assert_eq!(std::fs::read_to_string(report.path())?, "{}\n");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct OutputFile {
    path: PathBuf,
}

impl OutputFile {
    /// Checks that the file can be written: its folder is there and takes new files, and an old file of that name may
    /// be written. Creates nothing that stays.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn new(path: impl Into<PathBuf>) -> Result<Self, OutputError> {
        let path = path.into();
        if path.is_dir() || path.file_name().is_none() || is_spelled_as_folder(&path) {
            return Err(OutputError::IsFolder { path });
        }
        match Destination::of(&path) {
            Ok(Destination::Stream(_)) => {}
            Ok(Destination::Direct(file)) => {
                if let Err(source) = check_direct(&file) {
                    return Err(OutputError::Failed { path, source });
                }
            }
            Ok(Destination::File(file)) => check_file(&path, &file)?,
            Err(source) => return Err(OutputError::Failed { path, source }),
        }
        Ok(Self { path })
    }

    /// Its path, as it was named.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Replaces the file by what `write` writes.
    ///
    /// What is no regular file is written directly, and so is a regular file that is named as an open one, such as
    /// `/dev/stdout` or `/dev/fd/3` where a shell redirects it. That file is not replaced, because the shell and other
    /// processes hold it open: the content goes behind what it has.
    ///
    /// # Errors
    /// If `write` or the operating system fails. A file that would have been replaced is then as it was; one that is
    /// written directly may have a part of the content.
    pub fn write(&self, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Result<(), OutputError> {
        let written = Destination::of(&self.path).and_then(|destination| destination.write(write));
        written.map_err(|source| OutputError::Failed { path: self.path.clone(), source })
    }

    /// Replaces the file by `content`.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub fn write_all(&self, content: impl AsRef<[u8]>) -> Result<(), OutputError> {
        self.write(|file| file.write_all(content.as_ref()))
    }
}

/// Creates a folder for files, with those above it, if it is not there, and checks that it takes new files.
///
/// # Errors
/// If it cannot be created, or takes no files.
pub fn create_folder(folder: &Path) -> Result<(), OutputError> {
    let created = fs::create_dir_all(folder).and_then(|()| tempfile::tempfile_in(folder));
    created.map(drop).map_err(|source| OutputError::Failed { path: folder.to_owned(), source })
}

/// Whether it ends in `/` or `/.`, which `Path` takes for the same path as one without.
fn is_spelled_as_folder(path: &Path) -> bool {
    let bytes = path.as_os_str().as_encoded_bytes();
    let last = bytes.rsplit(|&byte| std::path::is_separator(char::from(byte))).next();
    last.is_some_and(|last| matches!(last, b"" | b"."))
}

/// Checks that what is no regular file may be written, without waiting for a pipe to have a reader.
#[cfg(target_os = "linux")]
fn check_direct(path: &Path) -> io::Result<()> {
    rustix::fs::access(path, rustix::fs::Access::WRITE_OK).map_err(io::Error::from)
}

/// Checks nothing: opening a pipe waits for a reader.
#[cfg(not(target_os = "linux"))]
fn check_direct(_path: &Path) -> io::Result<()> {
    Ok(())
}

/// `path` leads to `file`.
fn check_file(path: &Path, file: &Path) -> Result<(), OutputError> {
    let folder = folder_of(file);
    if !folder.is_dir() {
        return Err(OutputError::NoFolder { path: path.to_owned(), folder: folder.to_owned() });
    }
    let failed = |path: &Path| {
        let path = path.to_owned();
        move |source| OutputError::Failed { path, source }
    };
    match fs::symlink_metadata(file) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => {}
        // The name may be too long.
        Err(error) => return Err(failed(path)(error)),
        // Whoever protects a file from being written does not want it to be replaced.
        Ok(_) => OpenOptions::new().write(true).open(file).map(drop).map_err(failed(path))?,
    }
    // Has no name where the operating system has such files, so an interrupt leaves nothing.
    tempfile::tempfile_in(folder).map(drop).map_err(failed(folder))
}
