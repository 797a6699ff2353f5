//! What a stack says: where in the frame it is, whose code asks, and where the crate called for it.

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

/// Where in a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stage {
    /// In the jobs: from visibility to the finished pass, and in the graph that runs them.
    Jobs,
    /// Before and after them, while the frame is recorded.
    Around,
    Submit,
    Unknown,
}

/// One request, as far as it matters.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    pub stage: Stage,
    pub owner: Owner,
    /// The crate's lines that led there, the innermost first.
    pub lines: Vec<String>,
}

/// How many lines of a stack are told apart.
const MOST_LINES: usize = 4;

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
    file: &'a str,
    line: usize,
    owner: Owner,
}

/// The frames of a stack, the innermost first. Each is two lines: `  7: function` and `at file:line:column`.
fn frames(stack: &str) -> Vec<Frame<'_>> {
    stack.lines().filter_map(|text| text.trim().strip_prefix("at ")).map(frame).collect()
}

fn frame(place: &str) -> Frame<'_> {
    let mut parts = place.rsplitn(3, ':').skip(1);
    let line = parts.next().and_then(|line| line.parse().ok()).unwrap_or(0);
    let file = parts.next().unwrap_or("");
    Frame { file: shorten(file), line, owner: owner_of(file) }
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

fn stage(ours: &[&Frame<'_>]) -> Stage {
    let passes = |folder: &str| ours.iter().any(|frame| frame.file.starts_with(folder));
    if passes("src/graph/") {
        Stage::Jobs
    } else if passes("src/frame/renderer.rs") {
        Stage::Around
    } else if passes("src/frame/recorded.rs") {
        Stage::Submit
    } else {
        Stage::Unknown
    }
}
