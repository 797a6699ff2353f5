//! Unsafe code is only in modules that Miri and the thread sanitizer run: those that the package `interleavings` builds.

use std::path::Path;

use proc_macro2::TokenTree;

use crate::sources::{Source, read_all};
use crate::tokens::{is, trees_of};

#[test]
fn miri_can_run_all_unsafe_code() {
    let problems = unsafe_elsewhere(&read_all(&["src", "interleavings"]));
    assert!(problems.is_empty(), "`interleavings` does not build this unsafe code:\n{}", problems.join("\n"));
}

/// The lines with unsafe code in modules that `interleavings` does not build.
fn unsafe_elsewhere(sources: &[Source]) -> Vec<String> {
    let checked = sources.iter().find(|source| source.path == Path::new("interleavings/src/lib.rs"));
    let trees = checked.expect("there is a lib.rs").parse().expect("lib.rs is Rust");
    let modules: Vec<_> =
        trees.windows(2).filter(|pair| is(Some(&pair[0]), "mod")).map(|pair| pair[1].to_string()).collect();
    let mut problems = Vec::new();
    for source in sources.iter().filter(|source| source.is_rust() && source.path.starts_with("src")) {
        if source.module().first().is_some_and(|module| modules.contains(module)) {
            continue;
        }
        // `files` reports a file that does not parse.
        for line in source.parse().map(unsafe_lines).unwrap_or_default() {
            problems.push(format!("{}:{line}", source.path.display()));
        }
    }
    problems
}

/// The lines of each keyword `unsafe`.
fn unsafe_lines(trees: Vec<TokenTree>) -> Vec<usize> {
    let lines_of = |tree| match tree {
        TokenTree::Group(group) => unsafe_lines(trees_of(group.stream())),
        tree if is(Some(&tree), "unsafe") => vec![tree.span().start().line],
        _ => Vec::new(),
    };
    trees.into_iter().flat_map(lines_of).collect()
}

#[test]
fn unsafe_code_that_is_not_run_is_found() {
    let checked = Source {
        path: Path::new("interleavings/src/lib.rs").to_owned(),
        text: "#[path = \"../../src/task/mod.rs\"]\npub mod task;".to_owned(),
    };
    let code = "// unsafe\n#![deny(unsafe_code)]\nfn f() {\n    unsafe { g() }\n}\nunsafe impl Send for A {}\n";
    let sources = [checked, Source::new("task/queue.rs", code), Source::new("view/mod.rs", code)];
    assert_eq!(unsafe_elsewhere(&sources), ["src/view/mod.rs:4", "src/view/mod.rs:6"]);
}
