//! `graph` and the modules of the library that it uses. Threads share their data without locks, and all unsafe code is there, as
//! `tests/architecture` checks.

// What only other modules of the library use is here too.
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
#[path = "../../src/unwind/mod.rs"]
mod unwind;
