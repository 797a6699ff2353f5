//! Token trees of Rust source.

use proc_macro2::{Delimiter, TokenStream, TokenTree};

/// Whether the token is this word or punctuation mark.
pub fn is(tree: Option<&TokenTree>, text: &str) -> bool {
    tree.is_some_and(|tree| !matches!(tree, TokenTree::Group(_)) && tree.to_string() == text)
}

pub fn trees_of(stream: TokenStream) -> Vec<TokenTree> {
    stream.into_iter().collect()
}

/// The rest of an item, up to and including a semicolon or a group in braces.
pub fn item(trees: &[TokenTree]) -> &[TokenTree] {
    let is_end = |tree: &TokenTree| match tree {
        TokenTree::Group(group) => group.delimiter() == Delimiter::Brace,
        tree => is(Some(tree), ";"),
    };
    &trees[..trees.iter().position(is_end).map_or(trees.len(), |end| end + 1)]
}

/// Whether this is the attribute of a test, or of something that only tests are built with.
pub fn is_for_tests(attribute: &TokenTree) -> bool {
    let TokenTree::Group(group) = attribute else { return is(Some(attribute), "test") };
    let trees = trees_of(group.stream());
    // `not(test)` and `any(test, ...)` do not limit an item to tests.
    let counts = |at: usize| match trees[at] {
        TokenTree::Group(_) => at > 0 && ["cfg", "all"].iter().any(|word| is(trees.get(at - 1), word)),
        _ => true,
    };
    (0..trees.len()).any(|at| counts(at) && is_for_tests(&trees[at]))
}
