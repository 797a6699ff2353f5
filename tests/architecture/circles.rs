//! No circle of imports between the files of one module leaves a folder, so that a folder can be understood with only
//! what it imports. Files of one folder may import each other in circles: they are read together.
//!
//! A file imports the files that define the items it names: in `use` declarations, and in paths that start with
//! `crate`, `super`, `self` or a module that the file declares. Code for tests does not count, and neither does a
//! re-export of an item that the file does not use itself. So a `mod.rs` that only declares modules and re-exports
//! their items is not part of a circle.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

use proc_macro2::TokenTree;

use crate::paths::{Leaf, expand, from_root};
use crate::sources::{CRATES, Module, Source, modules_without_tests, read_all};
use crate::tokens::{is, is_for_tests, item, trees_of};

/// The maximum number of re-exports that are followed to the definition of one item.
const MAX_REEXPORTS: usize = 8;

#[test]
fn no_circle_of_imports_leaves_a_folder() {
    let problems = CRATES.map(|folder| circles(&read_all(&[folder]))).concat();
    assert!(problems.is_empty(), "{}", problems.join("\n"));
}

/// The circles of all modules that leave a folder, in words. Where circles share files, only a shortest one is
/// described.
fn circles(sources: &[Source]) -> Vec<String> {
    let imports = Imports::new(modules_without_tests(sources));
    let mut circles = Vec::new();
    let mut described = BTreeSet::new();
    let mut shortest: Vec<_> = (0..imports.modules.len()).filter_map(|file| imports.circle_through(file)).collect();
    // Of those that share files, one that leaves a folder is described.
    shortest.sort_by_key(|circle| (!imports.leaves_folder(circle.iter()), circle.len()));
    for circle in shortest {
        let connected = imports.mutual(circle[0]);
        if imports.leaves_folder(connected.iter()) && described.insert(connected.clone()) {
            circles.push(imports.describe(&circle, connected.len()));
        }
    }
    circles
}

struct Imports<'a> {
    modules: Vec<Module<'a>>,
    /// For each file the files of its top-level module that it imports, each with the line of the first import.
    of_file: Vec<BTreeMap<usize, usize>>,
}

impl<'a> Imports<'a> {
    fn new(modules: Vec<Module<'a>>) -> Self {
        let found: Vec<_> = modules.iter().map(|module| paths_in(&module.trees, &module.path)).collect();
        let resolver = Resolver::new(&modules, &found);
        let mut of_file = Vec::new();
        for (user, paths) in found.iter().enumerate() {
            let (mut imported, mut words) = (BTreeMap::new(), BTreeSet::new());
            words_outside_imports(&modules[user].trees, &mut words);
            let is_import = |found: &&FoundPath| match &found.name {
                Some(name) => !found.is_reexport || words.contains(name),
                None => true,
            };
            for found in paths.iter().filter(is_import) {
                let file = resolver.file_of(&found.path, MAX_REEXPORTS);
                let in_module = |file: &usize| modules[*file].path.first() == modules[user].path.first();
                if let Some(file) = file.filter(in_module).filter(|&file| file != user) {
                    imported.entry(file).or_insert(found.line);
                }
            }
            of_file.push(imported);
        }
        Self { modules, of_file }
    }

    /// A shortest path through imports from the file back to itself.
    fn circle_through(&self, file: usize) -> Option<Vec<usize>> {
        let mut importer = BTreeMap::new();
        let mut queue = VecDeque::from([file]);
        while let Some(user) = queue.pop_front() {
            for &used in self.of_file[user].keys() {
                if used == file {
                    let back = std::iter::successors(Some(user), |at| importer.get(at).copied());
                    let mut circle: Vec<_> = back.collect();
                    circle.reverse();
                    return Some(circle);
                }
                if let Entry::Vacant(entry) = importer.entry(used) {
                    entry.insert(user);
                    queue.push_back(used);
                }
            }
        }
        None
    }

    /// Whether files are in several folders.
    fn leaves_folder<'b>(&self, files: impl Iterator<Item = &'b usize>) -> bool {
        files.map(|file| self.modules[*file].source.path.parent()).collect::<BTreeSet<_>>().len() > 1
    }

    /// The files that the file leads to through imports, and that lead back to it.
    fn mutual(&self, file: usize) -> BTreeSet<usize> {
        let reached = |start: usize| {
            let (mut reached, mut stack) = (BTreeSet::new(), vec![start]);
            while let Some(user) = stack.pop() {
                stack.extend(self.of_file[user].keys().filter(|used| reached.insert(**used)));
            }
            reached
        };
        reached(file).into_iter().filter(|&other| reached(other).contains(&file)).collect()
    }

    fn describe(&self, circle: &[usize], connected: usize) -> String {
        let shown = |file: usize| self.modules[file].source.path.display();
        let next = circle.iter().skip(1).chain(circle.first());
        let steps = circle
            .iter()
            .zip(next)
            .map(|(user, used)| format!("{}:{} imports {}", shown(*user), self.of_file[*user][used], shown(*used)));
        let steps = steps.collect::<Vec<_>>().join(", ");
        match connected - circle.len() {
            0 => format!("circle: {steps}"),
            more => format!("circle: {steps} (and {more} more files import each other in circles with these)"),
        }
    }
}

/// Finds the file that defines an item.
struct Resolver {
    files: BTreeMap<Vec<String>, usize>,
    /// For each file the names that it imports, with their paths.
    names: Vec<BTreeMap<String, Vec<String>>>,
}

impl Resolver {
    fn new(modules: &[Module], found: &[Vec<FoundPath>]) -> Self {
        let files = modules.iter().enumerate().map(|(index, module)| (module.path.clone(), index)).collect();
        let named = |paths: &Vec<FoundPath>| {
            paths.iter().filter_map(|found| Some((found.name.clone()?, found.path.clone()))).collect()
        };
        Self { files, names: found.iter().map(named).collect() }
    }

    /// The file that defines the item at this path from the root; `None` if it is not the crate's.
    fn file_of(&self, path: &[String], reexports: usize) -> Option<usize> {
        let length = (0..=path.len()).rev().find(|&length| self.files.contains_key(&path[..length]))?;
        let file = self.files[&path[..length]];
        let rest = &path[length..];
        let reexported = rest.first().and_then(|name| self.names[file].get(name)).filter(|_| reexports > 0);
        let Some(target) = reexported else { return Some(file) };
        self.file_of(&[target, &rest[1..]].concat(), reexports - 1)
    }
}

/// A path in a file that leads into the crate.
struct FoundPath {
    /// From the crate's root.
    path: Vec<String>,
    line: usize,
    /// The name that a `use` declaration of the file itself gives to the item, or one of a module in it from which the
    /// file imports all.
    name: Option<String>,
    is_reexport: bool,
}

fn paths_in(trees: &[TokenTree], module: &[String]) -> Vec<FoundPath> {
    let mut found = Vec::new();
    find_paths(trees, module, &declared_modules(trees), true, &mut found);
    found
}

/// Adds the paths that start with `crate`, `super`, `self` or one of `children`.
fn find_paths(
    trees: &[TokenTree],
    module: &[String],
    children: &BTreeSet<String>,
    is_file: bool,
    found: &mut Vec<FoundPath>,
) {
    let mut at = 0;
    while let Some(tree) = trees.get(at) {
        let rest = &trees[at + 1..];
        match tree {
            TokenTree::Punct(mark) if mark.as_char() == '#' && rest.first().is_some_and(is_for_tests) => {
                at += item(rest).len();
            }
            TokenTree::Group(group) => {
                let inner = trees_of(group.stream());
                let is_visibility = at > 0 && is(trees.get(at - 1), "pub") && is(inner.first(), "in");
                if at > 1 && is(trees.get(at - 2), "mod") {
                    let name = trees[at - 1].to_string();
                    let is_of_file = is_file && imports_all_of(trees, &name);
                    let module = [module, &[name]].concat();
                    find_paths(&inner, &module, &declared_modules(&inner), is_of_file, found);
                } else if !is_visibility {
                    find_paths(&inner, module, children, false, found);
                }
            }
            TokenTree::Ident(start) => {
                let word = start.to_string();
                let is_use = at > 0 && is(trees.get(at - 1), "use");
                let before_use = trees[..at.saturating_sub(1)].iter().rev();
                let mut before_use = before_use.skip_while(|tree| matches!(tree, TokenTree::Group(_)));
                let is_reexport = is_use && is(before_use.next(), "pub");
                let starts = ["crate", "super", "self"].contains(&word.as_str()) || children.contains(&word);
                // Behind two colons the word goes on with a path.
                if starts && !(at > 0 && is(trees.get(at - 1), ":") && at > 1 && is(trees.get(at - 2), ":")) {
                    let mut leaves = Vec::new();
                    at = expand(trees, at, Vec::new(), &mut leaves);
                    // A word alone is a visibility, a receiver, or a child's declaration.
                    for Leaf { path, name } in leaves.into_iter().filter(|leaf| leaf.path.len() > 1 || is_use) {
                        let path = from_root(&path, module);
                        let name = Some(name).filter(|_| is_use && is_file);
                        found.push(FoundPath { path, line: start.span().start().line, name, is_reexport });
                    }
                    continue;
                }
            }
            _ => {}
        }
        at += 1;
    }
}

/// The names of modules that are declared here, in files of their own or in place.
fn declared_modules(trees: &[TokenTree]) -> BTreeSet<String> {
    let names = trees.windows(2).filter(|pair| is(Some(&pair[0]), "mod"));
    names.map(|pair| pair[1].to_string()).collect()
}

/// Whether a `use` declaration imports all that the module `name` has.
fn imports_all_of(trees: &[TokenTree], name: &str) -> bool {
    let glob = ["use", name, ":", ":", "*"];
    trees.windows(glob.len()).any(|trees| trees.iter().zip(glob).all(|(tree, token)| is(Some(tree), token)))
}

/// Adds the words of the file's code, without `use` declarations and code for tests.
fn words_outside_imports(trees: &[TokenTree], words: &mut BTreeSet<String>) {
    let mut at = 0;
    while let Some(tree) = trees.get(at) {
        at += 1;
        let rest = &trees[at..];
        match tree {
            TokenTree::Punct(mark) if mark.as_char() == '#' && rest.first().is_some_and(is_for_tests) => {
                at += item(rest).len();
            }
            TokenTree::Group(group) => words_outside_imports(&trees_of(group.stream()), words),
            TokenTree::Ident(word) if word == "use" => {
                at += rest.iter().position(|tree| is(Some(tree), ";")).unwrap_or(rest.len());
            }
            TokenTree::Ident(word) if word == "mod" => at += 1,
            TokenTree::Ident(word) => _ = words.insert(word.to_string()),
            _ => {}
        }
    }
}

/// The circles of a crate with these files.
fn circles_of(files: &[(&str, &str)]) -> Vec<String> {
    let sources: Vec<_> = files.iter().map(|(path, text)| Source::new(path, text)).collect();
    circles(&sources)
}

#[test]
fn a_circle_is_found() {
    let root = ("low/mod.rs", "//! Low.\nmod a;\npub(crate) mod b;\npub use a::A; pub(crate) use b::{B as Bee, g};");
    for (a, b) in [
        ("use super::b::B;", "use super::a::A;"),
        ("use super::Bee;", "use super::{A, g};"),
        ("use super::b;", "use crate::low::{a::A};"),
        ("fn f() { super::b::g() }", "fn g() { check!(crate::low::A::new()) }"),
        ("use crate::low::g as f;", "mod deep { use super::super::A; }"),
        ("use super::Bee; #[cfg(not(test))] fn f() {}", "fn f() { use super::a; }"),
    ] {
        let problems = circles_of(&[root, ("low/a.rs", a), ("low/b/mod.rs", b)]);
        let circle = "circle: src/low/a.rs:1 imports src/low/b/mod.rs, src/low/b/mod.rs:1 imports src/low/a.rs";
        assert_eq!(problems, [circle], "{a}\n{b}");
    }
}

#[test]
fn a_circle_through_a_file_with_children_is_found() {
    for (parent, child) in [
        ("low.rs", "mod part; use part::P; pub struct L;"),
        ("low/mod.rs", "pub mod part; pub struct L(part::P);"),
        ("low/mod.rs", "mod part;\n#[cfg(unix)]\nuse self::part::P;\nstruct L;"),
        ("low/mod.rs", "mod part; pub(crate) use part::P; struct L(P);"),
    ]
    .map(|parent| (parent, ("low/part/mod.rs", "use super::L;")))
    {
        let problems = circles_of(&[parent, child]);
        assert_eq!(problems.len(), 1, "{parent:?}\n{problems:?}");
    }
}

#[test]
fn connected_circles_are_described_by_the_shortest() {
    let problems = circles_of(&[
        ("low/mod.rs", "mod a; mod b; mod c; mod d;"),
        ("low/a.rs", "use super::b;"),
        ("low/b/mod.rs", "\nuse super::c;"),
        ("low/c/mod.rs", "\n\nuse super::{a, b};"),
        ("low/d.rs", "use super::a;"),
    ]);
    let circle = "circle: src/low/b/mod.rs:2 imports src/low/c/mod.rs, src/low/c/mod.rs:3 imports src/low/b/mod.rs";
    assert_eq!(problems, [format!("{circle} (and 1 more files import each other in circles with these)")]);
}

#[test]
fn a_circle_within_a_folder_is_allowed() {
    let root = ("low/mod.rs", "mod a; mod b; mod c;");
    let files = [root, ("low/a.rs", "use super::b;"), ("low/b.rs", "use super::a;")];
    assert_eq!(circles_of(&files), [""; 0]);
    // A third file in a folder of its own makes it one of folders.
    let problems = circles_of(&[root, ("low/a.rs", "use super::{b, c};"), files[2], ("low/c/mod.rs", "use super::b;")]);
    assert_eq!(problems.len(), 1, "{problems:?}");
    assert!(problems[0].contains("src/low/c/mod.rs"), "{problems:?}");
}

#[test]
fn imports_without_a_circle_are_allowed() {
    let root = ("low/mod.rs", "mod a; mod b; #[cfg(test)] mod tests; pub use a::A; pub(super) use b::B;");
    let hidden = "mod a; mod b; pub use internal::*; pub mod internal { pub use super::b::B; }";
    let problems = circles_of(&[("low/mod.rs", hidden), ("low/a.rs", ""), ("low/b/mod.rs", "use super::a;")]);
    assert_eq!(problems, [""; 0]);
    let problems =
        circles_of(&[("low/mod.rs", hidden), ("low/a.rs", "use super::B;"), ("low/b/mod.rs", "use super::a;")]);
    assert_eq!(problems.len(), 1, "{problems:?}");
    let items = ("low/mod.rs", "mod part; pub use part::{P as M, part}; #[cfg(test)] use part::Q; struct L;");
    assert_eq!(circles_of(&[items, ("low/part/mod.rs", "use super::L;")]), [""; 0]);
    for (a, b) in [
        ("use super::b::B;", "pub(in crate::low) struct B; fn f(self) {}"),
        ("use super::B;", "//! [`super::A`]\n/* super::A */ fn f() { g(\"super::A\") }"),
        ("use super::B;", "#[cfg(test)] use super::A; #[cfg(all(test, unix))] mod tests { use super::super::A; }"),
        ("use super::B;", "use std::a::A; fn f() { x.a::<A>(); b::a::A }"),
        ("use super::B;", "use crate::{low as other, high::a::A};"),
    ] {
        let tests = ("low/tests.rs", "use super::{a, b};");
        let problems = circles_of(&[root, ("low/a.rs", a), ("low/b/mod.rs", b), tests]);
        assert_eq!(problems, [""; 0], "{a}\n{b}");
    }
}
