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

/// The folder `drawloom` in Cargo's target folder. Creates it. Cargo's programs are two folders below the target
/// folder: `target/release/deps/bench`, `target/release/examples/example`.
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

#[cfg(test)]
mod tests {
    use std::env;
    use std::error::Error;
    use std::fs;
    use std::process::{self, Command};

    use serde::{Serialize, Serializer};

    use super::*;

    /// Set in a program that the test starts, which ends in the middle of a result.
    const INTERRUPTED: &str = "DRAWLOOM_RESULTS_INTERRUPTED";

    /// A row that takes the program down, as a signal would.
    struct Interruption;

    impl Serialize for Interruption {
        fn serialize<S: Serializer>(&self, _serializer: S) -> Result<S::Ok, S::Error> {
            process::abort()
        }
    }

    #[test]
    fn an_interrupt_leaves_the_results_of_the_run_before() -> Result<(), Box<dyn Error>> {
        let name = format!("interrupted-{}.json", env::var(INTERRUPTED).unwrap_or(process::id().to_string()));
        if env::var_os(INTERRUPTED).is_some() {
            // Far more than a buffer of a file holds.
            write_json(&name, &(vec!["new"; 100_000], Interruption))?;
        }
        write_json(&name, &["old"])?;
        let test = "results::tests::an_interrupt_leaves_the_results_of_the_run_before";
        let interrupted = Command::new(env::current_exe()?)
            .args(["--exact", test])
            .env(INTERRUPTED, process::id().to_string())
            .output()?;
        let path = file(&name)?;
        let left = fs::read_to_string(&path)?;
        fs::remove_file(path)?;
        assert!(!interrupted.status.success());
        assert_eq!(left, "[\n  \"old\"\n]\n");
        Ok(())
    }
}
