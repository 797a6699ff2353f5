//! Views that come and go forever, each with a name that no other view has had, leave no memory behind.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::{Backend, NullBackend, SoftwareBackend};
use drawloom::process::Deferred;
use drawloom::scene::{Camera, Scene, SceneRef};
use drawloom::task::Scheduler;
use drawloom_testing::scenes::field;

use crate::allocated_bytes;

/// In frames of one to five views.
const PERIOD: usize = 5;
/// Caches of recent frames are full then.
const WARM_UP: usize = 20 * PERIOD;
const FRAMES: usize = 1_000;
/// If each view kept a table of its own, that would be several times as much.
const MAX_GROWTH: usize = 16 * 1024;

fn growth<B: Backend>(backend: impl Fn(&Arc<Scheduler>) -> B, scene: &Scene) -> usize {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let (mut renderer, submitter) =
        Renderer::builder(backend(&scheduler)).pipeline(Deferred::to_picture()).build(scheduler).unwrap();
    let mut before = 0;
    for frame in 0..WARM_UP + FRAMES {
        if frame == WARM_UP {
            before = allocated_bytes();
        }
        let camera = |view| Camera { name: format!("{frame:4} {view}"), size: [8, 8], ..scene.cameras[0].clone() };
        let cameras: Vec<_> = (0..frame % PERIOD + 1).map(camera).collect();
        let recorded = renderer.record(SceneRef { cameras: &cameras, ..scene.as_scene_ref() }).unwrap();
        submitter.submit(recorded).unwrap();
    }
    allocated_bytes().saturating_sub(before)
}

pub fn views_of_ever_new_names_leave_no_memory_behind() {
    let scene = field(10);
    let software = |scheduler: &Arc<Scheduler>| SoftwareBackend::new(Arc::clone(scheduler));
    for growth in [growth(|_| NullBackend, &scene), growth(software, &scene)] {
        assert!(growth < MAX_GROWTH, "{FRAMES} frames leave {growth} bytes");
    }
}
