//! Paths in Rust source: those of `use` declarations, and those that start with `crate`, `super` or `self`.

use proc_macro2::TokenTree;

use crate::tokens::{is, trees_of};

/// One path of a tree such as `a::{b, c as d}`, and the name it gets.
pub struct Leaf {
    pub path: Vec<String>,
    pub name: String,
}

/// Adds the paths of the tree that starts at `at`, each prefixed with `path`, and returns where the tree ends.
pub fn expand(trees: &[TokenTree], mut at: usize, mut path: Vec<String>, leaves: &mut Vec<Leaf>) -> usize {
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

/// The same path from the crate's root, for a path that starts with `crate`, `super` or `self` in that module.
pub fn from_root(path: &[String], module: &[String]) -> Vec<String> {
    let mut full = module.to_vec();
    for segment in path {
        match segment.as_str() {
            "crate" => full.clear(),
            "super" => _ = full.pop(),
            "self" => {}
            segment => full.push(segment.to_owned()),
        }
    }
    full
}
