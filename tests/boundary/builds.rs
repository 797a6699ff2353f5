//! Renderers that are built and changed: processes, steps of post-processing and deformations are asked what they are.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use drawloom::backend::{NullBackend, SceneLimits, SoftwareBackend};
use drawloom::glam::Vec3;
use drawloom::process::{
    CpuShader, Declare, Deferred, Deformation, DeformationCpuShader, DeviceSupport, Draws, Fxaa, PassInputs, Pipeline,
    PipelineProcesses, PlanError, PostStep, RenderProcess, Requirements, SceneContents, ShaderObject, ShaderResource,
    ToneMapping, VertexInput,
};
use drawloom::quality::Quality;
use drawloom::raster::Real;
use drawloom::scene::{LayerMask, Light, Scene};
use drawloom::task::Scheduler;
use drawloom::view::ShadowMaps;
use drawloom::{BuildError, Granularity, Renderer, RendererBuilder, Submitter};
use drawloom_testing::limited::LimitedBackend;

use crate::engine::{OwnBackend, OwnProcess, Subject};
use crate::frames::worlds;
use crate::fuse::{self, Kind, Owned, PLANNED, call};
use crate::within_time;

/// A step of the engine's, which smooths edges.
struct OwnStep {
    _dropped: Owned<()>,
}

impl OwnStep {
    fn new() -> Self {
        Self { _dropped: Owned::new("step", ()) }
    }
}

impl PostStep for OwnStep {
    fn process(&self, source: &str, target: &str) -> Arc<dyn RenderProcess> {
        call(Kind::Step, "process");
        Fxaa::default().process(source, target)
    }

    fn with_quality(&self, _: &Quality) -> Option<Arc<dyn PostStep>> {
        call(Kind::Step, "with_quality");
        Some(Arc::new(Self::new()))
    }
}

/// A deformation of the engine's, which moves nothing.
struct OwnDeformation {
    _dropped: Owned<()>,
}

impl OwnDeformation {
    fn new() -> Self {
        Self { _dropped: Owned::new("deformation", ()) }
    }
}

impl Deformation for OwnDeformation {
    fn name(&self) -> &str {
        call(Kind::Step, "deformation's name");
        "still"
    }

    fn layers(&self) -> LayerMask {
        call(Kind::Step, "layers");
        LayerMask::layer(3)
    }

    fn declare(&self, _: &mut Declare) {
        call(Kind::Step, "deformation's declare");
    }

    fn shader(&self) -> &str {
        call(Kind::Step, "shader");
        "fn deform(in: VertexInput, object: Object) -> VertexInput { return in; }"
    }

    fn resources(&self) -> Vec<ShaderResource<'_>> {
        call(Kind::Step, "resources");
        Vec::new()
    }

    fn cpu_shader(&self, process: CpuShader) -> Option<CpuShader> {
        call(Kind::Step, "deformation's cpu_shader");
        Some(process.deformed(Still { _dropped: Owned::new("deforming shader", ()) }))
    }
}

struct Still {
    _dropped: Owned<()>,
}

impl<R: Real> DeformationCpuShader<R> for Still {
    fn deform(&self, _: &PassInputs<'_, R>, _: &ShaderObject<R>, vertex: &VertexInput<R>) -> VertexInput<R> {
        call(Kind::Step, "deform");
        *vertex
    }
}

type Built<S> = (Renderer<OwnBackend<S>>, Submitter<OwnBackend<S>>);

/// A process of the engine's in the place of one of the pipeline's.
struct Replacement {
    inner: Arc<dyn RenderProcess>,
    _dropped: Owned<()>,
}

impl RenderProcess for Replacement {
    fn name(&self) -> &str {
        call(Kind::Process, "replacement's name");
        self.inner.name()
    }

    fn declare(&self, declare: &mut Declare) {
        call(Kind::Process, "replacement's declare");
        self.inner.declare(declare);
    }

    fn draws(&self) -> Draws<'_> {
        call(Kind::Process, "replacement's draws");
        self.inner.draws()
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        self.inner.cpu_shader()
    }
}

pub fn deferred() -> Deferred {
    let inner = Fxaa::default().process("post-processed 1", "picture");
    let replacement = Replacement { inner, _dropped: Owned::new("replacement", ()) };
    let deferred = Deferred::new().post(ToneMapping::default()).post(OwnStep::new()).replace("fxaa", replacement);
    // A kept process is compared with those of deformations.
    deferred.deformation(OwnDeformation::new()).keep("transparency")
}

/// A pipeline of the engine's, with what the deferred one has.
struct OwnPipeline {
    inner: Deferred,
    _dropped: Owned<()>,
}

fn pipeline() -> OwnPipeline {
    OwnPipeline { inner: deferred(), _dropped: Owned::new("pipeline", ()) }
}

impl Pipeline for OwnPipeline {
    fn requirements(&self, scene: &SceneContents<'_>) -> Requirements {
        call(Kind::Step, "requirements");
        self.inner.requirements(scene)
    }

    fn build(
        &self,
        requirements: &Requirements,
        device: DeviceSupport,
        processes: &mut PipelineProcesses,
    ) -> Result<(), PlanError> {
        call(Kind::Step, "build");
        self.inner.build(requirements, device, processes)
    }

    fn check(&self) -> Result<(), PlanError> {
        call(Kind::Step, "check");
        self.inner.check()
    }

    fn kept(&self, device: DeviceSupport) -> Requirements {
        call(Kind::Step, "kept");
        self.inner.kept(device)
    }

    fn shadow_maps(&self) -> Option<ShadowMaps> {
        call(Kind::Step, "shadow_maps");
        Pipeline::shadow_maps(&self.inner)
    }

    fn with_quality(&self, quality: &Quality) -> Option<Arc<dyn Pipeline>> {
        call(Kind::Step, "pipeline's with_quality");
        let inner = self.inner.clone().quality(quality);
        Some(Arc::new(Self { inner, _dropped: Owned::new("pipeline", ()) }))
    }

    fn to_prepare(&self) -> Vec<Requirements> {
        call(Kind::Step, "to_prepare");
        self.inner.to_prepare()
    }

    fn lacks_float_blending(&self, device: DeviceSupport) -> bool {
        call(Kind::Step, "lacks_float_blending");
        self.inner.lacks_float_blending(device)
    }
}

fn builder<S: Subject>(scheduler: &Arc<Scheduler>) -> RendererBuilder<OwnBackend<S>> {
    let builder = Renderer::builder(OwnBackend::new(S::open(scheduler), false));
    builder.pipeline(pipeline()).process(OwnProcess::new()).quality(Quality::fast())
}

/// What an engine does once it has its processes.
struct Engine<S: Subject> {
    built: Option<Built<S>>,
    errors: Vec<String>,
}

impl<S: Subject> Engine<S> {
    /// Does something, once more if it fails the first time.
    fn attempt<T>(&mut self, mut work: impl FnMut(&mut Built<S>) -> Result<T, String>) -> T {
        let built = self.built.as_mut().unwrap();
        let first = work(built);
        first.unwrap_or_else(|error| {
            self.errors.push(error);
            work(built).expect("what comes after a panic succeeds")
        })
    }

    fn draw(&mut self, scene: &Scene) -> Vec<u8> {
        self.attempt(|(renderer, submitter)| {
            let recorded = renderer.record(scene.as_scene_ref()).map_err(|error| error.to_string())?;
            let submitted = submitter.submit(recorded).map_err(|error| error.to_string())?;
            let read = S::read(submitted.submission.get());
            // Its destructor is the engine's to catch.
            catch_unwind(AssertUnwindSafe(|| drop(submitted))).unwrap_or_else(std::mem::forget);
            Ok(read)
        })
    }
}

/// Builds a renderer, draws two scenes of which the second needs another plan, and changes the pipeline and the
/// quality. Returns the pictures and the errors.
fn build_and_change<S: Subject>() -> (Vec<Vec<u8>>, Vec<String>) {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let build = || builder::<S>(&scheduler).build(Arc::clone(&scheduler)).map_err(|error| error.to_string());
    let mut engine = Engine { built: None, errors: Vec::new() };
    engine.built = Some(build().unwrap_or_else(|error| {
        engine.errors.push(error);
        build().expect("what comes after a panic succeeds")
    }));
    let [mut scene, _] = worlds();
    scene.cameras.truncate(1);
    // Each pixel is a call of the process's shader.
    scene.cameras[0].size = [4, 4];
    let mut pictures = vec![engine.draw(&scene)];
    scene.lights.push(Light::Directional { direction: Vec3::NEG_Z, illuminance: Vec3::ONE, casts_shadow: true });
    pictures.push(engine.draw(&scene));
    engine.attempt(|(renderer, _)| renderer.set_quality(Quality::balanced()).map_err(|error| error.to_string()));
    pictures.push(engine.draw(&scene));
    engine.attempt(|(renderer, _)| renderer.set_pipeline(pipeline()).map_err(|error| error.to_string()));
    pictures.push(engine.draw(&scene));
    let remove = |renderer: &mut Renderer<_>| renderer.remove_process("the engine's process");
    engine.attempt(|(renderer, _)| remove(renderer).map_err(|error| error.to_string()));
    engine.attempt(|(renderer, _)| renderer.add_process(OwnProcess::new()).map_err(|error| error.to_string()));
    pictures.push(engine.draw(&scene));
    engine.attempt(|(renderer, _)| renderer.prepare_pipelines(scene.as_scene_ref()).map_err(|error| error.to_string()));
    (pictures, engine.errors)
}

/// Calls of a kind panic, each once: some of each name. Returns how many did.
fn each_call_panics_once<S: Subject>(kind: Kind) -> usize {
    let (expected, errors) = build_and_change::<S>();
    assert!(errors.is_empty(), "{errors:?}");
    let alive_before = fuse::alive();
    let indices = fuse::calls_to_try(kind, || drop(build_and_change::<S>()));
    for (round, &index) in indices.iter().enumerate() {
        let has_text = round % 2 == 0;
        fuse::arm(kind, index, has_text);
        let outcome = catch_unwind(build_and_change::<S>);
        let blown = fuse::disarm();
        let name = format!("{kind:?} {index} ({blown:?})");
        let (pictures, errors) = outcome.unwrap_or_else(|_| panic!("{name} unwinds"));
        assert!(blown.is_some(), "{name} does not panic");
        assert_eq!(errors.len(), usize::from(kind != Kind::Destructor), "{name}: {errors:?}");
        for error in errors {
            let is_named = ["process", "step", "panicked"].iter().any(|word| error.contains(word));
            assert!(is_named && error.ends_with(PLANNED) == has_text, "{name}: {error}");
        }
        assert!(pictures == expected, "{name}: the pictures are others");
        assert_eq!(fuse::alive(), alive_before, "after {name}");
    }
    indices.len()
}

fn each_call_of_all_backends_panics_once(kind: Kind, least: usize) {
    within_time(move || {
        let counts = [each_call_panics_once::<NullBackend>(kind), each_call_panics_once::<SoftwareBackend>(kind)];
        assert!(counts.iter().all(|count| *count >= least), "only {counts:?} calls of {kind:?} panicked");
    });
}

#[test]
fn a_panic_in_any_call_of_a_process_that_is_planned_is_an_error() {
    each_call_of_all_backends_panics_once(Kind::Process, 20);
}

#[test]
fn a_panic_in_any_call_of_a_step_or_a_deformation_is_an_error() {
    each_call_of_all_backends_panics_once(Kind::Step, 20);
}

#[test]
fn a_panic_in_any_destructor_of_what_is_planned_changes_nothing() {
    each_call_of_all_backends_panics_once(Kind::Destructor, 10);
}

/// A builder that is dropped, one whose processes make no frame, and a pipeline that a renderer does not take, all of
/// whose destructors panic.
#[test]
fn what_is_not_built_is_dropped() {
    within_time(|| {
        let scheduler = Arc::new(Scheduler::new(1).unwrap());
        let alive_before = fuse::alive();
        let builder = || builder::<NullBackend>(&scheduler);
        let drop_it = || drop(builder());
        let refuse = || {
            let refused = builder().pipeline(deferred().leave_out("nothing")).build(Arc::clone(&scheduler));
            assert!(refused.map(drop).unwrap_err().to_string().contains("nothing"));
        };
        let refuse_granularity = || {
            let refused = builder().granularity(Granularity::Chunk(0)).build(Arc::clone(&scheduler));
            assert!(matches!(refused.map(drop), Err(BuildError::EmptyChunk)));
        };
        let set = || {
            let (mut renderer, submitter) = builder().build(Arc::clone(&scheduler)).unwrap();
            assert!(
                renderer.set_pipeline(deferred().leave_out("nothing")).unwrap_err().to_string().contains("nothing")
            );
            drop((renderer, submitter));
        };
        let all: [(&str, &dyn Fn()); 4] =
            [("dropped", &drop_it), ("refused", &refuse), ("invalid", &refuse_granularity), ("set", &set)];
        for (name, work) in all {
            fuse::arm_each(Kind::Destructor);
            let outcome = catch_unwind(AssertUnwindSafe(work));
            assert!(fuse::disarm().is_some(), "{name}");
            if let Err(payload) = outcome {
                let message = payload.downcast_ref::<String>().cloned().unwrap_or_default();
                std::mem::forget(payload);
                panic!("{name} unwinds: {message}");
            }
            assert_eq!(fuse::alive(), alive_before, "{name}");
        }
    });
}

/// What a pipeline keeps depends on whether the backend blends floats, and is determined anew for another backend.
#[test]
fn a_panic_of_a_deformation_in_the_first_frame_of_another_backend_is_an_error() {
    within_time(|| {
        let scheduler = Arc::new(Scheduler::new(1).unwrap());
        let open = |blends_floats: bool| {
            let limited = LimitedBackend::new(NullBackend, SceneLimits::NONE);
            OwnBackend::new(if blends_floats { limited } else { limited.without_float_blending() }, false)
        };
        let [scene, _] = worlds();
        let builder = Renderer::builder(open(true)).pipeline(deferred());
        let (mut renderer, mut submitter) = builder.build(scheduler).unwrap();
        for has_text in [true, false] {
            for blends_floats in [false, true] {
                fuse::arm(Kind::Step, 0, has_text);
                let replaced = catch_unwind(AssertUnwindSafe(|| renderer.replace_backend(open(blends_floats))));
                submitter = replaced.unwrap_or_else(|_| panic!("it unwinds"));
                let recorded = catch_unwind(AssertUnwindSafe(|| renderer.record(scene.as_scene_ref()).map(drop)));
                assert_eq!(fuse::disarm(), Some("deformation's name"));
                let error = recorded.expect("it unwinds").unwrap_err().to_string();
                assert!(error.contains("panicked") && error.ends_with(PLANNED) == has_text, "{error}");
                drop(submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap());
            }
        }
        drop(submitter);
    });
}
