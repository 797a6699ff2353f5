//! A panicking render process fails the frame with an error that names it, and the next frame is complete.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use drawloom::backend::NullBackend;
use drawloom::process::{Declare, Deferred, Draws, FullScreen, ProcessError, RenderProcess};
use drawloom::task::Scheduler;
use drawloom::{FrameError, Renderer};
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
        Renderer::builder(NullBackend).deferred(Deferred::to_picture()).process(fragile).build(scheduler).unwrap();
    let scene = field(500);
    for frame in 0..20 {
        let broken = frame % 2 == 1;
        breaks.store(broken, Ordering::Relaxed);
        match renderer.record(scene.as_scene_ref()) {
            Ok(recorded) => {
                assert!(!broken);
                assert_eq!(submitter.submit(recorded).unwrap().submission.passes.len(), 12);
            }
            Err(FrameError::Process(ProcessError::Panicked { process, message })) => {
                assert!(broken);
                assert_eq!((process.as_str(), message.as_str()), ("fragile", "the glass is broken"));
            }
            Err(other) => panic!("{other}"),
        }
    }
}
