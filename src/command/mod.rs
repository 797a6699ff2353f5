//! Commands, each of which draws one object, independent of any device and small enough to sort by the million (M
//! 10.3). They are sorted in buckets, merged into batches (instanced draws), and joined to one draw list per pass (M
//! 10.5).

mod binned_segment;
mod bins;
mod bucket;
mod draw_list;
mod draw_state;
mod instance;
mod key_packer;
mod list_pieces;
mod partition;
mod radix_sort;
mod render_command;
mod selection;
mod sort;
mod sort_key;
mod splitters;
mod version;

pub use binned_segment::BinnedSegment;
pub use bins::{Bin, Bins};
pub use bucket::{Batch, Bucket};
pub use draw_list::DrawList;
pub use draw_state::{Cull, DrawState};
pub(crate) use instance::instance;
pub use list_pieces::ListPieces;
pub(crate) use partition::Partition;
pub use render_command::RenderCommand;
pub use selection::{Blending, DrawOrder, MaterialShare, MaterialTypeFilter, Selection};
pub(crate) use sort::{SortScratch, sort};
pub use sort_key::SortKey;
pub use splitters::Splitters;
pub use version::Version;
