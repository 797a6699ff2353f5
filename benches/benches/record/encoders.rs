//! An encoder for each camera, into which a thread records one draw for each object.

use drawloom::scene::{Camera, SceneRef};
use drawloom::wgpu;

use crate::draw_only::DrawOnly;
use crate::objects::clip_from_world;
use crate::spheres::{planes, visible_objects};
use crate::technique::{Failure, Technique};
use crate::threads::Threads;

pub struct Encoders {
    shared: DrawOnly,
    threads: Threads,
    drawn: usize,
}

impl Encoders {
    pub fn new(shared: DrawOnly, threads: &Threads) -> Self {
        Self { shared, threads: threads.clone(), drawn: 0 }
    }
}

impl Technique for Encoders {
    fn frame(&mut self, scene: SceneRef<'_>) -> Result<(), Failure> {
        let Self { shared, threads, drawn } = self;
        shared.prepare(&scene, threads)?;
        let mut cameras: Vec<_> = scene.cameras.iter().enumerate().collect();
        let encoded = threads.map(&mut cameras, |(index, camera)| encode(shared, &scene, *index, camera));
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
    let clip_from_world = clip_from_world(camera);
    shared.write_camera(index, &clip_from_world);
    let mut encoder = shared.fixture.encoder();
    let mut pass = shared.fixture.pass(&mut encoder, index);
    shared.set(&mut pass, index);
    let mut drawn = 0;
    for object in visible_objects(shared.groups(), 0, &planes(&clip_from_world)) {
        shared.draw(&mut pass, scene, object);
        drawn += 1;
    }
    drop(pass);
    (encoder.finish(), drawn)
}
