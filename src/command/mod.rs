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
mod draw_list_static_groups;
mod partition;
mod radix_sort;
mod render_command;
mod selection;
mod sort;
mod sort_key;
mod splitters;
mod version;

pub use bucket::Batch;
pub use draw_list::DrawList;
pub use draw_state::{Cull, DrawState};
pub(crate) use instance::instance;
pub(crate) use internal::*;
pub(crate) use partition::Partition;
pub use render_command::RenderCommand;
pub use selection::{Blending, DrawOrder, MaterialShare, MaterialTypes, Selection};
pub(crate) use sort::{SortScratch, sort};
pub use sort_key::SortKey;

/// Draw lists and how they are made: for backends, and for the tests and benchmarks of this repository. No part of
/// the interface.
#[doc(hidden)]
pub mod internal {
    pub use super::binned_segment::BinnedSegment;
    pub use super::bins::{Bin, Bins};
    pub use super::bucket::Bucket;
    pub use super::draw_list_static_groups::DrawListStaticGroups;
    pub use super::splitters::Splitters;
    pub use super::version::Version;
}
