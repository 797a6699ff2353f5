//! The file `ORDERINGS.md` in the source folder of a crate lists every atomic of the crate, and names tests that exist.
//! A crate without atomics needs no such file.

use std::collections::BTreeSet;
use std::fs;
use std::io::ErrorKind;
use std::path::Path;

use proc_macro2::TokenTree;

use crate::sources::{CRATES, Module, Source, modules_without_tests, read_all};
use crate::tokens::{is, is_for_tests, item, trees_of};

#[test]
fn the_tables_of_memory_orderings_list_every_atomic() {
    let problems = CRATES.map(|folder| wrong_atomics(&memory_orderings(folder), &read_all(&[folder])));
    let (problems, crates) = (problems.concat(), CRATES.join(", "));
    assert!(problems.is_empty(), "{} atomics of {crates}:\n{}", problems.len(), problems.join("\n"));
}

#[test]
fn the_tables_of_memory_orderings_name_tests_that_exist() {
    let sources = read_all(&["jobs", "src", "tests"]);
    let unknown = CRATES.map(|folder| unknown_tests(&memory_orderings(folder), &sources)).concat();
    assert!(unknown.is_empty(), "no source has these functions: {unknown:?}");
}

/// The tables of the crate with this source folder; empty if the crate has none.
fn memory_orderings(folder: &str) -> String {
    match fs::read_to_string(Path::new(folder).join("ORDERINGS.md")) {
        Err(error) if error.kind() == ErrorKind::NotFound => String::new(),
        text => text.expect("ORDERINGS.md can be read"),
    }
}

/// The tests in the tables of memory orderings that are no function of the sources.
fn unknown_tests(orderings: &str, sources: &[Source]) -> Vec<String> {
    let mut functions = BTreeSet::new();
    for trees in sources.iter().filter(|source| source.is_rust()).filter_map(|source| source.parse().ok()) {
        add_functions(&trees, &mut functions);
    }
    let listed = covering_tests(orderings);
    listed.into_iter().filter(|test| !functions.contains(test)).collect()
}

/// The backticked names in the columns "covered by", which are the last. A cell like "as `field`" refers to another
/// row, and a name with a slash is a file.
fn covering_tests(orderings: &str) -> Vec<String> {
    let cells = orderings.lines().filter_map(|line| line.strip_suffix('|')?.rsplit('|').next());
    let cells = cells.map(str::trim).filter(|cell| !cell.starts_with("as "));
    let names = cells.flat_map(|cell| cell.split('`').skip(1).step_by(2));
    names.filter(|name| !name.contains('/')).map(str::to_owned).collect()
}

fn add_functions(trees: &[TokenTree], functions: &mut BTreeSet<String>) {
    for (at, tree) in trees.iter().enumerate() {
        match (tree, trees.get(at + 1)) {
            (TokenTree::Group(group), _) => add_functions(&trees_of(group.stream()), functions),
            (TokenTree::Ident(word), Some(TokenTree::Ident(name))) if word == "fn" => {
                functions.insert(name.to_string());
            }
            _ => {}
        }
    }
}

/// The atomics that are only in the sources, or only in the tables of memory orderings.
fn wrong_atomics(orderings: &str, sources: &[Source]) -> Vec<String> {
    let (listed, mut declared) = (listed_atomics(orderings), BTreeSet::new());
    for Module { source, trees, .. } in modules_without_tests(sources) {
        let file = source.path.iter().skip_while(|part| *part != "src").skip(1);
        let file: Vec<_> = file.filter_map(|part| part.to_str()).collect();
        let names = declared_atomics(&trees).into_iter();
        declared.extend(names.map(|name| format!("{}::{name}", file.join("/"))));
    }
    let missing = declared.difference(&listed).map(|name| format!("{name} is in no table of memory orderings"));
    let removed = listed.difference(&declared).map(|name| format!("{name} is in a table, but not in src"));
    missing.chain(removed).collect()
}

/// The names `file::field` in the first columns. `::field` is in the file named before it.
fn listed_atomics(orderings: &str) -> BTreeSet<String> {
    let cells = orderings.lines().filter_map(|line| line.strip_prefix('|')?.split('|').next());
    // Code is between every other pair of backticks.
    let names = cells.flat_map(|cell| cell.split('`').skip(1).step_by(2)).filter_map(|name| name.split_once("::"));
    let mut file = "";
    let whole = names.map(|(in_file, field)| {
        file = if in_file.is_empty() { file } else { in_file };
        format!("{file}::{field}")
    });
    whole.collect()
}

/// The names of fields and statics with types that mention an atomic, and of tuple structs, enums and type aliases that
/// mention one. Locals and parameters do not count, nor do items that only tests are built with.
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

/// The fields of a struct with types that mention an atomic.
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

/// The problems of a crate of one file, with these rows in its table.
fn atomics_with(path: &str, text: &str, rows: &str) -> Vec<String> {
    let orderings = format!("# A\n\n`low.rs::prose`\n\n| atomic | what it is |\n| --- | --- |\n{rows}\n");
    wrong_atomics(&orderings, &[Source::new(path, text)])
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
    let removed = "low.rs::a is in a table, but not in src";
    for text in [
        "struct A { a: u8 }",
        "fn f(a: &AtomicU8) { let a: AtomicU8 = AtomicU8::new(0); A { a: AtomicU8::new(0) }; }",
        "use crate::sync::AtomicU8; static B: B = B { a: AtomicU8::new(0) };",
        "#[cfg(all(test, drawloom_loom))] mod loom_tests { struct A { a: AtomicU8 } }",
        "#[test] fn f() { static a: AtomicU8 = AtomicU8::new(0); }",
    ] {
        let problems = atomics_with("low.rs", text, "| `low.rs::a` |");
        assert!(problems.contains(&removed.to_owned()), "{text}\n{problems:?}");
    }
}

#[test]
fn a_row_whose_test_does_not_exist_is_found() {
    let row = "| `low.rs::a` | loom: `a_test`; shuttle: `another` |\n| `low.rs::b` | as `a` |\n| `low.rs::d` | all of `low/models.rs` |\n| `low.rs::c` | — |";
    let orderings = format!("# A\n\n`prose`\n\n{row}\n");
    let source = Source::new("low.rs", "mod tests { proptest! { #[test] fn a_test() {} } }");
    assert_eq!(unknown_tests(&orderings, &[source]), ["another"]);
}
