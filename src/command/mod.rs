//! What a view draws, from command to batch: one draw each, independent of any device, small enough to sort by the million
//! (M 10.3); sorted by bucket, merged into instanced draws, and joined to a draw list a pass (M 10.5).

mod bucket;
mod delta;
mod draw_list;
mod draw_state;
mod instance;
mod key_packer;
mod radix_sort;
mod render_command;
mod selection;
mod sort;
mod sort_key;
mod splitters;

pub use bucket::{Batch, Bucket};
pub use delta::{DeltaCommands, DeltaError};
pub use draw_list::DrawList;
pub use draw_state::{Cull, DrawState};
pub(crate) use instance::instance;
pub use render_command::RenderCommand;
pub use selection::{Blending, MaterialShare, Selection};
pub(crate) use sort::{SortScratch, sort};
pub use sort_key::SortKey;
pub use splitters::Splitters;
