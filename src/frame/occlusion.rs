//! Occlusion in a frame: in which views it can be, what hides there, and whether it pays.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

use super::jobs::FrameJobs;
use super::phase::{FrameContext, FrameTables};
use crate::backend::Backend;
use crate::command::{Blending, Selection};
use crate::process::{Draws, FramePlan, Pass};
use crate::scene::{Blend, SceneRef, ViewKind};
use crate::view::{OcclusionCuller, RenderView};

/// What a view's objects hide in one frame; kept from frame to frame so that its memory is reused.
#[derive(Debug, Default)]
pub(super) struct ViewOcclusion {
    pub(super) occlusion: OcclusionCuller,
    is_on: bool,
    hidden: AtomicUsize,
    /// What the view took: looking for what is hidden, and drawing the rest.
    nanoseconds: AtomicU64,
}

impl ViewOcclusion {
    /// Starts a frame, in which what is hidden is looked for in squares of so many pixels, or not at all.
    pub(super) fn reset(&mut self, view: &RenderView, side: Option<u32>) {
        self.is_on = side.is_some();
        *self.hidden.get_mut() = 0;
        *self.nanoseconds.get_mut() = 0;
        if let Some(side) = side {
            self.occlusion.reset(view, side);
        }
    }

    pub(super) fn is_on(&self) -> bool {
        self.is_on
    }

    /// Takes note of objects that are hidden.
    pub(super) fn hide(&self, objects: usize) {
        // Relaxed, here and below: they are sums, which are read when all jobs have ended.
        self.hidden.fetch_add(objects, Ordering::Relaxed);
    }

    /// How many objects are hidden.
    pub(super) fn hidden(&self) -> usize {
        self.hidden.load(Ordering::Relaxed)
    }

    /// Takes note of a job.
    pub(super) fn note(&self, took: Duration) {
        self.nanoseconds.fetch_add(took.as_nanos() as u64, Ordering::Relaxed);
    }

    /// Thread time in nanoseconds.
    pub(super) fn took(&self) -> u64 {
        self.nanoseconds.load(Ordering::Relaxed)
    }
}

/// Which objects hide others in a view: those that one of these takes. `None` where nothing may be left out, because something
/// could be seen through what is in front of it: objects that do not test the one depth there is, that test it before all that hides
/// is drawn or before it is cleared again, or that are drawn into other targets than what hides them. Shadow maps show what is hidden from elsewhere.
pub(super) fn occluders(
    plan: &FramePlan,
    draws: &[Draws<'_>],
    passes: &[Pass],
    (index, view): (usize, &RenderView),
) -> Option<Vec<Selection>> {
    if view.kind() == ViewKind::Shadow {
        return None;
    }
    // Passes come in the order in which they are drawn.
    let of_view = || passes.iter().filter(|pass| pass.view == index);
    let depth_of = |pass: &Pass| plan.processes()[pass.process].declaration.depth();
    let colors_of = |pass: &Pass| -> Vec<&str> {
        plan.processes()[pass.process].declaration.colors().map(|(target, _)| target).collect()
    };
    let (mut depth, mut colors, mut tests_only, mut occluders) = (None, Vec::new(), false, Vec::new());
    for pass in of_view() {
        let Some(selection) = draws[pass.process].selection() else { continue };
        let (target, access) = depth_of(pass)?;
        if *depth.get_or_insert(target) != target {
            return None;
        }
        if access.writes() && draws[pass.process].hides() && selection.blending != Blending::Blended {
            let own = colors_of(pass);
            if tests_only || !(colors.is_empty() || own.is_empty() || own == colors) {
                return None;
            }
            if !own.is_empty() {
                colors = own;
            }
            occluders.push(selection);
        } else {
            tests_only = true;
        }
    }
    let clears = |pass: &&Pass| depth_of(pass).is_some_and(|(target, access)| depth == Some(target) && !access.reads());
    (of_view().filter(clears).count() <= 1 && !occluders.is_empty()).then_some(occluders)
}

impl FrameTables {
    /// Prepares to look for what is hidden, in squares of `side` pixels, in those views where it can be and pays.
    pub(super) fn reset_occlusion(
        &mut self,
        scene: &SceneRef<'_>,
        views: &[RenderView],
        jobs: &FrameJobs,
        side: Option<u32>,
    ) {
        if side.is_some() {
            self.occluder_meshes.sync(scene.assets);
        }
        for (index, view) in views.iter().enumerate() {
            let is_on = jobs.occluders[index].is_some() && jobs.payoffs[index].is_on();
            self.occlusion[index].reset(view, side.filter(|side| is_on && has_room(view, *side)));
        }
    }

    /// Takes in what each view took in the frame that has ended, of those in which what is hidden is looked for.
    pub(super) fn learn_payoffs(&self, occluders: &[Option<Vec<Selection>>], payoffs: &mut [Payoff]) {
        for (view, payoff) in payoffs.iter_mut().enumerate().filter(|(view, _)| occluders[*view].is_some()) {
            let occlusion = &self.occlusion[view];
            payoff.learn(occlusion.took(), self.visible[view].count() + occlusion.hidden());
        }
    }
}

/// Whether a view's picture is not too large to look for what is hidden in it: no backend draws what has more than 2²⁴ squares of
/// 16 pixels, and finer ones would take more memory than the picture.
fn has_room(view: &RenderView, side: u32) -> bool {
    let [columns, rows] = view.camera.size.map(|pixels| u64::from(pixels.div_ceil(side.max(1))));
    columns * rows <= 1 << 24
}

/// Chooses, of what a view sees, what may hide the rest.
pub(super) fn choose_occluders<B: Backend>(frame: &FrameContext<'_, B>, view: usize) {
    let FrameTables { objects, visible, occlusion, occluder_meshes, .. } = frame.tables;
    let occluders = frame.occluders[view].as_deref().unwrap_or_default();
    occlusion[view].occlusion.select_occluders(frame.request.scene, objects, &visible[view], occluder_meshes, |draw| {
        let is_drawn = |selection: &Selection| selection.contains(draw.state.blend(), draw.material);
        draw.state.blend() == Blend::None && occluders.iter().any(is_drawn)
    });
}

/// Whether looking for what is hidden pays in a view: found out by trying it and leaving it out in turns, for a few frames each,
/// and again after a while. What counts is the thread time of all that the view's objects take from then on, for each of those in
/// its frustum. The picture is the same with and without.
#[derive(Clone, Debug)]
pub(super) struct Payoff {
    /// Frames since the last trial began.
    frame: u32,
    /// The least nanoseconds an object in the latest trial, with and without.
    with: f64,
    without: f64,
}

impl Payoff {
    /// Frames of a trial with, and as many without: the first of each finds things as the others left them, and does not count.
    const TRIAL: u32 = 3;
    /// From one trial to the next where it did not pay; and where it did, since frames without are then the longer ones.
    const RETRY: u32 = 60;
    const RETRY_PAYING: u32 = 600;

    /// Whether the next frame looks for what is hidden.
    pub(super) fn is_on(&self) -> bool {
        match self.frame / Self::TRIAL {
            0 => true,
            1 => false,
            _ => self.pays(),
        }
    }

    fn pays(&self) -> bool {
        self.with <= self.without
    }

    /// Takes in what a frame took with `objects` in the view's frustum.
    pub(super) fn learn(&mut self, nanoseconds: u64, objects: usize) {
        if objects == 0 {
            return;
        }
        if self.frame == 0 {
            (self.with, self.without) = (f64::INFINITY, f64::INFINITY);
        }
        let cost = nanoseconds as f64 / objects as f64;
        let counts = !self.frame.is_multiple_of(Self::TRIAL);
        match self.frame / Self::TRIAL {
            0 if counts => self.with = self.with.min(cost),
            1 if counts => self.without = self.without.min(cost),
            _ => {}
        }
        let retry = if self.pays() { Self::RETRY_PAYING } else { Self::RETRY };
        self.frame = if self.frame + 1 >= retry { 0 } else { self.frame + 1 };
    }
}

impl Default for Payoff {
    fn default() -> Self {
        Self { frame: 0, with: f64::INFINITY, without: f64::INFINITY }
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;

    /// How many of so many frames are with, where frames take so long with and without.
    fn frames_with(payoff: &mut Payoff, frames: usize, [with, without]: [u64; 2]) -> usize {
        let mut count = 0;
        for frame in 0..frames {
            let is_on = payoff.is_on();
            count += usize::from(is_on);
            // Now and then the system takes the processor away.
            let disturbed = if frame % 7 == 3 { 50 } else { 1 };
            payoff.learn(if is_on { with } else { without } * 1000 * disturbed, 1000);
        }
        count
    }

    #[test]
    fn it_is_tried_at_first_and_kept_only_where_it_pays() {
        let mut payoff = Payoff::default();
        assert!((0..3).all(|_| frames_with(&mut payoff, 1, [100, 300]) == 1));
        assert_eq!(frames_with(&mut payoff, 3, [100, 300]), 0);
        assert_eq!(frames_with(&mut payoff, 594, [100, 300]), 594);
        let mut payoff = Payoff::default();
        let share = frames_with(&mut payoff, 6000, [300, 100]);
        assert_eq!(share, 300, "3 in 60 are tried");
    }

    #[test]
    fn what_changes_is_found_out() {
        let mut payoff = Payoff::default();
        frames_with(&mut payoff, 600, [300, 100]);
        frames_with(&mut payoff, 60, [100, 300]);
        assert!(frames_with(&mut payoff, 600, [100, 300]) > 590);
        frames_with(&mut payoff, 600, [300, 100]);
        assert!(frames_with(&mut payoff, 600, [300, 100]) < 40);
    }

    #[test]
    fn an_empty_view_says_nothing() {
        let mut payoff = Payoff::default();
        payoff.learn(1_000_000, 0);
        assert_eq!((payoff.frame, payoff.is_on()), (0, true));
    }
}
