//! An engine whose code panics on request: its backend, process, node, device and subscriber.

use std::ops::Range;
use std::slice;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use drawloom::backend::{
    Backend, BackendError, BackendExtras, FrameFence, FrameRecorder, FrameRequest, NullBackend, PassRequest, Picture,
    ReadBack, SceneLimits, SoftwareBackend, TargetMemory, ViewQueue,
};
use drawloom::command::DrawState;
use drawloom::fence::DeviceProgress;
use drawloom::graph::NodeError;
use drawloom::process::{
    CpuShader, Declare, Draws, FramePlan, FullScreen, FullScreenCpuShader, FullScreenPixel, PassInputs, RenderProcess,
    ShaderResource,
};
use drawloom::quality::{Quality, VertexFormat};
use drawloom::raster::{Real, Vector4};
use drawloom::scene::Mesh;
use drawloom::task::{Scheduler, Worker};
use drawloom::timeline::{Labels, TuningChoice};
use drawloom::{CpuNode, NodeAccesses, NodeContext};
use drawloom_async_post::UploadPicture;
use tracing::span::{Attributes, Id, Record};
use tracing::subscriber::Interest;
use tracing::{Event, Level, Metadata, Subscriber};
use tracing_core::span::Current;

use crate::fuse::{Kind, Owned, call, panic_as_planned};

/// A backend under test.
pub trait Subject: Backend + Sized {
    fn open(scheduler: &Arc<Scheduler>) -> Self;

    /// All that a submission tells of what the main view shows.
    fn read(submission: &Self::Submission) -> Vec<u8>;
}

impl Subject for NullBackend {
    fn open(_: &Arc<Scheduler>) -> Self {
        Self
    }

    fn read(submission: &Self::Submission) -> Vec<u8> {
        let of_main = submission.passes.iter().filter(|pass| pass.view == 0);
        format!("{:?}", of_main.collect::<Vec<_>>()).into_bytes()
    }
}

impl Subject for SoftwareBackend {
    fn open(scheduler: &Arc<Scheduler>) -> Self {
        Self::new(Arc::clone(scheduler))
    }

    fn read(submission: &Self::Submission) -> Vec<u8> {
        submission.read(0, "picture").unwrap().bytes
    }
}

/// The engine's backend: each method may panic before it does what another backend does.
pub struct OwnBackend<B> {
    inner: B,
    joins_passes: bool,
    _dropped: Owned<()>,
}

impl<B> OwnBackend<B> {
    pub fn new(inner: B, joins_passes: bool) -> Self {
        Self { inner, joins_passes, _dropped: Owned::new("backend", ()) }
    }
}

fn backend(name: &'static str) {
    call(Kind::Backend, name);
}

impl<B: Backend> Backend for OwnBackend<B> {
    type Submission = Owned<B::Submission>;

    fn adapter_name(&self) -> String {
        self.inner.adapter_name()
    }

    fn limits(&self) -> SceneLimits {
        backend("limits");
        self.inner.limits()
    }

    fn check_mesh(&self, mesh: &Mesh, vertices: VertexFormat) -> Result<(), BackendError> {
        backend("check_mesh");
        self.inner.check_mesh(mesh, vertices)
    }

    fn prepare_pipelines(
        &self,
        plan: &FramePlan,
        draws: &[Draws<'_>],
        states: &[Vec<DrawState>],
        quality: &Quality,
    ) -> Result<(), BackendError> {
        backend("prepare_pipelines");
        self.inner.prepare_pipelines(plan, draws, states, quality)
    }

    fn begin(&self, request: &FrameRequest<'_>) -> Result<Self::Frame, BackendError> {
        backend("begin");
        self.inner.begin(request).map(|frame| Owned::new("frame", frame))
    }

    fn target_memory(&self, frame: &Self::Frame) -> TargetMemory {
        backend("target_memory");
        self.inner.target_memory(frame.get())
    }

    fn recording_choice(&self, frame: &Self::Frame, pass: usize, labels: &Arc<Labels>) -> Option<TuningChoice> {
        backend("recording_choice");
        self.inner.recording_choice(frame.get(), pass, labels)
    }

    fn read_back(&self, frame: &mut Self::Frame, view: usize, target: &str) -> Result<Box<dyn ReadBack>, BackendError> {
        backend("read_back");
        let inner = self.inner.read_back(frame.get_mut(), view, target)?;
        Ok(Box::new(OwnReadBack { inner, _dropped: Owned::new("read_back", ()) }))
    }

    fn submit(
        &self,
        frame: Self::Frame,
        queues: Vec<ViewQueue<Self::Commands>>,
        fences: Vec<FrameFence>,
    ) -> Result<Self::Submission, BackendError> {
        backend("submit");
        let passes_of = |queue: ViewQueue<Self::Commands>| {
            let passes = queue.passes.into_iter().map(|(pass, commands)| (pass, commands.take())).collect();
            ViewQueue { view: queue.view, passes }
        };
        let queues = queues.into_iter().map(passes_of).collect();
        let submission = self.inner.submit(frame.take(), queues, fences)?;
        Ok(Owned::new("submission", submission))
    }

    fn extras(&self) -> &dyn BackendExtras {
        self
    }
}

impl<B: Backend> BackendExtras for OwnBackend<B> {
    fn inner_extras(&self) -> Option<&dyn BackendExtras> {
        Some(self.inner.extras())
    }

    fn uploaded_bytes(&self) -> u64 {
        backend("uploaded_bytes");
        self.inner.extras().uploaded_bytes()
    }

    fn can_blend_floats(&self) -> bool {
        backend("can_blend_floats");
        self.inner.extras().can_blend_floats()
    }

    fn has_background_work(&self) -> bool {
        backend("has_background_work");
        true
    }

    fn work_in_background(&self) {
        backend("work_in_background");
    }

    fn counters(&self, count: &mut dyn FnMut(&'static str, f64)) {
        backend("counters");
        self.inner.extras().counters(count);
    }

    fn discard_frame(&self) {
        backend("discard_frame");
        self.inner.extras().discard_frame();
    }

    fn forget_histories(&self) {
        backend("forget_histories");
        self.inner.extras().forget_histories();
    }

    fn imports_targets_of(&self, view: &str) -> bool {
        backend("imports_targets_of");
        self.inner.extras().imports_targets_of(view)
    }
}

impl<B: Backend> FrameRecorder for OwnBackend<B> {
    type Frame = Owned<B::Frame>;
    type Part = Owned<B::Part>;
    type Commands = Owned<B::Commands>;

    fn objects_epoch(&self, frame: &Self::Frame) -> u64 {
        backend("objects_epoch");
        self.inner.objects_epoch(frame.get())
    }

    fn upload_objects(
        &self,
        frame: &Self::Frame,
        request: &FrameRequest<'_>,
        blocks: Range<usize>,
    ) -> Result<(), BackendError> {
        backend("upload_objects");
        self.inner.upload_objects(frame.get(), request, blocks)
    }

    fn prepare(&self, frame: &Self::Frame, pass: &PassRequest<'_>) -> Result<(), BackendError> {
        backend("prepare");
        self.inner.prepare(frame.get(), pass)
    }

    fn part_count(&self, frame: &Self::Frame, pass: &PassRequest<'_>) -> usize {
        backend("part_count");
        self.inner.part_count(frame.get(), pass)
    }

    fn record(
        &self,
        frame: &Self::Frame,
        pass: &PassRequest<'_>,
        parts: Range<usize>,
        emit: &mut dyn FnMut(Self::Part),
    ) -> Result<(), BackendError> {
        backend("record");
        self.inner.record(frame.get(), pass, parts, &mut |part| emit(Owned::new("part", part)))
    }

    fn shares_encoder(&self, _: &Self::Frame, pass: usize) -> bool {
        backend("shares_encoder");
        self.joins_passes && pass > 0
    }

    fn finish(
        &self,
        frame: &Self::Frame,
        passes: &[PassRequest<'_>],
        parts: &mut [Vec<Self::Part>],
        emit: &mut dyn FnMut(Self::Commands),
    ) -> Result<(), BackendError> {
        for (pass, parts) in passes.iter().zip(parts) {
            backend("finish");
            let mut parts = [parts.iter_mut().filter_map(|part| part.value.take()).collect()];
            let mut emit = |commands| emit(Owned::new("commands", commands));
            self.inner.finish(frame.get(), slice::from_ref(pass), &mut parts, &mut emit)?;
        }
        Ok(())
    }
}

impl<B: UploadPicture> UploadPicture for OwnBackend<B> {
    fn upload_picture(&self, picture: &Picture) -> Result<Option<ShaderResource<'static>>, BackendError> {
        backend("upload_picture");
        self.inner.upload_picture(picture)
    }
}

/// What reads a target back.
struct OwnReadBack {
    inner: Box<dyn ReadBack>,
    _dropped: Owned<()>,
}

impl ReadBack for OwnReadBack {
    fn try_read(&self) -> Result<Option<Picture>, BackendError> {
        call(Kind::Step, "try_read");
        self.inner.try_read()
    }

    fn read(&self) -> Result<Picture, BackendError> {
        call(Kind::Step, "read");
        self.inner.read()
    }
}

/// A process of the engine's, which does not change the picture.
pub struct OwnProcess {
    _dropped: Owned<()>,
}

impl OwnProcess {
    pub fn new() -> Self {
        Self { _dropped: Owned::new("process", ()) }
    }
}

impl RenderProcess for OwnProcess {
    fn name(&self) -> &str {
        call(Kind::Process, "process's name");
        "the engine's process"
    }

    fn declare(&self, declare: &mut Declare) {
        call(Kind::Process, "process's declare");
        declare.at(drawloom::process::InjectionPoint::AfterPostProcessing);
        declare.draws_over("picture");
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        call(Kind::Process, "draws");
        Draws::FullScreen(FullScreen::default())
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        call(Kind::Process, "cpu_shader");
        Some(CpuShader::full_screen(Leaves { _dropped: Owned::new("shader", ()) }))
    }
}

struct Leaves {
    _dropped: Owned<()>,
}

impl<R: Real> FullScreenCpuShader<R> for Leaves {
    fn fragment(&self, _: &PassInputs<'_, R>, _: &FullScreenPixel<R>, _: &mut [Vector4<R>]) -> bool {
        call(Kind::Process, "fragment");
        false
    }
}

/// A node of the engine's.
pub struct OwnNode;

impl CpuNode for OwnNode {
    fn name(&self) -> &str {
        call(Kind::Node, "name");
        "the engine's node"
    }

    fn declare(&self, _: &mut NodeAccesses) {
        call(Kind::Node, "declare");
    }

    fn width(&self, _: &NodeContext<'_>) -> usize {
        call(Kind::Node, "width");
        3
    }

    fn items_per_job(&self) -> Option<usize> {
        call(Kind::Node, "items_per_job");
        None
    }

    fn run(&self, _: &NodeContext<'_>, _: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        call(Kind::Node, "run");
        Ok(())
    }
}

/// A device that never sets its fence.
pub struct OwnDevice {
    _dropped: Owned<()>,
}

impl OwnDevice {
    pub fn new() -> Self {
        Self { _dropped: Owned::new("device", ()) }
    }
}

impl DeviceProgress for OwnDevice {
    fn advance(&self, _: Duration) -> Result<(), String> {
        call(Kind::Hook, "advance");
        Err(String::from("it has failed"))
    }
}

/// A subscriber of everything. It panics whenever it is told of an event or a span of Drawloom's for the first time:
/// that happens once in a program, in whichever case comes first.
#[derive(Default)]
pub struct OwnSubscriber {
    spans: AtomicU64,
    /// What it says the current span is.
    first: OnceLock<&'static Metadata<'static>>,
}

/// How many events and spans it was told of for the first time.
pub static CALLSITES: AtomicUsize = AtomicUsize::new(0);

/// How many errors it was told of.
pub static ERRORS: AtomicUsize = AtomicUsize::new(0);

fn subscriber(name: &'static str) {
    call(Kind::Subscriber, name);
}

impl Subscriber for OwnSubscriber {
    fn register_callsite(&self, metadata: &'static Metadata<'static>) -> Interest {
        if metadata.target().starts_with("drawloom") {
            let index = CALLSITES.fetch_add(1, Ordering::Relaxed);
            panic_as_planned(index.is_multiple_of(2));
        }
        Interest::sometimes()
    }

    fn enabled(&self, _: &Metadata<'_>) -> bool {
        subscriber("enabled");
        true
    }

    fn new_span(&self, attributes: &Attributes<'_>) -> Id {
        subscriber("new_span");
        self.first.get_or_init(|| attributes.metadata());
        Id::from_u64(1 + self.spans.fetch_add(1, Ordering::Relaxed))
    }

    fn record(&self, _: &Id, _: &Record<'_>) {
        subscriber("record");
    }

    fn record_follows_from(&self, _: &Id, _: &Id) {
        subscriber("record_follows_from");
    }

    fn event_enabled(&self, _: &Event<'_>) -> bool {
        subscriber("event_enabled");
        true
    }

    fn event(&self, event: &Event<'_>) {
        if *event.metadata().level() == Level::ERROR {
            ERRORS.fetch_add(1, Ordering::Relaxed);
        }
        subscriber("event");
    }

    fn enter(&self, _: &Id) {
        subscriber("enter");
    }

    fn exit(&self, _: &Id) {
        subscriber("exit");
    }

    fn current_span(&self) -> Current {
        subscriber("current_span");
        self.first.get().map_or_else(Current::none, |metadata| Current::new(Id::from_u64(1), metadata))
    }

    fn clone_span(&self, id: &Id) -> Id {
        subscriber("clone_span");
        id.clone()
    }

    fn try_close(&self, _: Id) -> bool {
        subscriber("try_close");
        true
    }
}
