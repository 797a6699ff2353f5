//! A panicking render process fails the frame with an error that names it, and the next frame is complete.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use drawloom::backend::NullBackend;
use drawloom::process::{Declare, Deferred, Draws, FullScreen, PlanError, PostStep, RenderProcess, ToneMapping};
use drawloom::quality::Quality;
use drawloom::task::Scheduler;
use drawloom::{BuildError, FrameError, Renderer};
use drawloom_testing::scenes::field;

/// Panics while `breaks` is set.
struct Fragile {
    breaks: Arc<AtomicBool>,
}

impl RenderProcess for Fragile {
    fn name(&self) -> &str {
        "fragile"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.draws_over("radiance");
        declare.after("transparency");
    }

    fn draws(&self) -> Draws<'_> {
        assert!(!self.breaks.load(Ordering::Relaxed), "the glass is broken");
        Draws::FullScreen(FullScreen::default())
    }
}

#[test]
fn a_panic_is_an_error_that_names_the_process_and_the_next_frame_succeeds() {
    let breaks = Arc::new(AtomicBool::new(false));
    let scheduler = Arc::new(Scheduler::new(3).unwrap());
    let fragile = Fragile { breaks: Arc::clone(&breaks) };
    let (mut renderer, submitter) =
        Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).process(fragile).build(scheduler).unwrap();
    let scene = field(500);
    for frame in 0..20 {
        let broken = frame % 2 == 1;
        breaks.store(broken, Ordering::Relaxed);
        match renderer.record(scene.as_scene_ref()) {
            Ok(recorded) => {
                assert!(!broken);
                assert_eq!(submitter.submit(recorded).unwrap().submission.passes.len(), 12);
            }
            Err(FrameError::Plan(PlanError::ProcessPanicked { process, message })) => {
                assert!(broken);
                assert_eq!((process.as_str(), message.as_str()), ("fragile", "the glass is broken"));
            }
            Err(other) => panic!("{other}"),
        }
    }
}

/// A step of post-processing that panics where it is asked.
struct FragileStep {
    breaks: &'static str,
}

/// A process that panics when it is asked for its name.
struct Nameless;

impl RenderProcess for Nameless {
    fn name(&self) -> &str {
        panic!("no name")
    }

    fn declare(&self, declare: &mut Declare) {
        declare.draws_over("radiance");
    }

    fn draws(&self) -> Draws<'_> {
        Draws::FullScreen(FullScreen::default())
    }
}

impl PostStep for FragileStep {
    fn process(&self, source: &str, target: &str) -> Arc<dyn RenderProcess> {
        match self.breaks {
            "process" => panic!("no process"),
            "name" => Arc::new(Nameless),
            _ => ToneMapping::default().process(source, target),
        }
    }

    fn with_quality(&self, _quality: &Quality) -> Option<Arc<dyn PostStep>> {
        assert!(self.breaks != "quality", "no quality");
        None
    }
}

#[test]
fn a_step_or_process_that_panics_while_the_frame_is_planned_is_an_error() {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let with_step = |breaks| Renderer::builder(NullBackend).pipeline(Deferred::new().post(FragileStep { breaks }));
    let message = |built: Result<_, BuildError>| match built.map(|_: (Renderer<NullBackend>, _)| ()) {
        Err(BuildError::Plan(PlanError::Panicked { message } | PlanError::PipelinePanicked { message, .. })) => message,
        other => panic!("{other:?}"),
    };
    for (breaks, expected) in [("process", "no process"), ("name", "no name")] {
        assert_eq!(message(with_step(breaks).build(Arc::clone(&scheduler))), expected);
    }
    let with_quality = with_step("quality").quality(Quality::fast());
    assert_eq!(message(with_quality.build(Arc::clone(&scheduler))), "no quality");
    let nameless = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).process(Nameless);
    assert_eq!(message(nameless.build(Arc::clone(&scheduler))), "no name");

    let (mut renderer, _submitter) = with_step("quality").build(scheduler).unwrap();
    let refused = renderer.set_quality(Quality::fast());
    let call = "with_quality";
    assert!(matches!(refused, Err(BuildError::Plan(PlanError::PipelinePanicked { call: named, .. })) if named == call));
    assert_eq!(renderer.quality(), &Quality::balanced());
    assert!(renderer.record(field(10).as_scene_ref()).is_ok());
}
