//! A forward renderer in plain wgpu, on one thread: what an engine writes by hand. It culls objects and lights, draws
//! all visible objects as instances of one mesh, and tone maps. How it lights them is a [`Lighting`]. It has the
//! layouts and the shading of this crate, so that pictures are the same.

mod clusters;
mod device;
mod draw_per_light;
pub mod picture;
pub mod visible_scene;

use std::error::Error;
use std::time::Instant;

use drawloom::backend::{Picture, WgpuBackend};
use drawloom::process::Format;
use drawloom::scene::SceneRef;
use drawloom::wgpu;
use drawloom_benches::stopwatch::FrameTime;

use crate::contender::{Contender, Counts};

use device::Device;
use visible_scene::VisibleScene;

pub use clusters::Clusters;
pub use draw_per_light::DrawPerLight;

/// How lights reach objects.
pub trait Lighting {
    /// Finds out which lights are needed where, and uploads that.
    ///
    /// # Errors
    /// Returns an error if it does not fit into the buffers.
    fn prepare(&mut self, queue: &wgpu::Queue, scene: &VisibleScene) -> Result<(), Box<dyn Error>>;

    /// Draws the visible objects with all their lights, in the pass over the radiance.
    fn draw(&self, pass: &mut wgpu::RenderPass<'_>, scene: &VisibleScene, index_count: u32) -> LightingCounts;
}

/// What a [`Lighting`] drew.
#[derive(Clone, Copy, Debug, Default)]
pub struct LightingCounts {
    pub draws: usize,
    /// Objects, once for each time that they are drawn.
    pub commands: usize,
}

pub struct PlainForward<L> {
    device: Device,
    scene: VisibleScene,
    lighting: L,
    counts: LightingCounts,
}

impl<L: Lighting> PlainForward<L> {
    /// `lighting` makes its pipelines.
    ///
    /// # Errors
    /// Returns an error if the scene has other than one camera or mesh.
    pub fn new(
        backend: &WgpuBackend,
        scene: &SceneRef<'_>,
        lighting: impl FnOnce(&Device, &SceneRef<'_>) -> L,
    ) -> Result<Self, Box<dyn Error>> {
        let device = Device::new(backend, scene)?;
        let lighting = lighting(&device, scene);
        Ok(Self { device, scene: VisibleScene::default(), lighting, counts: LightingCounts::default() })
    }
}

impl<L: Lighting> Contender for PlainForward<L> {
    fn frame(&mut self, scene: SceneRef<'_>) -> Result<FrameTime, Box<dyn Error>> {
        let Self { device, scene: visible, lighting, counts } = self;
        let start = Instant::now();
        visible.update(&scene)?;
        device.upload(visible);
        lighting.prepare(&device.queue, visible)?;
        let mut encoder = device.encoder();
        let mut pass = device.begin_radiance(&mut encoder, scene.background);
        *counts = lighting.draw(&mut pass, visible, device.index_count);
        drop(pass);
        device.tone_map(&mut encoder);
        let commands = encoder.finish();
        let submit = Instant::now();
        device.queue.submit([commands]);
        let cpu = start.elapsed();
        device.wait()?;
        Ok(FrameTime { cpu, borrowed: submit - start, device: submit.elapsed() })
    }

    fn counts(&self) -> Counts {
        let LightingCounts { draws, commands } = self.counts;
        let (visible, lights) = (self.scene.drawn.len(), self.scene.lights.len());
        Counts { views: 1, visible, lights, commands, draws, processes: PASSES }
    }

    fn picture(&self) -> Result<Picture, Box<dyn Error>> {
        let (bytes, [width, height]) = (self.device.read()?, self.device.size);
        Ok(Picture { width, height, format: Format::Rgba8Srgb, bytes })
    }
}

/// Radiance and tone mapping.
const PASSES: usize = 2;
