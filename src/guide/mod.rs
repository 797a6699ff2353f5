//! A guide for authors of engines. It has no code of its own: its examples are compiled and run with the
//! documentation's tests.
//!
//! - [`from_wgpu`]: from a plain wgpu renderer to Drawloom, in eight steps.
//! - [`coming_from`]: what the words of Bevy, rend3 and hand-written renderers are called here.
//! - [`choosing`]: how many threads, which views, how large a job, which quality.
//! - [`limits`]: what Drawloom is not for.

pub mod choosing;
pub mod coming_from;
pub mod from_wgpu;
pub mod limits;
