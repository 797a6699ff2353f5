//! The crate's rooms keep their order: each module that `src/lib.rs` lists is a room, which uses only those above it.
//!
//! Unit tests in `src` are held to it as well: a room whose tests need a room below it cannot be understood, or moved,
//! with only what is above it. Comments are not: a link downwards helps a reader, and no code depends on it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::{fs, io};

use proc_macro2::{TokenStream, TokenTree};

const LONGEST_FILE: usize = 500;
const DRAWERS: [&str; 5] = ["util", "utils", "helpers", "common", "misc"];

#[test]
fn the_crate_keeps_its_rules() {
    let sources = read_sources(Path::new("src")).expect("src can be read");
    let problems = broken_rules(&sources);
    assert!(problems.is_empty(), "{} rules broken:\n{}", problems.len(), problems.join("\n"));
}

#[test]
fn an_arrow_that_points_down_is_found() {
    let to_high = |user: &str| format!("{user} uses high, which is listed below it");
    for (path, text, arrow) in [
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
        assert!(problems.iter().any(|problem| problem.contains(&arrow)), "{path}: {text}\n{problems:?}");
    }
}

#[test]
fn what_is_no_arrow_down_is_let_through() {
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
fn other_broken_rules_are_found() {
    let longest = "\n".repeat(LONGEST_FILE);
    assert_eq!(problems_with("low.rs", &longest), [""; 0]);
    assert_eq!(problems_with("low.rs", &(longest + "\n")), ["src/low.rs: 501 lines, and 500 are the most"]);
    assert_eq!(problems_with("low/utils.rs", ""), ["src/low/utils.rs: \"utils\" does not say what is inside"]);
    assert_eq!(problems_with("misc/part.wgsl", ""), ["src/misc/part.wgsl: \"misc\" does not say what is inside"]);
    assert_eq!(problems_with("attic.rs", ""), ["src/attic.rs: attic is no room that lib.rs lists"]);
    let twice = Source { path: "src/lib.rs".into(), text: "mod low;\nmod high;\nmod low;".to_owned() };
    assert_eq!(broken_rules(&[twice]), ["src/lib.rs: low is listed twice"]);
    assert!(problems_with("low.rs", "fn f() {")[0].starts_with("src/low.rs: "));
}

/// What is wrong with a file in a crate of three rooms: `low`, `middle` and `high`.
fn problems_with(path: &str, text: &str) -> Vec<String> {
    let text_of_lib = "mod low;\npub mod middle;\n#[cfg(unix)]\nmod high;\n\n\
        pub use glam;\npub use high::{Engine, part::Wheel as Tire};\n";
    let lib = Source { path: "src/lib.rs".into(), text: text_of_lib.to_owned() };
    broken_rules(&[lib, Source { path: Path::new("src").join(path), text: text.to_owned() }])
}

struct Source {
    path: PathBuf,
    text: String,
}

fn read_sources(folder: &Path) -> io::Result<Vec<Source>> {
    let mut sources = Vec::new();
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            sources.extend(read_sources(&path)?);
        } else {
            let text = String::from_utf8_lossy(&fs::read(&path)?).into_owned();
            sources.push(Source { path, text });
        }
    }
    sources.sort_by(|one, other| one.path.cmp(&other.path));
    Ok(sources)
}

fn broken_rules(sources: &[Source]) -> Vec<String> {
    let parsed = |text: &str| text.parse::<TokenStream>().map(trees_of);
    let lib = sources.iter().find(|source| source.path == Path::new("src/lib.rs")).expect("there is a lib.rs");
    let root = Root::new(&parsed(&lib.text).expect("lib.rs is Rust"));
    let again = root.rooms.iter().enumerate().filter(|(index, room)| root.rooms[..*index].contains(room));
    let mut problems: Vec<_> = again.map(|(_, room)| format!("src/lib.rs: {room} is listed twice")).collect();
    for Source { path, text } in sources {
        let shown = path.display();
        let lines = text.lines().count();
        if lines > LONGEST_FILE {
            problems.push(format!("{shown}: {lines} lines, and {LONGEST_FILE} are the most"));
        }
        let names = path.iter().filter_map(|part| Path::new(part).file_stem()?.to_str());
        for name in names.filter(|name| DRAWERS.contains(name)) {
            problems.push(format!("{shown}: {name:?} does not say what is inside"));
        }
        if path.extension().is_some_and(|extension| extension == "rs") {
            let not_rust = |error| vec![format!("{shown}: {error}")];
            problems.extend(parsed(text).map_or_else(not_rust, |trees| root.wrong_arrows(path, &trees)));
        }
    }
    problems
}

/// What `lib.rs` lists.
#[derive(Default)]
struct Root {
    rooms: Vec<String>,
    /// The room behind each name at the root; `None` for what is another crate's.
    names: BTreeMap<String, Option<usize>>,
}

impl Root {
    fn new(trees: &[TokenTree]) -> Self {
        let mut root = Self::default();
        let mut leaves = Vec::new();
        for (at, next) in trees.iter().enumerate().skip(1) {
            if is(Some(&trees[at - 1]), "mod") {
                root.rooms.push(next.to_string());
            } else if is(Some(&trees[at - 1]), "use") {
                expand(trees, at, Vec::new(), &mut leaves);
            }
        }
        root.names.extend(root.rooms.iter().cloned().zip((0..).map(Some)));
        for Leaf { path, name } in leaves {
            let first = path.iter().find(|segment| !["crate", "self"].contains(&segment.as_str()));
            root.names.insert(name, root.rooms.iter().position(|room| Some(room) == first));
        }
        root
    }

    /// The uses of rooms below the file's own. `lib.rs` itself stands below every room.
    fn wrong_arrows(&self, path: &Path, trees: &[TokenTree]) -> Vec<String> {
        let (shown, module) = (path.display(), module_of(path));
        let Some(user) = module.first() else { return Vec::new() };
        let Some(own) = self.rooms.iter().position(|room| room == user) else {
            return vec![format!("{shown}: {user} is no room that lib.rs lists")];
        };
        let mut wrong = Vec::new();
        for (line, used) in uses_of_root(trees, &module) {
            let problem = match self.names.get(&used) {
                Some(&Some(room)) if room > own => format!("{}, which is listed below it", self.rooms[room]),
                Some(_) => continue,
                None => format!("{used}, which lib.rs does not name"),
            };
            wrong.push(format!("{shown}:{line}: {user} uses {problem}"));
        }
        wrong.dedup();
        wrong
    }
}

/// `src/view/frustum.rs` is `["view", "frustum"]`; `src/view/mod.rs` is `["view"]`; `src/lib.rs` is the root.
fn module_of(path: &Path) -> Vec<String> {
    let parts = path.with_extension("");
    let parts = parts.iter().skip(1).filter_map(|part| part.to_str());
    parts.filter(|part| !["mod", "lib"].contains(part)).map(str::to_owned).collect()
}

/// Every path that starts with `crate` or `super`: its line, and what it names at the crate's root, `*` for all.
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
                    let mut full = module.to_vec();
                    for segment in path {
                        match segment.as_str() {
                            "crate" => full.clear(),
                            "super" => _ = full.pop(),
                            "self" => {}
                            _ => full.push(segment),
                        }
                    }
                    uses.push((start.span().start().line, full.into_iter().next().unwrap_or_else(|| "*".to_owned())));
                }
                continue;
            }
            _ => {}
        }
        at += 1;
    }
    uses
}

/// One path of a tree such as `a::{b, c as d}`, and the name it gets.
struct Leaf {
    path: Vec<String>,
    name: String,
}

/// Adds the paths of the tree that starts at `at`, each behind `path`, and returns where it ends.
fn expand(trees: &[TokenTree], mut at: usize, mut path: Vec<String>, leaves: &mut Vec<Leaf>) -> usize {
    while let Some(tree) = trees.get(at) {
        if let TokenTree::Group(group) = tree {
            let inner = trees_of(group.stream());
            let parts = inner.split(|tree| is(Some(tree), ",")).filter(|part| !part.is_empty());
            parts.for_each(|part| _ = expand(part, 0, path.clone(), leaves));
            return at + 1;
        }
        path.push(tree.to_string());
        at += 1;
        let next = trees.get(at + 2).filter(|_| is(trees.get(at), ":") && is(trees.get(at + 1), ":"));
        if !(matches!(next, Some(TokenTree::Ident(_) | TokenTree::Group(_))) || is(next, "*")) {
            break;
        }
        at += 2;
    }
    let renamed = trees.get(at + 1).filter(|_| is(trees.get(at), "as"));
    let name = renamed.map(TokenTree::to_string).or_else(|| path.last().cloned()).unwrap_or_default();
    leaves.push(Leaf { path, name });
    at
}

/// Whether this is that word or punctuation mark.
fn is(tree: Option<&TokenTree>, text: &str) -> bool {
    tree.is_some_and(|tree| !matches!(tree, TokenTree::Group(_)) && tree.to_string() == text)
}

fn trees_of(stream: TokenStream) -> Vec<TokenTree> {
    stream.into_iter().collect()
}
