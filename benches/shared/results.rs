//! Where benches leave what they measured: in the folder `drawloom` of the target folder.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;

/// Writes `value` as the file `name`.
///
/// # Errors
/// If the file cannot be written.
pub fn write_json(name: &str, value: &impl Serialize) -> io::Result<()> {
    let path = file(name)?;
    fs::write(&path, serde_json::to_string_pretty(value)? + "\n")?;
    println!("{} written", path.display());
    Ok(())
}

/// The path of the file `name`, in a folder that is there.
///
/// # Errors
/// If the folder cannot be made.
pub fn file(name: &str) -> io::Result<PathBuf> {
    let temporary = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let folder = temporary.parent().unwrap_or(temporary).join("drawloom");
    fs::create_dir_all(&folder)?;
    Ok(folder.join(name))
}
