//! Frames that are lost after others were recorded: dropped, refused, or failed when they are submitted. A frame that
//! shows what a lost one was to draw is refused; every other is drawn, and what is recorded later is right.

use std::sync::{Arc, mpsc};
use std::time::Duration;

#[cfg(feature = "wgpu")]
use drawloom::backend::WgpuBackend;
use drawloom::backend::{Backend, NullBackend, SoftwareBackend};
use drawloom::fence::Fence;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{
    CpuShader, Declare, Deferred, Draws, FullScreen, FullScreenCpuShader, FullScreenPixel, InjectionPoint, PassInputs,
    RenderProcess,
};
use drawloom::quality::{Quality, ShadowQuality};
use drawloom::raster::{Real, Vector4};
use drawloom::scene::{Camera, Changes, Light, Material, Mesh, Redraw, RenderObject, Scene, ViewKind};
use drawloom::task::Scheduler;
use drawloom::{Buffering, FrameLoop, FrameLoopError, RecordedFrame, Renderer, SubmitError, Submitter};
use drawloom_testing::fault_injection::{CallKind, Fault, FaultyBackend};
use drawloom_testing::feedback::with_feedback;
use libtest_mimic::Failed;

use crate::Case;
use crate::calls::expect;
use crate::fixture::{Fixture, Setting};
use crate::subjects::Subject;
use crate::worlds::Worlds;

pub const CASES: &[Case] = &[
    ("frames_that_keep_a_view_of_a_lost_frame_are_refused_by_the_null_backend", kept_views_without_pictures),
    ("frames_that_keep_a_view_of_a_lost_frame_are_refused_in_software", kept_views::<SoftwareBackend>),
    ("frames_behind_a_lost_one_have_its_uploads_in_software", uploads::<SoftwareBackend>),
    ("frames_behind_a_lost_one_have_the_histories_of_the_last_submitted_in_software", histories::<SoftwareBackend>),
    ("a_loop_goes_on_after_frames_that_keep_a_lost_view", loop_goes_on),
    ("no_run_of_losses_refuses_frames_for_ever", runs_of_losses),
];

#[cfg(feature = "wgpu")]
pub const CASES_OF_ADAPTERS: &[Case] = &[
    ("frames_that_keep_a_view_of_a_lost_frame_are_refused_by_wgpu", kept_views::<WgpuBackend>),
    ("frames_behind_a_lost_one_have_its_uploads_on_wgpu", uploads::<WgpuBackend>),
    ("frames_behind_a_lost_one_have_the_histories_of_the_last_submitted_on_wgpu", histories::<WgpuBackend>),
];

/// How a frame is lost.
#[derive(Clone, Copy, Debug)]
enum Loss {
    Dropped,
    /// It waits for a fence that nobody sets.
    Refused,
    /// Its submission fails.
    Failed,
    /// Its submission panics.
    Panicked,
}

impl Loss {
    const ALL: [Self; 4] = [Self::Dropped, Self::Refused, Self::Failed, Self::Panicked];

    fn happen<S: Subject>(
        self,
        mut recorded: RecordedFrame<FaultyBackend<S>>,
        submitter: &Submitter<FaultyBackend<S>>,
    ) -> Result<(), Failed> {
        let fault = match self {
            Self::Dropped => {
                drop(recorded);
                return Ok(());
            }
            Self::Refused => None,
            Self::Failed => Some(Fault::OutOfMemory),
            Self::Panicked => Some(Fault::Panic),
        };
        let (_setter, never) = Fence::new("never");
        match fault {
            None => recorded.submit_after(&never, Duration::ZERO),
            Some(fault) => submitter.backend().inject(CallKind::Submit, 0, fault),
        }
        expect(submitter.submit(recorded).is_err(), || format!("{self:?}: the frame is not lost"))
    }
}

/// Shows what the view `mirror` shows.
struct Shows;

impl RenderProcess for Shows {
    fn name(&self) -> &str {
        "shows"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterPostProcessing);
        declare.samples_view(ViewKind::Reflection, "mirror", "radiance");
        declare.draws_over("picture");
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var mirror: texture_2d<f32>;

            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                return textureLoad(mirror, vec2<u32>(in.position.xy), 0);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        Some(CpuShader::full_screen(Self))
    }
}

impl<R: Real> FullScreenCpuShader<R> for Shows {
    fn fragment(&self, pass: &PassInputs<'_, R>, pixel: &FullScreenPixel<R>, targets: &mut [Vector4<R>]) -> bool {
        targets[0] = pass.sampled[0].load(pixel.coordinates, 0);
        true
    }
}

struct Mirrors<S: Subject> {
    renderer: Renderer<FaultyBackend<S>>,
    submitter: Submitter<FaultyBackend<S>>,
    read: Read<S>,
}

/// Reads what the main view shows.
type Read<S> = fn(&<S as Backend>::Submission) -> Result<Vec<u8>, Failed>;

impl<S: Subject> Mirrors<S> {
    fn new(read: Read<S>) -> Result<Self, Failed> {
        let scheduler = Arc::new(Scheduler::new(2)?);
        let backend = FaultyBackend::new(S::open(&scheduler)?);
        let balanced = Quality::balanced();
        let shadows = ShadowQuality { side: 24, interval: 1_000, ..balanced.shadows };
        let builder = Renderer::builder(backend).pipeline(Deferred::to_picture()).process(Shows);
        let (renderer, submitter) = builder.quality(Quality { shadows, ..balanced }).build(scheduler)?;
        Ok(Self { renderer, submitter, read })
    }

    fn record(&mut self, scene: &Scene) -> Result<RecordedFrame<FaultyBackend<S>>, Failed> {
        Ok(self.renderer.record(scene.as_scene_ref())?)
    }

    fn submit(&self, recorded: RecordedFrame<FaultyBackend<S>>) -> Result<Vec<u8>, Failed> {
        (self.read)(&self.submitter.submit(recorded)?.submission)
    }

    /// What a renderer shows that draws everything.
    fn fresh(scene: &Scene, read: Read<S>) -> Result<Vec<u8>, Failed> {
        let mut mirrors = Self::new(read)?;
        let recorded = mirrors.record(scene)?;
        mirrors.submit(recorded)
    }
}

/// What decides when a view is drawn anew.
#[derive(Clone, Copy, Debug)]
enum Anew {
    /// A mirror, when its camera changes.
    Camera,
    /// A mirror, when its size changes.
    Size,
    /// A mirror that comes.
    Appearance,
    /// The maps of a light that comes.
    Light,
}

impl Anew {
    const ALL: [Self; 4] = [Self::Camera, Self::Size, Self::Appearance, Self::Light];

    /// A scene. Two of different `states` draw the view anew.
    fn scene(self, state: usize) -> Result<Scene, Failed> {
        let mut scene = Scene::new();
        let mesh = scene.add(Mesh::cuboid("box", Vec3::splat(2.0))?)?;
        let material = scene.add(Material { emission: Vec3::splat(0.2), ..Material::default() })?;
        scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO))?;
        scene.add_object(RenderObject::new(mesh, material, DVec3::new(0.8, 0.6, 1.6)))?;
        let main = Camera { size: [16, 16], ..Camera::looking_at("main", DVec3::Z * 6.0, DVec3::ZERO) };
        let is_light = matches!(self, Self::Light);
        let redraw = if is_light { Redraw::EveryFrame } else { Redraw::OnCameraChange };
        let kind = ViewKind::Reflection;
        let distance = 3.0 + if matches!(self, Self::Camera) { state as f64 } else { 0.0 };
        let side = 16 + if matches!(self, Self::Size) { state as u32 } else { 0 };
        let mirror = Camera::looking_at("mirror", DVec3::Z * distance, DVec3::ZERO);
        let mirror = Camera { size: [side, 16], kind, redraw, ..mirror };
        scene.cameras = vec![main, mirror];
        if matches!(self, Self::Appearance) && state == 0 {
            scene.cameras.pop();
        }
        if !is_light || state > 0 {
            let (position, intensity) = (DVec3::new(2.0, 2.0, 6.0), Vec3::splat(20.0));
            scene.lights.push(Light::Point { position, intensity, range: 30.0, casts_shadow: true });
        }
        Ok(scene)
    }

    /// The beginning of the name of the view.
    fn view(self) -> &'static str {
        if matches!(self, Self::Light) { "" } else { "mirror" }
    }
}

/// Whether a frame was refused because of a lost view.
fn expect_refusal<S: Subject>(
    outcome: Result<drawloom::SubmittedFrame<FaultyBackend<S>>, SubmitError>,
    anew: Anew,
    name: &str,
) -> Result<(), Failed> {
    match outcome {
        Err(SubmitError::LostView { view }) => {
            let is_it = view.starts_with(anew.view()) && (view == "mirror") != matches!(anew, Anew::Light);
            expect(is_it, || format!("{name}: {view} is lost"))
        }
        Err(error) => Err(format!("{name}: {error}").into()),
        Ok(_) => Err(format!("{name}: it is submitted").into()),
    }
}

fn picture<S: Subject>(submission: &S::Submission) -> Result<Vec<u8>, Failed> {
    S::read(submission, 0, "picture")
}

fn kept_views_without_pictures() -> Result<(), Failed> {
    refusals::<NullBackend>(|_| Ok(Vec::new()))
}

fn kept_views<S: Subject>() -> Result<(), Failed> {
    refusals::<S>(picture::<S>)
}

fn refusals<S: Subject>(read: Read<S>) -> Result<(), Failed> {
    for anew in Anew::ALL {
        let scenes = [anew.scene(0)?, anew.scene(1)?, anew.scene(2)?];
        let expected = [Mirrors::<S>::fresh(&scenes[0], read)?, Mirrors::<S>::fresh(&scenes[1], read)?];
        let mut mirrors = Mirrors::<S>::new(read)?;
        for loss in Loss::ALL {
            let name = format!("{anew:?}, {loss:?}");
            let recorded = mirrors.record(&scenes[0])?;
            expect(mirrors.submit(recorded)? == expected[0], || format!("{name}: the first frame"))?;

            // Two frames rely on one that is lost.
            let lost = mirrors.record(&scenes[1])?;
            let behind = [mirrors.record(&scenes[1])?, mirrors.record(&scenes[1])?];
            loss.happen(lost, &mirrors.submitter)?;
            for recorded in behind {
                expect_refusal::<S>(mirrors.submitter.submit(recorded), anew, &name)?;
            }
            for _ in 0..2 {
                let recorded = mirrors.record(&scenes[1])?;
                expect(mirrors.submit(recorded)? == expected[1], || format!("{name}: the frame after them"))?;
            }

            // A frame draws what the lost one was to draw, and another one keeps that.
            let lost = mirrors.record(&scenes[2])?;
            let behind = [mirrors.record(&scenes[0])?, mirrors.record(&scenes[0])?];
            loss.happen(lost, &mirrors.submitter)?;
            for recorded in behind {
                expect(mirrors.submit(recorded)? == expected[0], || format!("{name}: a frame that relies on none"))?;
            }

            // The lost frame kept the view itself, from a frame that is submitted. The frame after a lost one draws all
            // views.
            let recorded = mirrors.record(&scenes[0])?;
            mirrors.submit(recorded)?;
            let lost = mirrors.record(&scenes[0])?;
            let behind = mirrors.record(&scenes[0])?;
            loss.happen(lost, &mirrors.submitter)?;
            expect(mirrors.submit(behind)? == expected[0], || {
                format!("{name}: a frame that relies on an earlier one")
            })?;

            // A frame is not submitted before the one that it relies on.
            let first = mirrors.record(&scenes[1])?;
            let second = mirrors.record(&scenes[1])?;
            expect_refusal::<S>(mirrors.submitter.submit(second), anew, &name)?;
            expect(mirrors.submit(first)? == expected[1], || format!("{name}: the frame that was overtaken"))?;
            let recorded = mirrors.record(&scenes[1])?;
            expect(mirrors.submit(recorded)? == expected[1], || format!("{name}: the last frame"))?;
        }
    }
    Ok(())
}

/// What a lost frame was told has changed is not told again, and what it uploaded is there.
fn uploads<S: Subject>() -> Result<(), Failed> {
    let setting = Setting { tests_occlusion: false, ..Setting::FULL };
    for worlds in [Worlds::plain()?, Worlds::with_nodes_and_static_groups()?] {
        let expected = [0, 1].map(|index| -> Result<_, Failed> {
            worlds.picture(&mut Fixture::<S>::new(setting)?, index, Changes::Unknown)
        });
        let [first, second] = expected;
        let expected = [first?, second?];
        let mut fixture = Fixture::<S>::new(setting)?;
        worlds.picture(&mut fixture, 0, Changes::Unknown)?;
        for (turn, loss) in Loss::ALL.into_iter().enumerate() {
            let world = (turn + 1) % 2;
            let lost = worlds.record(&mut fixture.renderer, world, Changes::Objects(&worlds.moved))?;
            let behind = [
                worlds.record(&mut fixture.renderer, world, Changes::NONE)?,
                worlds.record(&mut fixture.renderer, world, Changes::NONE)?,
            ];
            loss.happen(lost, &fixture.submitter)?;
            for recorded in behind {
                let submission = fixture.submitter.submit(recorded)?.submission;
                let shown = S::read(&submission, 0, "picture")?;
                expect(shown == expected[world], || format!("{loss:?}: a frame behind the lost one is another one"))?;
            }
            let next = worlds.picture(&mut fixture, world, Changes::NONE)?;
            expect(next == expected[world], || format!("{loss:?}: the next frame is another one"))?;
        }
    }
    Ok(())
}

/// Histories are those of the frame that was submitted last, whatever was recorded since.
fn histories<S: Subject>() -> Result<(), Failed> {
    let mut scene = Scene::new();
    let view = |name: &str, kind| Camera { kind, size: [24, 20], ..Camera::looking_at(name, DVec3::Z, DVec3::ZERO) };
    scene.cameras =
        vec![view("main", ViewKind::Main), view("left", ViewKind::Reflection), view("right", ViewKind::Reflection)];
    let new = || -> Result<_, Failed> {
        let scheduler = Arc::new(Scheduler::new(2)?);
        Ok(with_feedback(Renderer::builder(FaultyBackend::new(S::open(&scheduler)?))).build(scheduler)?)
    };
    let read = |submission: &S::Submission| -> Result<Vec<_>, Failed> {
        (0..3).map(|view| S::read(submission, view, "light")).collect()
    };
    let (mut renderer, submitter) = new()?;
    let mut expected = Vec::new();
    for _ in 0..1 + 2 * Loss::ALL.len() {
        expected.push(read(&submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission)?);
    }
    expect(expected[1] != expected[2], || String::from("nothing tells histories apart"))?;
    let (mut renderer, submitter) = new()?;
    let mut expected = expected.into_iter();
    let mut check = |submission: S::Submission, name: &str| -> Result<(), Failed> {
        expect(Some(read(&submission)?) == expected.next(), || format!("{name}: a history is another one"))
    };
    check(submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission, "the first frame")?;
    for loss in Loss::ALL {
        let lost = renderer.record(scene.as_scene_ref())?;
        let behind = [renderer.record(scene.as_scene_ref())?, renderer.record(scene.as_scene_ref())?];
        loss.happen(lost, &submitter)?;
        for recorded in behind {
            check(submitter.submit(recorded)?.submission, &format!("{loss:?}"))?;
        }
    }
    Ok(())
}

fn loop_goes_on() -> Result<(), Failed> {
    const FRAMES: u64 = 8;
    let scenes = [Anew::Camera.scene(0)?, Anew::Camera.scene(1)?];
    let fresh = |scene| Mirrors::<SoftwareBackend>::fresh(scene, picture::<SoftwareBackend>);
    let expected = [fresh(&scenes[0])?, fresh(&scenes[1])?];
    // The mirror is drawn anew in each other frame.
    let scene_of = |frame: u64| usize::from(frame / 2 % 2 == 1);
    for lost in 1..6 {
        let Mirrors { renderer, submitter, .. } = Mirrors::<SoftwareBackend>::new(picture::<SoftwareBackend>)?;
        let mut frames = FrameLoop::new(renderer, submitter, Buffering::Triple)?;
        let (_setter, never) = Fence::new("never");
        let (mut outcomes, (sender, shown)) = (Vec::new(), mpsc::channel());
        for number in 1..=FRAMES {
            let (slot, finished) = frames.begin();
            outcomes.extend(finished);
            let mut recorded = frames.renderer().record(scenes[scene_of(number)].as_scene_ref())?;
            if number == lost {
                recorded.submit_after(&never, Duration::from_millis(50));
            }
            let sender = sender.clone();
            // Later frames draw over what this one has drawn.
            slot.submit_then(recorded, move |submitted| {
                let picture = picture::<SoftwareBackend>(&submitted.submission).unwrap_or_default();
                sender.send((number, picture)).unwrap_or_default();
            });
        }
        outcomes.extend(frames.finish().1);
        drop(sender);
        for (number, picture) in &shown {
            let is_right = picture == expected[scene_of(number)];
            expect(is_right, || format!("frame {number} behind frame {lost} shows a view that was not drawn"))?;
        }
        expect(outcomes.len() as u64 == FRAMES, || format!("{} frames are told", outcomes.len()))?;
        for frame in outcomes {
            match frame.outcome {
                Ok(_) => {}
                Err(FrameLoopError::Submit(SubmitError::Fence(_))) if frame.number == lost => {}
                Err(FrameLoopError::Submit(SubmitError::LostView { view })) => {
                    expect((lost + 1..lost + 3).contains(&frame.number), || {
                        format!("{view} of frame {} is lost with frame {lost}", frame.number)
                    })?;
                }
                Err(error) => return Err(format!("frame {}: {error}", frame.number).into()),
            }
        }
    }
    Ok(())
}

/// Frames are recorded ahead of the submission of the ones before, each keeping a view, and one after the other is
/// lost.
fn runs_of_losses() -> Result<(), Failed> {
    let (scene, other) = (Anew::Camera.scene(0)?, Anew::Camera.scene(1)?);
    let mut mirrors = Mirrors::<NullBackend>::new(|_| Ok(Vec::new()))?;
    let recorded = mirrors.record(&other)?;
    mirrors.submit(recorded)?;
    let mut ahead = vec![mirrors.record(&scene)?, mirrors.record(&scene)?, mirrors.record(&scene)?];
    drop(ahead.remove(0));
    let mut refused = 0;
    for frame in 0.. {
        // The frame in front is submitted when the next one is recorded.
        ahead.push(mirrors.record(&scene)?);
        match mirrors.submitter.submit(ahead.remove(0)) {
            Ok(_) => break,
            Err(SubmitError::LostView { .. }) => refused += 1,
            Err(error) => return Err(error.to_string().into()),
        }
        expect(frame < 10, || String::from("each frame relies on one that is refused"))?;
    }
    expect(refused == 2, || format!("{refused} frames relied on the one that was lost"))
}
