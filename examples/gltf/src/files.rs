//! Files and URIs: what may be read, and how much of it.

use std::fs::{self, File};
use std::io::Read;
use std::path::{Component, Path, PathBuf};

use data_url::DataUrl;
use drawloom_output::path_text;
use percent_encoding::percent_decode_str;

use crate::error::Problem;

/// Reads a regular file of up to [`MAX_FILE_BYTES`].
///
/// # Errors
/// If it is not a regular file, is too large or cannot be read.
pub(crate) fn read_file(path: &Path) -> Result<Vec<u8>, Problem> {
    let unreadable = |error| Problem::Unreadable { path: path.to_owned(), error };
    // Before it is opened: to open a pipe blocks.
    let metadata = fs::metadata(path).map_err(unreadable)?;
    if !metadata.is_file() {
        return Err(Problem::NotARegularFile { path: path.to_owned() });
    }
    let mut bytes = Vec::new();
    // It may grow meanwhile.
    File::open(path).and_then(|file| file.take(MAX_FILE_BYTES + 1).read_to_end(&mut bytes)).map_err(unreadable)?;
    check_file_size(path, bytes.len() as u64)?;
    Ok(bytes)
}

/// Reads what a URI of an element refers to: data inside the URI, or a file in the folder of the document or below it.
///
/// # Errors
/// If the URI has another scheme, leads out of the folder, or leads to what cannot be read.
pub(crate) fn read_uri(folder: &Path, element: &str, uri: &str) -> Result<Vec<u8>, Problem> {
    let refused = |reason: String| Problem::Uri { element: element.to_owned(), reason };
    if uri.starts_with("data:") {
        let url = DataUrl::process(uri).map_err(|error| refused(format!("{error:?}")))?;
        return Ok(url.decode_to_vec().map_err(|error| refused(format!("{error:?}")))?.0);
    }
    read_file(&path_of(folder, uri).map_err(refused)?)
}

/// The greatest size of a file.
const MAX_FILE_BYTES: u64 = 2 << 30;

fn check_file_size(path: &Path, bytes: u64) -> Result<(), Problem> {
    if bytes <= MAX_FILE_BYTES {
        return Ok(());
    }
    let element = path_text(path);
    Err(Problem::TooMany { element, what: "bytes or more", count: bytes, limit: MAX_FILE_BYTES })
}

fn path_of(folder: &Path, uri: &str) -> Result<PathBuf, String> {
    let shown: String = uri.chars().take(80).collect();
    if uri.split('/').next().is_some_and(|first| first.contains(':')) {
        return Err(format!("{shown:?} has a scheme other than data"));
    }
    let path = percent_decode_str(uri).decode_utf8().map_err(|_| format!("{shown:?} is not UTF-8"))?;
    let path = Path::new(&*path);
    if path.components().any(|part| !matches!(part, Component::Normal(_) | Component::CurDir)) {
        return Err(format!("{shown:?} leads out of the file's folder"));
    }
    Ok(folder.join(path))
}
