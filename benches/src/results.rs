//! Writes the benchmarks' results to `target/drawloom/`.

use std::env;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use drawloom_output::{OutputFile, path_text, print_line};
use serde::Serialize;

/// Writes `value` as the file `name`.
///
/// # Errors
/// Returns an error if the file cannot be written.
pub fn write_json(name: &str, value: &impl Serialize) -> io::Result<()> {
    let file = OutputFile::new(file(name)?)?;
    file.write_all(serde_json::to_string_pretty(value)? + "\n")?;
    print_line!("{} written", path_text(file.path()));
    Ok(())
}

/// The path of the file `name`. Creates its folder.
///
/// # Errors
/// Returns an error if the folder cannot be created.
pub fn file(name: &str) -> io::Result<PathBuf> {
    let folder = folder()?;
    Ok(folder.join(name))
}

/// The folder `drawloom` in Cargo's target folder. Creates it. Cargo's programs are two folders below the target folder:
/// `target/release/deps/bench`, `target/release/examples/example`.
///
/// # Errors
/// Returns an error if the folder cannot be created.
pub fn folder() -> io::Result<PathBuf> {
    let program = env::current_exe()?;
    let target = program.ancestors().nth(3).unwrap_or(Path::new("target"));
    let folder = target.join("drawloom");
    fs::create_dir_all(&folder)?;
    Ok(folder)
}
