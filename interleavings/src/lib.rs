//! The modules of the library whose code threads share, and in which all its unsafe code is: those before `quality` in `src/lib.rs`. The
//! others use them, and would only be built.

// Modules that are not here use the rest.
#![allow(dead_code, unused_imports)]

#[path = "../../src/graph/mod.rs"]
pub mod graph;
#[path = "../../src/sync.rs"]
mod sync;
#[path = "../../src/task/mod.rs"]
pub mod task;
#[path = "../../src/timeline/mod.rs"]
pub mod timeline;
#[path = "../../src/tuning/mod.rs"]
mod tuning;
#[path = "../../src/unwind.rs"]
mod unwind;
