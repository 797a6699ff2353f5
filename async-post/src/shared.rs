//! What the handle, its processes, callbacks and jobs share.

use std::sync::{Arc, Weak};
use std::time::Instant;

use drawloom::backend::{Backend, BackendError, Picture};
use drawloom::fence::{Fence, FenceError};
use drawloom::process::{Format, ShaderResource};
use drawloom::scene::{Camera, ViewKind};
use drawloom::task::{JobPanic, Scheduler, catch};
use drawloom::{FencePoint, RecordedFrame};
use parking_lot::Mutex;

use crate::downsample::Downsample;
use crate::error::{AsyncPostError, AsyncPostErrorReason};
use crate::layer_view::view_picture;
use crate::selection::{Selection, SharedSelection};
use crate::source::StepSource;
use crate::statistics::AsyncPostStatistics;
use crate::step::{AsyncStep, StepFrame};
use crate::unwind::{Contained, emit};
use crate::upload_picture::UploadPicture;
use crate::view_work::{LayerTextures, Source, StepResult, ViewWork};

/// The maximum number of errors that are kept until the engine takes them.
pub(crate) const MAX_ERRORS: usize = 16;

/// What the handle, its processes, callbacks and jobs share.
pub(crate) struct Shared {
    pub(crate) name: Arc<str>,
    step: Contained<Box<dyn AsyncStep>>,
    pub(crate) source: StepSource,
    /// The target that is read back.
    pub(crate) target: String,
    scheduler: Arc<Scheduler>,
    state: Mutex<State>,
    /// What the processes draw.
    pub(crate) shown: SharedSelection,
}

#[derive(Default)]
struct State {
    /// How many frames have begun.
    frame: u64,
    /// The names of the current frame's main views.
    shown_in: Vec<String>,
    /// The backend that everything here belongs to.
    backend: Option<Weak<dyn UploadPicture>>,
    /// The textures of views without a result.
    neutral: Option<LayerTextures>,
    /// Frames whose pixels have not arrived, in the order of their numbers.
    in_flight: Vec<InFlight>,
    views: Vec<ViewWork>,
    /// How many views there have been.
    view_count: u64,
    errors: Vec<AsyncPostError>,
    /// Whether the device has failed since it last drew a frame.
    device_failed: bool,
    /// Whether the neutral textures failed when they were last made.
    neutral_failed: bool,
    /// Sources that are left out. They are dropped where the device may be used, which a fence's callback must not.
    retired: Vec<Source>,
}

struct InFlight {
    number: u64,
    drawn: Fence,
    /// Each with the identity of its view.
    sources: Vec<(u64, Source)>,
}

impl State {
    /// The work for a view, by name.
    fn view(&mut self, name: &str) -> &mut ViewWork {
        let index = self.views.iter().position(|work| work.view == name).unwrap_or_else(|| {
            self.view_count += 1;
            self.views.push(ViewWork::new(name.to_owned(), self.view_count));
            self.views.len() - 1
        });
        &mut self.views[index]
    }
}

impl Shared {
    pub(crate) fn new(scheduler: Arc<Scheduler>, step: impl AsyncStep, source: StepSource) -> Self {
        let (name, panic) = match catch(|| Arc::from(step.name())) {
            Ok(name) => (name, None),
            Err(panic) => (Arc::from("a step without a name"), Some(panic)),
        };
        let target = Downsample::target_of(&name, &source);
        let step: Box<dyn AsyncStep> = Box::new(step);
        let (step, state, shown) = (Contained::new(step), Mutex::default(), SharedSelection::default());
        let shared = Self { name, step, source, target, scheduler, state, shown };
        if let Some(JobPanic { message, .. }) = panic {
            let message = shared.add_error_of_all(&mut shared.state.lock(), AsyncPostErrorReason::Panicked { message });
            log(Some(message));
        }
        shared
    }

    /// See [`AsyncPost::begin_frame`](crate::AsyncPost::begin_frame).
    pub(crate) fn begin_frame(&self, backend: &Weak<dyn UploadPicture>, cameras: &[Camera]) {
        self.hear_from_device();
        self.belong_to(backend);
        if self.scheduler.workers() == 1 {
            self.work_on_all();
        }
        let neutral = (self.state.lock().neutral.is_none())
            .then(|| backend.upgrade().map_or(Ok(None), |backend| neutral_textures(&*backend)));
        let mut state = self.state.lock();
        let retired = std::mem::take(&mut state.retired);
        state.frame += 1;
        let message = match neutral {
            Some(Ok(neutral)) => {
                state.neutral = neutral;
                state.neutral_failed = false;
                None
            }
            Some(Err(error)) => {
                let is_told = !std::mem::replace(&mut state.neutral_failed, true);
                is_told.then(|| self.add_error_of_all(&mut state, error.into()))
            }
            None => None,
        };
        let of_main_views = || cameras.iter().filter(|camera| camera.kind == ViewKind::Main);
        let camera_of = |view: &str| of_main_views().find(|camera| camera.name == view);
        state.shown_in = of_main_views().map(|camera| camera.name.clone()).collect();
        let gone: Vec<_> = state.views.extract_if(.., |work| camera_of(&work.view).is_none()).collect();
        let (mut shown, mut of_other_sizes) = (Vec::new(), Vec::new());
        for work in &mut state.views {
            let size = camera_of(&work.view).map(|camera| camera.size);
            of_other_sizes.extend(work.latest.take_if(|latest| Some(latest.camera.size) != size));
            shown.extend(work.latest.clone().map(|latest| (work.view.clone(), latest)));
        }
        let selection = Selection::new(shown, state.neutral.as_ref());
        let before = self.shown.replace(selection);
        drop(state);
        // These may be the last references to what is on the device. To destroy that may wait for a thread that polls
        // the device, whose callbacks wait for the state.
        drop((retired, gone, of_other_sizes, before));
        log(message);
    }

    /// See [`AsyncPost::read_back`](crate::AsyncPost::read_back).
    pub(crate) fn read_back<B: Backend>(self: &Arc<Self>, recorded: &mut RecordedFrame<B>) {
        self.count_ages();
        let number = {
            let state = self.state.lock();
            let is_same = |backend: &Weak<dyn UploadPicture>| std::ptr::addr_eq(backend.as_ptr(), recorded.backend());
            if !state.backend.as_ref().is_some_and(is_same) {
                drop(state);
                return self.report_foreign_frame();
            }
            state.frame
        };
        let mut drawn: Vec<(usize, String)> = Vec::new();
        for (index, view) in recorded.views().iter().enumerate() {
            let is_source = view.kind() == ViewKind::Main && !view.is_cached();
            if is_source && drawn.iter().all(|(_, name)| name != view.name()) {
                drawn.push((index, view.name().to_owned()));
            }
        }
        let mut sources = Vec::new();
        for (index, view) in drawn {
            let Some(camera) = recorded.camera(index).cloned() else { continue };
            match recorded.read_back_whole(index, &self.target) {
                Ok(read_back) => {
                    let read_back = Contained::new(read_back);
                    let identity = self.state.lock().view(&view).identity;
                    sources.push((identity, Source { number, camera, read_back }));
                }
                Err(error) => self.fail_in_view(&view, number, error.into()),
            }
        }
        if sources.is_empty() {
            return;
        }
        // A frame always has an end.
        let Ok(drawn) = recorded.fence_at(FencePoint::End) else { return };
        self.state.lock().in_flight.push(InFlight { number, drawn: drawn.clone(), sources });
        let shared = Arc::downgrade(self);
        drawn.on_set(move |outcome| {
            if let Some(shared) = shared.upgrade() {
                shared.arrive(number, outcome);
            }
        });
    }

    /// See [`AsyncPost::latest`](crate::AsyncPost::latest).
    pub(crate) fn latest(&self, view: &str) -> Option<(u64, Arc<Picture>)> {
        let state = self.state.lock();
        let latest = state.views.iter().find(|work| work.view == view)?.latest.as_ref()?;
        Some((latest.number, Arc::clone(&latest.picture)))
    }

    /// See [`AsyncPost::take_errors`](crate::AsyncPost::take_errors).
    pub(crate) fn take_errors(&self) -> Vec<AsyncPostError> {
        std::mem::take(&mut self.state.lock().errors)
    }

    /// Has callbacks called for what the device has done.
    fn hear_from_device(&self) {
        let fences: Vec<_> = self.state.lock().in_flight.iter().map(|frame| frame.drawn.clone()).collect();
        // Not while the state is locked, as callbacks lock it. To ask for one that is not set asks for all.
        fences.iter().all(Fence::is_set);
    }

    /// Forgets everything that belongs to another backend.
    fn belong_to(&self, backend: &Weak<dyn UploadPicture>) {
        let mut state = self.state.lock();
        if state.backend.as_ref().is_some_and(|before| before.ptr_eq(backend)) {
            return;
        }
        let next = State {
            frame: state.frame,
            backend: Some(Weak::clone(backend)),
            view_count: state.view_count,
            errors: std::mem::take(&mut state.errors),
            ..State::default()
        };
        let before = std::mem::replace(&mut *state, next);
        drop(state);
        drop(before);
    }

    /// The device has drawn a frame, or will not.
    fn arrive(self: &Arc<Self>, number: u64, outcome: Result<(), FenceError>) {
        let (mut state, now) = (self.state.lock(), Instant::now());
        // Frames are drawn in their order, so with a drawn one come those before it. One that is dropped says nothing
        // of others.
        let has_arrived = |frame: &mut InFlight| match outcome {
            Ok(()) => frame.number <= number,
            Err(_) => frame.number == number,
        };
        let arrived: Vec<_> = state.in_flight.extract_if(.., has_arrived).collect();
        for (view, source) in arrived.into_iter().flat_map(|frame| frame.sources) {
            // The view may be gone, and another one of its name have come.
            let left_out = match state.views.iter_mut().find(|work| work.identity == view) {
                Some(work) if outcome.is_ok() => work.arrive(source, now),
                _ => Some(source),
            };
            state.retired.extend(left_out);
        }
        let message = match outcome {
            // The engine dropped the frame, or knows why it was refused.
            Err(FenceError::Abandoned { .. }) => None,
            Ok(()) => {
                state.device_failed = false;
                None
            }
            Err(error) => {
                let is_told = !std::mem::replace(&mut state.device_failed, true);
                is_told.then(|| self.add_error_of_all(&mut state, error.into()))
            }
        };
        drop(state);
        log(message);
        if self.scheduler.workers() > 1 {
            self.queue_jobs();
        }
    }

    /// Queues a job for each view whose source waits for one.
    fn queue_jobs(self: &Arc<Self>) {
        let mut state = self.state.lock();
        let waiting = state.views.iter_mut().filter_map(|work| work.needs_job().then_some(work.identity));
        let waiting: Vec<_> = waiting.collect();
        drop(state);
        for view in waiting {
            let shared = Arc::clone(self);
            // It reports what it has done to the state.
            drop(self.scheduler.background(move || {
                shared.work(view);
                // A job for each source, so that other background jobs have their turn.
                shared.queue_jobs();
            }));
        }
    }

    /// Computes the step for all views whose source waits.
    fn work_on_all(&self) {
        let views: Vec<_> = self.state.lock().views.iter().map(|work| work.identity).collect();
        views.into_iter().for_each(|view| self.work(view));
    }

    /// Computes the step for a view, by its identity, if its source waits.
    fn work(&self, view: u64) {
        let mut state = self.state.lock();
        let retired = std::mem::take(&mut state.retired);
        let backend = state.backend.clone();
        let source = state.views.iter_mut().find(|work| work.identity == view).and_then(ViewWork::start);
        drop(state);
        drop(retired);
        let Some(source) = source else { return };
        let number = source.number;
        let computed = catch(|| self.compute(source, backend.as_ref()));
        let result =
            computed.unwrap_or_else(|JobPanic { message, .. }| Err(AsyncPostErrorReason::Panicked { message }));
        let (result, error) = match result {
            Ok(result) => (Some(Arc::new(result)), None),
            Err(error) => (None, Some(error)),
        };
        let mut state = self.state.lock();
        // Otherwise the view is gone, or belonged to another backend.
        let Some(work) = state.views.iter_mut().find(|work| work.identity == view) else { return };
        let (is_told, before) = work.finish(result);
        let name = work.view.clone();
        let error = error.filter(|_| is_told).map(|reason| self.add_error(&mut state, name, number, reason));
        drop(state);
        drop(before);
        log(error);
    }

    fn compute(
        &self,
        source: Source,
        backend: Option<&Weak<dyn UploadPicture>>,
    ) -> Result<StepResult, AsyncPostErrorReason> {
        let _span = self.scheduler.timeline().span(self.name.to_string());
        let Source { number, camera, read_back } = source;
        let picture = read_back.read()?;
        drop(read_back);
        let frame = StepFrame { picture: &picture, camera: &camera, number, scheduler: &self.scheduler };
        let picture = self.step.compute(&frame);
        AsyncPostErrorReason::check(&picture)?;
        let textures = match backend.and_then(Weak::upgrade) {
            Some(backend) => layer_textures(&*backend, &picture, Some(&camera))?,
            None => None,
        };
        Ok(StepResult { number, camera, picture: Arc::new(picture), textures })
    }

    /// See [`AsyncPost::statistics`](crate::AsyncPost::statistics).
    pub(crate) fn statistics(&self) -> Vec<AsyncPostStatistics> {
        let (shown, state) = (self.shown.get(), self.state.lock());
        let of_view = |view: &String| {
            let work = state.views.iter().find(|work| work.view == *view);
            AsyncPostStatistics {
                step: self.name.to_string(),
                view: view.clone(),
                frame: state.frame,
                result: shown.result(view).map(|result| result.number),
                computed: work.map_or(0, |work| work.computed),
                skipped: work.map_or(0, |work| work.skipped),
                latest_took: work.map_or_else(Default::default, |work| work.latest_took),
            }
        };
        state.shown_in.iter().map(of_view).collect()
    }

    /// Adds to the timeline, if it is on, how old the results are that the frame shows.
    fn count_ages(&self) {
        // The timeline reads the clock, which may be the engine's code.
        let timeline = self.scheduler.timeline();
        if !timeline.is_on() {
            return;
        }
        for statistics in self.statistics() {
            if let Some(age) = statistics.age() {
                timeline.count(format!("age of {} in {}, frames", self.name, statistics.view), age as f64);
            }
        }
    }

    /// A frame is not of the renderer that `begin_frame` was called with.
    fn report_foreign_frame(&self) {
        let message = self.add_error_of_all(&mut self.state.lock(), AsyncPostErrorReason::ForeignFrame);
        log(Some(message));
    }

    /// Something failed for all views. Returns what is to be logged.
    fn add_error_of_all(&self, state: &mut State, reason: AsyncPostErrorReason) -> String {
        let number = state.frame;
        self.add_error(state, String::new(), number, reason)
    }

    /// Something failed for one view.
    fn fail_in_view(&self, view: &str, number: u64, reason: AsyncPostErrorReason) {
        let mut state = self.state.lock();
        let is_told = state.view(view).fail();
        let message = is_told.then(|| self.add_error(&mut state, view.to_owned(), number, reason));
        drop(state);
        log(message);
    }

    /// Keeps an error for the engine, and returns what is to be [logged](log) when the state is not locked.
    fn add_error(&self, state: &mut State, view: String, frame: u64, reason: AsyncPostErrorReason) -> String {
        let error = AsyncPostError { step: self.name.to_string(), view, frame, reason };
        let message = error.to_string();
        if state.errors.len() == MAX_ERRORS {
            state.errors.remove(0);
        }
        state.errors.push(error);
        message
    }
}

/// Tells of an error through `tracing`, whose subscriber is code of the engine's.
fn log(message: Option<String>) {
    if let Some(message) = message {
        emit(|| tracing::warn!(target: "drawloom", message));
    }
}

/// The textures of views without a result.
///
/// # Errors
/// If the device refuses.
fn neutral_textures(backend: &dyn UploadPicture) -> Result<Option<LayerTextures>, BackendError> {
    let pixel = Picture { width: 1, height: 1, format: Format::Rgba8Unorm, bytes: vec![0; 4] };
    layer_textures(backend, &pixel, None)
}

/// # Errors
/// If the device refuses.
fn layer_textures(
    backend: &dyn UploadPicture,
    picture: &Picture,
    camera: Option<&Camera>,
) -> Result<Option<LayerTextures>, BackendError> {
    let picture = upload(backend, picture)?;
    Ok(picture.zip(upload(backend, &view_picture(camera))?).map(<[_; 2]>::from))
}

/// # Errors
/// If the device refuses, or the backend panics.
fn upload(backend: &dyn UploadPicture, picture: &Picture) -> Result<Option<ShaderResource<'static>>, BackendError> {
    let uploaded = catch(|| backend.upload_picture(picture));
    uploaded.unwrap_or_else(|JobPanic { message, .. }| Err(BackendError::Panicked { call: "upload_picture", message }))
}
