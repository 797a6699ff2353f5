//! A log as a trace that Perfetto and `chrome://tracing` open.

mod events;
mod nested_tracks;
mod node_spans;
mod ready_nodes;
mod trace;

pub use self::trace::write_chrome_trace;
