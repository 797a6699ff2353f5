//! A backend that fails where a test wants it to.

use std::ops::Range;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use drawloom::backend::{
    Backend, BackendError, BackendLayer, FrameFence, FrameRequest, PassRequest, Picture, ViewQueue,
};
use drawloom::command::DrawState;
use drawloom::process::{Draws, FramePlan, ShaderResource};
use drawloom::quality::Quality;
use drawloom_async_post::UploadPicture;

/// Passes calls on to another backend, counts them, and fails one of them.
///
/// ```
/// use std::sync::Arc;
///
/// use drawloom::Renderer;
/// use drawloom::backend::NullBackend;
/// use drawloom::process::Deferred;
/// use drawloom::task::Scheduler;
/// use drawloom_testing::fault_injection::{CallKind, Fault, FaultyBackend};
/// use drawloom_testing::scenes::field;
///
/// let builder = Renderer::builder(FaultyBackend::new(NullBackend)).pipeline(Deferred::to_picture());
/// let (mut renderer, submitter) = builder.build(Arc::new(Scheduler::new(1)?))?;
/// renderer.backend().inject(CallKind::Finish, 2, Fault::OutOfMemory);
/// let scene = field(10);
/// let error = renderer.record(scene.as_scene_ref()).err().expect("the third pass fails");
/// let failed = renderer.backend().failed_call().expect("the fault came");
/// assert!(error.to_string().contains(&failed.process));
/// // The next frame is complete.
/// submitter.submit(renderer.record(scene.as_scene_ref())?)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct FaultyBackend<B> {
    inner: B,
    joins_passes: bool,
    state: Mutex<State>,
}

/// What a call asks of a backend. Calls that cannot fail have no kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CallKind {
    /// [`Backend::begin`].
    Begin,
    /// [`FrameRecorder::upload_objects`](drawloom::backend::FrameRecorder::upload_objects).
    UploadObjects,
    /// [`FrameRecorder::prepare`](drawloom::backend::FrameRecorder::prepare).
    Prepare,
    /// [`FrameRecorder::record`](drawloom::backend::FrameRecorder::record).
    Record,
    /// [`FrameRecorder::finish`](drawloom::backend::FrameRecorder::finish) of one pass.
    Finish,
    /// [`FrameRecorder::finish`](drawloom::backend::FrameRecorder::finish) of several passes, which fails in the
    /// middle: the passes of the first half are finished.
    FinishTogether,
    /// [`Backend::submit`].
    Submit,
    /// [`Backend::prepare_pipelines`].
    PreparePipelines,
}

impl CallKind {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Begin,
        Self::UploadObjects,
        Self::Prepare,
        Self::Record,
        Self::Finish,
        Self::FinishTogether,
        Self::Submit,
        Self::PreparePipelines,
    ];
}

/// What a call does instead of what it should.
#[derive(Clone)]
pub enum Fault {
    /// Says that the device is lost.
    DeviceLost,
    /// Says that the device has no memory.
    OutOfMemory,
    /// Says that the device refuses.
    Validation,
    /// Says that the device has less room than it claimed.
    Limit,
    /// Panics.
    Panic,
    /// Does what it should, after this time.
    Delay(Duration),
    /// Does what it should, after this function: one that loses a device, for example.
    After(Arc<dyn Fn() + Send + Sync>),
}

/// A call that failed. The names are empty where the call does not belong to a pass.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FailedCall {
    /// What was called.
    pub kind: CallKind,
    /// The name of the pass's process.
    pub process: String,
    /// The name of the pass's view.
    pub view: String,
}

#[derive(Default)]
struct State {
    /// The number of calls, by kind.
    counts: [usize; CallKind::ALL.len()],
    /// The call that is to fail, by its index among those of its kind.
    next: Option<(CallKind, usize, Fault)>,
    failed: Option<FailedCall>,
}

impl<B> FaultyBackend<B> {
    /// A backend without a fault.
    pub fn new(inner: B) -> Self {
        Self { inner, joins_passes: false, state: Mutex::default() }
    }

    /// Has passes share encoders, as many as the trait allows, even if the other backend finishes each alone.
    pub fn joining_passes(self) -> Self {
        Self { joins_passes: true, ..self }
    }

    /// Fails a call, once: of the calls of this kind from now on, that of this index. Counts begin anew.
    pub fn inject(&self, kind: CallKind, index: usize, fault: Fault) {
        *self.state() = State { next: Some((kind, index, fault)), ..State::default() };
    }

    /// Takes back a fault that did not come. Counts begin anew.
    pub fn clear(&self) {
        *self.state() = State::default();
    }

    /// The number of calls of a kind since the latest [`inject`](Self::inject) or [`clear`](Self::clear).
    pub fn calls(&self, kind: CallKind) -> usize {
        self.state().counts[kind as usize]
    }

    /// The call that failed since then.
    pub fn failed_call(&self) -> Option<FailedCall> {
        self.state().failed.clone()
    }

    /// Counts a call, and fails it if it is the one that is to fail.
    ///
    /// # Errors
    /// The fault.
    ///
    /// # Panics
    /// If that is the fault.
    fn call(&self, kind: CallKind, pass: Option<&PassRequest<'_>>) -> Result<(), BackendError> {
        self.fault_of(kind, pass).map_or(Ok(()), |fault| fault.happen())
    }

    /// Counts a call, and tells how it fails.
    fn fault_of(&self, kind: CallKind, pass: Option<&PassRequest<'_>>) -> Option<Fault> {
        let mut state = self.state();
        let index = state.counts[kind as usize];
        state.counts[kind as usize] += 1;
        let (.., fault) = state.next.take_if(|next| (next.0, next.1) == (kind, index))?;
        let process = pass.map(|request| &request.frame.plan.processes()[request.pass.process_index].name);
        let view = pass.map(|request| request.frame.views[request.pass.view_index].name());
        let (process, view) = (process.cloned().unwrap_or_default(), view.unwrap_or_default().to_owned());
        state.failed = Some(FailedCall { kind, process, view });
        Some(fault)
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Fault {
    fn happen(self) -> Result<(), BackendError> {
        let label = || String::from("an injected fault");
        match self {
            Self::DeviceLost => Err(BackendError::DeviceLost { message: label() }),
            Self::OutOfMemory => Err(BackendError::OutOfMemory { label: label() }),
            Self::Validation => Err(BackendError::Validation { label: label(), message: String::from("as requested") }),
            Self::Limit => Err(BackendError::Limit { limit: "max_injected", allowed: 0, needed: 1 }),
            Self::Panic => panic!("an injected fault"),
            Self::Delay(time) => {
                thread::sleep(time);
                Ok(())
            }
            Self::After(function) => {
                function();
                Ok(())
            }
        }
    }
}

impl<B: Backend> BackendLayer for FaultyBackend<B> {
    type Inner = B;

    fn inner(&self) -> &B {
        &self.inner
    }

    fn prepare_pipelines(
        &self,
        plan: &FramePlan,
        draws: &[Draws<'_>],
        states: &[Vec<DrawState>],
        quality: &Quality,
    ) -> Result<(), BackendError> {
        self.call(CallKind::PreparePipelines, None)?;
        self.inner.prepare_pipelines(plan, draws, states, quality)
    }

    fn begin(&self, request: &FrameRequest<'_>) -> Result<B::Frame, BackendError> {
        self.call(CallKind::Begin, None)?;
        self.inner.begin(request)
    }

    fn upload_objects(
        &self,
        frame: &B::Frame,
        request: &FrameRequest<'_>,
        blocks: Range<usize>,
    ) -> Result<(), BackendError> {
        self.call(CallKind::UploadObjects, None)?;
        self.inner.upload_objects(frame, request, blocks)
    }

    fn prepare(&self, frame: &B::Frame, pass: &PassRequest<'_>) -> Result<(), BackendError> {
        self.call(CallKind::Prepare, Some(pass))?;
        self.inner.prepare(frame, pass)
    }

    fn record(
        &self,
        frame: &B::Frame,
        pass: &PassRequest<'_>,
        parts: Range<usize>,
        emit: &mut dyn FnMut(B::Part),
    ) -> Result<(), BackendError> {
        self.call(CallKind::Record, Some(pass))?;
        self.inner.record(frame, pass, parts, emit)
    }

    fn shares_encoder(&self, frame: &B::Frame, pass: usize) -> bool {
        self.joins_passes && pass > 0 || self.inner.shares_encoder(frame, pass)
    }

    fn finish(
        &self,
        frame: &B::Frame,
        passes: &[PassRequest<'_>],
        parts: &mut [Vec<B::Part>],
        emit: &mut dyn FnMut(B::Commands),
    ) -> Result<(), BackendError> {
        if let [pass] = passes {
            self.call(CallKind::Finish, Some(pass))?;
        } else {
            let half = passes.len() / 2;
            if let Some(fault) = self.fault_of(CallKind::FinishTogether, passes.get(half)) {
                self.inner.finish(frame, &passes[..half], &mut parts[..half], emit)?;
                fault.happen()?;
                return self.inner.finish(frame, &passes[half..], &mut parts[half..], emit);
            }
        }
        self.inner.finish(frame, passes, parts, emit)
    }

    fn submit(
        &self,
        frame: B::Frame,
        queues: Vec<ViewQueue<B::Commands>>,
        fences: Vec<FrameFence>,
    ) -> Result<B::Submission, BackendError> {
        self.call(CallKind::Submit, None)?;
        self.inner.submit(frame, queues, fences)
    }
}

impl<B: UploadPicture> UploadPicture for FaultyBackend<B> {
    fn upload_picture(&self, picture: &Picture) -> Result<Option<ShaderResource<'static>>, BackendError> {
        self.inner.upload_picture(picture)
    }
}
