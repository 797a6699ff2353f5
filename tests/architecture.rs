//! The crate's rooms keep their order: each module that `src/lib.rs` lists is a room, which uses only those above it.
//!
//! Unit tests in `src` are held to it as well: a room whose tests need a room below it cannot be understood, or moved,
//! with only what is above it. Comments are not: a link downwards helps a reader, and no code depends on it.
//!
//! The tables of memory orderings in `ARCHITECTURE.md` list every atomic of `src`.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::{fs, io};

use proc_macro2::{Delimiter, TokenStream, TokenTree};

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

#[test]
fn the_tables_of_memory_orderings_list_every_atomic() {
    let architecture = fs::read_to_string("ARCHITECTURE.md").expect("ARCHITECTURE.md can be read");
    let sources = read_sources(Path::new("src")).expect("src can be read");
    let problems = wrong_atomics(&architecture, &sources);
    assert!(problems.is_empty(), "{} atomics:\n{}", problems.len(), problems.join("\n"));
}

#[test]
fn an_atomic_that_is_not_listed_is_found() {
    for (text, name) in [
        ("struct A { a: u8, pub(super) b: AtomicBool, c: u8 }", "b"),
        ("struct A<'a, T: 'static> where T: Fn(u8) { b: &'a [std::sync::atomic::AtomicPtr<T>], c: T }", "b"),
        ("mod linux { #[cfg(not(test))] struct A { /** AtomicU8 */ b: HashMap<u8, Box<AtomicU64>> } }", "b"),
        ("#[derive(Debug)] pub struct A(Arc<AtomicU32>);", "A"),
        ("enum A { B, C { count: AtomicI64 } }", "A"),
        ("type A = Box<[AtomicU32]>;", "A"),
        ("fn f() { static A: AtomicUsize = AtomicUsize::new(0); }", "A"),
        ("#[cfg(test)] mod tests { struct A { a: AtomicU8 } } struct B { b: AtomicU8 }", "b"),
    ] {
        let missing = format!("low/part.rs::{name} is in no table of memory orderings");
        assert_eq!(atomics_with("low/part.rs", text, ""), [missing], "{text}");
        let row = format!("| `low/part.rs::{name}` | `relaxed` |");
        assert_eq!(atomics_with("low/part.rs", text, &row), [""; 0], "{text}");
    }
    let two = "struct A { a: AtomicU8 } struct B { b: AtomicU8 }";
    assert_eq!(atomics_with("low.rs", two, "| `low.rs::a`, `::b` | hints |"), [""; 0]);
}

#[test]
fn a_row_without_an_atomic_is_found() {
    let gone = "low.rs::a is in a table, but not in src";
    for text in [
        "struct A { a: u8 }",
        "fn f(a: &AtomicU8) { let a: AtomicU8 = AtomicU8::new(0); A { a: AtomicU8::new(0) }; }",
        "use crate::sync::AtomicU8; static B: B = B { a: AtomicU8::new(0) };",
        "#[cfg(all(test, drawloom_loom))] mod loom_tests { struct A { a: AtomicU8 } }",
        "#[test] fn f() { static a: AtomicU8 = AtomicU8::new(0); }",
    ] {
        let problems = atomics_with("low.rs", text, "| `low.rs::a` |");
        assert!(problems.contains(&gone.to_owned()), "{text}\n{problems:?}");
    }
    for path in ["low/tests.rs", "low/shuttle_tests.rs", "task/sleep/models.rs"] {
        assert_eq!(atomics_with(path, "struct A { a: AtomicU8 }", ""), [""; 0], "{path}");
    }
}

/// What is wrong with a crate of one file, and these rows in the section of memory orderings.
fn atomics_with(path: &str, text: &str, rows: &str) -> Vec<String> {
    let architecture = format!("# A\n\n## Memory orderings\n\n{rows}\n\n## B\n\n| `low.rs::other` |\n");
    wrong_atomics(&architecture, &[Source { path: Path::new("src").join(path), text: text.to_owned() }])
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

/// The atomics that are only in the sources, or only in the tables of memory orderings.
fn wrong_atomics(architecture: &str, sources: &[Source]) -> Vec<String> {
    let (listed, mut declared) = (listed_atomics(architecture), BTreeSet::new());
    for Source { path, text } in sources.iter().filter(|source| !is_of_tests(&source.path)) {
        // What does not parse is no Rust, which is a broken rule of its own.
        if let (true, Ok(stream)) = (path.extension().is_some_and(|extension| extension == "rs"), text.parse()) {
            let file: Vec<_> = path.iter().skip(1).filter_map(|part| part.to_str()).collect();
            let names = declared_atomics(&trees_of(stream)).into_iter();
            declared.extend(names.map(|name| format!("{}::{name}", file.join("/"))));
        }
    }
    let missing = declared.difference(&listed).map(|name| format!("{name} is in no table of memory orderings"));
    let gone = listed.difference(&declared).map(|name| format!("{name} is in a table, but not in src"));
    missing.chain(gone).collect()
}

/// The names `file::field` in the first columns of the section. `::field` is in the file that was named last.
fn listed_atomics(architecture: &str) -> BTreeSet<String> {
    let mut sections = architecture.split("\n## ");
    let section = sections.find(|section| section.starts_with("Memory orderings\n")).unwrap_or_default();
    let cells = section.lines().filter_map(|line| line.strip_prefix('|')?.split('|').next());
    // Code stands between every other pair of backticks.
    let names = cells.flat_map(|cell| cell.split('`').skip(1).step_by(2)).filter_map(|name| name.split_once("::"));
    let mut file = "";
    let whole = names.map(|(in_file, field)| {
        file = if in_file.is_empty() { file } else { in_file };
        format!("{file}::{field}")
    });
    whole.collect()
}

/// Whether only tests are built with the file.
fn is_of_tests(path: &Path) -> bool {
    path == Path::new("src/task/sleep/models.rs") || path.ends_with("tests.rs") || path.ends_with("shuttle_tests.rs")
}

/// The names of fields and statics whose type mentions an atomic, and of tuple structs, enums and type aliases that do. Locals
/// and parameters are not among them, nor is anything that only tests are built with.
fn declared_atomics(trees: &[TokenTree]) -> Vec<String> {
    let (mut names, mut at) = (Vec::new(), 0);
    while let Some(tree) = trees.get(at) {
        at += 1;
        let rest = &trees[at..];
        match tree {
            TokenTree::Group(group) => names.extend(declared_atomics(&trees_of(group.stream()))),
            // A lifetime is a quotation mark and a word, which may be `static`.
            TokenTree::Punct(mark) if mark.as_char() == '\'' => at += 1,
            TokenTree::Punct(mark) if mark.as_char() == '#' && rest.first().is_some_and(is_for_tests) => {
                at += item(rest).len();
            }
            TokenTree::Ident(word) if ["struct", "enum", "type", "static"].iter().any(|kind| word == kind) => {
                match item(rest) {
                    [.., TokenTree::Group(fields)] if word == "struct" => {
                        names.extend(atomic_fields(&trees_of(fields.stream())));
                    }
                    whole => {
                        // A static's value may name types that the static itself does not have.
                        let mut parts = whole.split(|tree| word == "static" && is(Some(tree), "="));
                        let is_atomic = parts.next().is_some_and(|part| part.iter().any(mentions_atomic));
                        names.extend(whole.first().filter(|_| is_atomic).map(TokenTree::to_string));
                    }
                }
                at += item(rest).len();
            }
            _ => {}
        }
    }
    names
}

/// What is left of an item, which ends with a semicolon or with a group in braces.
fn item(trees: &[TokenTree]) -> &[TokenTree] {
    let is_end = |tree: &TokenTree| match tree {
        TokenTree::Group(group) => group.delimiter() == Delimiter::Brace,
        tree => is(Some(tree), ";"),
    };
    &trees[..trees.iter().position(is_end).map_or(trees.len(), |end| end + 1)]
}

/// Whether this is the attribute of a test, or of what only tests are built with.
fn is_for_tests(attribute: &TokenTree) -> bool {
    let TokenTree::Group(group) = attribute else { return is(Some(attribute), "test") };
    let trees = trees_of(group.stream());
    // Behind `not` and `any` the word says something else.
    let counts = |at: usize| match trees[at] {
        TokenTree::Group(_) => at > 0 && ["cfg", "all"].iter().any(|word| is(trees.get(at - 1), word)),
        _ => true,
    };
    (0..trees.len()).any(|at| counts(at) && is_for_tests(&trees[at]))
}

/// The fields of a struct whose type mentions an atomic.
fn atomic_fields(trees: &[TokenTree]) -> Vec<String> {
    let (mut names, mut field) = (Vec::new(), None);
    for (at, tree) in trees.iter().enumerate() {
        // Two colons are part of a path.
        let is_field = is(trees.get(at + 1), ":") && !is(trees.get(at + 2), ":");
        if let (true, TokenTree::Ident(name)) = (is_field, tree) {
            field = Some(name);
        }
        if mentions_atomic(tree) {
            names.extend(field.map(ToString::to_string));
        }
    }
    names
}

fn mentions_atomic(tree: &TokenTree) -> bool {
    match tree {
        TokenTree::Group(group) => trees_of(group.stream()).iter().any(mentions_atomic),
        tree => tree.to_string().starts_with("Atomic"),
    }
}

/// Whether this is that word or punctuation mark.
fn is(tree: Option<&TokenTree>, text: &str) -> bool {
    tree.is_some_and(|tree| !matches!(tree, TokenTree::Group(_)) && tree.to_string() == text)
}

fn trees_of(stream: TokenStream) -> Vec<TokenTree> {
    stream.into_iter().collect()
}
