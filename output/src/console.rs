//! Lines on the console, which may be a pipe or a file.

use std::fmt::Display;
use std::io::{self, ErrorKind, Write};
use std::path::Path;

/// A path as text. Control characters are escaped, so that none reaches a terminal.
pub fn path_text(path: &Path) -> String {
    let mut text = String::new();
    for character in path.display().to_string().chars() {
        if character.is_control() {
            text.extend(character.escape_unicode());
        } else {
            text.push(character);
        }
    }
    text
}

/// Prints a line on the standard output. That its reader has closed the pipe is no error: it wants no more, and what the program does beside
/// printing goes on.
///
/// # Errors
/// If the line cannot be written, on a full disk for example.
pub fn print_line(line: impl Display) -> io::Result<()> {
    let named =
        |error: io::Error| io::Error::new(error.kind(), format!("the standard output cannot be written: {error}"));
    or_unread(writeln!(io::stdout(), "{line}")).map_err(named)
}

/// Prints a line on the standard error output. If that fails there is nowhere to say so.
pub fn print_diagnostic(line: impl Display) {
    let _ = writeln!(io::stderr(), "{line}");
}

fn or_unread(written: io::Result<()>) -> io::Result<()> {
    written.or_else(|error| if error.kind() == ErrorKind::BrokenPipe { Ok(()) } else { Err(error) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_in_paths_are_escaped() {
        assert_eq!(path_text(Path::new("a/été\u{1b}[31m\n.png")), "a/été\\u{1b}[31m\\u{a}.png");
    }

    #[test]
    fn control_characters_in_the_names_of_files_that_cannot_be_written_are_escaped() {
        let error = crate::PictureFile::new("missing\u{1b}/a.png").unwrap_err().to_string();
        assert!(error.contains("missing\\u{1b}/a.png") && !error.contains('\u{1b}'), "{error}");
    }

    #[test]
    fn a_closed_pipe_is_no_error() {
        let error = |kind| Err(io::Error::from(kind));
        assert!(or_unread(error(ErrorKind::BrokenPipe)).is_ok());
        assert_eq!(or_unread(error(ErrorKind::StorageFull)).unwrap_err().kind(), ErrorKind::StorageFull);
    }
}
