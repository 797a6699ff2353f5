//! What examples and benchmarks write goes through `drawloom-output`: whole, or not at all. The library writes to what its callers open.

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
    let problems = written_directly(&read_all(&["src", "examples", "benches", "egui", "tracy", "testing"]));
    assert!(problems.is_empty(), "{} files are written directly:\n{}", problems.len(), problems.join("\n"));
}

fn written_directly(sources: &[Source]) -> Vec<String> {
    let is_for_tests = |source: &Source| source.path.with_extension("").iter().any(|part| part == "tests");
    let mut problems = Vec::new();
    for source in sources.iter().filter(|source| source.is_rust() && !is_for_tests(source)) {
        let lines = source.text.lines().enumerate().take_while(|(_, line)| *line != "mod tests {");
        for (number, line) in lines.filter(|(_, line)| WRITERS.iter().any(|writer| line.contains(writer))) {
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
