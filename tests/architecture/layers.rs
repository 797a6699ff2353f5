//! Each module that a crate's `lib.rs` lists is a layer, which uses only the layers above it.
//!
//! Unit tests in `src` follow the same rule: if a module's tests needed a lower layer, the module could not be
//! understood, or moved, with only the layers above it. Comments do not: no code depends on a link downwards, and it
//! helps a reader.

use std::collections::BTreeMap;

use proc_macro2::TokenTree;

use crate::paths::{Leaf, expand, from_root};
use crate::sources::{CRATES, Source, read_all};
use crate::tokens::{is, trees_of};

#[test]
fn a_module_uses_only_those_above_it() {
    let problems = CRATES.map(|folder| wrong_uses(&read_all(&[folder]))).concat();
    assert!(problems.is_empty(), "{} uses:\n{}", problems.len(), problems.join("\n"));
}

fn wrong_uses(sources: &[Source]) -> Vec<String> {
    let lib = sources.iter().find(|source| source.path.ends_with("src/lib.rs")).expect("there is a lib.rs");
    let root = Root::new(&lib.parse().expect("lib.rs is Rust"));
    let again = root.layers.iter().enumerate().filter(|(index, layer)| root.layers[..*index].contains(layer));
    let mut problems: Vec<_> =
        again.map(|(_, layer)| format!("{}: {layer} is listed twice", lib.path.display())).collect();
    for source in sources.iter().filter(|source| source.is_rust()) {
        // `files` reports a file that does not parse.
        if let Ok(trees) = source.parse() {
            problems.extend(root.wrong_uses(source, &trees));
        }
    }
    problems
}

/// The layers and names that `lib.rs` lists.
#[derive(Default)]
struct Root {
    layers: Vec<String>,
    /// The layer that defines each name at the root; `None` for a name from another crate.
    names: BTreeMap<String, Option<usize>>,
}

impl Root {
    fn new(trees: &[TokenTree]) -> Self {
        let mut root = Self::default();
        let mut leaves = Vec::new();
        for (at, next) in trees.iter().enumerate().skip(1) {
            if is(Some(&trees[at - 1]), "mod") {
                root.layers.push(next.to_string());
            } else if is(Some(&trees[at - 1]), "use") {
                expand(trees, at, Vec::new(), &mut leaves);
            }
        }
        root.names.extend(root.layers.iter().cloned().zip((0..).map(Some)));
        for Leaf { path, name } in leaves {
            let first = path.iter().find(|segment| !["crate", "self"].contains(&segment.as_str()));
            root.names.insert(name, root.layers.iter().position(|layer| Some(layer) == first));
        }
        root
    }

    /// The uses of layers below the file's own. `lib.rs` itself is below every layer.
    fn wrong_uses(&self, source: &Source, trees: &[TokenTree]) -> Vec<String> {
        let (shown, module) = (source.path.display(), source.module());
        let Some(user) = module.first() else { return Vec::new() };
        let Some(own) = self.layers.iter().position(|layer| layer == user) else {
            return vec![format!("{shown}: lib.rs does not list {user}")];
        };
        let mut wrong = Vec::new();
        for (line, used) in uses_of_root(trees, &module) {
            let problem = match self.names.get(&used) {
                Some(&Some(layer)) if layer > own => format!("{}, which is listed below it", self.layers[layer]),
                Some(_) => continue,
                None => format!("{used}, which lib.rs does not name"),
            };
            wrong.push(format!("{shown}:{line}: {user} uses {problem}"));
        }
        wrong.dedup();
        wrong
    }
}

/// Every path that starts with `crate` or `super`: its line, and the name at the crate's root that it goes through, `*`
/// for all of them.
fn uses_of_root(trees: &[TokenTree], module: &[String]) -> Vec<(usize, String)> {
    let (mut uses, mut at) = (Vec::new(), 0);
    while let Some(tree) = trees.get(at) {
        match tree {
            TokenTree::Group(group) => {
                let mut module = module.to_vec();
                if at > 1 && is(trees.get(at - 2), "mod") {
                    module.push(trees[at - 1].to_string());
                }
                uses.extend(uses_of_root(&trees_of(group.stream()), &module));
            }
            TokenTree::Ident(start) if start == "crate" || start == "super" => {
                let mut leaves = Vec::new();
                at = expand(trees, at, Vec::new(), &mut leaves);
                // A word alone is a visibility.
                for Leaf { path, .. } in leaves.into_iter().filter(|leaf| leaf.path.len() > 1) {
                    let name = from_root(&path, module).into_iter().next().unwrap_or_else(|| "*".to_owned());
                    uses.push((start.span().start().line, name));
                }
                continue;
            }
            _ => {}
        }
        at += 1;
    }
    uses
}

/// The problems of a file in a crate with three layers: `low`, `middle` and `high`.
fn problems_with(path: &str, text: &str) -> Vec<String> {
    let text_of_lib = "mod low;\npub mod middle;\n#[cfg(unix)]\nmod high;\n\n\
        pub use glam;\npub use high::{Engine, part::Wheel as Tire};\n";
    wrong_uses(&[Source::new("lib.rs", text_of_lib), Source::new(path, text)])
}

#[test]
fn a_use_of_a_lower_layer_is_found() {
    let to_high = |user: &str| format!("{user} uses high, which is listed below it");
    for (path, text, use_of_high) in [
        ("middle.rs", "\n\nuse crate::high::X;", format!("src/middle.rs:3: {}", to_high("middle"))),
        ("middle.rs", "use crate::{low, low::{A, B}, high::C};", to_high("middle")),
        ("middle/mod.rs", "use super::high;", to_high("middle")),
        ("middle/part.rs", "fn f() { super::super::high::f::<u8>(); }", to_high("middle")),
        ("middle/part.rs", "use super::{A as B, super::{low, high}};", to_high("middle")),
        ("low.rs", "mod tests { mod deep { } use super::super::high::X; }", to_high("low")),
        ("low.rs", "fn engine() -> crate::Engine {}", to_high("low")),
        ("low.rs", "use crate::{self as root, Tire};", to_high("low")),
        ("low.rs", "fn f() { (\"//\", '\"', crate::high::f::<'static>()) }", to_high("low")),
        ("low.rs", "/* /* */ */ fn f(self) { check!(\n(crate::high::f())); }", "src/low.rs:2: low".to_owned()),
        ("low.rs", "use crate::*;", "low uses *, which lib.rs does not name".to_owned()),
        ("low.rs", "use crate::{self as root};", "low uses *".to_owned()),
    ] {
        let problems = problems_with(path, text);
        assert!(problems.iter().any(|problem| problem.contains(&use_of_high)), "{path}: {text}\n{problems:?}");
    }
}

#[test]
fn other_uses_are_allowed() {
    for (path, text) in [
        ("high.rs", "use crate::{low, middle::{A, B as C}}; use crate::high::X;"),
        ("middle.rs", "//! [`crate::high`]\n/* crate::high /* */ crate::high */ fn f() { g(\"crate::high\", '\"'); }"),
        ("middle.rs", "mod tests { use super::high; } const RAW: &str = r##\"\"# crate::high\"##;"),
        ("middle/part.rs", "use super::high; fn f<'a>(a: &'a str, b: char) -> &'a str {}"),
        ("middle/mod.rs", "pub(crate) use self::high::X; pub(super) fn f(at: crate::glam::Vec3) {}"),
    ] {
        assert_eq!(problems_with(path, text), [""; 0], "{path}: {text}");
    }
}

#[test]
fn a_module_that_is_not_listed_once_is_found() {
    assert_eq!(problems_with("attic.rs", ""), ["src/attic.rs: lib.rs does not list attic"]);
    let twice = Source::new("lib.rs", "mod low;\nmod high;\nmod low;");
    assert_eq!(wrong_uses(&[twice]), ["src/lib.rs: low is listed twice"]);
}
