//! What examples and benchmarks write goes through `drawloom-output`: whole, or not at all. What they print does too,
//! so that no output that is closed or full ends them before their files are there, and so do their arguments, of which
//! clap prints those that are wrong. The library writes to what its
//! callers open, and prints nothing.

use std::path::Path;

use crate::sources::{Source, read_all};

/// What creates or replaces a file, or opens one to write to it.
const WRITERS: [&str; 11] = [
    "fs::write(",
    "File::create",
    "File::options",
    ".write(true)",
    ".append(true)",
    ".create(true)",
    "save_buffer",
    ".save(",
    ".save_with_format(",
    "SVGBackend::new(",
    ".from_path(",
];

#[test]
fn every_file_is_written_whole() {
    let problems = written_directly(&read_all(&[
        "async-post",
        "gltf",
        "jobs",
        "obj",
        "src",
        "examples",
        "benches",
        "egui",
        "tracy",
        "testing",
    ]));
    assert!(problems.is_empty(), "{} files are written directly:\n{}", problems.len(), problems.join("\n"));
}

fn written_directly(sources: &[Source]) -> Vec<String> {
    lines_of(sources, |line| WRITERS.iter().any(|writer| line.contains(writer)))
}

/// What prints, or names a stream to print to.
const PRINTERS: [&str; 7] = ["print", "println", "eprint", "eprintln", "dbg", "stdout", "stderr"];

/// The calls of clap that end a program, and print the arguments unescaped.
const PARSERS: [&str; 5] = ["::parse()", "::parse_from(", ".get_matches()", ".exit()", "Error::exit"];

/// What else is left: an event loop, and a span.
const OTHER_EXITS: [&str; 2] = ["event_loop.exit()", "self.tracing.exit()"];

/// Aborts the process, and says why where nothing else can.
const MAY_PRINT: &str = "jobs/src/unwind/mod.rs";

#[test]
fn every_line_is_printed_in_one_place() {
    let mut sources =
        read_all(&["async-post", "gltf", "jobs", "obj", "src", "examples", "benches", "egui", "tracy", "testing"]);
    sources.retain(|source| source.path != Path::new(MAY_PRINT));
    let problems = printed_directly(&sources);
    assert!(
        problems.is_empty(),
        "{} lines are printed past `drawloom-output`:\n{}",
        problems.len(),
        problems.join("\n")
    );
}

fn printed_directly(sources: &[Source]) -> Vec<String> {
    lines_of(sources, |line| {
        let is_word = |character: char| character.is_alphanumeric() || character == '_';
        let code = line.trim_start();
        let prints = |printer: &&str| {
            code.match_indices(*printer).any(|(start, _)| {
                let rest = &code[start + printer.len()..];
                let is_whole = !code[..start].ends_with(is_word) && !rest.starts_with(is_word);
                let names_stream = code[..start].ends_with("::")
                    || rest.starts_with('(') && !code[..start].ends_with('.')
                    || code.starts_with("use ");
                // A function may be called `print`, and a program that was run has an output.
                is_whole && if printer.starts_with("std") { names_stream } else { rest.starts_with('!') }
            })
        };
        let parsing = OTHER_EXITS.iter().fold(code.to_owned(), |code, exit| code.replace(exit, ""));
        let parses = |parser: &&str| parsing.contains(*parser);
        !code.starts_with("//") && (PRINTERS.iter().any(prints) || PARSERS.iter().any(parses))
    })
}

/// The lines for which `is_wanted`, without those of tests.
fn lines_of(sources: &[Source], is_wanted: impl Fn(&str) -> bool) -> Vec<String> {
    let is_for_tests = |source: &Source| source.path.with_extension("").iter().any(|part| part == "tests");
    let mut problems = Vec::new();
    for source in sources.iter().filter(|source| source.is_rust() && !is_for_tests(source)) {
        let lines = source.text.lines().enumerate().take_while(|(_, line)| *line != "mod tests {");
        for (number, line) in lines.filter(|(_, line)| is_wanted(line)) {
            problems.push(format!("{}:{}: {}", source.path.display(), number + 1, line.trim()));
        }
    }
    problems
}

#[test]
fn a_file_that_is_written_directly_is_found() {
    let problems_of = |text: &str| written_directly(&[Source::new("report.rs", text)]);
    assert_eq!(
        problems_of("fn f() {\n    std::fs::write(path, text)?;\n}\n"),
        ["src/report.rs:2: std::fs::write(path, text)?;"]
    );
    assert!(problems_of("image::save_buffer(path)?;")[0].starts_with("src/report.rs:1: "));
    assert_eq!(problems_of("mod tests;\nfn f() {}\nmod tests {\n    fn g() { std::fs::write(a, b) }\n}\n"), [""; 0]);
}

#[test]
fn a_line_that_is_printed_directly_is_found() {
    let count = |text: &str| printed_directly(&[Source::new("report.rs", text)]).len();
    for line in [
        "println!(\"a\");",
        "    eprintln!();",
        "print!(\"a\")",
        "dbg!(a);",
        "writeln!(io::stdout(), \"a\")?;",
        "use std::io::{self, stderr};",
        "events.with_writer(std::io::stderr)",
        "report.map(|line| println!(\"{line}\"));",
        "let arguments = Arguments::parse();",
        "Arguments::parse_from(arguments)",
        "command.get_matches()",
        "unwrap_or_else(|error| error.exit())",
        "unwrap_or_else(|e| e.exit())",
        "    .exit()",
        "unwrap_or_else(clap::Error::exit)",
    ] {
        assert_eq!(count(line), 1, "{line}");
    }
    for line in [
        "print_line!(\"a\");",
        "report.print();",
        "fn print(&self) {}",
        "// println!(\"a\")",
        "    /// stdout",
        "text(run.stdout)?",
        ".stderr(log)",
        "let count: usize = text.parse()?;",
        "Self::try_parse_from(arguments)?",
        "event_loop.exit();",
        "Opened { at, span: self.tracing.exit() }",
    ] {
        assert_eq!(count(line), 0, "{line}");
    }
}
