//! From the objects a view sees to the batches it draws: fill, split, sort, instance, join.

mod draw_list;
mod fill;
mod halvings;
mod instance;
mod key_bits;
mod radix;
mod sort;
mod split;

pub use draw_list::{Batch, DrawList, DrawPart};
pub use fill::{Blending, Fill, MaterialShare, Selection};
pub use instance::instance;
pub use sort::{SortMemory, sort};
pub use split::{Part, Split};
