//! One thread per camera, each with an encoder of its own.

use drawloom::scene::{Camera, SceneRef};
use drawloom::view::Frustum;
use drawloom::wgpu;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::CAMERAS;
use crate::draw_only::DrawOnly;
use crate::objects::clip_from_world;
use crate::technique::{Failure, Technique};

pub struct EncoderPerThread {
    shared: DrawOnly,
    /// Kept over all frames.
    threads: ThreadPool,
    drawn: usize,
}

impl EncoderPerThread {
    pub fn new(shared: DrawOnly) -> Result<Self, Failure> {
        let threads = ThreadPoolBuilder::new().num_threads(CAMERAS).build()?;
        Ok(Self { shared, threads, drawn: 0 })
    }
}

impl Technique for EncoderPerThread {
    fn frame(&mut self, scene: SceneRef<'_>) -> Result<(), Failure> {
        let Self { shared, threads, drawn } = self;
        threads.install(|| shared.prepare(&scene));
        let encode = |(index, camera): (usize, &Camera)| encode(shared, &scene, index, camera);
        let encoded: Vec<_> = threads.install(|| {
            let cameras = scene.cameras.par_iter().enumerate().with_max_len(1);
            cameras.map(encode).collect()
        });
        let (commands, counts): (Vec<_>, Vec<usize>) = encoded.into_iter().unzip();
        shared.fixture.queue.submit(commands);
        *drawn = counts.iter().sum();
        Ok(())
    }

    fn wait(&mut self) -> Result<(), Failure> {
        self.shared.fixture.wait()
    }

    fn drawn(&self) -> usize {
        self.drawn
    }

    fn picture(&mut self, camera: usize) -> Result<Vec<u8>, Failure> {
        self.shared.fixture.read(camera)
    }
}

/// Culls and records a camera's objects; also returns their number.
fn encode(shared: &DrawOnly, scene: &SceneRef<'_>, index: usize, camera: &Camera) -> (wgpu::CommandBuffer, usize) {
    shared.write_camera(index, &clip_from_world(camera));
    let frustum = Frustum::new(camera);
    let mut encoder = shared.fixture.encoder();
    let mut pass = shared.fixture.pass(&mut encoder, index);
    shared.set(&mut pass, index);
    let mut drawn = 0;
    for object in (0..scene.object_count()).filter(|&object| shared.spheres[object].is_visible(&frustum)) {
        shared.draw(&mut pass, scene, object);
        drawn += 1;
    }
    drop(pass);
    (encoder.finish(), drawn)
}
