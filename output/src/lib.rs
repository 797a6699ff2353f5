//! What Drawloom's examples and benchmarks write: files, whole or not at all, and lines on the console, which end no
//! program that cannot print them. With the feature `clap`, it parses the arguments of programs.
//!
//! A program names each of its files as an [`OutputFile`] or a [`PictureFile`] before it draws anything, so a name that
//! cannot be written is an error at once. It writes the file when the content is there. The content goes to a temporary
//! file in the same folder, reaches the disk, and takes the name of the file in one step:
//!
//! - An interrupt leaves the old file or the new one. If it comes while the content is written, a file
//!   `.drawloom-….part` stays behind.
//! - A full disk is an error, and leaves the old file.
//! - A new file has the permissions that the process gives to new files; one that is replaced keeps its own. Both
//!   belong to the user who runs the process.
//! - A symbolic link stays, and the file that it leads to is replaced. A hard link to the old file keeps the old
//!   content.
//! - What is no regular file, such as a pipe, a terminal or `/dev/full`, cannot be replaced: the content goes straight
//!   to it, and each error is reported. So does an open file that is named through `/proc`. `/dev/stdout` and
//!   `/dev/stderr` are the streams of the process, wherever a shell has redirected them: the content comes behind what
//!   was printed before.

#[cfg(feature = "clap")]
mod arguments;
mod console;
mod destination;
mod error;
mod file;
mod picture;

#[cfg(feature = "clap")]
pub use arguments::{exit_with, parse_arguments};
pub use console::{check_output, diagnostics, exit_code, print_diagnostic, print_line, text};
pub use drawloom_jobs::text::path_text;
pub use error::OutputError;
pub use file::{OutputFile, create_folder};
pub use picture::PictureFile;
