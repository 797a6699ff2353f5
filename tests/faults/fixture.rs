//! A renderer on a backend that fails on request, and the scenes that it draws.

use std::sync::Arc;

use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{Deferred, Fxaa, ToneMapping};
use drawloom::quality::{Quality, ShadowQuality};
use drawloom::scene::{Camera, Changes, RenderObject, Scene, SceneRef};
use drawloom::task::Scheduler;
use drawloom::{CpuNode, FrameError, FrameInputs, Granularity, Renderer, RendererBuilder, SubmitError, Submitter};
use drawloom_testing::fault_injection::FaultyBackend;
use drawloom_testing::scenes::everything::everything;
use libtest_mimic::Failed;

use crate::subjects::Subject;

/// How a frame is made.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    pub workers: usize,
    pub granularity: Granularity,
    /// Whether passes are finished together wherever the trait allows.
    pub joins_passes: bool,
    /// Whether there are shadow maps, and post-processing beyond tone mapping.
    pub is_full: bool,
    pub tests_occlusion: bool,
    /// The interval of frames in which shadow maps are drawn.
    pub shadow_interval: u32,
}

impl Setting {
    /// Everything that the pipeline has, drawn in every frame.
    pub const FULL: Self = Self {
        workers: 2,
        granularity: Granularity::Adaptive,
        joins_passes: false,
        is_full: true,
        tests_occlusion: true,
        shadow_interval: 1,
    };
}

pub struct Fixture<S: Subject> {
    pub scheduler: Arc<Scheduler>,
    pub renderer: Renderer<FaultyBackend<S>>,
    pub submitter: Submitter<FaultyBackend<S>>,
    /// Of all views of the latest frame that was recorded.
    pub executed_static_groups: usize,
}

/// Why a frame was not drawn.
#[derive(Debug)]
pub enum Refusal {
    Frame(FrameError),
    Submission(SubmitError),
}

impl<S: Subject> Fixture<S> {
    pub fn new(setting: Setting) -> Result<Self, Failed> {
        let scheduler = Arc::new(Scheduler::new(setting.workers)?);
        let backend = S::open(&scheduler)?;
        Self::on(backend, scheduler, setting)
    }

    pub fn on(backend: S, scheduler: Arc<Scheduler>, setting: Setting) -> Result<Self, Failed> {
        let backend = FaultyBackend::new(backend);
        let backend = if setting.joins_passes { backend.joining_passes() } else { backend };
        let builder = Renderer::builder(backend).granularity(setting.granularity);
        let (renderer, submitter) = with_deferred(builder, setting).build(Arc::clone(&scheduler))?;
        Ok(Self { scheduler, renderer, submitter, executed_static_groups: 0 })
    }

    /// Draws a frame. `Err` within `Ok` is a refusal by the renderer or submitter.
    pub fn draw(&mut self, scene: &Scene, changes: Changes<'_>) -> Result<Result<Vec<u8>, Refusal>, Failed> {
        self.draw_with_nodes(SceneRef { changes, ..scene.as_scene_ref() }, &[])
    }

    /// Draws a frame whose graph has these nodes.
    pub fn draw_with_nodes(
        &mut self,
        scene: SceneRef<'_>,
        nodes: &[&dyn CpuNode],
    ) -> Result<Result<Vec<u8>, Refusal>, Failed> {
        let recorded = match self.renderer.record_with(FrameInputs { nodes, ..FrameInputs::new(scene) }) {
            Ok(recorded) => recorded,
            Err(error) => return Ok(Err(Refusal::Frame(error))),
        };
        self.executed_static_groups = recorded.statistics().views.iter().map(|view| view.static_groups).sum::<usize>();
        match self.submitter.submit(recorded) {
            Ok(submitted) => S::read(&submitted.submission, 0, "picture").map(Ok),
            Err(error) => Ok(Err(Refusal::Submission(error))),
        }
    }

    /// Draws a frame that nothing fails.
    pub fn picture(&mut self, scene: &Scene, changes: Changes<'_>) -> Result<Vec<u8>, Failed> {
        self.draw(scene, changes)?.map_err(|refusal| format!("{refusal:?}").into())
    }
}

fn with_deferred<S: Subject>(
    builder: RendererBuilder<FaultyBackend<S>>,
    setting: Setting,
) -> RendererBuilder<FaultyBackend<S>> {
    let deferred = Deferred::new().post(ToneMapping::default());
    if !setting.is_full {
        return builder.pipeline(deferred.shadow_maps(None));
    }
    let balanced = Quality::balanced();
    let shadows = ShadowQuality { side: 24, interval: setting.shadow_interval, ..balanced.shadows };
    let occlusion = balanced.occlusion.filter(|_| setting.tests_occlusion);
    builder.pipeline(deferred.post(Fxaa::default())).quality(Quality { shadows, occlusion, ..balanced })
}

/// Two scenes with all that the pipeline draws, and the objects in which they differ.
pub fn two_scenes() -> Result<([Scene; 2], Vec<u32>), Failed> {
    let small = |mut scene: Scene| {
        scene.cameras.iter_mut().for_each(|camera: &mut Camera| camera.size = [32, 20]);
        scene
    };
    let before = small(everything());
    let mut after = small(everything());
    let mut moved = Vec::new();
    for (index, handle) in after.objects().collect::<Vec<_>>().into_iter().enumerate().skip(2).step_by(3) {
        let object = after.object(handle)?;
        let (position, scale) = (object.position + DVec3::new(0.3, 0.2, 0.5), object.scale * 1.3);
        after.replace_object(handle, RenderObject { position, scale, ..object })?;
        moved.push(index as u32);
    }
    after.ambient = Vec3::new(0.3, 0.1, 0.05);
    Ok(([before, after], moved))
}
