//! Counts instructions per chunk, with the recorder off and without one.

use std::env;
use std::error::Error;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use indicatif::ProgressBar;
use serde_json::Value;

use crate::report::Counted;
use crate::shape::{CHUNKS, Shape};

type Failure = Box<dyn Error + Send + Sync>;

/// Counts are differences of two numbers of frames, so that start and end of the program cancel out. The lower number
/// suffices for a schedule to have measured its nodes.
const FRAMES: [usize; 2] = [100, 300];

/// Runs of each count, of which the minimum is taken: the size of tickets depends on the clock.
const RUNS: usize = 5;

/// Counts all shapes in a program with a recorder and in one without.
///
/// # Errors
/// Returns an error if valgrind is missing, or if a program does not build or fails.
pub fn count(progress: &ProgressBar) -> Result<Vec<Counted>, Failure> {
    progress.set_message("building with a recorder");
    let with = build("with_timeline", "")?;
    progress.set_message("building without a recorder");
    let without = build("without_timeline", "--cfg drawloom_without_timeline")?;
    let mut counted = Vec::new();
    for &shape in Shape::ALL {
        progress.set_message(format!("counting {}", shape.name()));
        let [off, without] = [&with, &without].map(|program| instructions_per_chunk(program, shape));
        counted.push(Counted { shape, off: off?, without: without? });
    }
    Ok(counted)
}

/// Builds this program with these flags, and returns its path. It is built as a single codegen unit, as the split into
/// units affects inlining and would show in the difference.
fn build(folder: &str, flag: &str) -> Result<PathBuf, Failure> {
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).join(folder);
    let flags = env::var("RUSTFLAGS").unwrap_or_default() + " " + flag;
    let arguments = ["bench", "--no-run", "--bench", "timeline", "--no-default-features", "--message-format", "json"];
    let output = run(Command::new(env!("CARGO"))
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .env("CARGO_PROFILE_BENCH_CODEGEN_UNITS", "1")
        .env("CARGO_TARGET_DIR", target)
        .env("RUSTFLAGS", flags))?;
    let text = String::from_utf8(output.stdout)?;
    let mut programs = text.lines().rev().filter_map(|line| {
        let message: Value = serde_json::from_str(line).ok()?;
        (message["target"]["name"] == "timeline").then(|| message["executable"].as_str().map(PathBuf::from))?
    });
    programs.next().ok_or_else(|| "cargo built no program".into())
}

fn instructions_per_chunk(program: &Path, shape: Shape) -> Result<f64, Failure> {
    let [few, many] = FRAMES.map(|frames| min_instructions(program, shape, frames));
    Ok((many? - few?) as f64 / ((FRAMES[1] - FRAMES[0]) * CHUNKS) as f64)
}

fn min_instructions(program: &Path, shape: Shape, frames: usize) -> Result<u64, Failure> {
    let counts = (0..RUNS).map(|_| instructions(program, shape, frames));
    Ok(counts.collect::<Result<Vec<_>, _>>()?.into_iter().min().unwrap_or_default())
}

fn instructions(program: &Path, shape: Shape, frames: usize) -> Result<u64, Failure> {
    let output = run(Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg(program)
        .args(["--shape", shape.name(), "--frames", &frames.to_string()]))?;
    let text = String::from_utf8_lossy(&output.stderr);
    let collected = text.lines().find_map(|line| line.split("Collected :").nth(1));
    let count = collected.ok_or("valgrind printed no count")?;
    Ok(count.trim().parse()?)
}

/// # Errors
/// Returns an error if the program does not exist or fails.
fn run(command: &mut Command) -> Result<Output, Failure> {
    let name = Path::new(command.get_program()).file_name().unwrap_or(OsStr::new("?")).display().to_string();
    let output = command.output().map_err(|error| format!("{name} could not be started: {error}"))?;
    if output.status.success() {
        return Ok(output);
    }
    let output_text = String::from_utf8_lossy(&output.stderr).into_owned();
    Err(format!("{name} failed, {}:\n{output_text}", output.status).into())
}
