//! A world is updated and recorded for frame N + 1 while frame N is submitted, which on the software backend is when it
//! is drawn. The pictures are those of a loop that does one thing after the other, and has no static groups.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread;

use drawloom::backend::SoftwareBackend;
use drawloom::glam::{DVec3, Quat};
use drawloom::process::Deferred;
use drawloom::scene::{Changes, Scene, SceneRef, StaticGroup};
use drawloom::task::Scheduler;
use drawloom::{Buffering, FrameLoop, Renderer, Submitter};
use drawloom_testing::scenes::field;

const FRAMES: usize = 12;
const OBJECTS: usize = 60;
/// Of these. The others stand in static groups.
const MOVING: usize = 30;

fn world() -> Scene {
    let mut scene = field(OBJECTS);
    for camera in &mut scene.cameras {
        camera.size = [48, 32];
    }
    for first in (MOVING..OBJECTS).step_by(10) {
        scene
            .static_groups
            .push(StaticGroup::new(format!("from {first}"), (first as u32..first as u32 + 10).collect()));
    }
    scene
}

/// Moves the first half of the objects, differently in each frame. Now and then another one, so that a static group is
/// recorded anew. Returns what moved.
fn update(scene: &mut Scene, frame: usize) -> Vec<u32> {
    let handles: Vec<_> = scene.objects().collect();
    let moving = (0..MOVING as u32).chain((frame % 5 == 4).then_some(MOVING as u32 + frame as u32)).collect::<Vec<_>>();
    for &index in &moving {
        let handle = handles[index as usize];
        let mut object = scene.object(handle).unwrap();
        let angle = (frame * 7 + index as usize) as f64 * 0.37;
        object.position += DVec3::new(angle.sin(), angle.cos(), 0.0) * 0.2;
        object.orientation = Quat::from_rotation_y(angle as f32);
        scene.replace_object(handle, object).unwrap();
    }
    moving
}

/// Which objects changed: in the first frame all.
fn changes(frame: usize, moved: &[u32]) -> Changes<'_> {
    if frame == 0 { Changes::Unknown } else { Changes::Objects(moved) }
}

/// The scheduler that records also draws, so both have the same workers at the same time.
fn renderer_of(workers: usize) -> (Renderer<SoftwareBackend>, Submitter<SoftwareBackend>) {
    let scheduler = Arc::new(Scheduler::new(workers).unwrap());
    let backend = SoftwareBackend::new(Arc::clone(&scheduler));
    Renderer::builder(backend).pipeline(Deferred::to_picture()).build(scheduler).unwrap()
}

/// The pictures of both cameras, one frame after the other.
fn serial_pictures() -> Vec<Vec<u8>> {
    let (mut renderer, submitter) = renderer_of(1);
    let mut scene = world();
    (0..FRAMES)
        .map(|frame| {
            let moved = update(&mut scene, frame);
            let scene = SceneRef { changes: changes(frame, &moved), static_groups: &[], ..scene.as_scene_ref() };
            let recorded = renderer.record(scene).unwrap();
            let submitted = submitter.submit(recorded).unwrap();
            (0..2).flat_map(|view| submitted.submission.read(view, "picture").unwrap().bytes).collect()
        })
        .collect()
}

fn overlapped_pictures(workers: usize, buffering: Buffering) -> Vec<Vec<u8>> {
    let (renderer, submitter) = renderer_of(workers);
    let mut frames = FrameLoop::new(renderer, submitter, buffering).unwrap();
    let (pictures, drawn) = channel();
    let mut scene = world();
    let mut executed = 0;
    for frame in 0..FRAMES {
        let (slot, _) = frames.begin();
        let moved = update(&mut scene, frame);
        let scene = SceneRef { changes: changes(frame, &moved), ..scene.as_scene_ref() };
        let recorded = frames.renderer().record(scene).unwrap();
        executed += recorded.statistics().views.iter().map(|view| view.objects_of_static_groups).sum::<usize>();
        let pictures = pictures.clone();
        slot.submit_then(recorded, move |submitted| {
            let of_view = |view| submitted.submission.read(view, "picture").unwrap().bytes;
            pictures.send((0..2).flat_map(of_view).collect()).unwrap();
        });
    }
    let (_, finished) = frames.finish();
    assert!(finished.iter().all(|frame| frame.outcome.is_ok()));
    assert!(executed > FRAMES, "static groups are executed");
    drop(pictures);
    drawn.iter().collect()
}

#[test]
fn overlapped_frames_under_load_have_the_pictures_of_a_serial_loop() {
    let expected = serial_pictures();
    assert!(expected.windows(2).all(|pair| pair[0] != pair[1]), "every frame differs from the one before");
    let is_over = AtomicBool::new(false);
    thread::scope(|threads| {
        // More threads than the machine has cores, so that each is interrupted anywhere.
        for _ in 0..thread::available_parallelism().map_or(2, usize::from) {
            threads.spawn(|| {
                while !is_over.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            });
        }
        for workers in [2, 4] {
            for buffering in Buffering::ALL {
                let found = overlapped_pictures(workers, buffering);
                let same = found == expected;
                if !same {
                    is_over.store(true, Ordering::Relaxed);
                }
                assert!(same, "{workers} workers, {buffering:?}");
            }
        }
        is_over.store(true, Ordering::Relaxed);
    });
}
