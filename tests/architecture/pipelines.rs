//! `Deferred` is a pipeline as an engine's is: it uses public interfaces alone, and the frame does not know it.

use std::collections::BTreeSet;
use std::fs;

use proc_macro2::{Delimiter, TokenTree};

use crate::paths::{Leaf, expand, from_root};
use crate::sources::{Module, Source, modules_without_tests, read_all};
use crate::tokens::{is, is_for_tests, item, trees_of};

/// What CPU shaders use all the same. They are the reference of the tests: their WGSL once more, with WGSL's built-in
/// functions. A CPU shader of an engine's has functions of the engine's.
const EXCEPTIONS: [&str; 4] = ["process::cpu_shader::built_in", "rules", "is_bounded", "is_perspective"];

/// Functions of the standard library that have the names of others of the crate.
const STANDARD: [&str; 3] = ["clamp", "for_each", "min"];

/// Names at the root that are modules or crates of others.
const LAYERS: [&str; 6] = ["command", "process", "quality", "raster", "scene", "view"];

#[test]
fn the_deferred_pipeline_uses_public_interfaces_alone() {
    let sources = read_all(&["src"]);
    let modules = modules_without_tests(&sources);
    let public: BTreeSet<_> = LAYERS.iter().flat_map(|layer| public_names(&modules, layer)).collect();
    assert!(public.len() > 100, "{} public names found", public.len());
    let (restricted, open) = (names_of_functions(&modules, true), names_of_functions(&modules, false));
    let restricted: BTreeSet<_> = restricted.difference(&open).cloned().collect();
    assert!(restricted.len() > 100, "{} functions found", restricted.len());
    let own: Vec<_> = modules.iter().filter(|module| is_deferred(module)).collect();
    assert!(own.len() > 10, "{} files found", own.len());
    let mut wrong = Vec::new();
    for module in own {
        let shown = module.source.path.display();
        let is_exception = |name: &str| module.path.iter().any(|part| part == "cpu_shader") && is_exception(name);
        for used in uses(&module.trees, &module.path) {
            let is_allowed = is_allowed(&used, &public) || is_exception(&used);
            wrong.extend((!is_allowed).then(|| format!("{shown} uses {used}")));
        }
        let is_wrong =
            |call: &String| restricted.contains(call) && !is_exception(call) && !STANDARD.contains(&call.as_str());
        let calls = calls(&module.trees).into_iter().filter(is_wrong);
        wrong.extend(calls.map(|call| format!("{shown} calls {call}")));
    }
    assert!(wrong.is_empty(), "{} uses of what is not public:\n{}", wrong.len(), wrong.join("\n"));
}

fn is_deferred(module: &Module<'_>) -> bool {
    module.path.starts_with(&["process".to_owned(), "deferred".to_owned()])
}

fn is_exception(name: &str) -> bool {
    EXCEPTIONS.iter().any(|allowed| name == *allowed || name.starts_with(&format!("{allowed}::")))
}

/// Whether a path from the crate's root, with `::`, is public, or in the folder itself.
fn is_allowed(used: &str, public: &BTreeSet<String>) -> bool {
    let own = ["process::deferred", "glam", "bytemuck"];
    let is_own = own.iter().any(|own| used == *own || used.starts_with(&format!("{own}::")));
    is_own || public.contains(used)
}

/// The names that a module of the crate's root exports, without those of its hidden module.
fn public_names(modules: &[Module<'_>], layer: &str) -> Vec<String> {
    let root = modules.iter().find(|module| module.path == [layer]).expect("the module has a file");
    let trees = without_tests(&root.trees);
    let mut leaves = Vec::new();
    for at in 1..trees.len() {
        if !is(Some(&trees[at - 1]), "pub") {
            continue;
        }
        match &trees[at] {
            TokenTree::Ident(word) if word == "use" => _ = expand(&trees, at + 1, Vec::new(), &mut leaves),
            TokenTree::Ident(word)
                if ["struct", "enum", "trait", "fn", "const", "mod"].iter().any(|kind| word == kind) =>
            {
                leaves.push(Leaf { path: Vec::new(), name: trees[at + 1].to_string() });
            }
            _ => {}
        }
    }
    let names = leaves.into_iter().map(|leaf| leaf.name).filter(|name| name != "internal");
    names.map(|name| format!("{layer}::{name}")).collect()
}

/// The paths that start with `crate` or `super` and lead out of a module, from the crate's root.
fn uses(trees: &[TokenTree], module: &[String]) -> Vec<String> {
    let (trees, mut found, mut at) = (without_tests(trees), Vec::new(), 0);
    while let Some(tree) = trees.get(at) {
        match tree {
            TokenTree::Group(group) => found.extend(uses(&trees_of(group.stream()), module)),
            TokenTree::Ident(start) if start == "crate" || start == "super" => {
                let mut leaves = Vec::new();
                at = expand(&trees, at, Vec::new(), &mut leaves);
                let paths = leaves.into_iter().filter(|leaf| leaf.path.len() > 1);
                // What follows a type is its own: `crate::process::CpuShader::objects`.
                let used = paths.map(|leaf| from_root(&leaf.path, module)).map(|path| up_to_item(&path));
                found.extend(used);
                continue;
            }
            _ => {}
        }
        at += 1;
    }
    found
}

/// A path up to the first name that is not a module.
fn up_to_item(path: &[String]) -> String {
    let is_item = |name: &String| name.starts_with(char::is_uppercase);
    let end = path.iter().position(is_item).map_or(path.len(), |item| item + 1);
    path[..end].join("::")
}

/// The functions that are called by `.name(` or `::name(`.
fn calls(trees: &[TokenTree]) -> BTreeSet<String> {
    let trees = without_tests(trees);
    let mut found = BTreeSet::new();
    for (at, tree) in trees.iter().enumerate() {
        match tree {
            TokenTree::Group(group) => found.extend(calls(&trees_of(group.stream()))),
            TokenTree::Ident(name) if at > 0 && (is(trees.get(at - 1), ".") || is(trees.get(at - 1), ":")) => {
                let is_call = matches!(trees.get(at + 1), Some(TokenTree::Group(arguments))
                    if arguments.delimiter() == Delimiter::Parenthesis);
                found.extend(is_call.then(|| name.to_string()));
            }
            _ => {}
        }
    }
    found
}

/// The functions outside of the folder that are declared with a restricted visibility; or else all others, and those of
/// the folder.
fn names_of_functions(modules: &[Module<'_>], restricted: bool) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    modules.iter().for_each(|module| add_functions(&module.trees, is_deferred(module), restricted, &mut found));
    found
}

fn add_functions(trees: &[TokenTree], is_own: bool, restricted: bool, found: &mut BTreeSet<String>) {
    let trees = without_tests(trees);
    for (at, tree) in trees.iter().enumerate() {
        if let TokenTree::Group(group) = tree {
            add_functions(&trees_of(group.stream()), is_own, restricted, found);
        }
        let (true, Some(name)) = (is(Some(tree), "fn"), trees.get(at + 1)) else { continue };
        let is_word = |tree: &&TokenTree| ["const", "unsafe", "async"].iter().any(|word| is(Some(tree), word));
        let before = trees[..at].iter().rev().skip_while(is_word).take(2).collect::<Vec<_>>();
        let is_restricted = matches!(before[..], [TokenTree::Group(_), word] if is(Some(word), "pub"));
        if (is_restricted && !is_own) == restricted {
            found.insert(name.to_string());
        }
    }
}

/// The tokens without items that only tests are built with.
fn without_tests(trees: &[TokenTree]) -> Vec<TokenTree> {
    let (mut kept, mut at) = (Vec::new(), 0);
    while at < trees.len() {
        if is(trees.get(at), "#") && trees.get(at + 1).is_some_and(is_for_tests) {
            at += 2 + item(&trees[at + 2..]).len();
        } else {
            kept.push(trees[at].clone());
            at += 1;
        }
    }
    kept
}

#[test]
fn the_frame_does_not_know_the_deferred_pipeline() {
    let all = read_all(&["src"]);
    let lib = fs::read_to_string("src/process/deferred/mod.rs").expect("the pipeline has a file");
    let trees = trees_of(lib.parse().expect("it is Rust"));
    let mut leaves = Vec::new();
    for at in 1..trees.len() {
        if is(Some(&trees[at - 1]), "use") {
            expand(&trees, at, Vec::new(), &mut leaves);
        }
    }
    let names: BTreeSet<_> = leaves.into_iter().map(|leaf| leaf.name).collect();
    assert!(names.contains("Deferred") && names.contains("ShadowCasters"), "{names:?}");
    let plan = |source: &Source| source.module().starts_with(&["process".to_owned(), "plan".to_owned()]);
    let frame = |source: &Source| source.module().first().is_some_and(|layer| layer == "frame") || plan(source);
    let (mut wrong, mut checked) = (Vec::new(), 0);
    for module in modules_without_tests(&all).iter().filter(|module| frame(module.source)) {
        checked += 1;
        let named = words(&module.trees);
        let shown = module.source.path.display();
        wrong.extend(named.intersection(&names).map(|name| format!("{shown} names {name}")));
    }
    assert!(checked > 20, "{checked} files found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The words outside of comments and tests.
fn words(trees: &[TokenTree]) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for tree in without_tests(trees) {
        match tree {
            TokenTree::Group(group) => found.extend(words(&trees_of(group.stream()))),
            TokenTree::Ident(word) => _ = found.insert(word.to_string()),
            _ => {}
        }
    }
    found
}

#[test]
fn a_use_of_what_is_not_public_is_found() {
    let parse = |text: &str| trees_of(text.parse().expect("it is Rust"));
    let module = ["process", "deferred", "pipeline"].map(str::to_owned);
    let text = "use crate::unwind::Contained; use super::Light; fn f(x: X) { super::super::plan::of(); x.hidden(1); }
        #[cfg(test)] mod tests { use crate::frame::X; }";
    let public = BTreeSet::from(["process::Format".to_owned()]);
    let uses = uses(&parse(text), &module);
    assert_eq!(uses, ["unwind::Contained", "process::deferred::Light", "process::plan::of"]);
    assert_eq!(uses.iter().filter(|used| !is_allowed(used, &public)).count(), 2);
    assert!(is_allowed("process::Format", &public));
    assert!(calls(&parse(text)).contains("hidden"));
    let mut found = BTreeSet::new();
    add_functions(
        &parse("impl X { pub(crate) const fn hidden() {} pub fn open() {} fn own() {} }"),
        false,
        true,
        &mut found,
    );
    assert_eq!(found, BTreeSet::from(["hidden".to_owned()]));
}
