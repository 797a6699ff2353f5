//! The helper: from the pixels of frames to results that later frames show.

use std::sync::{Arc, Weak};
use std::time::Instant;

use parking_lot::Mutex;

use super::error::{HelperError, HelperErrorReason};
use super::late_picture::LatePicture;
use super::layer::LayerStep;
use super::layer_settings::HelperLayer;
use super::layer_view::view_words;
use super::selection::{Selection, SharedSelection};
use super::shrink::Shrink;
use super::source::HelperSource;
use super::statistics::HelperStatistics;
use super::step::{HelperFrame, HelperStep};
use super::view_work::{HelperResult, LayerTextures, Source, ViewWork};
use crate::backend::{Backend, BackendError, Picture};
use crate::fence::{Fence, FenceError};
use crate::frame::{FramePlace, Recorded, Renderer};
use crate::process::{Format, PostStep, RenderProcess, ShaderResource};
use crate::scene::Camera;
use crate::task::{JobPanic, Scheduler, catch};

/// Computes a step of post-processing on idle workers, one or more frames late (S 9.7): see [the module](super). Clones are the same helper.
///
/// The engine gives the renderer the helper's processes, and calls two methods a frame: [`begin_frame`](Self::begin_frame) before it
/// records, and [`read_back`](Self::read_back) before it submits.
///
/// | | what a frame shows |
/// | --- | --- |
/// | before the first result | no layer; of a late picture, the frame's own source |
/// | the step is done before the next frame is recorded | the result of the frame before |
/// | the step takes longer | the newest result, however old; of the sources that arrive meanwhile the newest is computed next |
/// | a view has another size, or comes back | as before the first result |
/// | the step panics, or the device refuses | the newest result before that, and [an error](Self::take_errors) |
/// | the backend is replaced | as before the first result |
///
/// With [`Buffering::SameFrame`](crate::Buffering::SameFrame) nothing overlaps that is worth it: the device is done before the next frame
/// begins, so the result of the frame before is there only if the step takes less time than the engine's update.
///
/// Call `begin_frame` before [`Renderer::prepare_pipelines`], too: until the first call the helper has no textures, and its processes other shaders.
///
/// On a scheduler of one worker there is nobody to help: `begin_frame` computes the step itself.
#[derive(Clone)]
pub struct PostHelper(Arc<Shared>);

struct Shared {
    name: Arc<str>,
    step: Box<dyn HelperStep>,
    source: HelperSource,
    /// The target that is read back.
    target: String,
    scheduler: Arc<Scheduler>,
    state: Mutex<State>,
    /// What the processes draw.
    shown: SharedSelection,
}

#[derive(Default)]
struct State {
    /// How many frames have begun.
    frame: u64,
    /// The backend that everything here belongs to.
    backend: Option<Weak<dyn UploadPicture>>,
    /// The textures of views without a result.
    neutral: Option<LayerTextures>,
    /// Frames whose pixels have not arrived, in the order of their numbers.
    in_flight: Vec<InFlight>,
    views: Vec<ViewWork>,
    errors: Vec<HelperError>,
    /// Whether what concerns all views has failed since it last worked.
    has_failed: bool,
    /// Sources that are left out. They are dropped where the device may be used, which a fence's callback must not.
    retired: Vec<Source>,
}

struct InFlight {
    number: u64,
    drawn: Fence,
    /// Each with its view.
    sources: Vec<(String, Source)>,
}

/// What a helper needs of a backend of any type.
trait UploadPicture: Send + Sync {
    fn upload_picture(&self, picture: &Picture) -> Result<Option<ShaderResource<'static>>, BackendError>;
}

impl<B: Backend> UploadPicture for B {
    fn upload_picture(&self, picture: &Picture) -> Result<Option<ShaderResource<'static>>, BackendError> {
        Backend::upload_picture(self, picture)
    }
}

impl PostHelper {
    /// So many errors are kept until the engine [takes](Self::take_errors) them.
    pub const MAX_ERRORS: usize = 16;

    /// A helper that computes a step from a source, on the workers of a scheduler: that of the renderer, as a rule.
    pub fn new(scheduler: Arc<Scheduler>, step: impl HelperStep, source: HelperSource) -> Self {
        let name: Arc<str> = step.name().into();
        let target = Shrink::target_of(&name, &source);
        let (step, state, shown) = (Box::new(step), Mutex::default(), SharedSelection::default());
        Self(Arc::new(Shared { name, step, source, target, scheduler, state, shown }))
    }

    /// The step's name.
    pub fn name(&self) -> &str {
        &self.0.name
    }

    /// What the step computes from.
    pub fn source(&self) -> &HelperSource {
        &self.0.source
    }

    /// The target that is read back: name it as an [output](crate::RendererBuilder::output) of the renderer, or nothing draws it.
    pub fn source_target(&self) -> &str {
        &self.0.target
    }

    /// The process that draws the source smaller, called `name source`: for [`RendererBuilder::process`](crate::RendererBuilder::process). `None` if
    /// the source is read back as it is.
    pub fn shrink(&self) -> Option<impl RenderProcess + 'static> {
        Shrink::new(&self.0.name, &self.0.source)
    }

    /// The step of post-processing that composites the helper's result over the picture: for [`Deferred::post`](crate::process::Deferred::post).
    pub fn layer(&self, layer: HelperLayer) -> impl PostStep + 'static {
        let Shared { name, shown, .. } = &*self.0;
        LayerStep { name: Arc::clone(name), shown: shown.clone(), settings: layer }
    }

    /// The process that draws the helper's result, as the whole picture, into a target of this name and format: for
    /// [`RendererBuilder::process`](crate::RendererBuilder::process). It stands after post-processing.
    pub fn late_picture(&self, target: impl Into<String>, format: Format) -> impl RenderProcess + 'static {
        let Shared { name, shown, source, target: source_target, .. } = &*self.0;
        LatePicture {
            name: format!("{name} late"),
            shown: shown.clone(),
            views: source.views,
            source: source_target.clone(),
            target: target.into(),
            format,
        }
    }

    /// What the current frame shows, for an engine's own shaders: `layer` and `layer_view` of `layer_lookup.wgsl`. Empty before the first frame, and
    /// where the backend has no textures.
    pub fn resources(&self) -> Vec<ShaderResource<'static>> {
        self.0.shown.resources()
    }

    /// Begins a frame: chooses the results that it shows. Call it right before the frame is [recorded](Renderer::record), so that they are
    /// as new as possible, with the cameras that are recorded. It does not wait, neither for the device nor for the step.
    pub fn begin_frame<B: Backend>(&self, renderer: &Renderer<B>, cameras: &[Camera]) {
        self.0.hear_from_device();
        let backend: Weak<dyn UploadPicture> = Arc::downgrade(renderer.shared_backend()) as Weak<dyn UploadPicture>;
        self.0.belong_to(&backend);
        if self.0.scheduler.workers() == 1 {
            self.0.work_on_all();
        }
        let neutral = (self.0.state.lock().neutral.is_none()).then(|| neutral_textures(renderer.backend()));
        let mut state = self.0.state.lock();
        let retired = std::mem::take(&mut state.retired);
        state.frame += 1;
        match neutral {
            Some(Ok(neutral)) => state.neutral = neutral,
            Some(Err(error)) => self.0.tell(&mut state, error.into()),
            None => {}
        }
        let camera_of = |view: &str| {
            let of_kind = |camera: &&Camera| camera.name == view && camera.kind == self.0.source.views;
            cameras.iter().find(of_kind)
        };
        let gone: Vec<_> = state.views.extract_if(.., |work| camera_of(&work.view).is_none()).collect();
        let (mut shown, mut of_other_sizes) = (Vec::new(), Vec::new());
        for work in &mut state.views {
            let size = camera_of(&work.view).map(|camera| camera.size);
            of_other_sizes.extend(work.latest.take_if(|latest| Some(latest.camera.size) != size));
            shown.extend(work.latest.clone().map(|latest| (work.view.clone(), latest)));
        }
        let selection = Selection::new(shown, state.neutral.as_ref());
        let before = self.0.shown.replace(selection);
        drop(state);
        // These may be the last references to what is on the device. To destroy that may wait for a thread that polls the device, whose callbacks
        // wait for the state.
        drop((retired, gone, of_other_sizes, before));
    }

    /// Has the source of a recorded frame read back when the frame is drawn, and the step computed from it. Call it when all cameras are
    /// [replaced](Recorded::replace_camera) that will be, before the frame is submitted and the next one begins. It does not wait.
    ///
    /// It also adds to the frame's [statistics](crate::FrameStatistics::helpers).
    pub fn read_back<B: Backend>(&self, recorded: &mut Recorded<B>) {
        self.0.add_statistics(recorded);
        let number = self.0.state.lock().frame;
        let mut drawn: Vec<(usize, String)> = Vec::new();
        for (index, view) in recorded.views.recorded().iter().enumerate() {
            let is_source = view.kind() == self.0.source.views && !view.is_cached();
            if is_source && drawn.iter().all(|(_, name)| name != view.name()) {
                drawn.push((index, view.name().to_owned()));
            }
        }
        let mut sources = Vec::new();
        for (index, view) in drawn {
            let Some(camera) = recorded.camera(index).cloned() else { continue };
            match recorded.read_back_whole(index, &self.0.target) {
                Ok(read_back) => sources.push((view, Source { number, camera, read_back })),
                Err(error) => self.0.tell_of_view(&view, number, error.into()),
            }
        }
        if sources.is_empty() {
            return;
        }
        // A frame always has an end.
        let Ok(drawn) = recorded.fence_at(FramePlace::End) else { return };
        self.0.state.lock().in_flight.push(InFlight { number, drawn: drawn.clone(), sources });
        let shared = Arc::downgrade(&self.0);
        drawn.on_set(move |outcome| {
            if let Some(shared) = shared.upgrade() {
                shared.arrive(number, outcome);
            }
        });
    }

    /// The newest result of a view, by name: the number of its frame, and the step's picture. `None` before the first one.
    pub fn latest(&self, view: &str) -> Option<(u64, Arc<Picture>)> {
        let state = self.0.state.lock();
        let latest = state.views.iter().find(|work| work.view == view)?.latest.as_ref()?;
        Some((latest.number, Arc::clone(&latest.picture)))
    }

    /// The errors since the last call, oldest first: the first of several in a row of each view, and at most [`MAX_ERRORS`](Self::MAX_ERRORS).
    /// Each has gone through `tracing`, too.
    pub fn take_errors(&self) -> Vec<HelperError> {
        std::mem::take(&mut self.0.state.lock().errors)
    }
}

impl Shared {
    /// Has callbacks called for what the device has done.
    fn hear_from_device(&self) {
        let fences: Vec<_> = self.state.lock().in_flight.iter().map(|frame| frame.drawn.clone()).collect();
        // Not while the state is locked, as callbacks lock it.
        fences.iter().for_each(|fence| _ = fence.is_set());
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
            errors: std::mem::take(&mut state.errors),
            ..State::default()
        };
        let before = std::mem::replace(&mut *state, next);
        drop(state);
        drop(before);
    }

    /// The device has drawn a frame, or will not.
    fn arrive(self: &Arc<Self>, number: u64, outcome: Result<(), FenceError>) {
        let mut state = self.state.lock();
        let State { in_flight, views, retired, .. } = &mut *state;
        // Frames are drawn in their order, so nothing comes of those before this one.
        let arrived = in_flight.iter().take_while(|frame| frame.number <= number).count();
        let mut is_waiting = false;
        for frame in in_flight.drain(..arrived) {
            for (view, source) in frame.sources {
                if frame.number < number || outcome.is_err() {
                    retired.push(source);
                    continue;
                }
                let index = views.iter().position(|work| work.view == view).unwrap_or_else(|| {
                    views.push(ViewWork::new(view));
                    views.len() - 1
                });
                retired.extend(views[index].arrive(source, Instant::now()));
                is_waiting = true;
            }
        }
        match outcome {
            // The engine dropped the frame, or knows why it was refused.
            Err(FenceError::Abandoned { .. }) => {}
            Ok(()) => state.has_failed = false,
            Err(error) => self.tell(&mut state, error.into()),
        }
        drop(state);
        if is_waiting && self.scheduler.workers() > 1 {
            self.start_jobs();
        }
    }

    /// Starts a job for each view whose source waits for one.
    fn start_jobs(self: &Arc<Self>) {
        let waiting = self.state.lock().views.iter().filter(|work| work.may_start()).count();
        for _ in 0..waiting {
            let shared = Arc::clone(self);
            // It reports what it has done to the state.
            drop(self.scheduler.background(move || {
                shared.work();
                // A job for each source, so that other background jobs have their turn.
                shared.start_jobs();
            }));
        }
    }

    fn work_on_all(&self) {
        while self.work() {}
    }

    /// Computes the step for a view whose source waits. Returns whether there was one.
    fn work(&self) -> bool {
        let (view, source, backend, retired) = {
            let mut state = self.state.lock();
            let retired = std::mem::take(&mut state.retired);
            let backend = state.backend.clone();
            let started = state.views.iter_mut().find_map(|work| Some((work.view.clone(), work.start()?)));
            let Some((view, source)) = started else { return false };
            (view, source, backend, retired)
        };
        drop(retired);
        let number = source.number;
        let computed = catch(|| self.compute(source, backend.as_ref()));
        let result = computed.unwrap_or_else(|JobPanic { message }| Err(HelperErrorReason::Panicked { message }));
        let mut state = self.state.lock();
        let is_current = backend.as_ref().zip(state.backend.as_ref()).is_some_and(|(one, other)| one.ptr_eq(other));
        // The view is gone, or all that belongs to the backend is forgotten.
        let Some(work) = state.views.iter_mut().find(|work| is_current && work.view == view) else { return true };
        let (result, error) = match result {
            Ok(result) => (Some(Arc::new(result)), None),
            Err(error) => (None, Some(error)),
        };
        let (is_told, before) = work.finish(result);
        if let Some(reason) = error.filter(|_| is_told) {
            self.add_error(&mut state, view, number, reason);
        }
        drop(state);
        drop(before);
        true
    }

    fn compute(
        &self,
        source: Source,
        backend: Option<&Weak<dyn UploadPicture>>,
    ) -> Result<HelperResult, HelperErrorReason> {
        let _span = self.scheduler.timeline().span(self.name.to_string());
        let Source { number, camera, read_back } = source;
        let picture = read_back.read()?;
        drop(read_back);
        let frame = HelperFrame { picture: &picture, camera: &camera, number, scheduler: &self.scheduler };
        let picture = self.step.compute(&frame);
        HelperErrorReason::check(&picture)?;
        let textures = match backend.and_then(Weak::upgrade) {
            Some(backend) => layer_textures(&*backend, &picture, Some(&camera))?,
            None => None,
        };
        Ok(HelperResult { number, camera, picture: Arc::new(picture), textures })
    }

    fn add_statistics<B: Backend>(&self, recorded: &mut Recorded<B>) {
        let (shown, state) = (self.shown.get(), self.state.lock());
        for view in recorded.views.recorded().iter().filter(|view| view.kind() == self.source.views) {
            let work = state.views.iter().find(|work| work.view == view.name());
            let statistics = HelperStatistics {
                step: self.name.to_string(),
                view: view.name().to_owned(),
                frame: state.frame,
                result: shown.result(view.name()).map(|result| result.number),
                computed: work.map_or(0, |work| work.computed),
                skipped: work.map_or(0, |work| work.skipped),
                latest_took: work.map_or_else(Default::default, |work| work.latest_took),
            };
            let timeline = self.scheduler.timeline();
            if let Some(age) = statistics.age().filter(|_| timeline.is_on()) {
                timeline.count(format!("age of {} in {}, frames", self.name, view.name()), age as f64);
            }
            recorded.statistics.helpers.push(statistics);
        }
    }

    /// Tells of what failed for all views.
    fn tell(&self, state: &mut State, reason: HelperErrorReason) {
        if !std::mem::replace(&mut state.has_failed, true) {
            let number = state.frame;
            self.add_error(state, String::new(), number, reason);
        }
    }

    /// Tells of what failed for one view.
    fn tell_of_view(&self, view: &str, number: u64, reason: HelperErrorReason) {
        let mut state = self.state.lock();
        if !state.views.iter().any(|work| work.view == view) {
            state.views.push(ViewWork::new(view.to_owned()));
        }
        let work = state.views.iter_mut().find(|work| work.view == view);
        if work.is_some_and(ViewWork::fail) {
            self.add_error(&mut state, view.to_owned(), number, reason);
        }
    }

    fn add_error(&self, state: &mut State, view: String, frame: u64, reason: HelperErrorReason) {
        let error = HelperError { step: self.name.to_string(), view, frame, reason };
        crate::unwind::emit(|| tracing::warn!(target: "drawloom", %error, "a helper has no result"));
        if state.errors.len() == PostHelper::MAX_ERRORS {
            state.errors.remove(0);
        }
        state.errors.push(error);
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
    let picture = backend.upload_picture(picture)?;
    Ok(picture.zip(backend.upload_picture(&view_words(camera))?).map(<[_; 2]>::from))
}
