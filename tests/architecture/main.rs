//! The structure of the crates, checked on its source:
//!
//! - `layers`: the modules that `lib.rs` lists are layers, and each uses only those above it.
//! - `circles`: no circle of imports within a module leaves a folder.
//! - `files`: files have few lines of code, and their names say what is inside.
//! - `outputs`: examples and benchmarks write files and print lines through `drawloom-output`.
//! - `pipelines`: `Deferred` uses public interfaces alone, and the frame does not know it.
//! - `stage_table`: `ARCHITECTURE.md` has the table of stages.
//! - `subscribers`: the library calls subscribers of `tracing` where their panics are caught.
//! - `atomics`: the file `ORDERINGS.md` of each crate lists every atomic of the crate.

mod atomics;
mod circles;
mod files;
mod layers;
mod outputs;
mod paths;
mod pipelines;
mod sources;
mod stage_table;
mod subscribers;
mod tokens;
