//! The tracing spans of runs and frames. Each test sets its own subscriber on its own threads.

mod frames;
mod recorder;
mod runs;
mod failures;
mod work;
