//! The handle: from the pixels of frames to results that later frames show.

use std::sync::{Arc, Weak};

use drawloom::backend::{Backend, Picture};
use drawloom::process::{Format, PostStep, RenderProcess, ShaderResource};
use drawloom::scene::Camera;
use drawloom::task::Scheduler;
use drawloom::{RecordedFrame, Renderer};

use crate::downsample::Downsample;
use crate::error::AsyncPostError;
use crate::late_picture::LatePicture;
use crate::layer::LayerStep;
use crate::layer_settings::LayerSettings;
use crate::shared::{MAX_ERRORS, Shared};
use crate::source::StepSource;
use crate::statistics::AsyncPostStatistics;
use crate::step::AsyncStep;
use crate::upload_picture::UploadPicture;

/// Computes a step of post-processing on idle workers, one or more frames late (S 9.7): see [the crate](crate). Clones
/// are the same handle.
///
/// The engine gives the renderer the processes below, and calls two methods a frame: [`begin_frame`](Self::begin_frame)
/// before it records, and [`read_back`](Self::read_back) before it submits.
///
/// | | what a frame shows |
/// | --- | --- |
/// | before the first result | no layer; of a late picture, the frame's own source |
/// | the step is done before the next frame begins | the result of the frame before |
/// | frames are in flight, and the device limits their rate | that of two frames before: a frame begins before the one before it is drawn |
/// | the step takes longer | the newest result, however old; of the sources that arrive meanwhile the newest is computed next |
/// | a view has another size, or comes back | as before the first result |
/// | the step panics, or the device refuses | the newest result before that, and [an error](Self::take_errors) |
/// | the backend is replaced | as before the first result |
///
/// With [`Buffering::SameFrame`](drawloom::Buffering::SameFrame) the device is done before the next frame begins, so
/// the step has the time of the engine's update to be one frame late.
///
/// Pixels arrive when something polls the device: [`FrameLoop`](drawloom::FrameLoop) does, and so does `begin_frame`.
/// An engine that has no loop, and wants results of the frame before, polls the device while it updates.
///
/// It serves one renderer; another one, that records no scene, may draw its [late picture](Self::late_picture_alone).
///
/// Call `begin_frame` before [`Renderer::prepare_pipelines`], too: until the first call there are no textures, and the
/// processes have other shaders.
///
/// On a scheduler of one worker there is no idle one: `begin_frame` computes the step itself.
#[derive(Clone)]
pub struct AsyncPost(Arc<Shared>);

impl AsyncPost {
    /// The maximum number of errors that are kept until the engine [takes](Self::take_errors) them.
    pub const MAX_ERRORS: usize = MAX_ERRORS;

    /// Computes a step from a source, on the workers of a scheduler: that of the renderer, as a rule.
    pub fn new(scheduler: Arc<Scheduler>, step: impl AsyncStep, source: StepSource) -> Self {
        Self(Arc::new(Shared::new(scheduler, step, source)))
    }

    /// The step's name.
    pub fn name(&self) -> &str {
        &self.0.name
    }

    /// What the step computes from.
    pub fn source(&self) -> &StepSource {
        &self.0.source
    }

    /// The target that is read back: name it as an [output](drawloom::RendererBuilder::output) of the renderer, or
    /// nothing draws it.
    pub fn source_target(&self) -> &str {
        &self.0.target
    }

    /// The process that draws the source smaller, called `name source`: for
    /// [`RendererBuilder::process`](drawloom::RendererBuilder::process). `None` if the source is read back as it is.
    pub fn downsample(&self) -> Option<impl RenderProcess + 'static> {
        Downsample::new(&self.0.name, &self.0.source)
    }

    /// The step of post-processing that composites the result over the picture: for
    /// [`Deferred::post`](drawloom::process::Deferred::post).
    pub fn layer(&self, layer: LayerSettings) -> impl PostStep + 'static {
        let Shared { name, shown, .. } = &*self.0;
        LayerStep { name: Arc::clone(name), shown: shown.clone(), settings: layer }
    }

    /// The process that draws the result, as the whole picture, into a target of this name and format: for
    /// [`RendererBuilder::process`](drawloom::RendererBuilder::process). It stands after post-processing, and draws the
    /// source where there is no result.
    ///
    /// With frames in flight, a frame is recorded before the device has drawn the one before, so its picture is that of
    /// two frames before, where the device limits the frame rate. [`late_picture_alone`](Self::late_picture_alone) is a
    /// frame sooner.
    pub fn late_picture(&self, target: impl AsRef<str>, format: Format) -> impl RenderProcess + 'static {
        self.late_picture_over(Some(self.0.target.clone()), target.as_ref().to_owned(), format)
    }

    /// The same, for a renderer of its own on the same device, whose frames are only this picture, and transparent
    /// black where there is no result (S figure 9.6). The engine calls [`begin_frame`](Self::begin_frame) with the
    /// renderer of the scene, then records and submits the picture with this one, if [something is shown](Self::shown),
    /// and then the scene of the next frame. So the picture stands in the device's queue before that scene, and not
    /// behind it. With [`Buffering::SameFrame`](drawloom::Buffering::SameFrame) its latency is that of the scene and
    /// one frame more; with more frames in flight it also waits for those that were submitted before it.
    ///
    /// Its scenes have cameras of the same names and sizes, and need no objects.
    pub fn late_picture_alone(&self, target: impl AsRef<str>, format: Format) -> impl RenderProcess + 'static {
        self.late_picture_over(None, target.as_ref().to_owned(), format)
    }

    fn late_picture_over(&self, source: Option<String>, target: String, format: Format) -> LatePicture {
        let Shared { name, shown, .. } = &*self.0;
        LatePicture { name: format!("{name} late"), shown: shown.clone(), source, target, format }
    }

    /// The number of the frame whose result the current frame shows in a view, by name.
    pub fn shown(&self, view: &str) -> Option<u64> {
        self.0.shown.get().result(view).map(|result| result.number)
    }

    /// What the current frame shows, for an engine's own shaders: `layer` and `layer_view` of `layer_lookup.wgsl`.
    /// Empty before the first frame, and where the backend has no textures.
    pub fn resources(&self) -> Vec<ShaderResource<'static>> {
        self.0.shown.resources()
    }

    /// Begins a frame: chooses the results that it shows. Call it right before the frame is
    /// [recorded](Renderer::record), so that they are as new as possible, with the cameras that are recorded. It does
    /// not wait for the device, nor, with more than one worker, for the step.
    pub fn begin_frame<B: Backend + UploadPicture>(&self, renderer: &Renderer<B>, cameras: &[Camera]) {
        let backend: Weak<B> = Arc::downgrade(renderer.backend());
        let backend: Weak<dyn UploadPicture> = backend;
        self.0.begin_frame(&backend, cameras);
    }

    /// Has the source of a recorded frame read back when the frame is drawn, and the step computed from it. Call it
    /// before the frame is submitted and the next one begins. It does not wait.
    pub fn read_back<B: Backend>(&self, recorded: &mut RecordedFrame<B>) {
        self.0.read_back(recorded);
    }

    /// What has been computed so far for each main view of the current frame, in the order of its cameras, and what the
    /// frame shows there.
    pub fn statistics(&self) -> Vec<AsyncPostStatistics> {
        self.0.statistics()
    }

    /// The newest result of a view, by name: the number of its frame, and the step's picture. `None` before the first
    /// one.
    pub fn latest(&self, view: &str) -> Option<(u64, Arc<Picture>)> {
        self.0.latest(view)
    }

    /// The errors since the last call, oldest first: the first of several in a row of each view, and at most
    /// [`MAX_ERRORS`](Self::MAX_ERRORS). Each has gone through `tracing`, too.
    pub fn take_errors(&self) -> Vec<AsyncPostError> {
        self.0.take_errors()
    }
}
