//! Commands: one draw each, independent of any device, small enough to sort by the million (M 10.3).

mod delta;
mod draw_state;
mod render_command;
mod sort_key;

pub use delta::{DeltaCommands, DeltaError};
pub use draw_state::{Cull, DrawState};
pub use render_command::RenderCommand;
pub use sort_key::SortKey;
