//! Files are short, parse if they are Rust, and have specific names.

use std::path::Path;

use crate::sources::{CRATES, Source, read_all};

const MAX_LINES: usize = 500;
const VAGUE_NAMES: [&str; 5] = ["util", "utils", "helpers", "common", "misc"];

#[test]
fn files_are_short_and_well_named() {
    let problems = wrong_files(&read_all(&CRATES));
    assert!(problems.is_empty(), "{} files:\n{}", problems.len(), problems.join("\n"));
}

fn wrong_files(sources: &[Source]) -> Vec<String> {
    let mut problems = Vec::new();
    for source in sources {
        let shown = source.path.display();
        let lines = source.text.lines().count();
        if lines > MAX_LINES {
            problems.push(format!("{shown}: {lines} lines, but the limit is {MAX_LINES}"));
        }
        let names = source.path.iter().filter_map(|part| Path::new(part).file_stem()?.to_str());
        for name in names.filter(|name| VAGUE_NAMES.contains(name)) {
            problems.push(format!("{shown}: {name:?} does not say what is inside"));
        }
        if let (true, Err(error)) = (source.is_rust(), source.parse()) {
            problems.push(format!("{shown}: {error}"));
        }
    }
    problems
}

#[test]
fn a_long_or_badly_named_file_is_found() {
    let problems_of = |path: &str, text: &str| wrong_files(&[Source::new(path, text)]);
    let longest = "\n".repeat(MAX_LINES);
    assert_eq!(problems_of("low.rs", &longest), [""; 0]);
    assert_eq!(problems_of("low.rs", &(longest + "\n")), ["src/low.rs: 501 lines, but the limit is 500"]);
    assert_eq!(problems_of("low/utils.rs", ""), ["src/low/utils.rs: \"utils\" does not say what is inside"]);
    assert_eq!(problems_of("misc/part.wgsl", ""), ["src/misc/part.wgsl: \"misc\" does not say what is inside"]);
    assert!(problems_of("low.rs", "fn f() {")[0].starts_with("src/low.rs: "));
}
