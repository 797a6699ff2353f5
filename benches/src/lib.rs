//! What Drawloom's benchmarks share.
//!
//!     cargo bench -p drawloom-benches --bench record
//!     cargo bench -p drawloom-benches --bench record -- --quick

#[cfg(feature = "wgpu")]
pub mod backends;
pub mod boxes;
pub mod chart;
pub mod clouds;
pub mod moving;
pub mod quick;
pub mod results;
pub mod stopwatch;
pub mod table;
#[cfg(feature = "wgpu")]
pub mod trial;
pub mod work;
