//! Frames that execute pieces allocate no more than frames without pieces.

use std::sync::Arc;

use drawloom::Renderer;
use drawloom::backend::NullBackend;
use drawloom::glam::DVec3;
use drawloom::process::Deferred;
use drawloom::quality::Quality;
use drawloom::scene::{Changes, ObjectSet, Piece, SceneRef};
use drawloom::task::Scheduler;
use drawloom_testing::scenes::field;

use crate::allocation_count;

const OBJECTS: u32 = 600;
const FRAMES: usize = 120;
const COUNTED: usize = 60;

/// The allocations of most frames, while a camera moves; and how many frames executed another number of pieces than the
/// frame before.
fn allocations(pieces: &[Piece]) -> (usize, usize) {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let builder = Renderer::builder(NullBackend).deferred(Deferred::to_picture()).quality(Quality::balanced());
    let (mut renderer, submitter) = builder.build(scheduler).unwrap();
    let scene = field(OBJECTS as usize);
    let mut cameras = scene.cameras.clone();
    let (mut counts, mut executed) = (Vec::new(), Vec::new());
    for frame in 0..FRAMES {
        // To and fro, twice.
        let along = frame % (FRAMES / 2);
        cameras[0].position = DVec3::new(0.0, 2.0, 24.0 - 0.8 * along.min(FRAMES / 2 - along) as f64);
        let before = allocation_count();
        let recorded =
            renderer.record(SceneRef { cameras: &cameras, pieces, changes: Changes::NONE, ..scene.as_scene_ref() });
        let submitted = submitter.submit(recorded.unwrap()).unwrap();
        counts.push(allocation_count() - before);
        executed.push(submitted.statistics.views[0].pieces);
    }
    let changes = executed[COUNTED..].windows(2).filter(|pair| pair[0] != pair[1]).count();
    // A controller that tries an alternative may allocate in some frames.
    let counted = &mut counts[COUNTED..];
    counted.sort_unstable();
    (counted[counted.len() * 3 / 4], changes)
}

pub fn frames_that_execute_pieces_allocate_nothing_more() {
    // Of one object each, so that every motion brings some into sight.
    let piece = |object: u32| Piece::new(format!("object {object}"), ObjectSet::new([object]));
    let pieces: Vec<_> = (0..OBJECTS).map(piece).collect();
    let (with, changes) = allocations(&pieces);
    let (without, _) = allocations(&[]);
    assert!(changes > 5, "the camera sees the same pieces");
    assert!(with <= without, "{with} allocations instead of {without}");
}
