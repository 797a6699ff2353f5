//! A bundle for each chunk of a camera's objects, into which a thread records one draw for each object.

use drawloom::scene::SceneRef;
use drawloom::wgpu;

use crate::draw_only::DrawOnly;
use crate::objects::clip_from_world;
use crate::spheres::{LANES, planes, visible_objects};
use crate::technique::{Failure, Technique};
use crate::threads::Threads;

/// Groups of objects in a bundle, which are 256 objects: fewer make bundles costly, more leave threads without work at
/// the end.
const GROUPS: usize = 256 / LANES;

pub struct Bundles {
    shared: DrawOnly,
    threads: Threads,
    drawn: usize,
}

impl Bundles {
    pub fn new(shared: DrawOnly, threads: &Threads) -> Self {
        Self { shared, threads: threads.clone(), drawn: 0 }
    }
}

impl Technique for Bundles {
    fn frame(&mut self, scene: SceneRef<'_>) -> Result<(), Failure> {
        let Self { shared, threads, drawn } = self;
        shared.prepare(&scene, threads)?;
        let cameras: Vec<_> = scene.cameras.iter().map(clip_from_world).collect();
        for (index, camera) in cameras.iter().enumerate() {
            shared.write_camera(index, camera);
        }
        let planes: Vec<_> = cameras.iter().map(planes).collect();
        let chunks = shared.groups().len().div_ceil(GROUPS);
        let mut all: Vec<_> =
            (0..cameras.len()).flat_map(|camera| (0..chunks).map(move |chunk| (camera, chunk))).collect();
        let recorded = threads.map(&mut all, |&mut (camera, chunk)| {
            let mut encoder = shared.fixture.bundle_encoder();
            shared.set(&mut encoder, camera);
            let (first, mut drawn) = (chunk * GROUPS, 0);
            let groups = &shared.groups()[first..shared.groups().len().min(first + GROUPS)];
            for object in visible_objects(groups, first, &planes[camera]) {
                shared.draw(&mut encoder, &scene, object);
                drawn += 1;
            }
            (encoder.finish(&wgpu::RenderBundleDescriptor::default()), drawn)
        });
        let (bundles, counts): (Vec<_>, Vec<usize>) = recorded.into_iter().unzip();
        let mut views: Vec<_> = bundles.chunks(chunks).enumerate().collect();
        let commands = threads.map(&mut views, |(camera, bundles)| {
            let mut encoder = shared.fixture.encoder();
            shared.fixture.pass(&mut encoder, *camera).execute_bundles(*bundles);
            encoder.finish()
        });
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
