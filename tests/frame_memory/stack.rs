//! Reads backtraces: the phase of the frame, the owner of the allocating code, and the crate's lines on the way.

/// The owner of the allocating code: the innermost known one in the backtrace.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Owner {
    /// The crate.
    Drawloom,
    /// wgpu and its dependencies.
    Wgpu,
    /// Neither.
    Other,
}

/// The phase of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Phase {
    /// In the jobs, from visibility to the finished pass, and in the graph that runs them.
    Jobs,
    /// Before and after the jobs, while the frame is recorded.
    Around,
    Submit,
    Unknown,
}

/// The call site of an allocation.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct CallSite {
    pub phase: Phase,
    pub owner: Owner,
    /// The crate's lines in the backtrace, the innermost first.
    pub lines: Vec<String>,
}

/// The maximum number of lines in a call site.
const MAX_LINES: usize = 4;

/// Parses a backtrace as the standard library prints it.
pub fn read(stack: &str) -> CallSite {
    let frames = frames(stack);
    let own_frames: Vec<_> = frames.iter().filter(|frame| frame.owner == Owner::Drawloom).collect();
    let owner = frames.iter().map(|frame| frame.owner).find(|&owner| owner != Owner::Other).unwrap_or(Owner::Other);
    let mut lines: Vec<_> = own_frames.iter().map(|frame| format!("{}:{}", frame.file, frame.line)).collect();
    // A closure's frame has the line of its caller.
    lines.dedup();
    lines.truncate(MAX_LINES);
    CallSite { phase: phase(&own_frames), owner, lines }
}

struct Frame<'a> {
    file: &'a str,
    line: usize,
    owner: Owner,
}

/// The frames of a backtrace, the innermost first. Each is two lines: `  7: function` and `at file:line:column`.
fn frames(stack: &str) -> Vec<Frame<'_>> {
    stack.lines().filter_map(|text| text.trim().strip_prefix("at ")).map(frame).collect()
}

fn frame(location: &str) -> Frame<'_> {
    let mut parts = location.rsplitn(3, ':').skip(1);
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
    let is_library = ["src/", "jobs/src/"].iter().any(|folder| shorten(file).starts_with(folder));
    match (is_own && is_library, is_wgpu) {
        (true, _) => Owner::Drawloom,
        (_, true) => Owner::Wgpu,
        _ => Owner::Other,
    }
}

fn phase(own_frames: &[&Frame<'_>]) -> Phase {
    let visits = |folder: &str| own_frames.iter().any(|frame| frame.file.starts_with(folder));
    if visits("jobs/src/graph/") {
        Phase::Jobs
    } else if visits("src/frame/renderer.rs") {
        Phase::Around
    } else if visits("src/frame/recorded_frame.rs") {
        Phase::Submit
    } else {
        Phase::Unknown
    }
}
