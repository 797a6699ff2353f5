//! Lines on the console, which may be a pipe or a file.

use std::fmt::{self, Display, Write as _};
use std::io::{self, ErrorKind, Write};
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};

use drawloom_jobs::text::Escaped;

/// The first error of the standard output, until it is [taken](check_output).
static OUTPUT_ERROR: Mutex<Option<io::Error>> = Mutex::new(None);

/// What a file holds, such as a name, as text on one line, [`Escaped`].
pub fn text(text: impl Display) -> String {
    Escaped::new(&text.to_string()).to_string()
}

/// Prints a line on the standard output, [`Escaped`] except for line feeds and tabs.
///
/// That its reader has closed the pipe is no error: it wants no more, and what the program does beside printing goes
/// on. Any other error, of a full disk for example, is kept until the program ends, so that it first writes its files:
/// [`exit_code`] tells it.
pub fn print_line(line: impl Display) {
    let written = io::stdout().write_all(line_of(line).as_bytes());
    if let Err(error) = or_unread(written) {
        OUTPUT_ERROR.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
    }
}

/// Prints a line on the standard error output, escaped as [`print_line`] does. If that fails there is nowhere to say
/// so.
pub fn print_diagnostic(line: impl Display) {
    let _ = io::stderr().write_all(line_of(line).as_bytes());
}

/// Prints a formatted line: see the [function](print_line()) of this name.
///
/// ```
/// drawloom_output::print_line!("{} frames in {:.1} ms", 3, 12.5);
/// drawloom_output::print_line!();
/// ```
#[macro_export]
macro_rules! print_line {
    () => {
        $crate::print_line("")
    };
    ($($arguments:tt)*) => {
        $crate::print_line(::std::format_args!($($arguments)*))
    };
}

/// Prints a formatted line: see the [function](print_diagnostic()) of this name.
#[macro_export]
macro_rules! print_diagnostic {
    ($($arguments:tt)*) => {
        $crate::print_diagnostic(::std::format_args!($($arguments)*))
    };
}

/// The standard error output for events, escaped as [`print_diagnostic`] does. Writing never fails: that events cannot
/// be printed is no reason to stop.
pub fn diagnostics() -> impl io::Write {
    Diagnostics
}

struct Diagnostics;

impl io::Write for Diagnostics {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let _ = io::stderr().write_all(escaped_lines(String::from_utf8_lossy(bytes)).as_bytes());
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Whether everything that was printed has reached the standard output, or had no reader.
///
/// # Errors
/// The first error since the last call.
pub fn check_output() -> io::Result<()> {
    let found = OUTPUT_ERROR.lock().unwrap_or_else(PoisonError::into_inner).take();
    let flushed = or_unread(io::stdout().flush());
    let named =
        |error: io::Error| io::Error::new(error.kind(), format!("the standard output cannot be written: {error}"));
    found.map_or(flushed, Err).map_err(named)
}

/// What a program ends with. Tells why it failed, or that a part of what it printed is lost.
///
/// ```no_run
/// use std::error::Error;
/// use std::process::ExitCode;
///
/// fn main() -> ExitCode {
///     drawloom_output::exit_code(run())
/// }
///
/// fn run() -> Result<(), Box<dyn Error>> {
///     drawloom_output::print_line!("done");
///     Ok(())
/// }
/// ```
pub fn exit_code<E: Display>(outcome: Result<(), E>) -> ExitCode {
    let failed = |error: &dyn Display| print_diagnostic(format_args!("error: {error}"));
    let outcomes = [outcome.map_err(|error| failed(&error)), check_output().map_err(|error| failed(&error))];
    if outcomes.iter().all(Result::is_ok) { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// A line with its end.
fn line_of(line: impl Display) -> String {
    let mut text = String::new();
    // Writing to a string does not fail, and a `Display` that does has said nothing.
    let _: fmt::Result = writeln!(text, "{line}");
    escaped_lines(text)
}

/// Lines that are escaped, except for their ends and tabs.
fn escaped_lines(text: impl AsRef<str>) -> String {
    let is_layout = |character: char| matches!(character, '\n' | '\t');
    let parts = text.as_ref().split_inclusive(is_layout).map(|part| {
        let end = part.trim_end_matches(is_layout).len();
        [&Escaped::new(&part[..end]).to_string(), &part[end..]].concat()
    });
    parts.collect()
}

fn or_unread(written: io::Result<()>) -> io::Result<()> {
    written.or_else(|error| if error.kind() == ErrorKind::BrokenPipe { Ok(()) } else { Err(error) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_in_names_are_escaped() {
        assert_eq!(text("\u{7}\u{9b}\r\t\u{7f}\u{202e}"), "\\u{7}\\u{9b}\\u{d}\\u{9}\\u{7f}\\u{202e}");
    }

    #[test]
    fn lines_keep_their_ends_and_tabs_and_no_other_control_characters() {
        assert_eq!(line_of("a\tb\n\u{1b}]0;title\u{7}\u{9b}2J\r"), "a\tb\n\\u{1b}]0;title\\u{7}\\u{9b}2J\\u{d}\n");
        assert_eq!(line_of("\n\t\n\u{202e}"), "\n\t\n\\u{202e}\n");
        assert_eq!(line_of(""), "\n");
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
