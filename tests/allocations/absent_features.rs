//! What a scene does not use requests no memory: its frames have as many allocations as with a renderer that lacks the
//! feature.

use std::sync::Arc;

use drawloom::ViewBudget;
use drawloom::backend::NullBackend;
use drawloom::scene::SceneRef;
use drawloom::task::Scheduler;
use drawloom_testing::absent_features::{AbsentFeature, Setup, VIEW_ARRAYS, absent_features};

use crate::allocation_count;

const WARM_UP: usize = 20;
const COUNTED: usize = 10;

/// The allocations of frames, on the thread that records.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Allocations {
    /// In the first frame, whose plan is known.
    first: usize,
    /// In each later frame, where tables and queues have their final size.
    steady: usize,
}

fn allocations(feature: &AbsentFeature, setup: &Setup) -> Allocations {
    // One worker: which worker is the first to need something depends on times.
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let (mut renderer, submitter) = setup.builder(NullBackend).build(scheduler).unwrap();
    let mut budget = ViewBudget::new(1e6).unwrap();
    // A plan is made of all processes that there could be, so it costs more with a feature.
    renderer.prepare_pipelines(feature.scene.as_scene_ref()).unwrap();
    let mut frame = || {
        let mut cameras = feature.cameras(setup);
        if setup.has_budget {
            cameras = budget.cameras(&setup.views(&feature.scene)).unwrap();
            renderer.add_choices(budget.choices());
        }
        let before = allocation_count();
        let recorded = renderer.record(SceneRef { cameras: &cameras, ..feature.scene.as_scene_ref() }).unwrap();
        let submitted = submitter.submit(recorded).unwrap();
        let allocations = allocation_count() - before;
        budget.update(&submitted.statistics);
        allocations
    };
    let first = frame();
    (1..WARM_UP).for_each(|_| _ = frame());
    let steady: Vec<_> = (0..COUNTED).map(|_| frame()).collect();
    // A controller that tries an alternative may allocate.
    Allocations { first, steady: steady.into_iter().min().unwrap() }
}

pub fn what_a_scene_does_not_use_allocates_nothing() {
    for feature in absent_features() {
        let [with, mut without] = [&feature.with, &feature.without].map(|setup| allocations(&feature, setup));
        assert!(with.first > 0);
        if feature.name == VIEW_ARRAYS {
            // The process that samples the cube is one with a longer declaration.
            without.first = with.first;
        }
        assert_eq!(with, without, "{}", feature.name);
    }
}
