//! Where the views lie in a frame's buffers.

use std::ops::Range;

use crate::backend::kept_views;
use crate::scene::ViewKind;
use crate::view::RenderView;

/// The bytes of a view in the frame's buffers.
pub(super) struct ViewRanges {
    kind: ViewKind,
    name: String,
    /// Those of its [`GpuView`](crate::view::GpuView).
    pub(super) view: Range<usize>,
    /// Those of the lights that reach it, and the length that these need.
    pub(super) lights: Range<usize>,
    pub(super) lights_length: usize,
}

impl ViewRanges {
    /// Makes `ranges` those of these views, by index. A view keeps those that it had, whatever its index was; a new
    /// view takes those of one of its kind that is gone, or none. Allocates nothing if the views are the same.
    pub(super) fn keep(ranges: &mut Vec<Self>, views: &[RenderView]) {
        if ranges.len() == views.len() && ranges.iter().zip(views).all(|(ranges, view)| ranges.are_of(view)) {
            return;
        }
        let kept = kept_views(ranges.iter().map(|ranges| (ranges.kind, ranges.name.as_str())), views);
        let mut before: Vec<_> = ranges.drain(..).map(Some).collect();
        ranges.extend(views.iter().zip(kept).map(|(view, kept)| {
            let kept = kept.and_then(|kept| before[kept.index].take());
            let [of_view, lights] = kept.map_or([0..0, 0..0], |kept| [kept.view, kept.lights]);
            Self { kind: view.kind(), name: view.name().to_owned(), view: of_view, lights, lights_length: 0 }
        }));
    }

    fn are_of(&self, view: &RenderView) -> bool {
        (self.kind, self.name.as_str()) == (view.kind(), view.name())
    }
}
