//! Whose targets a frame's views keep.

use std::collections::{HashMap, VecDeque};

use crate::scene::ViewKind;
use crate::view::RenderView;

/// The view of the frame before whose targets a view keeps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct KeptView {
    /// Its index in the frame before.
    pub(crate) index: usize,
    /// Whether it is the same view, so that what its targets held is this view's history.
    pub(crate) is_same: bool,
}

/// For each view the one of the frame before whose targets it keeps, by the kinds and names of those: the view of the
/// same kind and name, of several the one at the same place among them; otherwise one of the same kind that no other
/// view keeps. Of several views with the same kind and name none is the same as before if their number has changed,
/// because it is unknown which of them is new or gone.
pub(crate) fn kept_views<'a>(
    before: impl Iterator<Item = (ViewKind, &'a str)>,
    views: &'a [RenderView],
) -> Vec<Option<KeptView>> {
    kept_views_of(&before.collect::<Vec<_>>(), views)
}

fn kept_views_of(before: &[(ViewKind, &str)], views: &[RenderView]) -> Vec<Option<KeptView>> {
    let mut named: HashMap<(ViewKind, &str), VecDeque<usize>> = HashMap::new();
    for (index, view) in before.iter().copied().enumerate() {
        named.entry(view).or_default().push_back(index);
    }
    let mut count_changes: HashMap<(ViewKind, &str), isize> = HashMap::new();
    for view in views {
        *count_changes.entry((view.kind(), view.name())).or_default() += 1;
    }
    for (view, before) in &named {
        *count_changes.entry(*view).or_default() -= before.len() as isize;
    }
    let mut kept = Vec::with_capacity(views.len());
    for view in views {
        let view = (view.kind(), view.name());
        let index = named.get_mut(&view).and_then(VecDeque::pop_front);
        kept.push(index.map(|index| KeptView { index, is_same: count_changes[&view] == 0 }));
    }

    let mut left: Vec<_> = named.into_values().flatten().collect();
    left.sort_unstable();
    let mut of_kind: HashMap<ViewKind, VecDeque<usize>> = HashMap::new();
    for index in left {
        of_kind.entry(before[index].0).or_default().push_back(index);
    }
    for (kept, view) in kept.iter_mut().zip(views).filter(|(kept, _)| kept.is_none()) {
        let index = of_kind.get_mut(&view.kind()).and_then(VecDeque::pop_front);
        *kept = index.map(|index| KeptView { index, is_same: false });
    }
    kept
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::Camera;

    #[test]
    fn views_keep_the_targets_of_their_name_and_kind_or_of_a_view_that_is_gone() {
        use ViewKind::{Main, Reflection};
        let view = |(kind, name): (ViewKind, &str)| {
            RenderView::new(&Camera { kind, ..Camera::looking_at(name, DVec3::Z, DVec3::ZERO) })
        };
        let found = |before: &[(ViewKind, &str)], now: &[(ViewKind, &str)]| {
            let views: Vec<_> = now.iter().copied().map(view).collect();
            let kept = kept_views(before.iter().copied(), &views);
            kept.into_iter().map(|kept| kept.map(|kept| (kept.index, kept.is_same))).collect::<Vec<_>>()
        };
        let before = [(Main, "main"), (Reflection, "mirror"), (Main, "main"), (Main, "side")];
        assert_eq!(found(&before, &before), [0, 1, 2, 3].map(|index| Some((index, true))));
        // A mirror comes before the main view, and goes.
        assert_eq!(found(&before[..1], &[(Reflection, "mirror"), (Main, "main")]), [None, Some((0, true))]);
        assert_eq!(found(&before[1..3], &[(Main, "main")]), [Some((1, true))]);
        // It is unknown which of two views of a name is gone, or is the new one.
        assert_eq!(found(&before, &[(Main, "main"), (Main, "side")]), [Some((0, false)), Some((3, true))]);
        assert_eq!(found(&before[..2], &[(Main, "main"), (Main, "main")]), [Some((0, false)), None]);
        // Another name takes the targets of a view that is gone, but not those of another kind, or of a view that is
        // still there.
        assert_eq!(found(&before, &[(Main, "other"), (Main, "side")]), [Some((0, false)), Some((3, true))]);
        assert_eq!(found(&before[..2], &[(Main, "mirror"), (Main, "main")]), [None, Some((0, true))]);
        assert_eq!(found(&[], &[(Main, "main")]), [None]);
    }
}
