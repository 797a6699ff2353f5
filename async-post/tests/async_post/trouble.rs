//! Steps that are slow or panic, devices that fail, frames that are dropped: what is shown, and what is told.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};

use drawloom::backend::{Backend, BackendError, NullBackend, Picture, SoftwareBackend, WgpuBackend};
use drawloom::glam::Vec3;
use drawloom::process::{Deferred, Format};
use drawloom::scene::Scene;
use drawloom::task::Scheduler;
use drawloom::{Renderer, RendererBuilder, Submitter};
use drawloom_async_post::{AsyncPost, AsyncPostErrorReason, AsyncStep, StepFrame, StepSource, UploadPicture};
use drawloom_testing::adapter;
use drawloom_testing::fault_injection::{CallKind, Fault, FaultyBackend};
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{DrawingBackend, Engine, wait_until};

pub const ON_ADAPTER: &[Case] = &[
    ("a_slow_step_computes_the_newest_source_next", slow::<WgpuBackend>),
    ("a_step_that_panics_is_told_once_and_the_last_result_stays", panics::<WgpuBackend>),
    ("a_frame_that_is_dropped_has_no_result", dropped::<WgpuBackend>),
    ("a_frame_that_is_dropped_costs_no_other", dropped_in_flight::<WgpuBackend>),
    ("a_frame_of_another_renderer_is_refused", foreign_frame::<WgpuBackend>),
    ("one_worker_computes_the_step_when_the_next_frame_begins", one_worker::<WgpuBackend>),
    ("a_result_that_cannot_be_shown_is_told", unsuitable_results),
    ("another_backend_begins_anew", replaced),
    ("a_lost_device_is_told_and_another_one_begins_anew", lost),
    ("a_device_with_the_least_limits_is_enough", least_limits),
    ("nothing_is_left_of_a_step", nothing_left),
];

pub const IN_SOFTWARE: &[Case] = &[
    ("software_a_slow_step_computes_the_newest_source_next", slow::<SoftwareBackend>),
    ("software_a_step_that_panics_is_told_once_and_the_last_result_stays", panics::<SoftwareBackend>),
    ("software_a_frame_that_is_dropped_has_no_result", dropped::<SoftwareBackend>),
    ("software_a_frame_of_another_renderer_is_refused", foreign_frame::<SoftwareBackend>),
    ("software_one_worker_computes_the_step_when_the_next_frame_begins", one_worker::<SoftwareBackend>),
    ("a_submission_that_fails_has_no_result", failed_submission),
    ("a_backend_that_cannot_read_back_says_so_once", no_read_back),
    ("a_source_that_no_process_draws_is_told_once", unknown_source),
    ("the_timeline_shows_the_step_and_its_age", timeline),
];

/// A picture of one pixel of the number of the frame, and what is done before.
struct Numbered<F>(F);

impl<F: Fn(&StepFrame<'_>) + Send + Sync + 'static> AsyncStep for Numbered<F> {
    fn name(&self) -> &str {
        "numbered"
    }

    fn compute(&self, frame: &StepFrame<'_>) -> Picture {
        self.0(frame);
        let number = frame.number as u8;
        Picture { width: 1, height: 1, format: Format::Rgba8Unorm, bytes: vec![number, number, number, 255] }
    }
}

fn build<B: Backend>(builder: RendererBuilder<B>, post: &AsyncPost) -> RendererBuilder<B> {
    let late = post.late_picture("late picture", Format::Rgba8Unorm);
    builder.pipeline(Deferred::to_picture()).process(late).output("late picture")
}

fn engine<B: DrawingBackend>(
    workers: usize,
    before: impl Fn(&StepFrame<'_>) + Send + Sync + 'static,
) -> Result<Engine<B>, Failed> {
    Engine::with_workers(workers, Numbered(before), StepSource::whole("picture"), build)
}

fn scene() -> Scene {
    let mut scene = field(20);
    scene.cameras.truncate(1);
    scene.cameras[0].size = [32, 18];
    scene.cameras[0].name = "main".to_owned();
    // No picture is that of a number.
    scene.background = Vec3::splat(0.9);
    scene
}

/// The number that a frame shows; `None` if it shows its own picture.
fn shown<B: DrawingBackend>(submission: &B::Submission) -> Result<Option<u8>, Failed> {
    let late = B::read(submission, 0, "late picture")?;
    if late.bytes.chunks_exact(4).all(|pixel| pixel == [late.bytes[0], late.bytes[0], late.bytes[0], 255]) {
        return Ok(Some(late.bytes[0]));
    }
    Ok(None)
}

/// # Errors
/// If they differ.
fn expect<T: PartialEq + std::fmt::Debug>(what: &str, found: T, expected: T) -> Result<(), Failed> {
    if found == expected { Ok(()) } else { Err(format!("{what}: {found:?} instead of {expected:?}").into()) }
}

/// Steps that wait until they may go on, and the numbers of frames whose step has begun.
fn gate() -> (impl Fn(&StepFrame<'_>) + Send + Sync + 'static, Sender<()>, Receiver<u64>) {
    let ((release, released), (begin, begun)) = (channel::<()>(), channel());
    let (released, begin) = (Mutex::new(released), Mutex::new(begin));
    let wait = move |frame: &StepFrame<'_>| {
        begin.lock().unwrap().send(frame.number).unwrap();
        released.lock().unwrap().recv().unwrap();
    };
    (wait, release, begun)
}

fn slow<B: DrawingBackend>() -> Result<(), Failed> {
    let (wait, release, begun) = gate();
    let mut engine = engine::<B>(3, wait)?;
    let scene = scene();
    let draw = |engine: &mut Engine<B>| {
        let frame = engine.draw(&scene)?;
        Ok::<_, Failed>((shown::<B>(&frame.submission)?, frame.statistics[0].clone()))
    };
    expect("the first frame", draw(&mut engine)?.0, None)?;
    expect("the first step", begun.recv()?, 1)?;
    // Meanwhile frames go on, and their pixels arrive.
    for number in 2..=5_u64 {
        let (shown, statistics) = draw(&mut engine)?;
        expect("a frame while the step is computed", (shown, statistics.result), (None, None))?;
        expect("left out", statistics.skipped, number.saturating_sub(3))?;
    }
    release.send(())?;
    expect("the next step", begun.recv()?, 5)?;
    wait_until("the first result", || engine.post.latest("main").is_some_and(|(number, _)| number == 1))?;
    let (shown, statistics) = draw(&mut engine)?;
    expect("what is shown", (shown, statistics.age(), statistics.skipped), (Some(1), Some(5), 3))?;
    release.send(())?;
    expect("the step after that", begun.recv()?, 6)?;
    wait_until("the second result", || engine.post.latest("main").is_some_and(|(number, _)| number == 5))?;
    let (shown, statistics) = draw(&mut engine)?;
    expect("what is shown at last", (shown, statistics.age(), statistics.computed), (Some(5), Some(2), 2))?;
    // Those that still wait go on.
    drop(release);
    wait_until("the end", || engine.post.take_errors().len() == 1)
}

fn panics<B: DrawingBackend>() -> Result<(), Failed> {
    let attempts = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&attempts);
    let mut engine = engine::<B>(2, move |frame| {
        counted.fetch_add(1, Ordering::Relaxed);
        assert!(![3, 4, 6].contains(&frame.number), "frame {}", frame.number);
    })?;
    let scene = scene();
    let mut shown_numbers = Vec::new();
    let mut told = Vec::new();
    for number in 1..=8_u64 {
        let frame = if [3, 4, 6].contains(&number) {
            let frame = engine.draw(&scene)?;
            B::read(&frame.submission, 0, "picture")?;
            // No newer source takes its place.
            wait_until("an attempt", || attempts.load(Ordering::Relaxed) as u64 == number)?;
            frame
        } else {
            engine.draw_and_wait(&scene, &["main"])?
        };
        shown_numbers.push(shown::<B>(&frame.submission)?);
        told.extend(engine.post.take_errors());
    }
    let expected = [None, Some(1), Some(2), Some(2), Some(2), Some(5), Some(5), Some(7)];
    expect("what is shown", &shown_numbers[..], &expected[..])?;
    let is_panic = |reason: &AsyncPostErrorReason| matches!(reason, AsyncPostErrorReason::Panicked { .. });
    expect("panics", told.iter().filter(|error| is_panic(&error.reason)).count(), told.len())?;
    let told: Vec<_> = told.iter().map(|error| (error.frame, error.view.as_str(), error.step.as_str())).collect();
    expect("told", told, vec![(3, "main", "numbered"), (6, "main", "numbered")])
}

fn dropped<B: DrawingBackend>() -> Result<(), Failed> {
    let mut engine = engine::<B>(2, |_| ())?;
    let scene = scene();
    engine.draw_and_wait(&scene, &["main"])?;
    for _ in 0..3 {
        engine.post.begin_frame(&engine.renderer, &scene.cameras);
        let mut recorded = engine.renderer.record(scene.as_scene_ref())?;
        engine.post.read_back(&mut recorded);
        drop(recorded);
    }
    let frame = engine.draw_and_wait(&scene, &["main"])?;
    expect("what is shown", (shown::<B>(&frame.submission)?, frame.statistics[0].age()), (Some(1), Some(4)))?;
    let frame = engine.draw(&scene)?;
    expect("what is shown then", shown::<B>(&frame.submission)?, Some(5))?;
    engine.check_no_errors()
}

/// A frame that is dropped costs no frame that the device still draws.
fn dropped_in_flight<B: DrawingBackend>() -> Result<(), Failed> {
    let mut engine = engine::<B>(2, |_| ())?;
    let scene = scene();
    let drawn = engine.draw(&scene)?;
    engine.post.begin_frame(&engine.renderer, &scene.cameras);
    let mut recorded = engine.renderer.record(scene.as_scene_ref())?;
    engine.post.read_back(&mut recorded);
    drop(recorded);
    B::read(&drawn.submission, 0, engine.post.source_target())?;
    wait_until("the result", || engine.post.latest("main").is_some_and(|(latest, _)| latest == 1))?;
    engine.check_no_errors()
}

/// A frame of another renderer is not read back, and that is told.
fn foreign_frame<B: DrawingBackend>() -> Result<(), Failed> {
    let engine = engine::<B>(2, |_| ())?;
    let mut other = self::engine::<B>(2, |_| ())?;
    let scene = scene();
    engine.post.begin_frame(&engine.renderer, &scene.cameras);
    other.post.begin_frame(&other.renderer, &scene.cameras);
    let mut recorded = other.renderer.record(scene.as_scene_ref())?;
    engine.post.read_back(&mut recorded);
    other.submitter.submit(recorded)?;
    let errors = engine.post.take_errors();
    let is_told = matches!(&errors[..], [error] if matches!(error.reason, AsyncPostErrorReason::ForeignFrame));
    if is_told { Ok(()) } else { Err(format!("{errors:?}").into()) }
}

fn one_worker<B: DrawingBackend>() -> Result<(), Failed> {
    let mut engine = engine::<B>(1, |_| ())?;
    let scene = scene();
    for number in 1..=3_u64 {
        let frame = engine.draw(&scene)?;
        // Waits until it is drawn, so that the next frame finds its pixels.
        let shown = shown::<B>(&frame.submission)?;
        expect(
            "what is shown",
            (shown, frame.statistics[0].frame),
            (number.checked_sub(1).filter(|n| *n > 0).map(|n| n as u8), number),
        )?;
    }
    engine.check_no_errors()
}

/// A step that returns what it is told to.
struct Returns(Picture);

impl AsyncStep for Returns {
    fn name(&self) -> &str {
        "returns"
    }

    fn compute(&self, _frame: &StepFrame<'_>) -> Picture {
        self.0.clone()
    }
}

fn unsuitable_results() -> Result<(), Failed> {
    let picture = |width, height, format, bytes| Picture { width, height, format, bytes: vec![0; bytes] };
    let invalid = [
        picture(2, 2, Format::Rgba8Unorm, 15),
        picture(0, 2, Format::Rgba8Unorm, 0),
        picture(u32::MAX, u32::MAX, Format::Rgba16Float, 8),
        picture(1, 1, Format::R32Float, 4),
        picture(1, 1, Format::Depth32Float, 4),
    ];
    let too_large = picture(100_000, 1, Format::R8Unorm, 100_000);
    for (picture, is_invalid) in invalid.into_iter().map(|picture| (picture, true)).chain([(too_large, false)]) {
        let what = format!("{}x{} {:?}", picture.width, picture.height, picture.format);
        let mut engine =
            Engine::<WgpuBackend>::new(Returns(picture), StepSource::whole("picture"), |builder, post| {
                build(builder, post)
            })?;
        let frame = engine.draw(&scene())?;
        WgpuBackend::read(&frame.submission, 0, "picture")?;
        let errors = Mutex::new(Vec::new());
        wait_until("an error", || {
            errors.lock().unwrap().extend(engine.post.take_errors());
            !errors.lock().unwrap().is_empty()
        })?;
        let errors = errors.into_inner()?;
        let is_expected = match errors[0].reason {
            AsyncPostErrorReason::InvalidPicture { .. } | AsyncPostErrorReason::NotFilterable { .. } => is_invalid,
            AsyncPostErrorReason::Backend(BackendError::Validation { .. }) => !is_invalid,
            _ => false,
        };
        if !is_expected {
            return Err(format!("{what}: {}", errors[0]).into());
        }
        // Frames go on.
        expect("what is shown", shown::<WgpuBackend>(&engine.draw(&scene())?.submission)?, None)?;
    }
    Ok(())
}

fn replaced() -> Result<(), Failed> {
    let mut engine = engine::<WgpuBackend>(2, |_| ())?;
    let scene = scene();
    engine.draw_and_wait(&scene, &["main"])?;
    let in_flight = engine.draw(&scene)?;
    let [(device, queue), _] = adapter::two_devices()?;
    engine.submitter = engine.renderer.replace_backend(WgpuBackend::new(device, queue)?);
    let first = engine.draw_and_wait(&scene, &["main"])?;
    expect("the first frame on the other device", shown::<WgpuBackend>(&first.submission)?, None)?;
    WgpuBackend::read(&in_flight.submission, 0, "picture")?;
    let second = engine.draw(&scene)?;
    expect("the second one", shown::<WgpuBackend>(&second.submission)?, Some(3))?;
    engine.check_no_errors()
}

fn lost() -> Result<(), Failed> {
    let [(device, queue), (other_device, other_queue)] = adapter::two_devices()?;
    let mut engine = engine::<WgpuBackend>(2, |_| ())?;
    engine.submitter = engine.renderer.replace_backend(WgpuBackend::new(device.clone(), queue)?);
    let scene = scene();
    engine.draw_and_wait(&scene, &["main"])?;
    device.destroy();
    for _ in 0..3 {
        engine.post.begin_frame(&engine.renderer, &scene.cameras);
        if let Ok(mut recorded) = engine.renderer.record(scene.as_scene_ref()) {
            engine.post.read_back(&mut recorded);
            if engine.submitter.submit(recorded).is_ok() {
                return Err("a frame was submitted to a lost device".into());
            }
        }
    }
    if engine.post.take_errors().len() > 1 {
        return Err("the loss is told more than once".into());
    }
    engine.submitter = engine.renderer.replace_backend(WgpuBackend::new(other_device, other_queue)?);
    let first = engine.draw_and_wait(&scene, &["main"])?;
    expect("the first frame on the other device", shown::<WgpuBackend>(&first.submission)?, None)?;
    let number = first.statistics[0].frame as u8;
    expect("the second one", shown::<WgpuBackend>(&engine.draw(&scene)?.submission)?, Some(number))?;
    engine.check_no_errors()
}

fn least_limits() -> Result<(), Failed> {
    let (device, queue) = adapter::device_with_limits(WgpuBackend::REQUIRED_LIMITS)?;
    let mut engine = engine::<WgpuBackend>(2, |_| ())?;
    engine.submitter = engine.renderer.replace_backend(WgpuBackend::new(device, queue)?);
    let scene = scene();
    engine.draw_and_wait(&scene, &["main"])?;
    expect("what is shown", shown::<WgpuBackend>(&engine.draw(&scene)?.submission)?, Some(1))?;
    engine.check_no_errors()
}

fn nothing_left() -> Result<(), Failed> {
    let witness = Arc::new(());
    let (in_step, scene) = (Arc::clone(&witness), scene());
    let mut engine = engine::<WgpuBackend>(2, move |_| _ = &in_step)?;
    let mut submissions = Vec::new();
    for _ in 0..5 {
        submissions.push(engine.draw(&scene)?);
    }
    // With frames in flight, whose callbacks come later.
    drop(engine);
    wait_until("the end of the step", || Arc::strong_count(&witness) == 1)?;
    WgpuBackend::read(&submissions[4].submission, 0, "picture")?;
    Ok(())
}

fn on<B: Backend + UploadPicture>(backend: B, source: &str) -> Result<(Renderer<B>, Submitter<B>, AsyncPost), Failed> {
    let scheduler = Arc::new(Scheduler::new(2)?);
    let post = AsyncPost::new(Arc::clone(&scheduler), Numbered(|_: &StepFrame<'_>| ()), StepSource::whole(source));
    let builder = Renderer::builder(backend).pipeline(Deferred::to_picture());
    let (renderer, submitter) = builder.build(scheduler)?;
    Ok((renderer, submitter, post))
}

fn failed_submission() -> Result<(), Failed> {
    let scheduler = Arc::new(Scheduler::new(2)?);
    let backend = FaultyBackend::new(SoftwareBackend::new(scheduler));
    let (mut renderer, submitter, post) = on(backend, "picture")?;
    let scene = scene();
    renderer.backend().inject(CallKind::Submit, 1, Fault::OutOfMemory);
    for number in 1..=3_u64 {
        post.begin_frame(&renderer, &scene.cameras);
        let mut recorded = renderer.record(scene.as_scene_ref())?;
        post.read_back(&mut recorded);
        let is_submitted = submitter.submit(recorded).is_ok();
        expect("whether it is submitted", is_submitted, number != 2)?;
        if is_submitted {
            wait_until("the result", || post.latest("main").is_some_and(|(latest, _)| latest == number))?;
        }
    }
    expect("errors", post.take_errors().len(), 0)
}

/// # Errors
/// If not one error is told in three frames.
fn told_once<B: Backend + UploadPicture>(
    backend: B,
    source: &str,
    is_expected: impl Fn(&BackendError) -> bool,
) -> Result<(), Failed> {
    let (mut renderer, submitter, post) = on(backend, source)?;
    let scene = scene();
    for _ in 0..3 {
        post.begin_frame(&renderer, &scene.cameras);
        let mut recorded = renderer.record(scene.as_scene_ref())?;
        post.read_back(&mut recorded);
        submitter.submit(recorded)?;
    }
    let errors = post.take_errors();
    match &errors[..] {
        [error] if matches!(&error.reason, AsyncPostErrorReason::Backend(reason) if is_expected(reason)) => Ok(()),
        _ => Err(format!("{errors:?}").into()),
    }
}

fn no_read_back() -> Result<(), Failed> {
    told_once(NullBackend, "picture", |error| matches!(error, BackendError::CannotReadBack))
}

fn unknown_source() -> Result<(), Failed> {
    let backend = SoftwareBackend::new(Arc::new(Scheduler::new(1)?));
    told_once(backend, "no such target", |error| matches!(error, BackendError::UnknownTarget { .. }))
}

fn timeline() -> Result<(), Failed> {
    let mut engine = engine::<SoftwareBackend>(2, |_| ())?;
    let scene = scene();
    engine.renderer.scheduler().timeline().start();
    for _ in 0..3 {
        engine.draw_and_wait(&scene, &["main"])?;
    }
    let log = engine.renderer.scheduler().timeline().take();
    let steps = log.spans.iter().filter(|span| span.name == "numbered").count();
    expect("spans", steps >= 2, true)?;
    let ages = log.counters.iter().filter(|counter| counter.name == "age of numbered in main, frames");
    expect("ages", ages.map(|counter| counter.value).collect(), vec![1.0, 1.0])
}
