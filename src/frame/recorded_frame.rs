//! Recorded frames with their view queues, and their submission on the device thread.

use std::marker::PhantomData;
use std::sync::Arc;
use std::time::{Duration, Instant};

use super::encoders::PassRecording;
use super::views::FrameViews;
use super::views::view_cache::InFlight;
use super::{FrameError, FrameStatistics, SubmitError};
#[cfg(feature = "wgpu")]
use crate::backend::WgpuFrame;
use crate::backend::{Backend, BackendError, FrameFence, FrameRequest, GuardedBackend, ReadBack, ViewQueue};
use crate::fence::Fence;
use crate::process::{FramePlan, Pass};
use crate::scene::Camera;
use crate::task::{JobPanic, catch};
use crate::timeline::Timeline;
use crate::unwind::{CaughtSpan, Contained, discard};
use crate::view::RenderView;

/// A recorded frame. It borrows nothing, so the scene is free again, and it may be sent to the device thread. If it is
/// dropped without being submitted, the next frame draws all of its views, also those that it would have
/// [cached](crate::scene::Redraw). Frames that were recorded before it is dropped, and that keep a view which it draws,
/// are [refused](SubmitError::LostView). With wgpu, the thread that drops it then hands its uploads to the device,
/// which may call back for work that has finished: hold no lock that a callback takes.
#[must_use = "a frame is not drawn until it is submitted"]
pub struct RecordedFrame<B: Backend> {
    /// By view index.
    pub(super) queues: ViewQueues<B::Commands>,
    /// The passes of all queues in the order of the plan.
    pub(super) submission_order: Vec<Pass>,
    pub(super) plan: Arc<FramePlan>,
    pub(super) frame: Contained<B::Frame>,
    pub(super) statistics: FrameStatistics,
    pub(super) backend: GuardedBackend<B>,
    /// The number of its frame in the timeline, if that was on.
    pub(super) frame_number: Option<u64>,
    pub(super) in_flight: InFlight,
    pub(super) views: Arc<FrameViews>,
    pub(super) fences: FrameFences,
}

/// The fences of a recorded frame.
#[derive(Default)]
pub(super) struct FrameFences {
    /// Those that its submission waits for, each with the longest wait.
    awaited: Vec<(Fence, Duration)>,
    /// Those that the device sets.
    set: Vec<FrameFence>,
}

impl<B: Backend> RecordedFrame<B> {
    /// The frame's statistics.
    pub fn statistics(&self) -> &FrameStatistics {
        &self.statistics
    }

    /// The number of its frame in the [timeline](crate::timeline), if that was on while it was recorded.
    pub fn frame_number(&self) -> Option<u64> {
        self.frame_number
    }

    /// A fence that the device sets when it has done the frame up to this place (S 9.4). It is abandoned if the frame
    /// is dropped or refused.
    ///
    /// With wgpu each place but the end is a submission of its own. Where passes share a command encoder, the fence is
    /// set after the last of these.
    ///
    /// ```
    /// # use std::time::Duration;
    /// # use drawloom::{FencePoint, RecordedFrame, Submitter, backend::Backend};
    /// # fn submit<B: Backend>(mut recorded: RecordedFrame<B>, submitter: &Submitter<B>) -> Result<(), Box<dyn std::error::Error>> {
    /// let mirror_is_drawn = recorded.fence_at(FencePoint::View(1))?;
    /// let frame_is_drawn = recorded.fence_at(FencePoint::End)?;
    /// frame_is_drawn.on_set(|drawn| println!("{drawn:?}"));
    /// submitter.submit(recorded)?;
    /// mirror_is_drawn.wait(Duration::from_secs(10))?;
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`FrameError::UnknownPlace`] if the frame has no such pass or view, or the view is
    /// [cached](crate::scene::Redraw).
    pub fn fence_at(&mut self, place: FencePoint<'_>) -> Result<Fence, FrameError> {
        let process_name = |index: usize| self.plan.processes()[index].name.as_str();
        let passes = place.passes_before(&self.submission_order, process_name);
        let passes = passes.ok_or_else(|| FrameError::UnknownPlace { place: place.to_string() })?;
        let (setter, fence) = Fence::new(format!("{place} of {}", self.name()));
        let later = self.fences.set.partition_point(|fence| fence.passes <= passes);
        self.fences.set.insert(later, FrameFence { passes, setter });
        Ok(fence)
    }

    /// Makes the submission of the frame wait until the CPU sets a fence (S 9.4), at most as long as `limit`. Otherwise
    /// [`Submitter::submit`] returns [`SubmitError::Fence`], and drops the frame.
    ///
    /// Devices of wgpu cannot wait for the CPU themselves, so the device thread waits, and nothing behind this frame is
    /// submitted meanwhile.
    pub fn submit_after(&mut self, fence: &Fence, limit: Duration) {
        self.fences.awaited.push((fence.clone(), limit));
    }

    /// What messages call the frame.
    fn name(&self) -> String {
        self.frame_number.map_or_else(|| "a frame".to_owned(), |number| format!("frame {number}"))
    }

    /// The backend that it was recorded for.
    pub fn backend(&self) -> &B {
        self.backend.unguarded()
    }

    /// The views as they were recorded: those of the scene's cameras, in their order, then those of shadow maps.
    pub fn views(&self) -> &[RenderView] {
        &self.views.views
    }

    /// The camera that a view, by index, is drawn with. `None` if there is no [such view](Self::views).
    pub fn camera(&self, view: usize) -> Option<&Camera> {
        self.views.views.get(view).map(|view| &view.camera)
    }

    /// Has a view's target read back as a whole, as this frame leaves it, on any backend. It does not wait: ask the
    /// result when the frame is submitted, or when [its end](FencePoint::End) is reached.
    ///
    /// # Errors
    /// If there is no such target, or the backend cannot read it back.
    pub fn read_back_whole(&mut self, view: usize, target: impl AsRef<str>) -> Result<Box<dyn ReadBack>, BackendError> {
        self.backend.read_back(&mut self.frame, view, target.as_ref())
    }

    /// The queue of each view.
    pub fn queues(&self) -> &[ViewQueue<B::Commands>] {
        self.queues.as_slice()
    }
}

#[cfg(feature = "wgpu")]
impl<B: Backend<Frame = WgpuFrame>> RecordedFrame<B> {
    /// Reads back a rectangle of a view's target as this frame leaves it, without waiting: ask the result when the
    /// frame is submitted. `origin` is the rectangle's upper left pixel, `size` its width and height. For `WgpuBackend`
    /// and [layers](crate::backend::BackendLayer) around it.
    ///
    /// To find the object under the cursor, draw the indices of objects into a target of [`Format::R32Uint`], and read
    /// one pixel:
    ///
    /// ```no_run
    /// # use drawloom::{RecordedFrame, Submitter, backend::WgpuBackend, process::Target};
    /// # fn pick(mut recorded: RecordedFrame<WgpuBackend>, submitter: &Submitter<WgpuBackend>, cursor: [u32; 2])
    /// # -> Result<(), Box<dyn std::error::Error>> {
    /// const OBJECT_INDEX: Target = Target::new("object index");
    ///
    /// let under_cursor = recorded.read_back(0, OBJECT_INDEX, cursor, [1, 1])?;
    /// submitter.submit(recorded)?;
    /// // In this frame or a later one:
    /// if let Some(pixel) = under_cursor.try_read()? {
    ///     let object = u32::from_le_bytes(pixel.bytes[..4].try_into()?);
    /// }
    /// # Ok(()) }
    /// ```
    ///
    /// [`Format::R32Uint`]: crate::process::Format::R32Uint
    ///
    /// # Errors
    /// If there is no such target, it is [transient](crate::backend::WgpuBackend::transient_targets), the rectangle is
    /// empty or not in it, or is a part of a depth target, which is copied as a whole.
    pub fn read_back(
        &mut self,
        view: usize,
        target: impl AsRef<str>,
        origin: [u32; 2],
        size: [u32; 2],
    ) -> Result<crate::backend::WgpuReadBack, BackendError> {
        self.frame.read_back(view, target.as_ref(), [origin, size])
    }
}

/// Submits frames. It cannot leave the thread that built it, the device thread: the assert of M 10.3 as a type.
///
/// ```compile_fail
/// fn leave<B: drawloom::backend::Backend>(submitter: drawloom::Submitter<B>) {
///     std::thread::spawn(move || submitter);
/// }
/// ```
pub struct Submitter<B> {
    backend: GuardedBackend<B>,
    timeline: Arc<Timeline>,
    not_send: PhantomData<*const ()>,
}

impl<B: Backend> Submitter<B> {
    pub(super) fn new(backend: GuardedBackend<B>, timeline: Arc<Timeline>) -> Self {
        Self { backend, timeline, not_send: PhantomData }
    }

    /// Submits a frame: one view after the other, each with its whole queue, in the order of the plan's [view
    /// groups](crate::process::FramePlan::view_groups) (M listing 10.7). The engine submits frames in the order in
    /// which they were recorded; that is checked only where a frame keeps a view that an earlier one draws.
    ///
    /// # Errors
    /// If the frame is another renderer's, or another backend's, if the device refuses it, if a frame that draws a view
    /// which it keeps was not submitted, or if a fence that it [waits for](RecordedFrame::submit_after) is not set. If
    /// the device is lost, that is the error.
    pub fn submit(&self, recorded: RecordedFrame<B>) -> Result<SubmittedFrame<B>, SubmitError> {
        // Calls of the engine's code are caught one by one. Should one have been forgotten, the frame fails all the
        // same.
        let submitted = catch(|| self.submit_frame(recorded));
        submitted.unwrap_or_else(|JobPanic { message, .. }| Err(SubmitError::Panicked { message }))
    }

    fn submit_frame(&self, recorded: RecordedFrame<B>) -> Result<SubmittedFrame<B>, SubmitError> {
        let _span = CaughtSpan::new(|| tracing::debug_span!(target: "drawloom", "submit")).enter();
        if !self.backend.is(&recorded.backend) {
            return Err(SubmitError::ForeignFrame);
        }
        let missing_view = || recorded.in_flight.missing_view().and_then(|view| recorded.views.views.get(view));
        let lost_view = |view: &RenderView| SubmitError::LostView { view: view.name().to_owned() };
        missing_view().map_or(Ok(()), |view| Err(lost_view(view)))?;
        for (fence, limit) in &recorded.fences.awaited {
            fence.wait_as(*limit, || format!("the submission of {}", recorded.name()))?;
        }
        let _timeline_span = recorded.frame_number.map(|number| self.timeline.span_of(Some(number), "submit"));
        let start = Instant::now();
        let RecordedFrame { queues, submission_order, frame, mut statistics, in_flight, fences, .. } = recorded;
        let queues = queues.in_submission_order(&submission_order);
        let submission = self.backend.submit(frame.into_inner(), queues, fences.set);
        let submission = submission.map_err(|panic| SubmitError::Panicked { message: panic.message })??;
        in_flight.submitted();
        statistics.stages.submit = start.elapsed();
        Ok(SubmittedFrame { submission, statistics })
    }

    /// The backend.
    pub fn backend(&self) -> &B {
        self.backend.unguarded()
    }

    /// Whether it submits to this backend.
    pub(super) fn submits_to(&self, backend: &B) -> bool {
        std::ptr::eq(Arc::as_ptr(self.backend.unguarded()), backend)
    }

    /// What a submitter on another thread is made of, in place of this one.
    pub(super) fn into_parts(self) -> (GuardedBackend<B>, Arc<Timeline>) {
        (self.backend, self.timeline)
    }
}

/// A frame that was submitted.
pub struct SubmittedFrame<B: Backend> {
    /// The backend's view of the submission.
    pub submission: B::Submission,
    /// The frame's statistics.
    pub statistics: FrameStatistics,
}

/// The queues of a frame, by view index.
pub(super) struct ViewQueues<T>(Vec<ViewQueue<T>>);

impl<T> ViewQueues<T> {
    pub(super) fn as_slice(&self) -> &[ViewQueue<T>] {
        &self.0
    }

    /// The queues that are submitted one after the other: each view's whole queue, or several for a view whose passes
    /// alternate with those of other views.
    pub(super) fn in_submission_order(mut self, order: &[Pass]) -> Vec<ViewQueue<T>> {
        let passes_by_view = order.chunk_by(|one, next| one.view_index == next.view_index);
        let take = |passes: &[Pass]| {
            let view = passes[0].view_index;
            // A whole queue is moved, not copied: nothing is left to split off.
            let later = self.0[view].passes.split_off(passes.len());
            ViewQueue { view, passes: std::mem::replace(&mut self.0[view].passes, later) }
        };
        passes_by_view.map(take).collect()
    }
}

/// Commands are the backend's: their destructors may panic.
impl<T> Drop for ViewQueues<T> {
    fn drop(&mut self) {
        self.0.iter_mut().flat_map(|queue| queue.passes.drain(..)).for_each(discard);
    }
}

/// One queue for each view, its passes in the order of the plan.
///
/// # Errors
/// If a pass is not finished. This is a bug in Drawloom.
pub(super) fn view_queues<B: Backend>(
    request: &FrameRequest<'_>,
    recordings: &mut [PassRecording<B>],
) -> Result<ViewQueues<B::Commands>, FrameError> {
    // A process has at most one pass in a view.
    let empty = |view| ViewQueue { view, passes: Vec::with_capacity(request.plan.processes().len()) };
    let mut queues = ViewQueues((0..request.views.len()).map(empty).collect());
    for (&pass, recording) in request.passes.iter().zip(recordings) {
        let missing = || BackendError::BrokenRule { rule: "every pass is finished before its frame is".to_owned() };
        queues.0[pass.view_index].passes.push((pass, recording.take().ok_or_else(missing)?));
    }
    Ok(queues)
}

/// A place in the order in which a frame is submitted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FencePoint<'a> {
    /// After everything that a process draws in a view, and all that is submitted before that.
    Pass {
        /// The process's name.
        process: &'a str,
        /// The view's index.
        view: usize,
    },
    /// After all passes of a view, by index.
    View(usize),
    /// After the whole frame, its read-backs included.
    End,
}

impl FencePoint<'_> {
    /// The number of passes before the place, of a frame whose passes are submitted in this order. `None` if the frame
    /// has no such pass, as for views that are [cached](crate::scene::Redraw).
    pub(super) fn passes_before<'a>(self, order: &[Pass], process_name: impl Fn(usize) -> &'a str) -> Option<usize> {
        let is_last = |pass: &Pass| match self {
            Self::Pass { process, view } => pass.view_index == view && process_name(pass.process_index) == process,
            Self::View(view) => pass.view_index == view,
            Self::End => true,
        };
        match self {
            Self::End => Some(order.len()),
            Self::Pass { .. } | Self::View(_) => order.iter().rposition(is_last).map(|last| last + 1),
        }
    }
}

impl std::fmt::Display for FencePoint<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Pass { process, view } => write!(formatter, "process {process:?} in view {view}"),
            Self::View(view) => write!(formatter, "view {view}"),
            Self::End => write!(formatter, "the end"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fence_point_comes_after_the_last_of_its_passes() {
        let pass = |(process_index, view_index)| Pass { process_index, view_index };
        let order = [(0, 0), (1, 0), (0, 1), (1, 0), (1, 1)].map(pass);
        let passes_before = |point: FencePoint<'_>| point.passes_before(&order, |process| ["one", "other"][process]);
        let of_pass = |process, view| passes_before(FencePoint::Pass { process, view });
        assert_eq!([of_pass("one", 0), of_pass("other", 0)], [Some(1), Some(4)]);
        assert_eq!([of_pass("one", 1), of_pass("other", 1)], [Some(3), Some(5)]);
        assert_eq!([of_pass("third", 0), of_pass("one", 2)], [None, None]);
        assert_eq!([0, 1, 2].map(|view| passes_before(FencePoint::View(view))), [Some(4), Some(5), None]);
        assert_eq!(passes_before(FencePoint::End), Some(5));
    }

    #[test]
    fn a_fence_point_is_named_by_process_and_view() {
        let points = [FencePoint::Pass { process: "lights", view: 2 }, FencePoint::View(1), FencePoint::End];
        assert_eq!(points.map(|point| point.to_string()), [r#"process "lights" in view 2"#, "view 1", "the end"]);
    }
}
