//! Renderers on several backends, with limits.

use std::sync::Arc;

use drawloom::backend::{Backend, NullBackend, Picture, SceneLimits, SoftwareBackend, StreamingBudget, WgpuBackend};
use drawloom::process::Deferred;
use drawloom::quality::Quality;
use drawloom::scene::{Changes, Scene, SceneRef};
use drawloom::task::Scheduler;
use drawloom::view::{IssueReason, SceneIssue, ShadowMaps};
use drawloom::{Renderer, Submitter};
use drawloom_testing::adapter;
use drawloom_testing::limited::LimitedBackend;
use libtest_mimic::Failed;

use crate::wide_tints::WideTransparency;

/// What frames are drawn with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Device {
    /// The machine's adapter.
    Adapter,
    /// The software backend.
    Software,
    /// wgpu's noop device, which checks and draws nothing.
    Noop,
    /// The same, with meshes and textures that are streamed.
    Streamed,
    /// The null backend, which checks the rules.
    Null,
}

impl Device {
    /// Those that draw pictures.
    pub const DRAWING: &[Self] = &[Self::Adapter, Self::Software];
    /// All of them.
    pub const ALL: &[Self] = &[Self::Adapter, Self::Software, Self::Noop, Self::Streamed, Self::Null];

    pub fn name(self) -> &'static str {
        match self {
            Self::Adapter => "on_the_adapter",
            Self::Software => "in_software",
            Self::Noop => "on_noop",
            Self::Streamed => "streamed_on_noop",
            Self::Null => "on_null",
        }
    }
}

/// What a renderer draws.
#[derive(Clone, Copy, Default)]
pub struct Options {
    pub shadows: bool,
    pub process: Process,
    /// `None`: those of the device.
    pub limits: Option<SceneLimits>,
    pub quality: Option<Quality>,
}

/// A process of the test's own beside the shipped ones.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
pub enum Process {
    #[default]
    None,
    /// In the place of transparency, while an object is blended.
    WideTransparency,
}

/// A frame: the picture of each camera, if the device draws any, and what was left out, without what is yet to arrive.
#[derive(Debug)]
pub struct Frame {
    pub pictures: Vec<Picture>,
    pub scene_issues: Vec<SceneIssue>,
}

/// A renderer on any backend.
pub trait Frames {
    fn frame(&mut self, scene: SceneRef<'_>) -> Result<Frame, Failed>;
}

struct Fixture<B: Backend> {
    renderer: Renderer<B>,
    submitter: Submitter<B>,
    draws: bool,
}

impl<B: Backend> Frames for Fixture<B> {
    fn frame(&mut self, scene: SceneRef<'_>) -> Result<Frame, Failed> {
        let mut recorded = self.renderer.record(scene)?;
        let mut read_backs = Vec::new();
        if self.draws {
            for view in 0..scene.cameras.len() {
                read_backs.push(recorded.read_back_whole(view, "picture")?);
            }
        }
        let submitted = self.submitter.submit(recorded)?;
        let pictures = read_backs.iter().map(|read_back| read_back.read()).collect::<Result<_, _>>()?;
        // What is streamed is yet to arrive.
        let is_expected =
            |known: &SceneIssue| !matches!(known.reason, IssueReason::NotResident | IssueReason::TextureNotResident);
        let scene_issues = submitted.statistics.scene_issues.into_iter().filter(is_expected).collect();
        Ok(Frame { pictures, scene_issues })
    }
}

/// A renderer.
pub fn renderer(device: Device, options: Options) -> Result<Box<dyn Frames>, Failed> {
    let scheduler = Arc::new(Scheduler::new(2)?);
    let noop = || adapter::noop_device().map_err(|error| error.to_string());
    match device {
        Device::Adapter => {
            let backend = adapter::shared_backend().map_err(|error| error.to_string())?;
            build(backend, options, scheduler, true)
        }
        Device::Software => build(SoftwareBackend::new(Arc::clone(&scheduler)), options, scheduler, true),
        Device::Noop => {
            let (device, queue) = noop()?;
            build(WgpuBackend::new(device, queue)?, options, scheduler, false)
        }
        Device::Streamed => {
            let (device, queue) = noop()?;
            let budget = StreamingBudget { mesh_bytes: 1 << 30, texture_bytes: 1 << 30, ..StreamingBudget::default() };
            build(WgpuBackend::new(device, queue)?.stream_resources(budget)?, options, scheduler, false)
        }
        Device::Null => build(NullBackend, options, scheduler, false),
    }
}

fn build<B: Backend>(
    backend: B,
    options: Options,
    scheduler: Arc<Scheduler>,
    draws: bool,
) -> Result<Box<dyn Frames>, Failed> {
    Ok(match options.limits {
        Some(limits) => boxed(LimitedBackend::new(backend, limits), options, scheduler, draws)?,
        None => boxed(backend, options, scheduler, draws)?,
    })
}

fn boxed<B: Backend>(
    backend: B,
    Options { shadows, process, quality, .. }: Options,
    scheduler: Arc<Scheduler>,
    draws: bool,
) -> Result<Box<dyn Frames>, Failed> {
    let maps = ShadowMaps { side: 64, ..ShadowMaps::default() };
    let mut deferred = Deferred::to_picture().shadow_maps(shadows.then_some(maps));
    if process == Process::WideTransparency {
        deferred = deferred.replace("transparency", WideTransparency);
    }
    let mut builder = Renderer::builder(backend).pipeline(deferred);
    if let Some(quality) = quality {
        builder = builder.quality(quality);
    }
    let (renderer, submitter) = builder.build(scheduler)?;
    Ok(Box::new(Fixture { renderer, submitter, draws }))
}

/// Limits of this number of bytes for what shaders read, and of as much for a buffer as all views can need.
pub fn binding(binding_bytes: usize) -> Option<SceneLimits> {
    Some(SceneLimits { binding_bytes: binding_bytes as u64, ..SceneLimits::NONE })
}

/// Draws the scene twice, and compares the frames with one of `expected` that a new renderer without limits draws.
pub fn expect_same(
    frames: &mut dyn Frames,
    device: Device,
    options: Options,
    [scene, expected]: [SceneRef<'_>; 2],
) -> Result<Vec<SceneIssue>, Failed> {
    let expected = renderer(device, Options { limits: None, ..options })?.frame(expected)?;
    let first = frames.frame(scene)?;
    expect_pictures(&first, &expected)?;
    let second = frames.frame(SceneRef { changes: Changes::NONE, ..scene })?;
    expect_pictures(&second, &expected).map_err(|failed| format!("in the second frame: {failed:?}"))?;
    let changed = || format!("{:?}, and then {:?}", first.scene_issues, second.scene_issues);
    if first.scene_issues == second.scene_issues { Ok(first.scene_issues) } else { Err(changed().into()) }
}

/// # Errors
/// If a picture differs.
pub fn expect_pictures(found: &Frame, expected: &Frame) -> Result<(), Failed> {
    for (view, (found, expected)) in found.pictures.iter().zip(&expected.pictures).enumerate() {
        let differing = found.bytes.iter().zip(&expected.bytes).filter(|(found, expected)| found != expected).count();
        if differing > 0 {
            return Err(format!("{differing} bytes of the picture of view {view} differ").into());
        }
    }
    Ok(())
}

/// The scene with small pictures.
pub fn small(mut scene: Scene) -> Scene {
    for camera in &mut scene.cameras {
        camera.size = [camera.size[0] / 5, camera.size[1] / 5];
    }
    scene
}

/// # Errors
/// If the scene issues are not these: of each reason how many, the first, and its name.
pub fn expect_scene_issues(
    found: &[SceneIssue],
    expected: &[(IssueReason, usize, usize, Option<&str>)],
) -> Result<(), Failed> {
    let of = |known: &SceneIssue| (known.reason, known.count, known.first);
    let is_same = found
        .iter()
        .map(|known| (of(known), known.name.as_deref()))
        .eq(expected.iter().map(|&(reason, count, first, name)| ((reason, count, first), name)));
    if is_same { Ok(()) } else { Err(format!("{found:?} instead of {expected:?}").into()) }
}
