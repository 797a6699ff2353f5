//! The engine: its device and scheduler, and a renderer for each picture.

use std::error::Error;
use std::sync::Arc;

use drawloom::backend::{Picture, WgpuBackend, WgpuReadBack};
use drawloom::process::{Deferred, Fxaa, ToneMapping, targets};
use drawloom::task::Scheduler;
use drawloom::{Renderer, RendererBuilder, Submitter};

use crate::bloom::{BloomDown, BloomUp};
use crate::characters::{Characters, Crowd};
use crate::metal::MetalSurfaces;
use crate::outline::{Outline, Selected};
use crate::particles;
use crate::picking::{self, ObjectIndex};
use crate::temporal::{Motion, TemporalFilter};
use crate::tints::TintedGeometryBuffer;
use crate::world::World;

/// The engine's device and scheduler.
pub struct Engine {
    device: wgpu::Device,
    queue: wgpu::Queue,
    scheduler: Arc<Scheduler>,
}

impl Engine {
    pub fn new((device, queue): (wgpu::Device, wgpu::Queue)) -> Result<Self, Box<dyn Error>> {
        Ok(Self { device, queue, scheduler: Arc::new(Scheduler::with_available_parallelism()?) })
    }

    /// The world in its own tints and materials, and which object is in its middle.
    pub fn tints(&self, world: &World) -> Result<(Picture, u32), Box<dyn Error>> {
        let (mut renderer, submitter) = self.build(self.world(tinted().post(ToneMapping::new(1.0)))?)?;
        let (picture, under_cursor) = draw(&mut renderer, &submitter, world)?;
        Ok((picture, u32::from_le_bytes(under_cursor.read()?.bytes[..4].try_into()?)))
    }

    /// The same with a glow around what is bright.
    pub fn bloom(&self, world: &World) -> Result<Picture, Box<dyn Error>> {
        let (mut renderer, submitter) = self.build(self.glowing_world(tinted().post(ToneMapping::new(1.0)))?)?;
        Ok(draw(&mut renderer, &submitter, world)?.0)
    }

    /// The glowing world with a fountain, after some frames. Calls `progress` after each.
    pub fn particles(&self, world: &World, frames: usize, progress: impl Fn()) -> Result<Picture, Box<dyn Error>> {
        let builder = self.glowing_world(tinted().post(ToneMapping::new(1.0)))?;
        let builder = builder.process(particles::Begin).process(particles::Move::default()).process(particles::Draw);
        let (mut renderer, submitter) = self.build(builder)?;
        let mut picture = draw(&mut renderer, &submitter, world)?.0;
        for _ in 1..frames {
            picture = draw(&mut renderer, &submitter, world)?.0;
            progress();
        }
        Ok(picture)
    }

    /// The glowing world with temporal anti-aliasing, after some frames in which camera and objects move. Calls
    /// `progress` after each.
    pub fn smooth(&self, world: &mut World, frames: usize, progress: impl Fn()) -> Result<Picture, Box<dyn Error>> {
        let motion = Arc::new(Motion::default());
        let filter = |source: &str, target: &str| TemporalFilter::new(source, target);
        let smooth = tinted().post(filter).post(ToneMapping::new(1.0)).post(Fxaa::default());
        let (mut renderer, submitter) = self.build(self.glowing_world(smooth)?.process(Arc::clone(&motion)))?;
        motion.begin_frame(&world.camera);
        let mut picture = draw(&mut renderer, &submitter, world)?.0;
        for _ in 1..frames {
            world.step();
            motion.begin_frame(&world.camera);
            picture = draw(&mut renderer, &submitter, world)?.0;
            progress();
        }
        Ok(picture)
    }

    /// A crowd of walking characters, one of them selected.
    pub fn characters(&self, size: [u32; 2]) -> Result<Picture, Box<dyn Error>> {
        let characters = Arc::new(Characters::default());
        let mut crowd = Crowd::new(Arc::clone(&characters), size)?;
        crowd.walk_to(2.0);
        let deferred = Deferred::to_picture().post(Fxaa::default()).deformation(Arc::clone(&characters));
        let builder = self.builder()?.pipeline(deferred);
        let builder = builder.process(Selected(Arc::clone(&characters))).process(Outline(characters));
        let (mut renderer, submitter) = self.build(builder)?;
        let recorded = renderer.record(crowd.as_scene_ref(&crowd.columns()))?;
        Ok(submitter.submit(recorded)?.submission.read(0, targets::PICTURE)?)
    }

    fn builder(&self) -> Result<RendererBuilder<WgpuBackend>, Box<dyn Error>> {
        Ok(Renderer::builder(WgpuBackend::new(self.device.clone(), self.queue.clone())?))
    }

    /// A pipeline with the engine's own material, and with picking.
    fn world(&self, deferred: Deferred) -> Result<RendererBuilder<WgpuBackend>, Box<dyn Error>> {
        let builder = self.builder()?.pipeline(deferred).process(ObjectIndex).output(picking::TARGET);
        Ok(builder.process(MetalSurfaces::new(&self.device, &self.queue)))
    }

    /// The same with bloom.
    fn glowing_world(&self, deferred: Deferred) -> Result<RendererBuilder<WgpuBackend>, Box<dyn Error>> {
        Ok(self.world(deferred)?.process(BloomDown::HALF).process(BloomDown::QUARTER).process(BloomUp))
    }

    fn build(
        &self,
        builder: RendererBuilder<WgpuBackend>,
    ) -> Result<(Renderer<WgpuBackend>, Submitter<WgpuBackend>), Box<dyn Error>> {
        Ok(builder.build(Arc::clone(&self.scheduler))?)
    }
}

fn tinted() -> Deferred {
    Deferred::new().replace("geometry buffer", TintedGeometryBuffer::default())
}

/// Draws the world. Returns the picture, and the read-back of what is in its middle.
fn draw(
    renderer: &mut Renderer<WgpuBackend>,
    submitter: &Submitter<WgpuBackend>,
    world: &World,
) -> Result<(Picture, WgpuReadBack), Box<dyn Error>> {
    let mut recorded = renderer.record(world.as_scene_ref(&world.columns()))?;
    let middle = world.camera.size.map(|pixels| pixels / 2);
    let under_cursor = recorded.read_back(0, picking::TARGET, middle, [1, 1])?;
    let picture = submitter.submit(recorded)?.submission.read(0, targets::PICTURE)?;
    Ok((picture, under_cursor))
}
