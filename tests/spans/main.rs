//! What subscribers are told of runs and frames. Each test has a subscriber of its own, set on its threads alone.

mod frames;
mod recorder;
mod runs;
mod troubles;
mod work;
