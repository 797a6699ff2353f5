//! Files have few lines of code, parse if they are Rust, and have specific names.

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
        let lines = code_lines(source);
        if lines > MAX_LINES {
            problems.push(format!("{shown}: {lines} lines of code, but the limit is {MAX_LINES}"));
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

/// The number of lines without blank ones, comments, and the tests at the end of the file.
fn code_lines(source: &Source) -> usize {
    let code = source.text.split("\n#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    code.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with("//")).count()
}

#[test]
fn a_long_or_badly_named_file_is_found() {
    let problems_of = |path: &str, text: &str| wrong_files(&[Source::new(path, text)]);
    let longest = "struct S;\n".repeat(MAX_LINES);
    let uncounted = "//! Docs.\n\n    // A comment.\n#[cfg(test)]\nmod tests {\n    use super::*;\n}\n";
    assert_eq!(problems_of("low.rs", &(longest.clone() + uncounted)), [""; 0]);
    let too_long = ["src/low.rs: 501 lines of code, but the limit is 500"];
    assert_eq!(problems_of("low.rs", &(longest.clone() + "#[test]\n")), too_long);
    assert_eq!(problems_of("low.rs", &(longest + "#[cfg(test)]\n" + uncounted)), too_long);
    assert_eq!(problems_of("low/utils.rs", ""), ["src/low/utils.rs: \"utils\" does not say what is inside"]);
    assert_eq!(problems_of("misc/part.wgsl", ""), ["src/misc/part.wgsl: \"misc\" does not say what is inside"]);
    assert!(problems_of("low.rs", "fn f() {")[0].starts_with("src/low.rs: "));
}
