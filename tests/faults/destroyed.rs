//! Raw passes that destroy what they are lent. Their frame fails, and later ones have it anew.

use std::error::Error;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use drawloom::backend::{BackendError, WgpuBackend};
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::{
    ClearColor, Declare, Deferred, Draws, Format, FullScreen, InjectionPoint, RawPass, RawPassResources, RenderProcess,
    StorageBuffer, previous_name, targets,
};
use drawloom::quality::{Quality, ShadowQuality};
use drawloom::scene::{Camera, Light, Redraw, Scene, ViewKind};
use drawloom::task::Scheduler;
use drawloom::{FrameError, RecordedFrame, Renderer, Submitter, wgpu};
use drawloom_testing::adapter::shared_backend;
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;

use crate::Case;
use crate::calls::expect;

pub const CASES_OF_ADAPTERS: &[Case] =
    &[("what_a_raw_pass_destroys_is_made_anew", destroyed), ("kept_views_that_are_destroyed_are_drawn_anew", kept)];

const COUNTS: StorageBuffer<u32> = StorageBuffer::new("counts", 4);

/// What is destroyed.
#[derive(Clone, Copy, Debug)]
enum Target {
    Own,
    Picture,
    Depth,
    History,
    ShadowMaps,
    Buffer,
}

impl Target {
    const ALL: [Self; 6] = [Self::Own, Self::Picture, Self::Depth, Self::History, Self::ShadowMaps, Self::Buffer];
}

/// Destroys something when it is armed, and otherwise does nothing.
struct Destroys {
    target: Target,
    is_armed: Arc<AtomicBool>,
}

impl RenderProcess for Destroys {
    fn name(&self) -> &str {
        "destroys"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.at(InjectionPoint::AfterPostProcessing);
        declare.changes("picture");
        declare.changes("own");
        declare.reads("depth");
        declare.samples_previous("picture");
        declare.samples_layers(ViewKind::Shadow, targets::SHADOW_MAP);
        declare.changes_buffer(COUNTS);
        declare.keep();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Raw(self)
    }
}

impl RawPass for Destroys {
    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &RawPassResources<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        encoder.clear_buffer(resources.buffer(COUNTS)?, 0, None);
        if !self.is_armed.swap(false, Ordering::Relaxed) {
            return Ok(());
        }
        match self.target {
            Target::Own => resources.target("own")?.destroy(),
            Target::Picture => resources.target("picture")?.destroy(),
            Target::Depth => resources.target("depth")?.destroy(),
            Target::History => resources.target(previous_name("picture"))?.destroy(),
            Target::ShadowMaps => resources.layered_target(ViewKind::Shadow, targets::SHADOW_MAP)?.destroy(),
            Target::Buffer => resources.buffer(COUNTS)?.destroy(),
        }
        Ok(())
    }
}

/// Clears a target of its own.
struct Clears;

impl RenderProcess for Clears {
    fn name(&self) -> &str {
        "clears"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.clears_color("own", Format::Rgba8Unorm, ClearColor::Value([0.25; 4]));
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @fragment
            fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                return vec4<f32>(0.5);
            }
        ";
        Draws::FullScreen(FullScreen { shader, ..FullScreen::default() })
    }
}

struct Fixture {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    scene: Scene,
    is_armed: Arc<AtomicBool>,
}

impl Fixture {
    fn new(target: Target, redraw: Redraw) -> Result<Self, Failed> {
        let is_armed = Arc::<AtomicBool>::default();
        let process = Destroys { target, is_armed: Arc::clone(&is_armed) };
        let balanced = Quality::balanced();
        let shadows = ShadowQuality { side: 24, ..balanced.shadows };
        let builder = Renderer::builder(shared_backend()?).pipeline(Deferred::to_picture());
        let builder = builder.process(Clears).process(process).output("own").quality(Quality { shadows, ..balanced });
        let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(2)?))?;
        let mut scene = field(20);
        scene.cameras = ["main", "other"]
            .map(|name| {
                let camera = Camera::looking_at(name, DVec3::new(0.0, 2.0, 24.0), DVec3::ZERO);
                Camera { redraw, size: [32, 20], ..camera }
            })
            .to_vec();
        let (position, intensity) = (DVec3::new(2.0, 6.0, 12.0), Vec3::splat(50.0));
        scene.lights.push(Light::Point { position, intensity, range: 30.0, casts_shadow: true });
        Ok(Self { renderer, submitter, scene, is_armed })
    }

    fn record(&mut self) -> Result<RecordedFrame<WgpuBackend>, FrameError> {
        self.renderer.record(self.scene.as_scene_ref())
    }

    /// Draws a frame, and returns what both views show.
    fn draw(&mut self) -> Result<Vec<Vec<u8>>, String> {
        let recorded = self.record().map_err(|error| error.to_string())?;
        let submission = self.submitter.submit(recorded).map_err(|error| error.to_string())?.submission;
        let read = |view, target| Ok::<_, BackendError>(submission.read(view, target)?.bytes);
        let all = [(0, "picture"), (0, "own"), (1, "picture")].map(|(view, target)| read(view, target));
        all.into_iter().collect::<Result<_, _>>().map_err(|error| error.to_string())
    }
}

fn destroyed() -> Result<(), Failed> {
    for target in Target::ALL {
        let mut fixture = Fixture::new(target, Redraw::EveryFrame)?;
        let expected = fixture.draw()?;
        for _ in 0..2 {
            expect(fixture.draw()? == expected, || format!("{target:?}: frames differ"))?;
            fixture.is_armed.store(true, Ordering::Relaxed);
            let error = fixture.draw().err().ok_or_else(|| format!("{target:?}: nothing is destroyed"))?;
            expect(error.contains("destroyed"), || format!("{target:?}: {error}"))?;
            for frame in 0..2 {
                let shown = fixture.draw().map_err(|error| format!("{target:?}, then frame {frame}: {error}"))?;
                expect(shown == expected, || format!("{target:?}, then frame {frame}: it is another one"))?;
            }
        }
    }
    Ok(())
}

/// Frames with a view that is kept, and that is destroyed meanwhile: one more may be refused, which then draws nothing
/// wrong.
fn kept() -> Result<(), Failed> {
    for target in Target::ALL {
        let mut fixture = Fixture::new(target, Redraw::OnCameraChange)?;
        let expected = fixture.draw()?;
        for ahead in 0..3 {
            expect(fixture.draw()? == expected, || format!("{target:?}: frames differ"))?;
            // A camera that moves has its view drawn, with the raw pass.
            fixture.scene.cameras[0].position.x += 0.5;
            fixture.is_armed.store(true, Ordering::Relaxed);
            let mut frames = Vec::new();
            for _ in 0..=ahead {
                frames.extend(fixture.record());
            }
            let outcomes = frames.into_iter().map(|frame| fixture.submitter.submit(frame).is_err());
            let failed = outcomes.filter(|failed| *failed).count();
            expect(failed > 0, || format!("{target:?}, {ahead} frames ahead: nothing is destroyed"))?;
            fixture.scene.cameras[0].position.x -= 0.5;
            let mut tries = 0;
            let shown = loop {
                match fixture.draw() {
                    Ok(shown) => break shown,
                    Err(error) => expect(tries < 2, || format!("{target:?}, {ahead} frames ahead, then: {error}"))?,
                }
                tries += 1;
            };
            expect(shown == expected, || format!("{target:?}, {ahead} frames ahead: the next frame is another one"))?;
        }
    }
    Ok(())
}
