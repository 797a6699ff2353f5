//! Frames that execute static groups allocate no more than frames without static groups.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::NullBackend;
use drawloom::glam::DVec3;
use drawloom::process::Deferred;
use drawloom::quality::Quality;
use drawloom::scene::{Changes, ObjectSet, SceneRef, StaticGroup};
use drawloom::task::Scheduler;
use drawloom_testing::scenes::field;

use crate::allocation_count;

const OBJECTS: u32 = 600;
const FRAMES: usize = 120;
const COUNTED: usize = 60;

/// The allocations of most frames, while a camera moves; and how many frames executed another number of static groups
/// than the frame before.
fn allocations(static_groups: &[StaticGroup]) -> (usize, usize) {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).quality(Quality::balanced());
    let (mut renderer, submitter) = builder.build(scheduler).unwrap();
    let scene = field(OBJECTS as usize);
    let mut cameras = scene.cameras.clone();
    let (mut counts, mut executed) = (Vec::new(), Vec::new());
    for frame in 0..FRAMES {
        // To and fro, twice.
        let along = frame % (FRAMES / 2);
        cameras[0].position = DVec3::new(0.0, 2.0, 24.0 - 0.8 * along.min(FRAMES / 2 - along) as f64);
        let before = allocation_count();
        let recorded = renderer.record(SceneRef {
            cameras: &cameras,
            static_groups,
            changes: Changes::NONE,
            ..scene.as_scene_ref()
        });
        let submitted = submitter.submit(recorded.unwrap()).unwrap();
        counts.push(allocation_count() - before);
        executed.push(submitted.statistics.views[0].static_groups);
    }
    let changes = executed[COUNTED..].windows(2).filter(|pair| pair[0] != pair[1]).count();
    // A controller that tries an alternative may allocate in some frames.
    let counted = &mut counts[COUNTED..];
    counted.sort_unstable();
    (counted[counted.len() * 3 / 4], changes)
}

pub fn frames_that_execute_static_groups_allocate_nothing_more() {
    // Of one object each, so that every motion brings some into sight.
    let static_group = |object: u32| StaticGroup::new(format!("object {object}"), ObjectSet::new([object]));
    let static_groups: Vec<_> = (0..OBJECTS).map(static_group).collect();
    let (with, changes) = allocations(&static_groups);
    let (without, _) = allocations(&[]);
    assert!(changes > 5, "the camera sees the same static groups");
    assert!(with <= without, "{with} allocations instead of {without}");
}
