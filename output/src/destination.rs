//! Where the content of a file goes.

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
    /// Straight to something that cannot be replaced.
    Direct(PathBuf),
}

impl Destination {
    /// Follows symbolic links.
    ///
    /// # Errors
    /// If there are too many, or if they cannot be read.
    pub(crate) fn of(path: &Path) -> io::Result<Self> {
        if fs::metadata(path).is_ok_and(|metadata| !metadata.is_file() && !metadata.is_dir()) {
            return Ok(Self::Direct(path.to_owned()));
        }
        let mut resolved = path.to_owned();
        for _link in 0..MAX_LINKS {
            // Its links name open files, which need not have a name of their own.
            if resolved.starts_with("/proc") {
                return Ok(Self::Direct(path.to_owned()));
            }
            if !fs::symlink_metadata(&resolved).is_ok_and(|metadata| metadata.is_symlink()) {
                return Ok(Self::File(resolved));
            }
            resolved = folder_of(&resolved).join(fs::read_link(&resolved)?);
        }
        Err(io::Error::other("too many symbolic links"))
    }

    /// Writes the content.
    ///
    /// # Errors
    /// The error of `write`, or of the operating system. A file is then as it was.
    pub(crate) fn write(&self, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> io::Result<()> {
        let path = match self {
            Self::Direct(path) => {
                let mut writer = BufWriter::new(OpenOptions::new().append(true).open(path)?);
                write(&mut writer)?;
                return writer.flush();
            }
            Self::File(path) => path,
        };
        let old_permissions = fs::metadata(path).ok().map(|metadata| metadata.permissions());
        let temporary = temporary_files().tempfile_in(folder_of(path))?;
        let (file, name) = temporary.into_parts();
        let mut writer = BufWriter::new(file);
        write(&mut writer)?;
        let file = writer.into_inner().map_err(io::IntoInnerError::into_error)?;
        if let Some(permissions) = old_permissions {
            file.set_permissions(permissions)?;
        }
        // The disk may turn out to be full only now. And the name must not lead to content that is lost with the power.
        file.sync_all()?;
        drop(file);
        Ok(name.persist(path)?)
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
