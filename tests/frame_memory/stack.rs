//! What a stack says: the stage of the frame, whose code asks, and where the crate called for it.

use std::fs;
use std::path::Path;

/// Whose code asked for memory: the innermost that is one of these.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Owner {
    /// The crate.
    Drawloom,
    /// wgpu and what is below it.
    Wgpu,
    /// Neither.
    Nobody,
}

/// One request, as far as it matters.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    pub stage: String,
    pub owner: Owner,
    /// The crate's lines that led there, the innermost first.
    pub lines: Vec<String>,
}

/// How many lines of a stack are told apart.
const MOST_LINES: usize = 4;

pub const UNKNOWN: &str = "unknown";
pub const BEFORE: &str = "before the jobs";
pub const AFTER: &str = "after the jobs";
pub const GRAPH: &str = "between jobs";
pub const SUBMIT: &str = "submit";

/// Reads a stack as the standard library prints it.
pub fn read(stack: &str) -> Place {
    let frames = frames(stack);
    let ours: Vec<_> = frames.iter().filter(|frame| frame.owner == Owner::Drawloom).collect();
    let owner = frames.iter().map(|frame| frame.owner).find(|&owner| owner != Owner::Nobody).unwrap_or(Owner::Nobody);
    let mut lines: Vec<_> = ours.iter().map(|frame| format!("{}:{}", frame.file, frame.line)).collect();
    // A closure stands on the line that it is called from.
    lines.dedup();
    lines.truncate(MOST_LINES);
    Place { stage: stage(&ours), owner, lines }
}

struct Frame<'a> {
    function: &'a str,
    file: &'a str,
    line: usize,
    owner: Owner,
}

/// The frames of a stack, the innermost first. Each is two lines: `  7: function` and `at file:line:column`.
fn frames(stack: &str) -> Vec<Frame<'_>> {
    let mut frames = Vec::new();
    let mut function = "";
    for text in stack.lines().map(str::trim) {
        if let Some(place) = text.strip_prefix("at ") {
            let mut parts = place.rsplitn(3, ':').skip(1);
            let line = parts.next().and_then(|line| line.parse().ok()).unwrap_or(0);
            let file = parts.next().unwrap_or("");
            frames.push(Frame { function, file: shorten(file), line, owner: owner_of(file) });
        } else if let Some((_, name)) = text.split_once(": ") {
            function = name;
        }
    }
    frames
}

/// A path relative to the package.
fn shorten(file: &str) -> &str {
    let file = file.strip_prefix(env!("CARGO_MANIFEST_DIR")).unwrap_or(file);
    file.trim_start_matches(['.', '/'])
}

fn owner_of(file: &str) -> Owner {
    let is_own = file.starts_with(env!("CARGO_MANIFEST_DIR")) || file.starts_with("./");
    let is_wgpu = ["/wgpu-", "/naga-"].iter().any(|package| file.contains(package));
    match (is_own && shorten(file).starts_with("src/"), is_wgpu) {
        (true, _) => Owner::Drawloom,
        (_, true) => Owner::Wgpu,
        _ => Owner::Nobody,
    }
}

/// The phase whose arm a job is in; without a job, where in a frame the calling thread is.
fn stage(ours: &[&Frame<'_>]) -> String {
    let find = |file: &str, function: &str| {
        ours.iter().find(|frame| frame.file == file && is_named(frame.function, function)).map(|frame| frame.line)
    };
    if let Some(line) = find("src/frame/phase.rs", "work") {
        return arm_above("src/frame/phase.rs", line).unwrap_or_else(|| UNKNOWN.to_owned());
    }
    if ours.iter().any(|frame| frame.file.starts_with("src/graph/") && frame.function.contains("run")) {
        return GRAPH.to_owned();
    }
    if let Some(line) = find("src/frame/renderer.rs", "record") {
        let run = line_of("src/frame/renderer.rs", "schedule.run(");
        return if run.is_none_or(|run| line < run) { BEFORE } else { AFTER }.to_owned();
    }
    match find("src/frame/recorded.rs", "submit") {
        Some(_) => SUBMIT.to_owned(),
        None => UNKNOWN.to_owned(),
    }
}

/// Whether a function has that name, whatever it is part of and whatever types it is for.
fn is_named(function: &str, name: &str) -> bool {
    let end = function.rfind(&format!("::{name}")).map_or(0, |place| place + 2);
    function[end..]
        .strip_prefix(name)
        .is_some_and(|rest| !rest.starts_with(|next: char| next.is_alphanumeric() || next == '_'))
}

/// The match arm `Self::Name` that a line is in.
fn arm_above(file: &str, line: usize) -> Option<String> {
    let text = source(file);
    let above: Vec<_> = text.lines().take(line).collect();
    let arm = above.iter().rev().find_map(|text| text.trim().strip_prefix("Self::"))?;
    let name: String = arm.chars().take_while(|letter| letter.is_alphanumeric()).collect();
    Some(format!("job {name}"))
}

fn line_of(file: &str, part: &str) -> Option<usize> {
    source(file).lines().position(|line| line.contains(part)).map(|index| index + 1)
}

fn source(file: &str) -> String {
    fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join(file)).unwrap_or_default()
}
