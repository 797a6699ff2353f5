//! Results in frame loops, and cameras that are replaced.

use std::sync::mpsc::channel;
use std::sync::{Arc, Mutex};

use drawloom::backend::{Picture, SoftwareBackend, WgpuBackend};
use drawloom::glam::Quat;
use drawloom::process::{Deferred, Format};
use drawloom::scene::{Camera, Scene, SceneRef};
use drawloom::{Buffering, FrameLoop, RendererBuilder};
use drawloom_async_post::{AsyncPost, AsyncStep, StepFrame, StepSource};
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{DrawingBackend, Engine};

pub const ON_ADAPTER: &[Case] = &[
    ("frames_in_flight_show_the_results_that_they_say", in_flight::<WgpuBackend>),
    ("a_result_is_of_the_camera_that_was_drawn", drawn_camera::<WgpuBackend>),
];

pub const IN_SOFTWARE: &[Case] = &[
    ("software_frames_in_flight_show_the_results_that_they_say", in_flight::<SoftwareBackend>),
    ("software_a_result_is_of_the_camera_that_was_drawn", drawn_camera::<SoftwareBackend>),
];

/// A picture of the number of the frame and of that of the view's camera, which its width tells. Cameras are noted.
#[derive(Clone, Default)]
struct Noting(Arc<Mutex<Vec<Camera>>>);

impl AsyncStep for Noting {
    fn name(&self) -> &str {
        "noting"
    }

    fn compute(&self, frame: &StepFrame<'_>) -> Picture {
        self.0.lock().unwrap().push(frame.camera.clone());
        let pixel = [frame.number as u8, frame.picture.width as u8, 0, 255];
        Picture { width: 1, height: 1, format: Format::Rgba8Unorm, bytes: pixel.to_vec() }
    }
}

fn engine<B: DrawingBackend>(step: &Noting) -> Result<Engine<B>, Failed> {
    Engine::new(step.clone(), StepSource::whole("picture"), |builder: RendererBuilder<B>, post: &AsyncPost| {
        let late = post.late_picture("late picture", Format::Rgba8Unorm);
        builder.pipeline(Deferred::to_picture()).process(late).output("late picture")
    })
}

/// Two views of different sizes.
fn scene() -> Scene {
    let mut scene = field(30);
    let main = Camera { name: "main".to_owned(), size: [40, 20], ..scene.cameras[0].clone() };
    scene.cameras = vec![Camera { name: "map".to_owned(), size: [24, 16], ..main.clone() }, main];
    scene
}

fn in_flight<B: DrawingBackend>() -> Result<(), Failed>
where
    B::Submission: Send,
{
    const FRAMES: u64 = 30;
    for buffering in Buffering::ALL {
        let step = Noting::default();
        let Engine { renderer, submitter, post } = engine::<B>(&step)?;
        let mut frames = FrameLoop::new(renderer, submitter, buffering)?;
        let (drawn, pictures) = channel();
        let scene = scene();
        for number in 1..=FRAMES {
            let (slot, finished) = frames.begin();
            for frame in finished {
                frame.outcome?;
            }
            post.begin_frame(frames.renderer(), &scene.cameras);
            let mut recorded = frames.renderer().record(scene.as_scene_ref())?;
            post.read_back(&mut recorded);
            let results: Vec<_> = post.statistics().iter().map(|view| (view.frame, view.result)).collect();
            let drawn = drawn.clone();
            slot.submit_then(recorded, move |submitted| {
                let late = [0, 1].map(|view| B::read(&submitted.submission, view, "late picture").ok());
                drawn.send((number, results, late)).unwrap();
            });
        }
        for frame in frames.finish().1 {
            frame.outcome?;
        }
        drop(drawn);
        let mut newest = [0; 2];
        for (number, results, late) in pictures {
            for (view, ((frame, result), late)) in results.into_iter().zip(late).enumerate() {
                let late = late.ok_or("a picture cannot be read")?;
                let Some(result) = result else { continue };
                let expected = [result as u8, [24, 40][view], 0, 255];
                let is_right = late.bytes.chunks_exact(4).all(|pixel| pixel == expected);
                let is_in_order = frame == number && result < number && result >= newest[view];
                if !is_right || !is_in_order {
                    return Err(format!("{buffering:?}: frame {number} of view {view} says {result}").into());
                }
                newest[view] = result;
            }
        }
        if newest.contains(&0) {
            return Err(format!("{buffering:?}: a view has no result in {FRAMES} frames").into());
        }
        if let Some(error) = post.take_errors().first() {
            return Err(error.to_string().into());
        }
    }
    Ok(())
}

fn drawn_camera<B: DrawingBackend>() -> Result<(), Failed> {
    let step = Noting::default();
    let mut engine = engine::<B>(&step)?;
    let mut scene = scene();
    scene.cameras.truncate(1);
    let turn = Quat::from_rotation_y(0.3);
    let turned = Camera { orientation: (turn * scene.cameras[0].orientation).normalize(), ..scene.cameras[0].clone() };
    let cameras = [turned.clone()];
    engine.post.begin_frame(&engine.renderer, &cameras);
    let mut recorded = engine.renderer.record(SceneRef { cameras: &cameras, ..scene.as_scene_ref() })?;
    engine.post.read_back(&mut recorded);
    let number = engine.post.statistics()[0].frame;
    let submitted = engine.submitter.submit(recorded)?;
    // A step that is late leaves out all frames but the newest.
    engine.wait_for(&submitted.submission, number, &["map"])?;
    engine.draw_and_wait(&scene, &["map"])?;
    let noted: Vec<_> = step.0.lock().unwrap().iter().map(|camera| camera.orientation).collect();
    if noted != [turned.orientation, scene.cameras[0].orientation] {
        return Err(format!("the cameras are {noted:?}").into());
    }
    engine.check_no_errors()
}
