//! Where the content of a file goes.

use std::ffi::OsStr;
use std::fs::{self, File, OpenOptions, Permissions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::Builder;

/// The most symbolic links that are followed, as on Linux.
const MAX_LINKS: usize = 40;

/// Where the content of a file goes.
pub(crate) enum Destination {
    /// To a regular file, which is there or not. No symbolic link.
    File(PathBuf),
    /// Straight to something that cannot be replaced, or to a file that is open already: behind its content.
    Direct(PathBuf),
    /// To the standard output or the standard error of this process, behind what it has written there.
    Stream(StandardStream),
}

/// A stream that every process has.
#[derive(Clone, Copy)]
pub(crate) enum StandardStream {
    Output,
    Error,
}

impl Destination {
    /// Follows symbolic links.
    ///
    /// # Errors
    /// If there are too many, or if they cannot be read.
    pub(crate) fn of(path: &Path) -> io::Result<Self> {
        let mut resolved = path.to_owned();
        for _link in 0..MAX_LINKS {
            if let Some(stream) = StandardStream::of(&resolved) {
                return Ok(Self::Stream(stream));
            }
            // Names in these folders lead to open files, which need not have a name of their own, and which others
            // write to as well.
            let is_open = |folder: PathBuf| folder.starts_with("/proc") || folder == Path::new("/dev/fd");
            if fs::canonicalize(folder_of(&resolved)).is_ok_and(is_open) {
                return Ok(Self::Direct(path.to_owned()));
            }
            match fs::symlink_metadata(&resolved) {
                Ok(found) if found.is_symlink() => resolved = folder_of(&resolved).join(fs::read_link(&resolved)?),
                Ok(found) if !found.is_file() && !found.is_dir() => return Ok(Self::Direct(path.to_owned())),
                _ => return Ok(Self::File(resolved)),
            }
        }
        Err(io::Error::other("too many symbolic links"))
    }

    /// Writes the content.
    ///
    /// # Errors
    /// The error of `write`, or of the operating system. A file that would have been replaced is then as it was.
    pub(crate) fn write(&self, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> io::Result<()> {
        let file = match self {
            Self::File(path) => return replace(path, write),
            Self::Direct(path) => OpenOptions::new().append(true).open(path)?,
            Self::Stream(stream) => stream.open()?,
        };
        let mut writer = BufWriter::new(file);
        write(&mut writer)?;
        writer.flush()
    }
}

/// Replaces a file in one step.
fn replace(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> io::Result<()> {
    let old_permissions = fs::metadata(path).ok().map(|metadata| metadata.permissions());
    let temporary = temporary_files().tempfile_in(folder_of(path))?;
    let (file, name) = temporary.into_parts();
    // Before there is content, which others may not be allowed to read.
    if let Some(permissions) = old_permissions {
        file.set_permissions(permissions)?;
    }
    let mut writer = BufWriter::new(file);
    write(&mut writer)?;
    let file = writer.into_inner().map_err(io::IntoInnerError::into_error)?;
    // The disk may turn out to be full only now. And the name must not lead to content that is lost with the power.
    file.sync_all()?;
    drop(file);
    Ok(name.persist(path)?)
}

impl StandardStream {
    /// The stream that a path names, such as `/dev/stdout`, which leads to `/proc/self/fd/1` on Linux.
    fn of(path: &Path) -> Option<Self> {
        let stream = match path.file_name().and_then(OsStr::to_str) {
            Some("1") => Self::Output,
            Some("2") => Self::Error,
            _ => return None,
        };
        let folder = fs::canonicalize(folder_of(path)).ok()?;
        let is_folder = |name| fs::canonicalize(name).is_ok_and(|descriptors| descriptors == folder);
        ["/proc/self/fd", "/dev/fd"].into_iter().any(is_folder).then_some(stream)
    }

    /// The stream as a file with the same offset: one that is opened by its name begins elsewhere, and what the process
    /// prints then overwrites it.
    #[cfg(unix)]
    fn open(self) -> io::Result<File> {
        use std::os::fd::AsFd;

        let descriptor = match self {
            Self::Output => {
                io::stdout().flush()?;
                io::stdout().as_fd().try_clone_to_owned()
            }
            Self::Error => io::stderr().as_fd().try_clone_to_owned(),
        };
        descriptor.map(File::from)
    }

    /// No path names a stream there.
    #[cfg(not(unix))]
    fn open(self) -> io::Result<File> {
        Err(io::ErrorKind::Unsupported.into())
    }
}

/// The folder of a file.
pub(crate) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Temporary files with the permissions of other new files.
fn temporary_files() -> Builder<'static, 'static> {
    let mut builder = Builder::new();
    builder.prefix(".drawloom-").suffix(".part");
    if let Some(permissions) = permissions_of_new_files() {
        builder.permissions(permissions);
    }
    builder
}

/// What the process's mask is applied to.
#[cfg(unix)]
fn permissions_of_new_files() -> Option<Permissions> {
    Some(std::os::unix::fs::PermissionsExt::from_mode(0o666))
}

#[cfg(not(unix))]
fn permissions_of_new_files() -> Option<Permissions> {
    None
}
