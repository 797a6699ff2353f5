//! Commands, each of which draws one object, independent of any device and small enough to sort by the million (M
//! 10.3). They are sorted in buckets, merged into batches (instanced draws), and joined to one draw list per pass (M
//! 10.5).

mod binned_segment;
mod bucket;
mod draw_list;
mod draw_state;
mod item_list;
mod key_packer;
mod partition;
mod radix_sort;
mod selection;
mod sort;
mod sort_key;
mod splitters;

pub(crate) use bucket::instance;
pub use bucket::{Batch, RenderCommand};
pub use draw_list::DrawList;
pub use draw_state::{Cull, DrawState};
pub(crate) use internal::*;
pub(crate) use item_list::{BlockBits, ListChanges};
pub(crate) use partition::Partition;
pub(crate) use selection::{Blending, MaterialShare, MaterialTypes};
pub use selection::{DrawOrder, Selection};
pub(crate) use sort::{SortScratch, sort};
pub use sort_key::SortKey;

/// Draw lists and how they are made: for backends, and for the tests and benchmarks of this repository. No part of
/// the interface.
#[doc(hidden)]
pub mod internal {
    pub use super::binned_segment::{Bin, BinnedSegment, Bins};
    pub use super::bucket::Bucket;
    pub use super::draw_list::{DrawListStaticGroups, Version};
    pub use super::item_list::ItemList;
    pub use super::splitters::Splitters;
}
