//! A loop of frames with a device thread of its own.

mod slot;

use std::io;
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

pub use slot::{Buffering, FinishedFrame, FrameLoopError, FrameSlot, FrameTimes};

use self::slot::LoopQueues;
use self::slot::{AfterSubmission, AwaitedFrame, DeviceTask, FrameQueues, QueuedFrame, Submission};
use super::{FencePoint, RecordedFrame, Renderer, Submitter};
use crate::backend::{Backend, BackendError};
use crate::fence::{Fence, FenceError};
use crate::task::{JobPanic, catch};
use crate::unwind::{Contained, discard, discard_all};

/// Keeps a few frames in flight: it owns the device thread, which submits recorded frames, and keeps the engine from
/// running further ahead of the device than its [`Buffering`] says (S figures 9.1 and 9.2). An engine may use it, or
/// call [`Submitter::submit`] where it likes.
///
/// The engine's thread updates its world and records; the world is its own again when recording ends (L 3), so it
/// updates and records the next frame while the device thread submits this one and the device draws. The order of an
/// iteration is that of this example: what it draws depends on the input after [`begin`](Self::begin), so that is where
/// [latency](FrameTimes::latency) is measured from.
///
/// ```
/// # use std::sync::Arc;
/// # use drawloom::backend::NullBackend;
/// # use drawloom::glam::DVec3;
/// # use drawloom::process::Deferred;
/// # use drawloom::scene::{Camera, Scene};
/// # use drawloom::task::Scheduler;
/// use drawloom::{Buffering, FrameLoop, Renderer};
///
/// # let scheduler = Arc::new(Scheduler::new(2)?);
/// # let mut world = Scene::new();
/// # world.cameras.push(Camera::looking_at("main", DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO));
/// let (renderer, submitter) = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).build(scheduler)?;
/// let mut frames = FrameLoop::new(renderer, submitter, Buffering::Double)?;
/// for _ in 0..3 {
///     // Waits while two frames are in flight.
///     let (slot, finished) = frames.begin();
///     for frame in finished {
///         frame.outcome?;
///         println!("frame {}: {:?} from the input to the picture", frame.number, frame.times.latency());
///     }
///     // Here the engine reads its input, and updates the world.
///     let recorded = frames.renderer().record(world.as_scene_ref())?;
///     // The world is free again.
///     slot.submit(recorded);
/// }
/// let (_renderer, last_frames) = frames.finish();
/// assert!(last_frames.iter().all(|frame| frame.outcome.is_ok()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct FrameLoop<B: Backend>
where
    B::Submission: Send,
{
    /// `None` once it is handed back.
    renderer: Option<Renderer<B>>,
    queues: Arc<FrameQueues<B>>,
    threads: Vec<JoinHandle<()>>,
    /// The number of frames begun.
    begun: u64,
}

impl<B: Backend> FrameLoop<B>
where
    B::Submission: Send,
{
    /// How long the device may take for a frame, if [nothing else](Self::set_device_limit) is set.
    pub const DEVICE_LIMIT: Duration = Duration::from_secs(30);

    /// A loop around a renderer. The submitter moves to a thread of the loop, so that thread is the device thread from
    /// now on.
    ///
    /// # Errors
    /// - [`FrameLoopError::ForeignSubmitter`] if the submitter is not the renderer's.
    /// - [`FrameLoopError::Thread`] if the OS starts no thread.
    pub fn new(renderer: Renderer<B>, submitter: Submitter<B>, buffering: Buffering) -> Result<Self, FrameLoopError> {
        if !submitter.submits_to(renderer.backend()) {
            return Err(FrameLoopError::ForeignSubmitter);
        }
        let queues = Arc::new(LoopQueues::new(buffering, Self::DEVICE_LIMIT));
        // A loop from the first thread on, so that dropping it ends a thread if the other one cannot start.
        let mut frames = Self { renderer: Some(renderer), queues, threads: Vec::new(), begun: 0 };
        // The submitter itself cannot leave its thread, which is what makes that the device thread; what it submits to
        // can.
        let (backend, timeline) = submitter.into_parts();
        frames.spawn("drawloom device", move |queues| submit_frames(Submitter::new(backend, timeline), queues))?;
        frames.spawn("drawloom completion", await_frames)?;
        Ok(frames)
    }

    fn spawn(&mut self, name: &str, work: impl FnOnce(&FrameQueues<B>) + Send + 'static) -> Result<(), FrameLoopError> {
        let queues = Arc::clone(&self.queues);
        let thread = thread::Builder::new().name(name.to_owned()).spawn(move || work(&queues));
        self.threads.push(thread.map_err(|error: io::Error| FrameLoopError::Thread(error))?);
        Ok(())
    }

    /// Begins a frame: waits until fewer frames are in flight than the buffering allows, and returns a slot for one,
    /// with the frames that finished since the last call, in their order. A frame that is dropped instead of submitted
    /// frees its slot.
    ///
    /// This waits no longer than the submissions of the frames in flight, and the [limit](Self::set_device_limit) of
    /// the device, allow. A slot that the engine holds counts as a frame in flight: to begin another frame while it
    /// holds all of them is to wait for itself. A thread of the loop, which calls [what follows a
    /// submission](FrameSlot::submit_then) and callbacks of fences, never waits here.
    pub fn begin(&mut self) -> (FrameSlot<B>, Vec<FinishedFrame<B>>) {
        let start = Instant::now();
        let finished = self.queues.take_slot(!self.is_on_own_thread());
        let begun = Instant::now();
        self.begun += 1;
        (FrameSlot::new(Arc::clone(&self.queues), self.begun, begun, begun - start), finished)
    }

    /// The renderer, to record a frame with.
    pub fn renderer(&mut self) -> &mut Renderer<B> {
        self.renderer.as_mut().expect("only `finish` takes the renderer, and with it the loop")
    }

    /// Sets the buffering from the next frame on.
    pub fn set_buffering(&mut self, buffering: Buffering) {
        self.queues.set_buffering(buffering);
    }

    /// The buffering.
    pub fn buffering(&self) -> Buffering {
        self.queues.buffering()
    }

    /// Sets how long the device may take from the submission of a frame until it is drawn. After that the frame is
    /// [reported](FrameLoopError::Unfinished) as failed, and the loop goes on without it.
    pub fn set_device_limit(&mut self, limit: Duration) {
        self.queues.set_device_limit(limit);
    }

    /// Puts another backend in the place of this one, from the next frame on, and waits for nothing: see
    /// [`Renderer::replace_backend`], which also says what is left to the engine. Frames that were recorded before
    /// still go to the backend before, if they are handed over before this call; a frame of it that comes later is
    /// reported as lost, with [`SubmitError::ForeignFrame`](super::SubmitError::ForeignFrame). Several frames in flight
    /// report one lost device, each for itself, so an engine replaces a device once and ignores what frames with
    /// smaller [numbers](FrameSlot::number) report of the one before.
    pub fn replace_backend(&mut self, backend: B) {
        let (backend, timeline) = self.renderer().replace_backend(backend).into_parts();
        self.queues.add_task(DeviceTask::ReplaceBackend(backend, timeline));
    }

    /// Waits for all frames in flight, ends the threads, and returns the renderer and the frames that finished since
    /// the last [`begin`](Self::begin). A slot that is still held is worth nothing afterwards: what it submits is
    /// dropped.
    ///
    /// A thread of the loop cannot wait for itself: if it calls this, or drops the loop, it goes on with the frames in
    /// flight afterwards, and nobody is told of those.
    pub fn finish(mut self) -> (Renderer<B>, Vec<FinishedFrame<B>>) {
        self.end_threads();
        let renderer = self.renderer.take().expect("nothing takes it before");
        (renderer, self.queues.take_finished())
    }

    fn is_on_own_thread(&self) -> bool {
        self.threads.iter().any(|thread| thread.thread().id() == thread::current().id())
    }

    fn end_threads(&mut self) {
        self.queues.close();
        if self.is_on_own_thread() {
            // The other thread may wait for this one. Both end by themselves, when the frames in flight are done.
            return self.threads.clear();
        }
        for thread in self.threads.drain(..) {
            // What the engine's code can panic in is caught on these threads, but for the destructors of thread-locals.
            if let Err(payload) = thread.join() {
                discard(payload);
            }
        }
    }
}

impl<B: Backend> Drop for FrameLoop<B>
where
    B::Submission: Send,
{
    fn drop(&mut self) {
        self.end_threads();
        discard(self.renderer.take());
        discard_all(self.queues.take_finished());
    }
}

/// The device thread: submits frames in the order in which they come.
fn submit_frames<B: Backend>(mut submitter: Submitter<B>, queues: &FrameQueues<B>)
where
    B::Submission: Send,
{
    while let Some(task) = queues.next_task() {
        let QueuedFrame { slot, recorded, after, recorded_at } = match task {
            DeviceTask::Submit(frame) => *frame,
            DeviceTask::ReplaceBackend(backend, timeline) => {
                submitter = Submitter::new(backend, timeline);
                continue;
            }
        };
        let start = Instant::now();
        let outcome = caught(|| submit_then(&submitter, recorded, after));
        queues.add_awaited(AwaitedFrame { slot, recorded_at, start, end: Instant::now(), outcome });
    }
    queues.end_submission();
}

/// Submits a frame, and calls what the engine does afterwards. If the submission fails, that is dropped, and not
/// called.
fn submit_then<B: Backend>(
    submitter: &Submitter<B>,
    mut recorded: RecordedFrame<B>,
    after: Contained<AfterSubmission<B>>,
) -> Result<Submission<B>, FrameLoopError> {
    let drawn = recorded.fence_at(FencePoint::End)?;
    let submitted = submitter.submit(recorded)?;
    // The device draws the frame, whatever the engine's code does.
    let called = caught(|| {
        after.into_inner()(&submitted);
        Ok(())
    });
    Ok((submitted, drawn, called))
}

/// Does a part of a frame's work on a thread of the loop, where a panic would leave all frames behind this one waiting
/// for ever.
fn caught<R>(work: impl FnOnce() -> Result<R, FrameLoopError>) -> Result<R, FrameLoopError> {
    catch(work).unwrap_or_else(|JobPanic { message, .. }| Err(FrameLoopError::Panicked { message }))
}

/// The completion thread: waits until the device has drawn the frames, one after the other.
fn await_frames<B: Backend>(queues: &FrameQueues<B>)
where
    B::Submission: Send,
{
    while let Some(AwaitedFrame { slot, recorded_at, start, end, outcome }) = queues.next_to_await() {
        let mut drawn_at = end;
        let mut wait = |drawn: &Fence| {
            match drawn.wait(queues.device_limit()) {
                Err(FenceError::Device { message, .. }) => return Err(BackendError::DeviceLost { message }.into()),
                other => other?,
            }
            drawn_at = drawn.set_at().unwrap_or(end).max(end);
            Ok(())
        };
        let outcome = outcome.and_then(|(submitted, drawn, called)| {
            let waited = caught(|| wait(&drawn)).and(called);
            // Of a frame that is reported as failed, nobody gets the submission.
            match waited {
                Ok(()) => Ok(submitted),
                Err(error) => {
                    discard(submitted);
                    Err(error)
                }
            }
        });
        let times = FrameTimes {
            waited: slot.waited(),
            begun: slot.begun(),
            recorded: recorded_at,
            submission_began: start,
            submitted: end,
            finished: if outcome.is_ok() { drawn_at } else { Instant::now() },
        };
        let number = slot.number();
        // Before the slot is free, so that whoever begins a frame in it hears of this one.
        queues.add_finished(FinishedFrame { number, outcome, times });
        drop(slot);
    }
}
