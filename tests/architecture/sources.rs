//! The source files of crates and their tests.

use std::path::{Path, PathBuf};
use std::{fs, io};

use proc_macro2::{LexError, TokenTree};

use crate::tokens::{is, is_for_tests, trees_of};

pub struct Source {
    pub path: PathBuf,
    pub text: String,
}

impl Source {
    /// A made-up file, at `path` below `src`.
    pub fn new(path: &str, text: &str) -> Self {
        Self { path: Path::new("src").join(path), text: text.to_owned() }
    }

    pub fn is_rust(&self) -> bool {
        self.path.extension().is_some_and(|extension| extension == "rs")
    }

    pub fn parse(&self) -> Result<Vec<TokenTree>, LexError> {
        self.text.parse().map(trees_of)
    }

    /// `src/view/frustum.rs` is `["view", "frustum"]`; `src/view/mod.rs` is `["view"]`; `src/lib.rs` is the root.
    pub fn module(&self) -> Vec<String> {
        let parts = self.path.with_extension("");
        let parts = parts.iter().skip_while(|part| *part != "src").skip(1).filter_map(|part| part.to_str());
        parts.filter(|part| !["mod", "lib"].contains(part)).map(str::to_owned).collect()
    }
}

/// The folders of the crates that engines build.
pub const CRATES: [&str; 5] = ["async-post/src", "gltf/src", "jobs/src", "obj/src", "src"];

/// The files of these folders.
pub fn read_all(folders: &[&str]) -> Vec<Source> {
    let mut sources = Vec::new();
    for folder in folders {
        read_folder(Path::new(folder), &mut sources).expect("the folder can be read");
    }
    sources.sort_by(|one, other| one.path.cmp(&other.path));
    sources
}

fn read_folder(folder: &Path, sources: &mut Vec<Source>) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            read_folder(&path, sources)?;
        } else {
            let text = String::from_utf8_lossy(&fs::read(&path)?).into_owned();
            sources.push(Source { path, text });
        }
    }
    Ok(())
}

/// A Rust file that is built without tests too.
pub struct Module<'a> {
    pub source: &'a Source,
    pub path: Vec<String>,
    pub trees: Vec<TokenTree>,
}

/// The Rust files, without those that only tests are built with. A file that does not parse is left out; `files`
/// reports it.
pub fn modules_without_tests(sources: &[Source]) -> Vec<Module<'_>> {
    let rust = sources.iter().filter(|source| source.is_rust());
    let parsed = rust.filter_map(|source| {
        let trees = source.parse().ok()?;
        Some(Module { source, path: source.module(), trees })
    });
    let mut modules: Vec<_> = parsed.collect();
    let of_tests: Vec<_> = modules.iter().flat_map(test_modules).collect();
    modules.retain(|module| !of_tests.iter().any(|tests| module.path.starts_with(tests)));
    modules
}

/// The paths of modules that the file declares for tests only.
fn test_modules(module: &Module) -> Vec<Vec<String>> {
    let (trees, mut found) = (&module.trees, Vec::new());
    for at in 0..trees.len() {
        if !(is(trees.get(at), "#") && trees.get(at + 1).is_some_and(is_for_tests)) {
            continue;
        }
        if let (true, Some(name)) = (is(trees.get(at + 2), "mod"), trees.get(at + 3)) {
            found.push([&module.path[..], &[name.to_string()]].concat());
        }
    }
    found
}

#[test]
fn files_that_only_tests_are_built_with_are_left_out() {
    let sources = [
        Source::new("low/mod.rs", "#[cfg(all(test, not(a)))] mod samples; #[cfg(not(test))] mod part;"),
        Source::new("low/part.rs", ""),
        Source::new("low/samples.rs", ""),
        Source::new("low/samples/deep.rs", ""),
    ];
    let names: Vec<_> = modules_without_tests(&sources).iter().map(|module| module.path.join("::")).collect();
    assert_eq!(names, ["low", "low::part"]);
}
