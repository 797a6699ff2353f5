//! The view cache: views that are drawn once for several frames, and what becomes of the frames that draw them.

use std::collections::HashSet;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use parking_lot::Mutex;

use crate::frame::views::{FrameViews, covers, have_same_maps, with_brightness_of};
use crate::process::{FramePlan, ViewArray};
use crate::scene::{Camera, Redraw, ViewKind};
use crate::view::{PerView, RenderView};

/// The views of the latest frame, for the next one to read: see [`Redraw`].
#[derive(Default)]
pub(in crate::frame) struct ViewCache {
    /// `None` where the next frame must draw all of its views.
    latest: Option<DrawnViews>,
    /// The indices of these views.
    indices: PerView<usize>,
    /// Whether a recorded frame was dropped before it was submitted, so that its views were never drawn.
    lost: Arc<AtomicBool>,
    /// By view of the frame that is being recorded: the earlier frame that draws it, if it is cached.
    kept_from: Vec<Option<Arc<FrameOutcome>>>,
    /// The number of frames so far.
    frames: u64,
}

/// The views of a frame, each as it was drawn.
struct DrawnViews {
    /// The plan's identity.
    plan: u64,
    views: Arc<FrameViews>,
    /// By view: the frame that draws it.
    drawn_by: Vec<Arc<FrameOutcome>>,
}

/// A recorded frame that is not submitted yet. If it is dropped, the views that it draws are lost.
pub(in crate::frame) struct InFlight {
    /// `None` once it is submitted, and where no later frame keeps its views.
    outcome: Option<Arc<FrameOutcome>>,
    /// That of the cache.
    lost: Arc<AtomicBool>,
    /// The views that it keeps, by index, each with the frame that draws it.
    kept: Vec<(usize, Arc<FrameOutcome>)>,
}

impl ViewCache {
    /// Decides which of the requested views a frame draws. The others become those that were drawn: of a light's shadow
    /// map also the light, because the map is valid only with that one. The brightness of a light is always the
    /// requested one.
    ///
    /// `is_imported` says whether the frame draws a view of this name into a texture of the engine's own.
    ///
    /// # Errors
    /// Those of `is_imported`.
    pub(in crate::frame) fn resolve<E>(
        &mut self,
        plan: &FramePlan,
        mut requested: FrameViews,
        is_imported: impl Fn(&str) -> Result<bool, E>,
    ) -> Result<FrameViews, E> {
        let latest = self.latest.take().filter(|latest| latest.plan == plan.identity());
        let was_lost = self.lost.swap(false, Ordering::Relaxed);
        let mut turns = Turns { frame: self.frames, counts: Vec::new(), latest_light: None };
        self.frames += 1;
        for view in requested.views.iter_mut().filter(|view| !view.camera.redraw.is_every_frame()) {
            // The texture is only one frame's.
            if is_imported(view.name())? {
                view.camera.redraw = Redraw::EveryFrame;
            }
        }
        self.kept_from.clear();
        self.kept_from.resize(requested.views.len(), None);
        let latest = latest.filter(|_| !was_lost && requested.may_be_cached());
        let Some(DrawnViews { views: drawn, drawn_by, .. }) = latest else { return Ok(requested) };
        let keeps_layers = kinds_with_same_layers(plan, &drawn.views, &requested.views);
        let keeps_light_maps = have_same_maps(&drawn, &requested);
        let loses_layer = views_without_their_layers(&drawn, &requested);
        let FrameViews { views, lights, scene_indices, .. } = &mut requested;
        let mut cached: Vec<Option<usize>> = Vec::with_capacity(views.len());
        for (index, view) in views.iter().enumerate() {
            let is_turn = turns.take(view, view.valid_light.map(|light| MapSet::of(light, scene_indices)));
            let Some((&kept, true)) = self.indices.kept(view) else {
                cached.push(None);
                continue;
            };
            let before = &drawn.views[kept];
            let is_needed = match view.camera.redraw {
                Redraw::EveryFrame => true,
                Redraw::Interval(interval) => is_turn || before.age + 1 >= interval,
                Redraw::OnCameraChange => before.camera != view.camera,
            };
            let keeps_targets = !before.camera.redraw.is_every_frame()
                && before.camera.size == view.camera.size
                && keeps_layers[view.kind() as usize]
                && !loses_layer.contains(&index)
                && !drawn_by[kept].is_lost();
            let is_light_map = view.valid_light.is_some();
            let is_valid = !is_light_map || keeps_light_maps && covers(before, view);
            cached.push((!is_needed && keeps_targets && is_valid).then_some(kept));
        }
        // The maps of a set are drawn together: where faces or cascades meet, different ages would show.
        let is_drawn = |(view, cached): (&RenderView, &Option<usize>)| view.valid_light.filter(|_| cached.is_none());
        let drawn_lights: HashSet<usize> = views.iter().zip(&cached).filter_map(is_drawn).collect();
        for ((view, cached), kept_from) in views.iter_mut().zip(cached).zip(&mut self.kept_from) {
            let Some(index) = cached.filter(|_| !view.valid_light.is_some_and(|light| drawn_lights.contains(&light)))
            else {
                continue;
            };
            let before = &drawn.views[index];
            if let (Some(light), Some(drawn_with)) = (view.valid_light, before.valid_light) {
                lights[light] = with_brightness_of(drawn.lights[drawn_with], &lights[light]);
            }
            let camera = Camera { redraw: view.camera.redraw, ..before.camera.clone() };
            (view.camera, view.frustum, view.age) = (camera, before.frustum.clone(), before.age.saturating_add(1));
            *kept_from = Some(Arc::clone(&drawn_by[index]));
        }
        Ok(requested)
    }

    /// Stores the views of a frame that was recorded.
    pub(in crate::frame) fn store(&mut self, plan: &FramePlan, views: &Arc<FrameViews>) -> InFlight {
        if !views.may_be_cached() {
            self.latest = None;
            return InFlight { outcome: None, lost: Arc::clone(&self.lost), kept: Vec::new() };
        }
        let outcome = Arc::new(FrameOutcome::in_flight(self.kept_from.iter().flatten()));
        let drawn_by = |kept: &Option<Arc<FrameOutcome>>| kept.clone().unwrap_or_else(|| Arc::clone(&outcome));
        let drawn_by = self.kept_from.iter().map(drawn_by).collect();
        self.indices.set_views(&views.views, |_| {});
        (0..views.views.len()).for_each(|index| self.indices[index] = index);
        self.latest = Some(DrawnViews { plan: plan.identity(), views: Arc::clone(views), drawn_by });
        let kept = self.kept_from.drain(..).enumerate();
        let kept = kept.filter_map(|(view, frame)| Some((view, frame.filter(|frame| !frame.is_submitted())?)));
        let kept = kept.collect();
        InFlight { outcome: Some(outcome), lost: Arc::clone(&self.lost), kept }
    }

    /// Makes the next frame draw all of its views.
    pub(in crate::frame) fn invalidate(&mut self) {
        self.latest = None;
    }

    /// Makes the next frame draw all of its views, whatever becomes of frames that are in flight.
    pub(in crate::frame) fn forget_frames_in_flight(&mut self) {
        (self.latest, self.lost) = (None, Arc::default());
    }
}

impl InFlight {
    /// A view, by index, that the frame keeps although the frame that was to draw it is not submitted.
    pub(in crate::frame) fn missing_view(&self) -> Option<usize> {
        self.kept.iter().find(|(_, frame)| !frame.is_submitted()).map(|(view, _)| *view)
    }

    /// The frame was submitted.
    pub(in crate::frame) fn submitted(mut self) {
        if let Some(outcome) = self.outcome.take() {
            outcome.submit();
        }
    }
}

impl Drop for InFlight {
    fn drop(&mut self) {
        if let Some(outcome) = &self.outcome {
            outcome.lose();
            self.lost.store(true, Ordering::Relaxed);
        }
    }
}

/// The maps of a light that are drawn together: for one main camera, if it is directional.
#[derive(Clone, Copy)]
struct MapSet {
    /// The light's index in the scene.
    light: usize,
    /// How many sets of the light there are before this one.
    rank: u64,
}

impl MapSet {
    /// That of a light of the frame, given the index in the scene of each.
    fn of(light: usize, scene_indices: &[usize]) -> Self {
        let before = scene_indices[..light].iter().rev().take_while(|index| **index == scene_indices[light]);
        // The light itself, whose copies have the sets of several main cameras, has none then.
        Self { light: scene_indices[light], rank: before.count().saturating_sub(1) as u64 }
    }
}

/// Whose turn it is among the views of each interval.
struct Turns {
    /// The frame's number.
    frame: u64,
    /// How many views of each interval there were so far. The maps of a light count as one.
    counts: Vec<(u32, u64)>,
    /// The light of the map before, by its index in the scene, and how many views of its interval there were before it.
    latest_light: Option<(usize, u64)>,
}

impl Turns {
    /// Views of one interval are drawn in at most this many of its frames: each set of drawn views is a stage graph of
    /// its own.
    const MAX_GROUPS: u32 = 8;

    /// Whether it is the turn of the next view, if that has an interval. `maps` are the maps that it is one of. Which
    /// turn those of one main camera have does not depend on the cameras after it.
    fn take(&mut self, view: &RenderView, maps: Option<MapSet>) -> bool {
        let Redraw::Interval(interval) = view.camera.redraw else { return false };
        let of_light = self.latest_light.filter(|(light, _)| maps.is_some_and(|maps| maps.light == *light));
        let place = of_light.map_or_else(|| self.count(interval), |(_, place)| place);
        self.latest_light = maps.map(|maps| (maps.light, place));
        let groups = u64::from(interval.min(Self::MAX_GROUPS));
        let offset = (place + maps.map_or(0, |maps| maps.rank)) * u64::from(interval) / groups;
        (self.frame + offset).is_multiple_of(u64::from(interval))
    }

    /// Counts a view of an interval: how many there were before it.
    fn count(&mut self, interval: u32) -> u64 {
        let known = self.counts.iter().position(|(known, _)| *known == interval).unwrap_or_else(|| {
            self.counts.push((interval, 0));
            self.counts.len() - 1
        });
        let (_, count) = &mut self.counts[known];
        *count += 1;
        *count - 1
    }
}

/// By kind of views, whether the views have the same layers of the targets that they share.
fn kinds_with_same_layers(plan: &FramePlan, before: &[RenderView], views: &[RenderView]) -> [bool; ViewKind::COUNT] {
    let mut are_same = [true; ViewKind::COUNT];
    for kind in plan.targets().iter().filter(|target| target.layered).map(|target| target.views) {
        let [before, after] =
            [before, views].map(|views| views.iter().filter(move |view| view.kind() == kind).map(|view| view.id));
        are_same[kind as usize] = before.eq(after);
    }
    are_same
}

/// The indices of the views whose targets are layers of a texture that cannot be that of the frame before.
fn views_without_their_layers(before: &FrameViews, requested: &FrameViews) -> HashSet<usize> {
    let keeps_texture = |array: &&ViewArray| {
        let mut of_target = before.arrays.iter().filter(|before| before.target_index == array.target_index);
        of_target.any(|before| array.keeps_texture_of(before))
    };
    let lost = requested.arrays.iter().filter(|array| !keeps_texture(array));
    lost.flat_map(|array| array.view_indices.iter().flatten().copied()).collect()
}

/// What becomes of a recorded frame. Later frames that keep a view which it draws share this with it.
pub(in crate::frame) struct FrameOutcome {
    state: Mutex<State>,
}

enum State {
    /// It is neither submitted nor dropped, and keeps views that these frames draw, or that frames draw which they keep
    /// views of in turn.
    InFlight(Vec<Arc<FrameOutcome>>),
    Submitted,
    /// It was dropped, or its submission failed.
    Lost,
}

impl FrameOutcome {
    /// Of a frame that keeps views which `earlier` frames draw.
    pub(in crate::frame) fn in_flight<'a>(earlier: impl Iterator<Item = &'a Arc<Self>>) -> Self {
        let mut pending: Vec<Arc<Self>> = Vec::new();
        let mut add = |frame: &Arc<Self>| {
            if !frame.is_submitted() && !pending.iter().any(|known| Arc::ptr_eq(known, frame)) {
                pending.push(Arc::clone(frame));
            }
        };
        for frame in earlier {
            if let State::InFlight(earlier) = &*frame.state.lock() {
                earlier.iter().for_each(&mut add);
            }
            add(frame);
        }
        Self { state: Mutex::new(State::InFlight(pending)) }
    }

    pub(in crate::frame) fn is_submitted(&self) -> bool {
        matches!(*self.state.lock(), State::Submitted)
    }

    /// Whether what the frame draws is lost, or will be, because a frame that it relies on is lost.
    pub(in crate::frame) fn is_lost(&self) -> bool {
        match &*self.state.lock() {
            // Each of them is older, so no two wait for each other's lock. Those that these rely on are among them.
            State::InFlight(earlier) => earlier.iter().any(|frame| matches!(*frame.state.lock(), State::Lost)),
            State::Submitted => false,
            State::Lost => true,
        }
    }

    pub(in crate::frame) fn submit(&self) {
        self.end(State::Submitted);
    }

    pub(in crate::frame) fn lose(&self) {
        self.end(State::Lost);
    }

    fn end(&self, state: State) {
        let before = std::mem::replace(&mut *self.state.lock(), state);
        // The earlier frames are not needed any more, which keeps the chains of frames short.
        drop(before);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(earlier: &[&Arc<FrameOutcome>]) -> Arc<FrameOutcome> {
        Arc::new(FrameOutcome::in_flight(earlier.iter().copied()))
    }

    /// The number of frames that it waits for.
    fn pending(frame: &FrameOutcome) -> usize {
        match &*frame.state.lock() {
            State::InFlight(pending) => pending.len(),
            State::Submitted | State::Lost => 0,
        }
    }

    #[test]
    fn a_frame_relies_on_all_earlier_ones_that_are_not_submitted_once() {
        let [one, other] = [frame(&[]), frame(&[])];
        let third = frame(&[&one, &other, &one]);
        assert_eq!(pending(&third), 2);
        let fourth = frame(&[&third, &one]);
        assert_eq!(pending(&fourth), 3);
        one.submit();
        assert_eq!(pending(&frame(&[&third, &one])), 2, "the third and the other");
        assert!(!third.is_lost() && !fourth.is_lost());
        other.lose();
        assert!(other.is_lost() && third.is_lost() && fourth.is_lost() && !one.is_lost());
    }

    #[test]
    fn a_frame_misses_a_view_until_the_frame_that_draws_it_is_submitted() {
        let [one, other] = [frame(&[]), frame(&[])];
        let kept = vec![(3, Arc::clone(&one)), (5, Arc::clone(&other))];
        let in_flight = InFlight { outcome: None, lost: Arc::default(), kept };
        assert_eq!(in_flight.missing_view(), Some(3));
        one.submit();
        assert_eq!(in_flight.missing_view(), Some(5));
        other.submit();
        assert_eq!(in_flight.missing_view(), None);
    }
}
