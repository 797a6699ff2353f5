//! Code of the engine's that calls back while it is called: conversions, clocks, subscribers, callbacks of fences.
//! Whatever it asks for, it does not wait for itself.

use std::borrow::Cow;
use std::cell::{Cell, RefCell};
use std::sync::mpsc;
use std::sync::{Arc, Mutex, OnceLock};
use std::thread;
use std::time::Duration;

use drawloom::backend::{Picture, StreamingBudget, WgpuBackend};
use drawloom::glam::Vec3;
use drawloom::process::{ClearColor, Declare, Deferred, Draws, Format, FullScreen, Parameters, RenderProcess};
use drawloom::scene::{Mesh, Texture};
use drawloom::task::Scheduler;
use drawloom::timeline::Timeline;
use drawloom::{FencePoint, Renderer, Submitter};
use drawloom_async_post::{AsyncPost, AsyncStep, StepFrame, StepSource};
use libtest_mimic::Failed;
use tracing_subscriber::layer::{Context, Layer, SubscriberExt};

use crate::Case;
use crate::fixture::{LONG, ensure, noop_backend, same, scene};

pub const CASES: &[Case] = &[
    ("a_name_that_calls_the_timeline_while_it_is_converted", names),
    ("a_clock_that_waits_while_a_log_is_taken", clocks),
    ("a_clock_that_asks_for_the_picture_of_a_step", async_post),
    ("parameters_that_are_read_and_set_while_they_are_updated", parameters),
    ("a_subscriber_that_asks_a_backend_while_that_streams", streaming),
    ("a_subscriber_that_asks_a_backend_while_that_makes_pipelines", pipelines),
    ("a_fence_whose_callback_asks_a_backend_while_that_uploads", uploads),
];

/// A name whose conversion uses the timeline.
struct Name<F>(F);

impl<F: FnOnce()> From<Name<F>> for Cow<'static, str> {
    fn from(name: Name<F>) -> Self {
        (name.0)();
        "name".into()
    }
}

fn names() -> Result<(), Failed> {
    let scheduler = Scheduler::new(1)?;
    let timeline = scheduler.timeline();
    timeline.start();
    let calls: [fn(&Timeline); 7] = [
        |timeline| timeline.mark_frame(),
        |timeline| timeline.count("inner", 1.0),
        |timeline| drop(timeline.span("inner")),
        |timeline| drop(timeline.take()),
        |timeline| timeline.stop(),
        |timeline| timeline.start(),
        |timeline| _ = timeline.now(),
    ];
    for call in calls {
        timeline.count(Name(|| call(timeline)), 1.0);
        drop(timeline.span(Name(|| call(timeline))));
        timeline.start();
    }
    timeline.count(Name(|| timeline.count(Name(|| timeline.mark_frame()), 2.0)), 3.0);
    let values: Vec<_> = timeline.take().counters.iter().map(|counter| counter.value).collect();
    ensure(values.ends_with(&[2.0, 3.0]), format_args!("the counters: {values:?}"))
}

thread_local! {
    /// Whether the clock waits on this thread.
    static WAITS: Cell<bool> = const { Cell::new(false) };
}

fn clocks() -> Result<(), Failed> {
    let (in_clock, is_in_clock) = mpsc::channel();
    let (release, is_released) = mpsc::channel();
    let is_released = Mutex::new(is_released);
    let clock = move || {
        if WAITS.get() {
            in_clock.send(()).unwrap();
            let _ = is_released.lock().unwrap().recv_timeout(LONG);
        }
        Duration::from_secs(1)
    };
    let scheduler = Scheduler::builder().workers(1).timeline_clock(clock).build()?;
    scheduler.timeline().start();
    thread::scope(|scope| {
        let waiting = scope.spawn(|| {
            WAITS.set(true);
            scheduler.timeline().take()
        });
        is_in_clock.recv_timeout(LONG)?;
        // Another thread takes a log meanwhile.
        scheduler.timeline().count("value", 1.0);
        same(scheduler.timeline().take().counters.len(), 1, "counters")?;
        release.send(())?;
        waiting.join().map_err(|_| "a log cannot be taken")?;
        Ok(())
    })
}

/// A step that makes a picture of one pixel.
struct Pixel;

impl AsyncStep for Pixel {
    fn name(&self) -> &str {
        "pixel"
    }

    fn compute(&self, _: &StepFrame<'_>) -> Picture {
        Picture { width: 1, height: 1, format: Format::Rgba8Unorm, bytes: vec![0; 4] }
    }
}

fn async_post() -> Result<(), Failed> {
    static ASYNC_POST: OnceLock<AsyncPost> = OnceLock::new();
    let clock = || {
        if let Some(post) = ASYNC_POST.get() {
            post.latest("main");
        }
        Duration::from_secs(1)
    };
    let scheduler = Arc::new(Scheduler::builder().workers(1).timeline_clock(clock).build()?);
    scheduler.timeline().start();
    let backend = drawloom::backend::SoftwareBackend::new(Arc::clone(&scheduler));
    let (mut renderer, submitter) =
        Renderer::builder(backend).pipeline(Deferred::to_picture()).build(Arc::clone(&scheduler))?;
    ASYNC_POST.set(AsyncPost::new(scheduler, Pixel, StepSource::whole("picture"))).map_err(|_| "it is set once")?;
    let post = ASYNC_POST.get().ok_or("it is set")?;
    let scene = scene();
    for _ in 0..5 {
        post.begin_frame(&renderer, &scene.cameras);
        let mut recorded = renderer.record(scene.as_scene_ref())?;
        post.read_back(&mut recorded);
        submitter.submit(recorded)?;
    }
    let counters = renderer.scheduler().timeline().take().counters;
    ensure(counters.iter().any(|counter| counter.name.starts_with("age of pixel")), "the age is counted")
}

fn parameters() -> Result<(), Failed> {
    let parameters = Parameters::new(1.0_f32);
    let other = parameters.clone();
    let found = parameters.update(|value| {
        *value += 1.0;
        other.set(7.0);
        let nested = other.update(|value| {
            *value += 1.0;
            *value
        });
        (other.get(), other.bytes().len(), nested)
    });
    same((found, parameters.get()), ((8.0, 4, 8.0), 2.0), "what the outermost update has made")?;
    // Other threads read meanwhile, and no update of theirs is lost.
    thread::scope(|scope| {
        parameters.update(|_| scope.spawn(|| other.get()).join().map_err(|_| "reading panicked"))?;
        for _ in 0..4 {
            scope.spawn(|| (0..1_000).for_each(|_| parameters.update(|value| *value += 1.0)));
        }
        Ok::<_, Failed>(())
    })?;
    same(parameters.get(), 4_002.0, "all updates")?;
    let unwound = drawloom::task::catch(|| {
        parameters.update(|value| {
            *value = 0.0;
            panic!("as planned")
        })
    });
    ensure(unwound.is_err() && parameters.get() == 4_002.0, "an update that panics changes nothing")
}

/// Calls a function for each event of this crate's.
struct Hears<F>(F);

impl<S: tracing::Subscriber, F: Fn() + 'static> Layer<S> for Hears<F> {
    fn on_event(&self, event: &tracing::Event<'_>, _: Context<'_, S>) {
        if event.metadata().target() == "drawloom" {
            (self.0)();
        }
    }
}

/// Calls `call` with a subscriber that hears of events, and returns of how many.
fn hearing(
    call: impl FnOnce() -> Result<(), Failed>,
    hear: impl Fn() + Send + Sync + 'static,
) -> Result<usize, Failed> {
    let count = Arc::new(std::sync::atomic::AtomicUsize::new(0));
    let counted = Arc::clone(&count);
    let layer = Hears(move || {
        counted.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        hear();
    });
    tracing::subscriber::with_default(tracing_subscriber::registry().with(layer), call)?;
    Ok(count.load(std::sync::atomic::Ordering::Relaxed))
}

thread_local! {
    /// The backend that the subscriber and the callbacks of this thread ask.
    static ASKED: RefCell<Option<Submitter<WgpuBackend>>> = const { RefCell::new(None) };
    /// How often it was asked.
    static ANSWERS: Cell<usize> = const { Cell::new(0) };
}

/// Asks the backend of this thread for everything that it tells.
fn ask() {
    ASKED.with_borrow(|asked| {
        let Some(backend) = asked.as_ref().map(Submitter::backend) else { return };
        backend.streaming_statistics();
        backend.resources();
        backend.shader_errors();
        backend.pass_statistics();
        ANSWERS.set(ANSWERS.get() + 1);
    });
}

/// A fixture whose backend this thread asks.
fn asked(backend: WgpuBackend, process: Option<Unused>) -> Result<Renderer<WgpuBackend>, Failed> {
    let mut builder = Renderer::builder(backend).pipeline(Deferred::to_picture());
    if let Some(process) = process {
        builder = builder.process(process);
    }
    let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(1)?))?;
    ASKED.set(Some(submitter));
    ANSWERS.set(0);
    Ok(renderer)
}

fn submit(recorded: drawloom::RecordedFrame<WgpuBackend>) -> Result<(), Failed> {
    // Taken out, so that callbacks of the submission ask nobody.
    let submitter = ASKED.take().ok_or("it is there")?;
    submitter.submit(recorded)?;
    ASKED.set(Some(submitter));
    Ok(())
}

fn streaming() -> Result<(), Failed> {
    let budget = StreamingBudget {
        mesh_bytes: StreamingBudget::MIN_BYTES,
        texture_bytes: StreamingBudget::MIN_BYTES,
        ..StreamingBudget::default()
    };
    let mut renderer = asked(noop_backend()?.stream_resources(budget)?, None)?;
    let mut scene = scene();
    let object = scene.object(scene.objects().next().ok_or("one")?)?;
    let draw = || {
        // One that is too large, and more of the others than there is room for.
        for number in 0..4 {
            let fine = Mesh::cuboid(format!("box {number}"), Vec3::ONE)?.subdivided(0.0, 10_000 * (1 + 3 * number));
            let mesh = scene.add(fine)?;
            scene.add_object(drawloom::scene::RenderObject { mesh, ..object })?;
        }
        for _ in 0..20 {
            let recorded = renderer.record(scene.as_scene_ref())?;
            submit(recorded)?;
        }
        Ok(())
    };
    let count = hearing(draw, ask)?;
    ensure(count >= 2, format_args!("{count} events"))?;
    same(ANSWERS.get(), count, "answers")
}

/// A process that declares a target which its shader does not read.
struct Unused;

impl RenderProcess for Unused {
    fn name(&self) -> &str {
        "unused"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.samples("picture");
        declare.clears_color("own", Format::Rgba8Unorm, ClearColor::Value([0.0; 4]));
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "@fragment fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> { return vec4<f32>(1.0); }";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

fn pipelines() -> Result<(), Failed> {
    let mut renderer = asked(noop_backend()?, Some(Unused))?;
    let draw = || submit(renderer.record(scene().as_scene_ref())?);
    let count = hearing(draw, ask)?;
    ensure(count > 0, "what is unused is told")?;
    same(ANSWERS.get(), count, "answers")
}

fn uploads() -> Result<(), Failed> {
    for streams in [false, true] {
        let backend = noop_backend()?;
        let backend = if streams { backend.stream_resources(StreamingBudget::default())? } else { backend };
        let mut renderer = asked(backend, None)?;
        let mut scene = scene();
        for number in 0..6 {
            // Each is larger than those before, so that arrays are copied.
            let pixels = vec![number; 4 << (2 * number as usize)];
            scene.add(Texture::new("grey", 1 << number, 1 << number, pixels)?)?;
            let mut recorded = renderer.record(scene.as_scene_ref())?;
            // The uploads of a frame call back for the frame before.
            let what = format_args!("answers in frame {number}, streamed: {streams}");
            same(ANSWERS.get(), usize::from(number), what)?;
            recorded.fence_at(FencePoint::End)?.on_set(|_| ask());
            submit(recorded)?;
        }
        // The callback of the last frame runs when the queue is dropped, and asks nobody.
        drop(ASKED.take());
    }
    Ok(())
}
