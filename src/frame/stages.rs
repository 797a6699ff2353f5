//! The stages of a frame, in order.
//!
//! A stage is a type that holds all about itself: its [`StageInfo`](super::stage::StageInfo), when a frame needs it,
//! its width and its work. To add one, implement [`Stage`] and add a line to one of these lists.

#[cfg(feature = "occlusion")]
mod of_culling;
mod of_draw_list;
mod of_frame;
mod of_pass;
mod of_static_groups;
mod of_view;

#[cfg(feature = "occlusion")]
use of_culling::{CoarseDepth, CullList, Occluders, Occlusion, Triangles};
use of_draw_list::{Bin, Fill, Instance, Join, Sort, Split};
use of_frame::{Bins, Objects, Upload};
use of_pass::{Finish, Prepare, Record};
use of_static_groups::{ExecuteStaticGroups, RecordStaticGroups};
use of_view::{Compact, Levels, Visibility};

use super::stage::Stage;
use crate::backend::Backend;

/// The stages that a frame has once.
pub(super) fn stages_of_frame<B: Backend>() -> Vec<Box<dyn Stage<B>>> {
    vec![Box::new(Objects), Box::new(Bins), Box::new(Upload), Box::new(RecordStaticGroups)]
}

/// The stages of one view, by index.
pub(super) fn stages_of_view<B: Backend>(view: usize) -> Vec<Box<dyn Stage<B>>> {
    vec![
        Box::new(Visibility { view }),
        Box::new(Levels { view }),
        #[cfg(feature = "occlusion")]
        Box::new(Occluders { view }),
        #[cfg(feature = "occlusion")]
        Box::new(CoarseDepth { view }),
        #[cfg(feature = "occlusion")]
        Box::new(Occlusion { view }),
        Box::new(Compact { view }),
    ]
}

/// The stages of one pass, by index in the frame.
pub(super) fn stages_of_pass<B: Backend>(pass: usize) -> Vec<Box<dyn Stage<B>>> {
    vec![
        Box::new(Fill { pass }),
        Box::new(Split { pass }),
        Box::new(Sort { pass }),
        Box::new(Instance { pass }),
        Box::new(Bin { pass }),
        Box::new(ExecuteStaticGroups { pass }),
        Box::new(Join { pass }),
        #[cfg(feature = "occlusion")]
        Box::new(Triangles { pass }),
        #[cfg(feature = "occlusion")]
        Box::new(CullList { pass }),
        Box::new(Prepare { pass }),
        Box::new(Record { pass }),
        Box::new(Finish { pass }),
    ]
}
