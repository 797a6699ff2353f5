//! Loops that draw frames with the step in different places.

use std::error::Error;
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use drawloom::backend::{Backend, WgpuSubmission};
use drawloom::fence::Fence;
use drawloom::glam::DVec3;
use drawloom::process::{
    ClearColor, Declare, Deferred, Draws, Format, FullScreen, PostStep, RenderProcess, ShaderResource, ToneMapping,
    targets,
};
use drawloom::scene::{Camera, Scene};
use drawloom::task::Scheduler;
use drawloom::{Buffering, FencePoint, FrameLoop, Renderer, Submitter, wgpu};
use drawloom_async_post::{
    AsyncPost, AsyncPostStatistics, AsyncStep, Bloom, LayerSettings, StepFrame, StepSource, UploadPicture,
};
use drawloom_benches::moving::Moving;

use crate::steps::{self, Grade};

/// Longer than any frame.
const LONG: Duration = Duration::from_secs(60);

const STRENGTH: f32 = 0.3;

/// The step, and where it is computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Without,
    BloomOnDevice,
    BloomOnCpuInSameFrame,
    BloomLayer,
    GradeOnDevice,
    GradeOnCpuInSameFrame,
    /// In a later frame of the same renderer.
    LateGrade,
    /// In a frame of its own, before the next scene.
    LateGradeAlone,
}

impl Kind {
    pub fn name(self) -> &'static str {
        match self {
            Self::Without => "none",
            Self::BloomOnDevice => "bloom on the device",
            Self::BloomOnCpuInSameFrame => "bloom on the CPU, waiting",
            Self::BloomLayer => "asynchronous bloom, late layer",
            Self::GradeOnDevice => "grade on the device",
            Self::GradeOnCpuInSameFrame => "grade on the CPU, waiting",
            Self::LateGrade => "asynchronous grade, in a later frame",
            Self::LateGradeAlone => "asynchronous grade, before the next frame",
        }
    }
}

/// What is measured.
#[derive(Clone, Copy, Debug)]
pub struct Variant {
    pub kind: Kind,
    pub buffering: Buffering,
}

impl Variant {
    pub const ALL: [Self; 12] = [
        Self::new(Kind::Without, Buffering::SameFrame),
        Self::new(Kind::GradeOnDevice, Buffering::SameFrame),
        Self::new(Kind::GradeOnCpuInSameFrame, Buffering::SameFrame),
        Self::new(Kind::LateGradeAlone, Buffering::SameFrame),
        Self::new(Kind::BloomOnCpuInSameFrame, Buffering::SameFrame),
        Self::new(Kind::BloomLayer, Buffering::SameFrame),
        Self::new(Kind::Without, Buffering::Double),
        Self::new(Kind::GradeOnDevice, Buffering::Double),
        Self::new(Kind::LateGradeAlone, Buffering::Double),
        Self::new(Kind::LateGrade, Buffering::Double),
        Self::new(Kind::BloomOnDevice, Buffering::Double),
        Self::new(Kind::BloomLayer, Buffering::Double),
    ];

    const fn new(kind: Kind, buffering: Buffering) -> Self {
        Self { kind, buffering }
    }

    pub fn buffering_name(self) -> &'static str {
        match self.buffering {
            Buffering::SameFrame => "same frame",
            Buffering::Double => "double",
            Buffering::Triple => "triple",
        }
    }
}

/// A frame that was drawn.
#[derive(Clone, Copy, Debug)]
pub struct FrameSample {
    pub finished: Instant,
    /// From the input of what it shows.
    pub latency: Duration,
    pub age: Option<u64>,
    /// The time of the latest result.
    pub step: Option<Duration>,
}

/// A loop that draws frames.
pub struct Contender<B: Backend>
where
    B::Submission: Send,
{
    kind: Kind,
    frames: Frames<B>,
    post: Option<AsyncPost>,
    presenter: Option<Presenter<B>>,
    world: Moving,
}

#[expect(clippy::large_enum_variant, reason = "there are five")]
enum Frames<B: Backend>
where
    B::Submission: Send,
{
    Loop(FrameLoop<B>),
    Waiting(Renderer<B>, Submitter<B>, Waiting<B>),
}

/// Draws late pictures, each as soon as it is there.
struct Presenter<B: Backend> {
    renderer: Renderer<B>,
    submitter: Submitter<B>,
    scene: Scene,
    /// The number of the frame whose picture was drawn last.
    latest: u64,
}

impl<B: Backend<Submission = WgpuSubmission> + UploadPicture> Contender<B> {
    /// `open` opens a backend: the first one on a device, or one beside the first, whose frames only draw a finished
    /// picture.
    pub fn new(
        Variant { kind, buffering }: Variant,
        open: impl Fn(Kind, Option<&B>) -> B,
        world: Moving,
    ) -> Result<Self, Box<dyn Error>> {
        let scheduler = Arc::new(Scheduler::new(2)?);
        let bloom = Bloom::default();
        let first = open(kind, None);
        let second = open(kind, Some(&first));
        let builder = Renderer::builder(first);
        let camera = &world.as_scene_ref().cameras[0];
        let mut scene = Scene::new();
        scene.cameras = vec![Camera {
            name: camera.name.clone(),
            size: camera.size,
            ..Camera::looking_at("", DVec3::Z, DVec3::ZERO)
        }];
        let mut post = None;
        let builder = match kind {
            Kind::Without => builder.pipeline(Deferred::to_picture()),
            Kind::BloomOnDevice => {
                let (processes, step) = bloom.on_device(STRENGTH);
                let builder = builder.pipeline(Deferred::new().post(step).post(ToneMapping::default()));
                processes.into_iter().fold(builder, |builder, process| builder.process(process))
            }
            Kind::BloomOnCpuInSameFrame => {
                // Never begun: only its process and the name of its target are used.
                let source = AsyncPost::new(Arc::clone(&scheduler), bloom.on_cpu(), bloom.source());
                let downsample = source.downsample().ok_or("bloom is computed from a smaller picture")?;
                builder.pipeline(Deferred::new()).process(downsample).output(source.source_target())
            }
            Kind::BloomLayer => {
                let post = post.insert(AsyncPost::new(Arc::clone(&scheduler), bloom.on_cpu(), bloom.source()));
                let layer = post.layer(LayerSettings { strength: STRENGTH, ..LayerSettings::default() });
                let downsample = post.downsample().ok_or("bloom is computed from a smaller picture")?;
                let deferred = Deferred::new().post(layer).post(ToneMapping::default());
                builder.pipeline(deferred).process(downsample).output(post.source_target())
            }
            Kind::GradeOnDevice => {
                builder.pipeline(Deferred::new().post(ToneMapping::default()).post(steps::grade_on_device))
            }
            Kind::LateGrade => {
                let source = StepSource::whole(targets::PICTURE);
                let post = post.insert(AsyncPost::new(Arc::clone(&scheduler), Grade, source));
                let late = post.late_picture("late picture", Format::Rgba8Srgb);
                builder.pipeline(Deferred::to_picture()).process(late).output("late picture")
            }
            Kind::LateGradeAlone | Kind::GradeOnCpuInSameFrame => {
                let source = StepSource::whole(targets::PICTURE);
                post = Some(AsyncPost::new(Arc::clone(&scheduler), Grade, source));
                builder.pipeline(Deferred::to_picture())
            }
        };
        let (renderer, submitter) = builder.build(Arc::clone(&scheduler))?;
        let (mut presenter, mut waiting) = (None, None);
        match (kind, &post) {
            (Kind::BloomOnCpuInSameFrame, _) => {
                waiting = Some(Waiting::new(second, bloom, scene, Arc::clone(&scheduler))?);
            }
            (Kind::LateGradeAlone | Kind::GradeOnCpuInSameFrame, Some(post)) => {
                let late = post.late_picture_alone("late picture", Format::Rgba8Srgb);
                let builder = Renderer::builder(second).process(late).output("late picture");
                let (renderer, submitter) = builder.build(Arc::clone(&scheduler))?;
                presenter = Some(Presenter { renderer, submitter, scene, latest: 0 });
            }
            _ => {}
        }
        let frames = match waiting {
            Some(waiting) => Frames::Waiting(renderer, submitter, waiting),
            None => Frames::Loop(FrameLoop::new(renderer, submitter, buffering)?),
        };
        Ok(Self { kind, frames, post, presenter, world })
    }

    /// Draws frames, whose update takes so long, and waits for the last one.
    pub fn draw(&mut self, count: usize, update: Duration) -> Result<Vec<FrameSample>, Box<dyn Error>> {
        let world = &mut self.world;
        let mut samples = Vec::with_capacity(count);
        let frames = match &mut self.frames {
            Frames::Loop(frames) => frames,
            Frames::Waiting(renderer, submitter, waiting) => {
                for _ in 0..count {
                    let begun = Instant::now();
                    world.step_for(update);
                    let (finished, step) = waiting.draw(renderer, submitter, world)?;
                    samples.push(FrameSample { finished, latency: finished - begun, age: Some(0), step: Some(step) });
                }
                return Ok(samples);
            }
        };
        let mut finished = Vec::with_capacity(count);
        // Of each frame, its statistics.
        let mut statistics = Vec::with_capacity(count);
        // The numbers of the frames whose pictures were drawn alone and of those that were begun by then, and when they
        // are drawn.
        let mut presented = Vec::new();
        for _ in 0..count {
            let (slot, more) = frames.begin();
            finished.extend(more);
            world.step_for(update);
            if let Some(post) = &self.post {
                let cameras = world.as_scene_ref().cameras;
                post.begin_frame(frames.renderer(), cameras);
                if let (Kind::LateGradeAlone, Some(presenter)) = (self.kind, &mut self.presenter)
                    && let Some((number, drawn)) = presenter.draw(post.shown(&cameras[0].name))?
                {
                    presented.push((number, statistics.len(), drawn));
                }
            }
            let mut recorded = frames.renderer().record(world.as_scene_ref())?;
            if let Some(post) = &self.post {
                post.read_back(&mut recorded);
            }
            statistics.push(self.post.as_ref().and_then(|post| post.statistics().into_iter().next()));
            slot.submit(recorded);
            if let (Kind::GradeOnCpuInSameFrame, Some(presenter), Some(post)) =
                (self.kind, &mut self.presenter, &self.post)
            {
                let cameras = world.as_scene_ref().cameras;
                let current = statistics.last().and_then(Option::as_ref).map_or(0, |of_view| of_view.frame);
                while post.latest(&cameras[0].name).is_none_or(|(number, _)| number < current) {
                    thread::sleep(Duration::from_micros(20));
                }
                post.begin_frame(frames.renderer(), cameras);
                if let Some((number, drawn)) = presenter.draw(post.shown(&cameras[0].name))? {
                    drawn.wait(LONG)?;
                    presented.push((number, statistics.len() - 1, drawn));
                }
            }
        }
        while finished.len() < count {
            thread::sleep(Duration::from_micros(100));
            let (slot, more) = frames.begin();
            finished.extend(more);
            drop(slot);
        }
        let mut times = Vec::with_capacity(count);
        for frame in finished {
            frame.outcome?;
            times.push(frame.times);
        }
        if let Some(error) = self.post.as_ref().and_then(|post| post.take_errors().into_iter().next()) {
            return Err(error.into());
        }
        if self.presenter.is_some() {
            for (number, index, drawn) in presented {
                drawn.wait(LONG)?;
                let finished = drawn.set_at().ok_or("it is set")?;
                let is_shown =
                    |of_frame: &Option<AsyncPostStatistics>| of_frame.as_ref().is_some_and(|of| of.frame == number);
                // What shows a picture of the turn before is not counted.
                let Some(shown) = statistics.iter().position(is_shown) else { continue };
                let latency = finished.saturating_duration_since(times[shown].begun);
                let step = statistics[index].as_ref().map(|of_view| of_view.latest_took);
                samples.push(FrameSample { finished, latency, age: Some((index - shown) as u64), step });
            }
            return Ok(samples);
        }
        for (index, (frame, statistics)) in times.iter().zip(&statistics).enumerate() {
            let age = statistics.as_ref().and_then(|statistics| statistics.age());
            let shown = match (self.kind, age) {
                (Kind::LateGrade, Some(age)) => index.checked_sub(age as usize),
                _ => Some(index),
            };
            // What shows a picture of the turn before is not counted.
            let Some(shown) = shown else { continue };
            samples.push(FrameSample {
                finished: frame.finished,
                latency: frame.finished.saturating_duration_since(times[shown].begun),
                age,
                step: statistics.as_ref().filter(|of_view| of_view.computed > 0).map(|of_view| of_view.latest_took),
            });
        }
        Ok(samples)
    }
}

impl<B: Backend> Presenter<B> {
    /// Draws the picture of this frame, unless it was drawn. Returns the frame's number, and when it is drawn.
    fn draw(&mut self, shown: Option<u64>) -> Result<Option<(u64, Fence)>, Box<dyn Error>> {
        let Some(number) = shown.filter(|&number| number > self.latest) else { return Ok(None) };
        let mut recorded = self.renderer.record(self.scene.as_scene_ref())?;
        let drawn = recorded.fence_at(FencePoint::End)?;
        self.submitter.submit(recorded)?;
        self.latest = number;
        Ok(Some((number, drawn)))
    }
}

/// Draws a frame, waits for it, computes the step, and composites its result with a second renderer.
struct Waiting<B: Backend> {
    composition: (Renderer<B>, Submitter<B>),
    compose: Arc<Compose>,
    scene: Scene,
    step: Box<dyn AsyncStep>,
    scheduler: Arc<Scheduler>,
}

impl<B: Backend<Submission = WgpuSubmission> + UploadPicture> Waiting<B> {
    fn new(second: B, bloom: Bloom, scene: Scene, scheduler: Arc<Scheduler>) -> Result<Self, Box<dyn Error>> {
        let compose = Arc::new(Compose::default());
        let composition = Renderer::builder(second)
            .process(Arc::clone(&compose))
            .process(ToneMapping::default().process("composed", "picture"))
            .output(targets::PICTURE)
            .build(Arc::clone(&scheduler))?;
        Ok(Self { composition, compose, scene, step: Box::new(bloom.on_cpu()), scheduler })
    }

    /// Returns when the device was done, and how long the step took with its upload.
    fn draw(
        &mut self,
        renderer: &mut Renderer<B>,
        submitter: &Submitter<B>,
        world: &Moving,
    ) -> Result<(Instant, Duration), Box<dyn Error>> {
        let mut recorded = renderer.record(world.as_scene_ref())?;
        let source = recorded.read_back_whole(0, "bloom source")?;
        let drawn = recorded.fence_at(FencePoint::End)?;
        let submitted = submitter.submit(recorded)?;
        drawn.wait(LONG)?;
        let start = Instant::now();
        let picture = source.read()?;
        let camera = &world.as_scene_ref().cameras[0];
        let frame = StepFrame { picture: &picture, camera, number: 1, scheduler: &self.scheduler };
        let layer = renderer.backend().upload_picture(&self.step.compute(&frame))?;
        let took = start.elapsed();
        let (radiance, _) = submitted.submission.texture(0, targets::RADIANCE)?;
        let view = radiance.create_view(&wgpu::TextureViewDescriptor::default());
        let radiance = ShaderResource::Texture { view, dimension: wgpu::TextureViewDimension::D2 };
        *self.compose.0.lock().expect("no thread panics") = vec![layer.ok_or("wgpu has textures")?, radiance];
        let (renderer, submitter) = &mut self.composition;
        let mut recorded = renderer.record(self.scene.as_scene_ref())?;
        let drawn = recorded.fence_at(FencePoint::End)?;
        submitter.submit(recorded)?;
        drawn.wait(LONG)?;
        Ok((drawn.set_at().ok_or("it is set")?, took))
    }
}

/// Adds a layer to a radiance.
#[derive(Default)]
struct Compose(Mutex<Vec<ShaderResource<'static>>>);

impl RenderProcess for Compose {
    fn name(&self) -> &str {
        "compose"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("composed", Format::Rgba16Float, ClearColor::Value([0.0; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(3) @binding(0) var layer: texture_2d<f32>;
            @group(3) @binding(1) var radiance: texture_2d<f32>;

            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                let value = textureSampleLevel(layer, target_sampler, in.clip * vec2<f32>(0.5, -0.5) + 0.5, 0.0);
                return textureLoad(radiance, vec2<i32>(in.position.xy), 0) + 0.3 * value;
            }
        ";
        let resources = self.0.lock().expect("no thread panics").clone();
        Draws::FullScreen(FullScreen { shader, resources, ..FullScreen::default() })
    }
}
