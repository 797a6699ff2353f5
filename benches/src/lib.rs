//! Code that Drawloom's benchmarks share.
//!
//! ```sh
//! cargo bench -p drawloom-benches --bench record
//! cargo bench -p drawloom-benches --bench record -- --quick
//! ```

pub mod arguments;
#[cfg(feature = "wgpu")]
pub mod backends;
pub mod chart;
pub mod city;
pub mod clouds;
pub mod cpu_time;
pub mod delta;
pub mod harness;
pub mod mirror;
pub mod moving;
pub mod plain;
pub mod results;
pub mod sphere;
pub mod spinning;
pub mod statistics;
pub mod stopwatch;
pub mod table;
pub mod targets;
pub mod work;
