//! What an engine has workers compute.

use drawloom::backend::Picture;
use drawloom::scene::Camera;
use drawloom::task::Scheduler;

/// A step of post-processing that the CPU computes, from the pixels of a frame that the device has drawn.
///
/// ```
/// use drawloom::backend::Picture;
/// use drawloom_async_post::{StepFrame, AsyncStep};
///
/// /// The negative of a picture of bytes.
/// struct Negative;
///
/// impl AsyncStep for Negative {
///     fn name(&self) -> &str {
///         "negative"
///     }
///
///     fn compute(&self, frame: &StepFrame<'_>) -> Picture {
///         let mut picture = frame.picture.clone();
///         // A row at a time, on all workers that have nothing else to do.
///         let rows = picture.bytes.chunks_mut(picture.width as usize * 4);
///         let outcome = frame.scheduler.parallel_for_each(rows, |row, _worker| {
///             row.chunks_mut(4).for_each(|pixel| pixel[..3].iter_mut().for_each(|channel| *channel = 255 - *channel));
///         });
///         outcome.expect("a row does not panic");
///         picture
///     }
/// }
/// ```
pub trait AsyncStep: Send + Sync + 'static {
    /// Its name in errors, statistics and the timeline, and the first part of the names of its processes and its
    /// targets. Called once, by [`AsyncPost::new`](crate::AsyncPost::new). If it panics, that is
    /// [reported](crate::AsyncPost::take_errors), and the step is called `a step without a name`.
    fn name(&self) -> &str;

    /// Computes the step, in a [background job](Scheduler::background): on a worker that nothing else needs. A later
    /// frame samples what it returns, in any size, and any [format that can be
    /// filtered](drawloom::process::Format::is_filterable).
    ///
    /// Calls for one view do not overlap, unless the view was absent for a frame. Calls for several views may. If it
    /// panics, the result is dropped, and [reported](crate::AsyncPost::take_errors).
    fn compute(&self, frame: &StepFrame<'_>) -> Picture;
}

/// What a step computes from.
pub struct StepFrame<'a> {
    /// The pixels of the [source](crate::StepSource), as the device left them.
    pub picture: &'a Picture,
    /// The camera that the frame was drawn with.
    pub camera: &'a Camera,
    /// The number of the frame: how many had [begun](crate::AsyncPost::begin_frame) until it began, itself included.
    pub number: u64,
    /// The workers: loops that the step opens on it are background work, as the step is.
    pub scheduler: &'a Scheduler,
}
