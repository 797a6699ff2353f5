//! The tracing spans of runs. Each test sets its own subscriber on its own threads.

mod recorder;
mod runs;
mod failures;
mod work;
