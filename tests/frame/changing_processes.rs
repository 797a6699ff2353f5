//! Processes, outputs and pipelines that change while the renderer lives, and pipelines that are wrong.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use drawloom::backend::NullBackend;
use drawloom::process::{
    ClearColor, CommandDraws, Declare, Deferred, DeviceSupport, Draws, Format, InjectionPoint, Pipeline,
    PipelineProcesses, PlanError, RenderProcess, Requirements, SceneContents,
};
use drawloom::scene::Scene;
use drawloom::task::Scheduler;
use drawloom::{BuildError, FrameError, Renderer, Submitter};
use drawloom_testing::scenes::field;
use parking_lot::Mutex;

use crate::declaring::Declaring;

/// A process over `radiance`.
fn over(name: &'static str) -> Declaring {
    Declaring::new(name, |declare| {
        declare.at(InjectionPoint::AfterLighting);
        declare.draws_over("radiance");
    })
}

type Built = (Renderer<NullBackend>, Submitter<NullBackend>);

fn build(pipeline: impl Pipeline + 'static) -> Result<Built, BuildError> {
    Renderer::builder(NullBackend).pipeline(pipeline).build(Arc::new(Scheduler::new(2).unwrap()))
}

fn dark_field() -> Scene {
    let mut scene = field(50);
    scene.cameras.truncate(1);
    scene.lights.clear();
    scene
}

/// The passes of a frame.
fn passes((renderer, submitter): &mut Built, scene: &Scene) -> Vec<String> {
    let submitted = submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
    submitted.submission.passes.into_iter().map(|pass| pass.process).collect()
}

fn plan_error(result: Result<(), BuildError>) -> PlanError {
    match result {
        Err(BuildError::Plan(error)) => error,
        other => panic!("{other:?}"),
    }
}

#[test]
fn processes_are_added_switched_off_and_removed_between_frames() {
    let scene = dark_field();
    let mut built = build(Deferred::to_picture().leave_out("transparency")).unwrap();
    let shipped = ["geometry buffer", "tone mapping"];
    let with_fog = ["geometry buffer", "fog", "tone mapping"];
    assert_eq!(passes(&mut built, &scene), shipped);
    built.0.add_process(over("fog")).unwrap();
    assert_eq!(passes(&mut built, &scene), with_fog);
    built.0.set_process_enabled("fog", false).unwrap();
    assert_eq!(passes(&mut built, &scene), shipped);
    built.0.set_process_enabled("fog", true).unwrap();
    assert_eq!(passes(&mut built, &scene), with_fog);
    // A pipeline that is replaced, and a quality, leave the engine's processes as they are.
    built.0.set_process_enabled("fog", false).unwrap();
    built.0.set_pipeline(Deferred::to_picture().leave_out("transparency")).unwrap();
    assert_eq!(passes(&mut built, &scene), shipped);
    built.0.set_process_enabled("fog", true).unwrap();
    built.0.remove_process("fog").unwrap();
    assert_eq!(passes(&mut built, &scene), shipped);
}

#[test]
fn outputs_are_added_and_removed_between_frames() {
    let scene = dark_field();
    let mut built = build(Deferred::to_picture().leave_out("transparency")).unwrap();
    let map = |declare: &mut Declare| declare.clears_color("map", Format::Rgba8Unorm, ClearColor::Background);
    built.0.add_process(Declaring::new("map", map)).unwrap();
    assert!(!passes(&mut built, &scene).contains(&"map".to_owned()), "it leads to no output");
    built.0.add_output("map").unwrap();
    assert!(passes(&mut built, &scene).contains(&"map".to_owned()));
    // It is an output, so nothing can take its process away.
    assert!(matches!(plan_error(built.0.remove_process("map")), PlanError::UnknownOutput { .. }));
    assert!(passes(&mut built, &scene).contains(&"map".to_owned()));
    built.0.remove_output("map").unwrap();
    built.0.remove_process("map").unwrap();
    assert_eq!(passes(&mut built, &scene), ["geometry buffer", "tone mapping"]);
}

#[test]
fn names_that_the_engine_has_not_added_are_errors_that_list_those_it_has() {
    let scene = dark_field();
    let mut built = build(Deferred::to_picture().leave_out("transparency")).unwrap();
    built.0.add_process(over("fog")).unwrap();
    let message = plan_error(built.0.remove_process("smoke")).to_string();
    assert_eq!(message, "the engine has added no process \"smoke\", only: \"fog\"");
    let message = plan_error(built.0.set_process_enabled("geometry buffer", false)).to_string();
    assert_eq!(message, "the engine has added no process \"geometry buffer\", only: \"fog\"");
    let message = plan_error(built.0.remove_output("picture")).to_string();
    assert_eq!(message, "the engine has added no output \"picture\", only: none");
    assert!(matches!(plan_error(built.0.add_output("nothing")), PlanError::UnknownOutput { .. }));
    assert!(matches!(plan_error(built.0.add_process(over("fog"))), PlanError::Graph(_)), "two of one name");
    assert_eq!(passes(&mut built, &scene), ["geometry buffer", "fog", "tone mapping"]);
}

#[test]
fn frames_that_are_recorded_keep_a_process_that_is_removed() {
    let scene = dark_field();
    let (mut renderer, submitter) = build(Deferred::to_picture().leave_out("transparency")).unwrap();
    let fog = Arc::new(over("fog"));
    renderer.add_process(Arc::clone(&fog)).unwrap();
    let recorded: Vec<_> = (0..2).map(|_| renderer.record(scene.as_scene_ref()).unwrap()).collect();
    renderer.remove_process("fog").unwrap();
    let without = renderer.record(scene.as_scene_ref()).unwrap();
    for frame in recorded {
        let drawn = submitter.submit(frame).unwrap().submission.passes;
        assert!(drawn.iter().any(|pass| pass.process == "fog"));
    }
    let drawn = submitter.submit(without).unwrap().submission.passes;
    assert!(drawn.iter().all(|pass| pass.process != "fog"));
    assert_eq!(Arc::strong_count(&fog), 1);
}

/// A process that draws the picture, or over it.
#[derive(Clone)]
struct Draw {
    name: String,
    over: bool,
}

impl RenderProcess for Draw {
    fn name(&self) -> &str {
        &self.name
    }

    fn declare(&self, declare: &mut Declare) {
        match self.over {
            true => declare.draws_over("picture"),
            false => declare.clears_color("picture", Format::Rgba8Srgb, ClearColor::Background),
        }
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Commands(CommandDraws::default())
    }
}

fn draw(name: impl Into<String>, over: bool) -> Draw {
    Draw { name: name.into(), over }
}

/// A pipeline with a number of processes over its first one, and with mistakes.
#[derive(Default)]
struct Own {
    /// What the next frame requires.
    over: AtomicU64,
    /// The call that panics, or what is wrong with the processes.
    mistake: Mutex<Option<&'static str>>,
    /// Each process that it made, while it lives.
    made: Arc<()>,
    builds: AtomicU64,
}

impl Own {
    fn make(&self, mistake: &'static str) {
        *self.mistake.lock() = Some(mistake);
    }

    fn has(&self, mistake: &str) -> bool {
        *self.mistake.lock() == Some(mistake)
    }

    fn panic_in(&self, call: &str) {
        assert!(!self.has(call), "the pipeline is clogged");
    }
}

/// A process that its pipeline counts.
struct Counted(Draw, #[expect(dead_code, reason = "it counts")] Arc<()>);

impl RenderProcess for Counted {
    fn name(&self) -> &str {
        self.0.name()
    }

    fn declare(&self, declare: &mut Declare) {
        self.0.declare(declare);
    }

    fn draws(&self) -> Draws<'_> {
        self.0.draws()
    }
}

impl Pipeline for Own {
    fn requirements(&self, _: &SceneContents<'_>) -> Requirements {
        self.panic_in("requirements");
        Requirements::default().with_own(self.over.load(Ordering::Relaxed))
    }

    fn build(
        &self,
        requirements: &Requirements,
        _: DeviceSupport,
        processes: &mut PipelineProcesses,
    ) -> Result<(), PlanError> {
        self.panic_in("build");
        self.builds.fetch_add(1, Ordering::Relaxed);
        processes.process(Counted(draw("first", false), Arc::clone(&self.made)));
        for over in 0..requirements.own() % 3 {
            processes.process(Counted(draw(format!("over {over}"), true), Arc::clone(&self.made)));
        }
        // Its name is another one in each plan.
        processes.process(Counted(draw(format!("last {}", requirements.own()), true), Arc::clone(&self.made)));
        if self.has("two of one name") {
            processes.process(draw("first", true));
        }
        if self.has("a target that nobody writes") {
            processes.process(over("astray"));
        }
        processes.output(if self.has("an output that nobody writes") { "nothing" } else { "picture" });
        Ok(())
    }
}

fn set(own: &Own, over: u64) {
    own.over.store(over, Ordering::Relaxed);
}

#[test]
fn a_pipeline_that_panics_or_makes_no_frame_is_an_error_and_the_next_frame_is_drawn() {
    let scene = dark_field();
    let own = Arc::new(Own::default());
    let mut built = build(Arc::clone(&own)).unwrap();
    let cases = [
        ("requirements", "the pipeline's `requirements` panicked: the pipeline is clogged"),
        ("build", "the pipeline's `build` panicked: the pipeline is clogged"),
        ("two of one name", "two nodes are named \"first\""),
        ("a target that nobody writes", "process \"astray\" is to come after or before \"the place after lighting\""),
        ("an output that nobody writes", "nothing"),
    ];
    for (round, (mistake, expected)) in (1..).zip(cases) {
        set(&own, round);
        own.make(mistake);
        let error = built.0.record(scene.as_scene_ref()).map(drop).unwrap_err();
        assert!(matches!(error, FrameError::Plan(_)) && error.to_string().contains(expected), "{error}");
        let refused = build(Arc::clone(&own)).map(drop).unwrap_err().to_string();
        assert!(refused.contains(expected), "{refused}");
        let refused = built.0.set_pipeline(Arc::clone(&own)).unwrap_err().to_string();
        assert!(refused.contains(expected), "{refused}");
        *own.mistake.lock() = None;
        let drawn = passes(&mut built, &scene);
        assert_eq!(drawn.len() as u64, 2 + round % 3, "{drawn:?}");
    }
}

#[test]
fn a_pipeline_that_changes_its_mind_in_every_frame_draws_what_it_says_and_keeps_few_plans() {
    let scene = dark_field();
    let own = Arc::new(Own::default());
    let mut built = build(Arc::clone(&own)).unwrap();
    // Back and forth: each plan is compiled once.
    for frame in 0..20 {
        set(&own, frame % 2);
        assert_eq!(passes(&mut built, &scene).len() as u64, 2 + frame % 2);
    }
    let compiled = own.builds.load(Ordering::Relaxed);
    for frame in 0..20 {
        set(&own, frame % 2);
        passes(&mut built, &scene);
    }
    assert_eq!(own.builds.load(Ordering::Relaxed), compiled);
    // Always another: no more plans than the limit, and none of the processes of the others.
    let frames = 3 * Renderer::<NullBackend>::MAX_PLANS as u64;
    let mut alive = Vec::new();
    for frame in 0..frames {
        set(&own, frame);
        let drawn = passes(&mut built, &scene);
        assert_eq!(drawn.last(), Some(&format!("last {frame}")));
        alive.push(Arc::strong_count(&own.made));
    }
    assert_eq!(built.0.plan_count(), Renderer::<NullBackend>::MAX_PLANS);
    let (middle, end) = (alive[2 * alive.len() / 3], alive[alive.len() - 1]);
    assert!(end <= middle + 8, "{middle} processes are alive, later {end}");
    // The plan that was used last is still there, and the first one is not.
    let compiled = own.builds.load(Ordering::Relaxed);
    passes(&mut built, &scene);
    assert_eq!(own.builds.load(Ordering::Relaxed), compiled);
    set(&own, 0);
    passes(&mut built, &scene);
    assert_eq!(own.builds.load(Ordering::Relaxed), compiled + 1);
    drop(built);
    assert_eq!(Arc::strong_count(&own.made), 1);
}

/// A pipeline whose shader differs in every frame.
#[cfg(feature = "wgpu")]
#[derive(Default)]
struct Shaders(AtomicU64);

#[cfg(feature = "wgpu")]
impl Pipeline for Shaders {
    fn requirements(&self, _: &SceneContents<'_>) -> Requirements {
        Requirements::default().with_own(self.0.load(Ordering::Relaxed))
    }

    fn build(
        &self,
        requirements: &Requirements,
        _: DeviceSupport,
        processes: &mut PipelineProcesses,
    ) -> Result<(), PlanError> {
        let red = requirements.own();
        let picture = |declare: &mut Declare| {
            declare.clears_color("picture", Format::Rgba8Srgb, ClearColor::Background);
        };
        processes.process(Declaring::new("shader", picture).with_shader(format!(
            "@fragment fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {{ return vec4<f32>({red}.0); }}"
        )));
        processes.output("picture");
        Ok(())
    }
}

#[cfg(feature = "wgpu")]
#[test]
fn device_pipelines_go_with_the_plans_that_needed_them() {
    use drawloom::backend::WgpuBackend;

    let (device, queue) = drawloom_testing::adapter::noop_device().unwrap();
    let backend = WgpuBackend::new(device, queue).unwrap();
    let shaders = Arc::new(Shaders::default());
    let builder = Renderer::builder(backend).pipeline(Arc::clone(&shaders));
    let (mut renderer, submitter) = builder.build(Arc::new(Scheduler::new(1).unwrap())).unwrap();
    let scene = dark_field();
    let most = Renderer::<WgpuBackend>::MAX_PLANS;
    let mut found = Vec::new();
    for frame in 0..2 * most as u64 {
        shaders.0.store(frame, Ordering::Relaxed);
        drop(submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap());
        found.push(renderer.backend().resources().pipelines);
    }
    let largest = found.iter().max().unwrap();
    assert!((most / 2..most + 16).contains(largest), "{largest} pipelines for {most} plans");
}
