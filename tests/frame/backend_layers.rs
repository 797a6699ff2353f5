//! Backends around another one.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, Mutex};

use drawloom::backend::{
    Backend, BackendError, BackendExtras, BackendLayer, FrameRecorder, NoExtras, NullBackend, PassRequest, SceneLimits,
    StreamingBudget, TargetMemory, WgpuBackend,
};
use drawloom::process::Deferred;
use drawloom::quality::{Quality, VertexFormat};
use drawloom::scene::Mesh;
use drawloom::task::Scheduler;
use drawloom::timeline::{TuningChoice, TuningSubject};
use drawloom::{FrameError, FrameStatistics, RecordedFrame, Renderer};
use drawloom_testing::adapter;
use drawloom_testing::scenes::field;

/// Collects the names of the methods that are called.
struct Names<B> {
    inner: B,
    called: Mutex<BTreeSet<&'static str>>,
}

impl<B> Names<B> {
    fn around(inner: B) -> Self {
        Self { inner, called: Mutex::default() }
    }
}

impl<B: Backend> BackendLayer for Names<B> {
    type Inner = B;

    fn inner(&self) -> &B {
        &self.inner
    }

    fn forward<R>(&self, method: &'static str, call: impl FnOnce() -> R) -> R {
        self.called.lock().unwrap().insert(method);
        call()
    }
}

/// Streams, so that it has every extra.
fn streaming() -> WgpuBackend {
    let (device, queue) = adapter::noop_device().unwrap();
    WgpuBackend::new(device, queue).unwrap().stream_resources(StreamingBudget::default()).unwrap()
}

/// What is known of a backend after some frames. Streaming and tuning depend on time before that.
#[derive(Debug, PartialEq)]
struct Known {
    name: String,
    limits: SceneLimits,
    targets: TargetMemory,
    recording_choices: usize,
    uploaded: u64,
    counters: BTreeMap<String, f64>,
}

fn known<B: Backend>(backend: B, read_pixel: impl Fn(&mut RecordedFrame<B>)) -> (Known, Renderer<B>) {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    scheduler.timeline().start();
    let builder = Renderer::builder(backend).pipeline(Deferred::to_picture());
    let (mut renderer, submitter) = builder.build(Arc::clone(&scheduler)).unwrap();
    let scene = field(600);
    renderer.prepare_pipelines(scene.as_scene_ref()).unwrap();
    let mut frame = || {
        let mut recorded = renderer.record(scene.as_scene_ref()).unwrap();
        drop(recorded.read_back_whole(0, "picture").unwrap());
        read_pixel(&mut recorded);
        submitter.submit(recorded).unwrap().statistics
    };
    let FrameStatistics { targets, tuning, .. } = (0..20).map(|_| frame()).last().unwrap();
    let is_recording = |choice: &&TuningChoice| choice.subject == TuningSubject::Recording;
    let counters = scheduler.timeline().take().counters.into_iter().map(|counter| (counter.name, counter.value));
    let known = Known {
        name: renderer.backend().adapter_name(),
        limits: renderer.backend().limits(),
        targets,
        recording_choices: tuning.choices.iter().filter(is_recording).count(),
        uploaded: renderer.backend().extras().uploaded_bytes(),
        counters: counters.filter(|(name, _)| name != "bytes uploaded").collect(),
    };
    (known, renderer)
}

#[test]
fn layers_lose_no_call_and_no_extra() {
    let (direct, _) = known(streaming(), |recorded| drop(recorded.read_back(0, "picture", [0, 0], [1, 1]).unwrap()));
    let (wrapped, renderer) = known(Names::around(Names::around(streaming())), |recorded| {
        // Methods for wgpu's frames exist through layers.
        drop(recorded.read_back(0, "picture", [0, 0], [1, 1]).unwrap());
    });
    assert_eq!(wrapped, direct);
    assert!(direct.targets != TargetMemory::default() && direct.recording_choices > 0 && direct.uploaded > 0);
    assert!(direct.counters["bytes resident"] > 0.0, "{direct:?}");
    let all = BTreeSet::from([
        "adapter_name",
        "begin",
        "check_mesh",
        "extras",
        "finish",
        "limits",
        "objects_epoch",
        "part_count",
        "prepare",
        "prepare_pipelines",
        "read_back",
        "record",
        "recording_choice",
        "shares_encoder",
        "submit",
        "target_memory",
        "upload_objects",
    ]);
    let outer = renderer.backend();
    assert_eq!(*outer.called.lock().unwrap(), all);
    assert_eq!(*outer.inner.called.lock().unwrap(), all);
}

/// Draws nothing. Fails when it has finished all passes of an encoder.
struct FailsAfterwards(NullBackend);

impl BackendLayer for FailsAfterwards {
    type Inner = NullBackend;

    fn inner(&self) -> &NullBackend {
        &self.0
    }

    fn finish(
        &self,
        frame: &<NullBackend as FrameRecorder>::Frame,
        passes: &[PassRequest<'_>],
        parts: &mut [Vec<<NullBackend as FrameRecorder>::Part>],
        emit: &mut dyn FnMut(<NullBackend as FrameRecorder>::Commands),
    ) -> Result<(), BackendError> {
        self.0.finish(frame, passes, parts, emit)?;
        Err(BackendError::CannotReadBack)
    }
}

#[test]
fn an_error_after_all_passes_are_finished_is_that_of_the_last_one() {
    let builder = Renderer::builder(FailsAfterwards(NullBackend)).pipeline(Deferred::to_picture());
    let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
    let Err(error) = renderer.record(field(10).as_scene_ref()) else { panic!("it has not failed") };
    assert!(matches!(error, FrameError::Failed { .. }), "{error}");
    assert!(matches!(error.backend_error(), Some(BackendError::CannotReadBack)), "{error}");
}

/// Draws nothing, and no mesh with full vertices.
struct PackedOnly(NullBackend);

impl BackendLayer for PackedOnly {
    type Inner = NullBackend;

    fn inner(&self) -> &NullBackend {
        &self.0
    }

    fn check_mesh(&self, _: &Mesh, vertices: VertexFormat) -> Result<(), BackendError> {
        if vertices == VertexFormat::Packed { Ok(()) } else { Err(BackendError::CannotReadBack) }
    }
}

#[test]
fn a_backend_is_asked_again_which_meshes_it_draws_when_their_format_changes() {
    let builder = Renderer::builder(PackedOnly(NullBackend)).pipeline(Deferred::to_picture());
    let (mut renderer, _) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
    let scene = field(10);
    for (vertices, left_out) in
        [(VertexFormat::Packed, 0), (VertexFormat::Full, 10), (VertexFormat::Packed, 0), (VertexFormat::Full, 10)]
    {
        renderer.set_quality(Quality { vertices, ..Quality::balanced() }).unwrap();
        let recorded = renderer.record(scene.as_scene_ref()).unwrap();
        let issues: usize = recorded.statistics().scene_issues.iter().map(|issue| issue.count).sum();
        assert_eq!(issues, left_out, "{:?}", recorded.statistics().scene_issues);
    }
}

/// Counts bytes itself, and asks another backend for the rest.
struct Bytes<'a>(&'a dyn BackendExtras);

impl BackendExtras for Bytes<'_> {
    fn inner_extras(&self) -> Option<&dyn BackendExtras> {
        Some(self.0)
    }

    fn uploaded_bytes(&self) -> u64 {
        7
    }
}

/// Has each extra.
#[derive(Default)]
struct All(Mutex<Vec<String>>);

impl All {
    fn log(&self, call: impl Into<String>) {
        self.0.lock().unwrap().push(call.into());
    }
}

impl BackendExtras for All {
    fn inner_extras(&self) -> Option<&dyn BackendExtras> {
        None
    }

    fn uploaded_bytes(&self) -> u64 {
        self.log("uploaded_bytes");
        3
    }

    fn can_blend_floats(&self) -> bool {
        self.log("can_blend_floats");
        true
    }

    fn has_background_work(&self) -> bool {
        self.log("has_background_work");
        true
    }

    fn work_in_background(&self) {
        self.log("work_in_background");
    }

    fn counters(&self, count: &mut dyn FnMut(&'static str, f64)) {
        self.log("counters");
        count("number", 2.0);
    }

    fn discard_frame(&self) {
        self.log("discard_frame");
    }

    fn forget_histories(&self) {
        self.log("forget_histories");
    }

    fn imports_targets_of(&self, view: &str) -> bool {
        self.log(format!("imports_targets_of {view}"));
        true
    }
}

/// Calls each method, and returns what they say.
fn answers(extras: &dyn BackendExtras) -> (u64, [bool; 3], Vec<(&'static str, f64)>) {
    extras.work_in_background();
    extras.discard_frame();
    extras.forget_histories();
    let mut counted = Vec::new();
    extras.counters(&mut |name, value| counted.push((name, value)));
    let can = [extras.can_blend_floats(), extras.has_background_work(), extras.imports_targets_of("main")];
    (extras.uploaded_bytes(), can, counted)
}

#[test]
fn an_extra_that_a_backend_does_not_implement_is_that_of_the_inner_one() {
    let all = All::default();
    assert_eq!(answers(&all), (3, [true; 3], vec![("number", 2.0)]));
    let mut expected = std::mem::take(&mut *all.0.lock().unwrap());
    assert_eq!(expected.pop().as_deref(), Some("uploaded_bytes"));
    assert_eq!(answers(&Bytes(&all)), (7, [true; 3], vec![("number", 2.0)]));
    assert_eq!(*all.0.lock().unwrap(), expected);
    assert_eq!(answers(&NoExtras), (0, [false; 3], vec![]));
    assert_eq!(answers(&Bytes(&NoExtras)), (7, [false; 3], vec![]));
}
