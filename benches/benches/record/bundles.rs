//! Chunks of objects. Any free thread of a rayon pool culls a chunk and records it as a bundle.

use std::sync::atomic::{AtomicUsize, Ordering};

use drawloom::scene::SceneRef;
use drawloom::view::Frustum;
use drawloom::wgpu;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::draw_only::DrawOnly;
use crate::objects::clip_from_world;
use crate::technique::{Failure, Technique};

/// Objects per chunk: fewer make bundles costly, more leave threads without work at the end.
const CHUNK: usize = 256;

pub struct Parallel {
    shared: DrawOnly,
    pool: ThreadPool,
    drawn: usize,
}

impl Parallel {
    pub fn new(shared: DrawOnly, threads: usize) -> Result<Self, Failure> {
        let pool = ThreadPoolBuilder::new().num_threads(threads).build()?;
        Ok(Self { shared, pool, drawn: 0 })
    }
}

impl Technique for Parallel {
    fn frame(&mut self, scene: SceneRef<'_>) -> Result<(), Failure> {
        let Self { shared, pool, drawn } = self;
        *drawn = pool.install(|| {
            shared.prepare(&scene);
            for (index, camera) in scene.cameras.iter().enumerate() {
                shared.write_camera(index, &clip_from_world(camera));
            }
            record(shared, &scene)
        });
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

/// Returns the number of objects drawn.
fn record(shared: &DrawOnly, scene: &SceneRef<'_>) -> usize {
    let drawn = AtomicUsize::new(0);
    let frustums: Vec<_> = scene.cameras.iter().map(Frustum::new).collect();
    let chunks = shared.spheres.len().div_ceil(CHUNK);
    let bundle = |index: usize| {
        let (camera, chunk) = (index / chunks, index % chunks);
        let mut encoder = shared.fixture.bundle_encoder();
        shared.set(&mut encoder, camera);
        let mut count = 0;
        for object in (chunk * CHUNK..shared.spheres.len()).take(CHUNK) {
            if shared.spheres[object].is_visible(&frustums[camera]) {
                shared.draw(&mut encoder, scene, object);
                count += 1;
            }
        }
        drawn.fetch_add(count, Ordering::Relaxed);
        encoder.finish(&wgpu::RenderBundleDescriptor::default())
    };
    let bundles: Vec<_> = (0..chunks * frustums.len()).into_par_iter().map(bundle).collect();
    let encode = |(camera, bundles): (usize, &[wgpu::RenderBundle])| {
        let mut encoder = shared.fixture.encoder();
        shared.fixture.pass(&mut encoder, camera).execute_bundles(bundles);
        encoder.finish()
    };
    let commands: Vec<_> = bundles.par_chunks(chunks).enumerate().map(encode).collect();
    shared.fixture.queue.submit(commands);
    drawn.into_inner()
}
