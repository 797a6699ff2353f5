//! Asynchronous post-processing: its steps, and what reads their sources back.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::{Picture, SoftwareBackend};
use drawloom::process::Deferred;
use drawloom::task::Scheduler;
use drawloom_async_post::{AsyncPost, AsyncStep, StepFrame, StepSource};

use crate::engine::{OwnBackend, OwnProcess};
use crate::frames::worlds;
use crate::fuse::{self, Kind, Owned, PLANNED, call};
use crate::within_time;

/// A step of the engine's, which does not change a picture.
struct OwnStep {
    _dropped: Owned<()>,
}

impl OwnStep {
    fn new() -> Self {
        Self { _dropped: Owned::new("step", ()) }
    }
}

impl AsyncStep for OwnStep {
    fn name(&self) -> &str {
        call(Kind::Step, "name");
        "step"
    }

    fn compute(&self, frame: &StepFrame<'_>) -> Picture {
        call(Kind::Step, "compute");
        frame.picture.clone()
    }
}

/// A call of a kind panics in one of three frames, or when the handle is made or dropped. Returns which did, the
/// errors, and the result of a frame after those.
fn compute(kind: Kind, index: usize, has_text: bool) -> (Option<&'static str>, Vec<String>, Picture) {
    let [mut scene, _] = worlds();
    scene.cameras.truncate(1);
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let backend = OwnBackend::new(SoftwareBackend::new(Arc::clone(&scheduler)), false);
    let builder = Renderer::builder(backend).pipeline(Deferred::to_picture()).process(OwnProcess::new());
    let (mut renderer, submitter) = builder.build(Arc::clone(&scheduler)).unwrap();
    fuse::arm(kind, index, has_text);
    let post = AsyncPost::new(scheduler, OwnStep::new(), StepSource::whole("picture"));
    let mut draw = || {
        post.begin_frame(&renderer, &scene.cameras);
        let mut recorded = renderer.record(scene.as_scene_ref()).unwrap();
        post.read_back(&mut recorded);
        let submitted = submitter.submit(recorded).unwrap();
        // Its destructor is the engine's to catch.
        catch_unwind(AssertUnwindSafe(|| drop(submitted))).unwrap_or_else(std::mem::forget);
    };
    (0..3).for_each(|_| draw());
    let before = fuse::disarm();
    draw();
    post.begin_frame(&renderer, &scene.cameras);
    let (number, result) = post.latest("main").expect("there is a result");
    assert_eq!(number, 4, "after {before:?}");
    let errors = post.take_errors().iter().map(ToString::to_string).collect();
    // The destructor of the step is the last.
    fuse::arm(kind, 0, has_text);
    drop(post);
    let last = fuse::disarm();
    assert_eq!(last.is_some(), kind == Kind::Destructor);
    (before, errors, Arc::unwrap_or_clone(result))
}

fn each_call_panics_once(kind: Kind) -> Vec<&'static str> {
    let (alive_before, mut panicked) = (fuse::alive(), Vec::new());
    let (_, _, expected) = compute(kind, usize::MAX, true);
    for index in 0.. {
        let has_text = index % 2 == 0;
        let outcome = catch_unwind(|| compute(kind, index, has_text));
        let (blown, errors, shown) = outcome.unwrap_or_else(|_| panic!("{kind:?} {index} unwinds or has no result"));
        assert!(shown == expected, "{blown:?}: the result is another one");
        let may_fail = blown.is_some() && kind == Kind::Step;
        assert_eq!(errors.len(), usize::from(may_fail), "{blown:?}: {errors:?}");
        for error in errors {
            assert!(error.contains("the step") && error.contains("panicked"), "{blown:?}: {error}");
            assert_eq!(error.contains(PLANNED), has_text, "{blown:?}: {error}");
        }
        assert_eq!(fuse::alive(), alive_before, "after {blown:?}");
        let Some(blown) = blown else { break };
        panicked.push(blown);
    }
    panicked.sort_unstable();
    panicked.dedup();
    panicked
}

#[test]
fn a_panic_in_any_call_of_a_step_or_of_what_reads_back_is_an_error() {
    within_time(|| assert_eq!(each_call_panics_once(Kind::Step), ["compute", "name", "read"]));
}

#[test]
fn a_panic_in_any_destructor_of_a_step_changes_nothing() {
    within_time(|| assert!(each_call_panics_once(Kind::Destructor).contains(&"read_back")));
}
