//! Files and URIs: what may be read, and how much of it.

use std::fmt::Display;
use std::fs::{self, File};
use std::io::Read;
use std::path::{Component, Path, PathBuf};

use data_url::DataUrl;
use drawloom::text::path_text;
use percent_encoding::percent_decode_str;

use crate::error::{Problem, excerpt};
use crate::limits::Limit;

/// Reads a regular file.
///
/// # Errors
/// If it is not a regular file, cannot be read, or has more bytes than what is left of the limit.
pub(crate) fn read_file(path: &Path, limit: &Limit) -> Result<Vec<u8>, Problem> {
    let unreadable = |error| Problem::Unreadable { path: path.to_owned(), error };
    // Before it is opened: to open a pipe blocks.
    let metadata = fs::metadata(path).map_err(unreadable)?;
    if !metadata.is_file() {
        return Err(Problem::NotARegularFile { path: path.to_owned() });
    }
    if metadata.len() > limit.left() {
        limit.take(path_text(path), metadata.len(), 1)?;
    }
    let mut bytes = Vec::new();
    // It may grow meanwhile.
    let greatest = limit.left().saturating_add(1);
    File::open(path).and_then(|file| file.take(greatest).read_to_end(&mut bytes)).map_err(unreadable)?;
    limit.take(path_text(path), bytes.len() as u64, 1)?;
    Ok(bytes)
}

/// Reads what a URI of an element refers to: data inside the URI, or a file in the folder of the document or below it.
///
/// # Errors
/// If the URI has another scheme, leads out of the folder, leads to what cannot be read, or to more bytes than what is
/// left of the limit.
pub(crate) fn read_uri(folder: &Path, element: &dyn Display, uri: &str, limit: &Limit) -> Result<Vec<u8>, Problem> {
    let refused = |reason: String| Problem::Uri { element: element.to_string(), reason };
    if is_data(uri) {
        let url = DataUrl::process(uri).map_err(|error| refused(format!("{error:?}")))?;
        let mut bytes = Vec::new();
        let decoded = url.decode(|part| {
            if bytes.len() as u64 + part.len() as u64 > limit.left() {
                return Err(bytes.len() as u64 + part.len() as u64);
            }
            bytes.extend_from_slice(part);
            Ok(())
        });
        return match decoded {
            Ok(_) => {
                limit.take(element, bytes.len() as u64, 1)?;
                Ok(bytes)
            }
            Err(data_url::forgiving_base64::DecodeError::WriteError(length)) => {
                limit.take(element, length, 1)?;
                Ok(bytes)
            }
            Err(error) => Err(refused(format!("{error:?}"))),
        };
    }
    read_file(&path_of(folder, uri).map_err(refused)?, limit)
}

/// Whether a URI has the data that it refers to.
pub(crate) fn is_data(uri: &str) -> bool {
    uri.get(..5).is_some_and(|scheme| scheme.eq_ignore_ascii_case("data:"))
}

/// No system has longer paths. Messages show paths whole.
const MAX_PATH_BYTES: usize = 4_096;

fn path_of(folder: &Path, uri: &str) -> Result<PathBuf, String> {
    let shown = excerpt(uri);
    if uri.split('/').next().is_some_and(|first| first.contains(':')) {
        return Err(format!("\"{shown}\" has a scheme other than data"));
    }
    let path = percent_decode_str(uri).decode_utf8().map_err(|_| format!("\"{shown}\" is not UTF-8"))?;
    if path.len() > MAX_PATH_BYTES {
        return Err(format!("\"{shown}\" is longer than a path can be"));
    }
    let path = Path::new(&*path);
    if path.components().any(|part| !matches!(part, Component::Normal(_) | Component::CurDir)) {
        return Err(format!("\"{shown}\" leads out of the file's folder"));
    }
    Ok(folder.join(path))
}
