//! Instancing by hand: a thread culls a camera's objects one by one, counts and scatters them by mesh, and records one instanced
//! draw for each mesh. It has no scheduler, and sorts by nothing else.

use drawloom::scene::{Camera, SceneRef};
use drawloom::view::Frustum;
use drawloom::wgpu;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::draw_only::DrawOnly;
use crate::objects::clip_from_world;
use crate::technique::{Failure, Technique};

pub struct ByMesh {
    shared: DrawOnly,
    /// By camera; kept over all frames.
    visible: Vec<VisibleObjects>,
    /// Kept over all frames. `None` for one thread, which needs no pool.
    threads: Option<ThreadPool>,
}

/// The objects that a camera sees.
#[derive(Default)]
struct VisibleObjects {
    /// In the order of the scene.
    in_order: Vec<u32>,
    /// The same by mesh.
    by_mesh: Vec<u32>,
    /// For each mesh, by slot: the end of its range in `by_mesh`. While objects are scattered, where its next one goes.
    ends: Vec<u32>,
}

impl ByMesh {
    /// `shared` must have lists of instances.
    pub fn new(shared: DrawOnly, threads: usize) -> Result<Self, Failure> {
        let visible = (0..shared.camera_count()).map(|_| VisibleObjects::default()).collect();
        let pool = (threads > 1).then(|| ThreadPoolBuilder::new().num_threads(threads).build()).transpose()?;
        Ok(Self { shared, visible, threads: pool })
    }
}

impl Technique for ByMesh {
    fn frame(&mut self, scene: SceneRef<'_>) -> Result<(), Failure> {
        let Self { shared, visible, threads } = self;
        let commands: Vec<_> = match threads {
            None => {
                shared.prepare_serially(&scene);
                let cameras = scene.cameras.iter().enumerate().zip(visible);
                cameras.map(|((index, camera), visible)| encode(shared, &scene, index, camera, visible)).collect()
            }
            Some(threads) => threads.install(|| {
                shared.prepare(&scene);
                let cameras = scene.cameras.par_iter().enumerate().zip(visible).with_max_len(1);
                cameras.map(|((index, camera), visible)| encode(shared, &scene, index, camera, visible)).collect()
            }),
        };
        shared.fixture.queue.submit(commands);
        Ok(())
    }

    fn wait(&mut self) -> Result<(), Failure> {
        self.shared.fixture.wait()
    }

    fn drawn(&self) -> usize {
        self.visible.iter().map(|visible| visible.in_order.len()).sum()
    }

    fn picture(&mut self, camera: usize) -> Result<Vec<u8>, Failure> {
        self.shared.fixture.read(camera)
    }
}

/// Culls, orders and records a camera's objects.
fn encode(
    shared: &DrawOnly,
    scene: &SceneRef<'_>,
    index: usize,
    camera: &Camera,
    visible: &mut VisibleObjects,
) -> wgpu::CommandBuffer {
    shared.write_camera(index, &clip_from_world(camera));
    visible.find(shared, scene, camera);
    shared.write_instances(index, &visible.by_mesh);
    let mut encoder = shared.fixture.encoder();
    let mut pass = shared.fixture.pass(&mut encoder, index);
    shared.set(&mut pass, index);
    let mut first = 0;
    for (mesh, &end) in visible.ends.iter().enumerate() {
        if end > first {
            shared.draw_mesh(&mut pass, mesh, first..end);
            first = end;
        }
    }
    drop(pass);
    encoder.finish()
}

impl VisibleObjects {
    /// Finds a camera's objects, and orders them by mesh with a counting sort.
    fn find(&mut self, shared: &DrawOnly, scene: &SceneRef<'_>, camera: &Camera) {
        let Self { in_order, by_mesh, ends } = self;
        let frustum = Frustum::new(camera);
        in_order.clear();
        ends.clear();
        ends.resize(shared.mesh_count(), 0);
        for (object, (sphere, mesh)) in shared.spheres.iter().zip(scene.meshes).enumerate() {
            if sphere.is_visible(&frustum) {
                in_order.push(object as u32);
                ends[mesh.index() as usize] += 1;
            }
        }
        let mut end = 0;
        for count in ends.iter_mut() {
            // Where the mesh's first object goes.
            end += std::mem::replace(count, end);
        }
        by_mesh.resize(in_order.len(), 0);
        for &object in in_order.iter() {
            let next = &mut ends[scene.meshes[object as usize].index() as usize];
            by_mesh[*next as usize] = object;
            *next += 1;
        }
    }
}
