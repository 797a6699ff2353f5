//! Subscribers of `tracing` are code of the engine's, which may panic: the library calls them only where that is
//! caught.

use proc_macro2::TokenTree;

use crate::sources::{CRATES, Source, read_all};
use crate::tokens::{is, trees_of};

/// The macros of `tracing` that call a subscriber, and the ways to enter a span that exit it in a destructor of
/// `tracing`'s own.
const CALLS: [&str; 12] = [
    "trace",
    "debug",
    "info",
    "warn",
    "error",
    "event",
    "span",
    "trace_span",
    "debug_span",
    "info_span",
    "warn_span",
    "error_span",
];
const GUARDS: [&str; 2] = ["entered", "in_scope"];

#[test]
fn subscribers_are_called_where_their_panics_are_caught() {
    let problems = unguarded_calls(&read_all(&CRATES));
    assert!(problems.is_empty(), "{} calls of subscribers are not caught:\n{}", problems.len(), problems.join("\n"));
}

fn unguarded_calls(sources: &[Source]) -> Vec<String> {
    let mut problems = Vec::new();
    for source in sources.iter().filter(|source| source.is_rust()) {
        // `files` reports a file that does not parse.
        let mut lines = Vec::new();
        if let Ok(trees) = source.parse() {
            add_unguarded(&trees, false, &mut lines);
        }
        problems.extend(lines.iter().map(|line| format!("{}:{line}", source.path.display())));
    }
    problems
}

/// Adds the lines of calls outside of `emit(..)`, `emit_unlocked(..)` and `CaughtSpan::new(..)`.
fn add_unguarded(trees: &[TokenTree], is_caught: bool, lines: &mut Vec<usize>) {
    let before = |at: usize, back: usize| at.checked_sub(back).and_then(|at| trees.get(at));
    for (at, tree) in trees.iter().enumerate() {
        match tree {
            TokenTree::Group(group) => {
                let is_span = is(before(at, 1), "new") && is(before(at, 4), "CaughtSpan");
                let is_emitted = ["emit", "emit_unlocked"].iter().any(|emits| is(before(at, 1), emits));
                let catches = is_emitted || is_span;
                add_unguarded(&trees_of(group.stream()), is_caught || catches, lines);
            }
            TokenTree::Ident(name) if !is_caught => {
                let name = name.to_string();
                let is_macro = CALLS.contains(&name.as_str())
                    && is(before(at, 3), "tracing")
                    && is(before(at, 1), ":")
                    && is(trees.get(at + 1), "!");
                let is_guard = GUARDS.contains(&name.as_str()) && is(before(at, 1), ".");
                if is_macro || is_guard {
                    lines.push(tree.span().start().line);
                }
            }
            _ => {}
        }
    }
}

#[test]
fn a_call_that_is_not_caught_is_found() {
    let problems_of = |text: &str| unguarded_calls(&[Source::new("report.rs", text)]);
    assert_eq!(problems_of("fn f() {\n    tracing::warn!(\"late\");\n}"), ["src/report.rs:2"]);
    assert_eq!(problems_of("fn f() { g(|| tracing::debug_span!(\"late\")) }"), ["src/report.rs:1"]);
    assert_eq!(problems_of("fn f() { let entered = CaughtSpan::new(g); span.entered(); }"), ["src/report.rs:1"]);
    for caught in [
        "fn f() { emit(|| tracing::warn!(\"late\")); }",
        "fn f() { emit(|| { if late { tracing::error!(\"late\"); } }); }",
        "fn f() { crate::unwind::CaughtSpan::new(|| tracing::span!(level, \"late\")).enter() }",
        "fn f() { let warn = tracing::Level::WARN; }",
    ] {
        assert_eq!(problems_of(caught), [""; 0], "{caught}");
    }
}
