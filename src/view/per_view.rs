//! Values that views keep from frame to frame.

use std::ops::{Index, IndexMut};

use super::RenderView;
use super::render_view::ViewId;

/// A value for each view of a frame, by the view's index. The views keep their values from frame to frame, whatever
/// their indices: each value stays in the [slot](ViewId) of its view.
#[derive(Clone, Debug)]
pub(crate) struct PerView<T> {
    /// By the view's index.
    ids: Vec<ViewId>,
    /// By slot; a default value where no view is.
    values: Vec<T>,
    /// By slot: the identity of the view that has it.
    identities: Vec<Option<u64>>,
}

impl<T> Default for PerView<T> {
    fn default() -> Self {
        Self { ids: Vec::new(), values: Vec::new(), identities: Vec::new() }
    }
}

impl<T: Default> PerView<T> {
    /// The values of these views.
    #[cfg(any(feature = "software", feature = "wgpu", test))]
    pub(crate) fn new(views: &[RenderView], values: impl IntoIterator<Item = T>) -> Self {
        let mut of_views = Self::default();
        of_views.set_views(views, |_| {});
        for (index, value) in values.into_iter().enumerate() {
            of_views[index] = value;
        }
        of_views
    }

    /// Makes the values those of these views. Calls `replace` with each value that another view had, or none. Drops the
    /// values of views that are gone and whose slots no other view has. Returns whether the views are those that it
    /// had; then it allocates nothing.
    pub(crate) fn set_views(&mut self, views: &[RenderView], mut replace: impl FnMut(&mut T)) -> bool {
        let ids = || views.iter().map(|view| view.id);
        if self.ids.len() == views.len() && self.ids.iter().copied().eq(ids()) {
            return true;
        }
        self.ids.clear();
        self.ids.extend(ids());
        let slot_count = ids().map(|id| id.slot as usize + 1).max().unwrap_or(0);
        self.values.resize_with(slot_count, T::default);
        let mut before = std::mem::replace(&mut self.identities, vec![None; slot_count]);
        before.resize(slot_count, None);
        for ViewId { slot, identity } in ids() {
            let slot = slot as usize;
            self.identities[slot] = Some(identity);
            if before[slot] != Some(identity) {
                replace(&mut self.values[slot]);
            }
        }
        let slots = self.values.iter_mut().zip(&self.identities).zip(before);
        let left = slots.filter(|((_, now), before)| now.is_none() && before.is_some());
        left.for_each(|((value, _), _)| *value = T::default());
        false
    }

    /// Drops all values.
    pub(crate) fn clear(&mut self) {
        *self = Self::default();
    }
}

impl<T> PerView<T> {
    /// The value in the slot of a view of another frame, and whether it is the same view's: otherwise only its memory
    /// is of use. `None` if no view has the slot.
    pub(crate) fn kept(&self, view: &RenderView) -> Option<(&T, bool)> {
        let slot = view.id.slot as usize;
        let identity = self.identities.get(slot).copied().flatten()?;
        Some((&self.values[slot], identity == view.id.identity))
    }

    /// A view's value, by the view's index.
    pub(crate) fn get(&self, view: usize) -> Option<&T> {
        self.ids.get(view).map(|id| &self.values[id.slot as usize])
    }

    /// The values in the order of their views.
    #[cfg(any(feature = "software", feature = "wgpu", test))]
    pub(crate) fn iter(&self) -> impl Iterator<Item = &T> {
        self.ids.iter().map(|id| &self.values[id.slot as usize])
    }

    /// All values, in the order of their slots, and a default value for each slot in which no view is.
    pub(crate) fn slots_mut(&mut self) -> &mut [T] {
        &mut self.values
    }
}

impl<T> Index<usize> for PerView<T> {
    type Output = T;

    fn index(&self, view: usize) -> &T {
        &self.values[self.ids[view].slot as usize]
    }
}

impl<T> IndexMut<usize> for PerView<T> {
    fn index_mut(&mut self, view: usize) -> &mut T {
        &mut self.values[self.ids[view].slot as usize]
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::Camera;

    fn views(ids: &[(u32, u64)]) -> Vec<RenderView> {
        let view = RenderView::new(&Camera::looking_at("main", DVec3::Z, DVec3::ZERO));
        ids.iter().map(|&(slot, identity)| RenderView { id: ViewId { slot, identity }, ..view.clone() }).collect()
    }

    /// Sets views that write a cross where they replace a value.
    fn set(values: &mut PerView<String>, ids: &[(u32, u64)]) -> Vec<String> {
        values.set_views(&views(ids), |value| value.push('x'));
        assert!(values.set_views(&views(ids), |_| panic!("nothing has changed")));
        assert_eq!(values.get(ids.len()), None);
        values.iter().cloned().collect()
    }

    #[test]
    fn values_stay_with_their_views_and_others_are_replaced() {
        let mut values = PerView::new(&views(&[(2, 12), (0, 10), (1, 11)]), ["c", "a", "b"].map(String::from));
        assert_eq!(values.slots_mut(), ["a", "b", "c"]);
        assert_eq!(set(&mut values, &[(0, 10), (1, 11), (2, 12)]), ["a", "b", "c"]);
        assert_eq!([0, 1, 2].map(|view| values[view].clone()), ["a", "b", "c"]);
        assert_eq!(set(&mut values, &[(3, 14), (1, 13), (2, 12)]), ["x", "bx", "c"]);
        values[1] = String::from("d");
        assert_eq!(set(&mut values, &[(1, 13)]), ["d"]);
    }

    #[test]
    fn values_of_slots_without_a_view_are_dropped() {
        let mut values = PerView::new(&views(&[(0, 10), (1, 11), (2, 12)]), ["a", "b", "c"].map(String::from));
        assert_eq!(set(&mut values, &[(1, 11)]), ["b"]);
        assert_eq!(values.slots_mut(), ["", "b"]);
        assert_eq!(set(&mut values, &[(0, 13), (1, 11), (2, 12)]), ["x", "b", "x"]);
        values.clear();
        assert!(values.slots_mut().is_empty() && values.iter().next().is_none());
        assert_eq!(set(&mut values, &[(1, 11)]), ["x"]);
    }

    #[test]
    fn a_view_of_another_frame_finds_what_is_in_its_slot() {
        let values = PerView::new(&views(&[(2, 12), (0, 10)]), [7, 8]);
        let kept = |slot, identity| {
            let next = &views(&[(slot, identity)])[0];
            values.kept(next).map(|(value, is_same)| (*value, is_same))
        };
        assert_eq!([kept(0, 10), kept(2, 12), kept(2, 13)], [Some((8, true)), Some((7, true)), Some((7, false))]);
        assert_eq!([kept(1, 11), kept(3, 10)], [None, None]);
    }
}
