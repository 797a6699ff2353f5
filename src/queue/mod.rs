//! From the objects a view sees to the batches it draws: fill, sort, instance.

mod draw_list;
mod fill;
mod halvings;
mod instance;
mod sort;

pub use draw_list::{Batch, DrawList};
pub use fill::{Blending, Fill, MaterialShare, Selection};
pub use instance::instance;
pub use sort::sort;
