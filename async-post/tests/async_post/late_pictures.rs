//! The whole picture, computed from an earlier frame.

use std::sync::Arc;

use drawloom::backend::{Picture, SoftwareBackend, WgpuBackend};
use drawloom::glam::Vec3;
use drawloom::process::{Deferred, Format};
use drawloom::scene::{Camera, Scene};
use drawloom::{Renderer, RendererBuilder};
use drawloom_async_post::{AsyncPost, AsyncStep, StepFrame, StepSource};
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{DrawingBackend, Engine, wait_until};

pub const ON_ADAPTER: &[Case] = &[
    ("a_late_picture_is_the_step_of_the_frame_before", late::<WgpuBackend>),
    ("the_first_picture_and_that_of_another_size_are_the_frames_own", first_and_resized::<WgpuBackend>),
    ("each_view_has_its_own_results", several_views::<WgpuBackend>),
    ("a_renderer_of_its_own_draws_a_picture_before_the_next_frame", alone::<WgpuBackend>),
];

pub const IN_SOFTWARE: &[Case] = &[
    ("software_a_late_picture_is_the_step_of_the_frame_before", late::<SoftwareBackend>),
    ("software_the_first_picture_and_that_of_another_size_are_the_frames_own", first_and_resized::<SoftwareBackend>),
    ("software_each_view_has_its_own_results", several_views::<SoftwareBackend>),
    ("software_a_renderer_of_its_own_draws_a_picture_before_the_next_frame", alone::<SoftwareBackend>),
];

/// The negative of a picture of bytes.
struct Negative;

impl AsyncStep for Negative {
    fn name(&self) -> &str {
        "negative"
    }

    fn compute(&self, frame: &StepFrame<'_>) -> Picture {
        let mut picture = frame.picture.clone();
        let rows = picture.bytes.chunks_mut(picture.width as usize * 4);
        let outcome = frame.scheduler.parallel_for_each(rows, |row, _worker| {
            row.chunks_mut(4).for_each(|pixel| pixel[..3].iter_mut().for_each(|channel| *channel = 255 - *channel));
        });
        outcome.unwrap();
        picture
    }
}

fn negative_of(picture: &Picture) -> Vec<u8> {
    let pixels = picture.bytes.chunks(4);
    pixels.flat_map(|pixel| [255 - pixel[0], 255 - pixel[1], 255 - pixel[2], pixel[3]]).collect()
}

fn engine<B: DrawingBackend>() -> Result<Engine<B>, Failed> {
    Engine::new(Negative, StepSource::whole("picture"), |builder: RendererBuilder<B>, post: &AsyncPost| {
        let late = post.late_picture("late picture", Format::Rgba8Srgb);
        builder.pipeline(Deferred::to_picture()).process(late).output("late picture")
    })
}

fn scene() -> Scene {
    let mut scene = field(40);
    scene.cameras.truncate(1);
    scene.cameras[0].size = [64, 36];
    scene
}

fn name_of(scene: &Scene) -> &str {
    &scene.cameras[0].name
}

fn late<B: DrawingBackend>() -> Result<(), Failed> {
    let mut engine = engine::<B>()?;
    let mut scene = scene();
    let mut before: Option<Picture> = None;
    for frame in 1..=5_u64 {
        scene.background = Vec3::new(frame as f32 * 0.15, 0.5, 1.0 - frame as f32 * 0.15);
        let drawn = engine.draw_and_wait(&scene, &[name_of(&scene)])?;
        let late = B::read(&drawn.submission, 0, "late picture")?;
        let statistics = &drawn.statistics[0];
        if let Some(before) = before {
            if late.bytes != negative_of(&before) {
                return Err(format!("frame {frame} does not show the step of the frame before").into());
            }
            if (statistics.frame, statistics.result, statistics.age()) != (frame, Some(frame - 1), Some(1)) {
                return Err(format!("{statistics:?}").into());
            }
        }
        before = Some(B::read(&drawn.submission, 0, "picture")?);
    }
    engine.check_no_errors()
}

fn first_and_resized<B: DrawingBackend>() -> Result<(), Failed> {
    let mut engine = engine::<B>()?;
    let mut scene = scene();
    for size in [[64, 36], [40, 40], [64, 36]] {
        scene.cameras[0].size = size;
        let first = engine.draw_and_wait(&scene, &[name_of(&scene)])?;
        let own = B::read(&first.submission, 0, "picture")?;
        if B::read(&first.submission, 0, "late picture")? != own || first.statistics[0].result.is_some() {
            return Err(format!("the first picture of {size:?} is not its own").into());
        }
        let second = engine.draw(&scene)?;
        if B::read(&second.submission, 0, "late picture")?.bytes != negative_of(&own) {
            return Err(format!("the second picture of {size:?} is not the step of the first").into());
        }
    }
    engine.check_no_errors()
}

fn several_views<B: DrawingBackend>() -> Result<(), Failed> {
    let mut engine = engine::<B>()?;
    let mut scene = scene();
    let main = scene.cameras[0].clone();
    let map = Camera { name: "map".to_owned(), size: [20, 30], position: main.position + 2.0, ..main.clone() };
    let again = Camera { name: "map".to_owned(), position: main.position - 2.0, ..map.clone() };
    scene.cameras = vec![main.clone(), map.clone(), again];
    let names = [main.name.as_str(), "map"];
    let first = engine.draw_and_wait(&scene, &names)?;
    let own = [0, 1].map(|view| B::read(&first.submission, view, "picture"));
    // In another order, and beside a view that is new.
    let other = Camera { name: "other".to_owned(), ..main.clone() };
    scene.cameras = vec![map, other, main];
    let second = engine.draw(&scene)?;
    let [of_main, of_map] = own;
    let shown = |view| B::read(&second.submission, view, "late picture");
    if shown(0)?.bytes != negative_of(&of_map?) || shown(2)?.bytes != negative_of(&of_main?) {
        return Err("a view shows the result of another one".into());
    }
    if shown(1)? != B::read(&second.submission, 1, "picture")? {
        return Err("a new view shows a result".into());
    }
    let results: Vec<_> = second.statistics.iter().map(|of_view| of_view.result).collect();
    if results != [Some(1), None, Some(1)] {
        return Err(format!("{:?}", second.statistics).into());
    }
    engine.check_no_errors()
}

fn alone<B: DrawingBackend>() -> Result<(), Failed> {
    let mut engine = Engine::<B>::new(Negative, StepSource::whole("picture"), |builder, _| {
        builder.pipeline(Deferred::to_picture())
    })?;
    let scheduler = Arc::clone(engine.renderer.scheduler());
    let late = engine.post.late_picture_alone("late picture", Format::Rgba8Srgb);
    let builder = Renderer::builder(B::open(&scheduler)?).process(late).output("late picture");
    let (mut renderer, submitter) = builder.build(scheduler)?;
    let mut scene = scene();
    let mut pictures = Scene::new();
    pictures.cameras = scene.cameras.clone();
    let mut before: Option<Picture> = None;
    for number in 1..=4_u64 {
        scene.background = Vec3::new(number as f32 * 0.2, 0.5, 1.0 - number as f32 * 0.2);
        engine.post.begin_frame(&engine.renderer, &scene.cameras);
        let submitted = submitter.submit(renderer.record(pictures.as_scene_ref())?)?;
        let late = B::read(&submitted.submission, 0, "late picture")?;
        let shown = engine.post.shown(name_of(&scene));
        let expected = before.as_ref().map_or_else(|| vec![0; late.bytes.len()], negative_of);
        if late.bytes != expected || shown != number.checked_sub(1).filter(|number| *number > 0) {
            return Err(format!("before frame {number}, the picture of {shown:?} is another one").into());
        }
        let mut recorded = engine.renderer.record(scene.as_scene_ref())?;
        engine.post.read_back(&mut recorded);
        let submission = engine.submitter.submit(recorded)?.submission;
        before = Some(B::read(&submission, 0, "picture")?);
        wait_until("a result", || engine.post.latest(name_of(&scene)).is_some_and(|(latest, _)| latest == number))?;
    }
    engine.check_no_errors()
}
