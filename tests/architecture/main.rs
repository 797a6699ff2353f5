//! The crate's structure, checked on its source:
//!
//! - `layers`: the modules that `src/lib.rs` lists are layers, and each uses only those above it.
//! - `circles`: the files of one module do not import each other in circles.
//! - `files`: files are short, and their names say what is inside.
//! - `outputs`: examples and benchmarks write files and print lines through `drawloom-output`.
//! - `subscribers`: the library calls subscribers of `tracing` where their panics are caught.
//! - `unsafe_code`: unsafe code is in modules that Miri and the thread sanitizer run.
//! - `atomics`: the tables of memory orderings in `ARCHITECTURE.md` list every atomic of `src`.

mod atomics;
mod circles;
mod files;
mod layers;
mod outputs;
mod paths;
mod sources;
mod subscribers;
mod tokens;
mod unsafe_code;
