//! Which view of a frame is which view of the frame before.

use std::collections::{HashMap, VecDeque};

use super::RenderView;
use super::render_view::ViewId;
use crate::scene::ViewKind;

/// The views of the latest frame. It decides which views of the next frame are the same, and gives each a slot: see
/// [`ViewId`].
///
/// A view is the same as the one of its kind and name in the latest frame; of several, as the one at the same place
/// among them. If the number of these has changed, none is the same, because it is unknown which of them is new or
/// gone.
#[derive(Debug, Default)]
pub(crate) struct ViewRegistry {
    /// The views of the latest frame that was recorded.
    latest: Vec<RegisteredView>,
    /// The views of the frame that is being recorded; `None` if they are those of the latest frame.
    next: Option<Vec<RegisteredView>>,
    /// The latest identity that a view was given.
    identity: u64,
}

#[derive(Debug)]
struct RegisteredView {
    kind: ViewKind,
    name: String,
    id: ViewId,
}

impl ViewRegistry {
    /// Gives the views of a frame their ids. If they are those of the latest frame, it allocates nothing, and compares
    /// each name once.
    pub(crate) fn begin_frame(&mut self, views: &mut [RenderView]) {
        let is_of = |(known, view): (&RegisteredView, &RenderView)| {
            known.kind == view.kind() && known.name.as_str() == view.name()
        };
        let are_same = self.latest.len() == views.len() && self.latest.iter().zip(&*views).all(is_of);
        self.next = (!are_same).then(|| {
            let ids = new_ids(&self.latest, views, &mut self.identity);
            let registered = |(view, id): (&RenderView, ViewId)| RegisteredView {
                kind: view.kind(),
                name: view.name().to_owned(),
                id,
            };
            views.iter().zip(ids).map(registered).collect()
        });
        let registered = self.next.as_ref().unwrap_or(&self.latest);
        views.iter_mut().zip(registered).for_each(|(view, registered)| view.id = registered.id);
    }

    /// The frame that began was recorded. Without this call the views of the next frame are compared with those of the
    /// frame before the one that failed.
    pub(crate) fn end_frame(&mut self) {
        if let Some(next) = self.next.take() {
            self.latest = next;
        }
    }
}

/// The ids of a frame's views. A view has the slot of the view of its kind and name in the latest frame; otherwise one
/// that a view of its kind has left; otherwise any that is free.
fn new_ids(latest: &[RegisteredView], views: &[RenderView], identity: &mut u64) -> Vec<ViewId> {
    let mut new_identity = || {
        *identity += 1;
        *identity
    };
    // By kind and name: the ids of the views in the latest frame, and by how much the number of the views has grown.
    let mut named: HashMap<(ViewKind, &str), (VecDeque<ViewId>, isize)> = HashMap::new();
    for known in latest {
        let (ids, growth) = named.entry((known.kind, &known.name)).or_default();
        ids.push_back(known.id);
        *growth -= 1;
    }
    for view in views {
        let (_, growth) = named.entry((view.kind(), view.name())).or_default();
        *growth += 1;
    }
    let slot_count = latest.iter().map(|known| known.id.slot + 1).max().unwrap_or(0);
    let mut is_taken = vec![false; slot_count as usize];
    let mut ids: Vec<Option<ViewId>> = Vec::with_capacity(views.len());
    for view in views {
        let (known, growth) = named.entry((view.kind(), view.name())).or_default();
        let id = known.pop_front();
        id.iter().for_each(|id| is_taken[id.slot as usize] = true);
        let is_same = *growth == 0;
        ids.push(id.map(|id| if is_same { id } else { ViewId { identity: new_identity(), ..id } }));
    }

    let mut left_by_kind: [VecDeque<u32>; ViewKind::COUNT] = Default::default();
    for known in latest.iter().filter(|known| !is_taken[known.id.slot as usize]) {
        left_by_kind[known.kind as usize].push_back(known.id.slot);
    }
    for (id, view) in ids.iter_mut().zip(views).filter(|(id, _)| id.is_none()) {
        let slot = left_by_kind[view.kind() as usize].pop_front();
        slot.iter().for_each(|slot| is_taken[*slot as usize] = true);
        *id = slot.map(|slot| ViewId { slot, identity: new_identity() });
    }
    let mut free = (0_u32..).filter(|slot| !is_taken.get(*slot as usize).is_some_and(|is_taken| *is_taken));
    let mut id_in_free_slot = || ViewId { slot: free.next().unwrap_or(u32::MAX), identity: new_identity() };
    ids.into_iter().map(|id| id.unwrap_or_else(&mut id_in_free_slot)).collect()
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::Camera;

    type Named<'a> = (ViewKind, &'a str);

    /// The ids of these views in a frame. The frame fails if `fails`.
    fn frame(registry: &mut ViewRegistry, named: &[Named<'_>], fails: bool) -> Vec<ViewId> {
        let view = |&(kind, name): &Named<'_>| {
            RenderView::new(&Camera { kind, ..Camera::looking_at(name, DVec3::Z, DVec3::ZERO) })
        };
        let mut views: Vec<_> = named.iter().map(view).collect();
        registry.begin_frame(&mut views);
        if !fails {
            registry.end_frame();
        }
        views.iter().map(|view| view.id).collect()
    }

    /// For each view of `now` the index of the view whose slot it has in the frame `before`, and whether it is the
    /// same.
    fn found(before: &[Named<'_>], now: &[Named<'_>]) -> Vec<Option<(usize, bool)>> {
        let mut registry = ViewRegistry::default();
        let ids_before = frame(&mut registry, before, false);
        let index_of = |id: ViewId| {
            let index = ids_before.iter().position(|before| before.slot == id.slot)?;
            Some((index, ids_before[index].identity == id.identity))
        };
        frame(&mut registry, now, false).into_iter().map(index_of).collect()
    }

    #[test]
    fn views_keep_the_slots_of_their_name_and_kind_or_of_a_view_that_is_gone() {
        use ViewKind::{Main, Reflection};
        let before = [(Main, "main"), (Reflection, "mirror"), (Main, "main"), (Main, "side")];
        assert_eq!(found(&before, &before), [0, 1, 2, 3].map(|index| Some((index, true))));
        // A mirror comes before the main view, and goes.
        assert_eq!(found(&before[..1], &[(Reflection, "mirror"), (Main, "main")]), [None, Some((0, true))]);
        assert_eq!(found(&before[1..3], &[(Main, "main")]), [Some((1, true))]);
        // It is unknown which of two views of a name is gone, or is the new one.
        assert_eq!(found(&before, &[(Main, "main"), (Main, "side")]), [Some((0, false)), Some((3, true))]);
        assert_eq!(found(&before[..1], &[(Main, "main"), (Main, "main")]), [Some((0, false)), None]);
        // Another name takes the slot of a view that is gone, of another kind only if none of its own is left, but not
        // that of a view that is still there.
        assert_eq!(found(&before, &[(Main, "other"), (Main, "side")]), [Some((0, false)), Some((3, true))]);
        assert_eq!(found(&before[1..], &[(Main, "other"), (Main, "side")]), [Some((1, false)), Some((2, true))]);
        assert_eq!(found(&before[..2], &[(Main, "mirror"), (Main, "main")]), [Some((1, false)), Some((0, true))]);
        assert_eq!(found(&[], &[(Main, "main")]), [None]);
        // As many views as before, with another kind or another name.
        for other in [(Reflection, "main"), (Main, "side")] {
            assert_eq!(found(&before[..1], &[other]), [Some((0, false))]);
        }
    }

    #[test]
    fn views_change_places_and_keep_their_slots() {
        use ViewKind::{Main, Reflection};
        let before = [(Main, "main"), (Main, "main"), (Main, "side"), (Reflection, "main")];
        let now = [(Reflection, "main"), (Main, "side"), (Main, "main"), (Main, "main")];
        assert_eq!(found(&before, &now), [3, 2, 0, 1].map(|index| Some((index, true))));
    }

    #[test]
    fn a_frame_that_fails_changes_no_view_and_its_identities_are_not_used_again() {
        use ViewKind::Main;
        let mut registry = ViewRegistry::default();
        let main = frame(&mut registry, &[(Main, "main")], false)[0];
        let failed = frame(&mut registry, &[(Main, "side"), (Main, "top")], true);
        assert_eq!(failed[0].slot, main.slot);
        assert_eq!(frame(&mut registry, &[(Main, "main")], false), [main]);
        let [_, top] = frame(&mut registry, &[(Main, "main"), (Main, "top")], false)[..] else { panic!() };
        assert!(top.slot == failed[1].slot && !failed.iter().any(|failed| failed.identity == top.identity));
        // Nor after the failure of a frame with the views of the latest one.
        frame(&mut registry, &[(Main, "main")], true);
        frame(&mut registry, &[(Main, "main"), (Main, "top")], true);
        assert_eq!(frame(&mut registry, &[(Main, "main"), (Main, "top")], false), [main, top]);
    }

    #[test]
    fn views_that_come_and_go_forever_need_no_more_slots_than_the_most_views_of_a_frame() {
        let mut registry = ViewRegistry::default();
        let (mut identities, mut all) = (std::collections::HashSet::new(), 0);
        for round in 0..1000_usize {
            let names: Vec<_> = (0..round * 7 % 6).map(|index| format!("{round} {index}")).collect();
            let kinds = [ViewKind::Main, ViewKind::Reflection, ViewKind::Shadow].into_iter().cycle().skip(round % 5);
            let views: Vec<_> = kinds.zip(names.iter().map(String::as_str)).collect();
            let ids = frame(&mut registry, &views, round % 11 == 3);
            let mut slots: Vec<_> = ids.iter().map(|id| id.slot).collect();
            slots.sort_unstable();
            slots.dedup();
            assert!(slots.len() == ids.len() && slots.iter().all(|slot| *slot < 5), "{slots:?}");
            all += ids.len();
            identities.extend(ids.into_iter().map(|id| id.identity));
        }
        assert_eq!(identities.len(), all);
    }
}
