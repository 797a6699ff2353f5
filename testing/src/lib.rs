//! Code that Drawloom's tests, examples and benchmarks share: scenes, devices, random numbers, and oracles in f64.

pub mod absent_features;
#[cfg(feature = "wgpu")]
pub mod adapter;
pub mod changing_world;
pub mod culling;
pub mod demo;
pub mod draw_lists;
pub mod fault_injection;
pub mod feedback;
pub mod hills;
pub mod light_sums;
pub mod limited;
pub mod mip_levels;
pub mod obj_files;
pub mod precision;
pub mod random;
pub mod samples;
pub mod scenes;
pub mod shared_scenes;
pub mod simulated_device;
pub mod slow_cases;
pub mod tinted;
