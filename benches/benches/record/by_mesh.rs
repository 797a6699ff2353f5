//! Instancing by hand: threads cull the objects of cameras eight at a time, and count and scatter them by mesh. A
//! camera is recorded as one instanced draw for each mesh. There is no scheduler, and no other order.

use std::ops::Range;

use drawloom::glam::Mat4;
use drawloom::scene::{Camera, SceneRef};
use drawloom::wgpu;
use multiversion::multiversion;

use crate::draw_only::DrawOnly;
use crate::objects::clip_from_world;
use crate::spheres::{LANES, Planes, SphereGroup, planes};
use crate::technique::{Failure, Technique};
use crate::threads::Threads;

pub struct ByMesh {
    shared: DrawOnly,
    /// Parts of each camera after those of the camera before; kept over all frames.
    visible: Vec<VisibleObjects>,
    threads: Threads,
}

/// The objects of a range of groups that a camera sees.
#[derive(Default)]
struct VisibleObjects {
    groups: Range<usize>,
    /// In the order of the scene.
    in_order: Vec<u32>,
    /// The same by mesh.
    by_mesh: Vec<u32>,
    /// For each mesh, by slot: the end of its range in `by_mesh`. While objects are scattered, where its next one goes.
    ends: Vec<u32>,
}

/// A camera, and its parts of [`ByMesh::visible`].
struct View<'a> {
    index: usize,
    clip_from_world: Mat4,
    parts: &'a mut [VisibleObjects],
}

impl ByMesh {
    /// `shared` must have lists of instances.
    pub fn new(shared: DrawOnly, threads: &Threads) -> Self {
        let (cameras, groups) = (shared.camera_count(), shared.groups().len());
        let parts = threads.parts(cameras);
        let part = |index: usize| VisibleObjects {
            groups: groups * index / parts..groups * (index + 1) / parts,
            ..VisibleObjects::default()
        };
        let visible = (0..cameras).flat_map(|_| (0..parts).map(part)).collect();
        Self { shared, visible, threads: threads.clone() }
    }
}

impl Technique for ByMesh {
    fn frame(&mut self, scene: SceneRef<'_>) -> Result<(), Failure> {
        let Self { shared, visible, threads } = self;
        shared.prepare(&scene, threads)?;
        let parts = visible.len() / scene.cameras.len();
        if parts > 1 {
            // More threads than cameras: they share the culling of each camera.
            let cameras: Vec<_> = scene.cameras.iter().map(clip_from_world).collect();
            let mut all: Vec<_> = visible.iter_mut().enumerate().collect();
            threads.for_each(&mut all, |(index, part)| {
                part.find(shared, &scene, *index / parts, &planes(&cameras[*index / parts]));
            });
        }
        let view = |(index, (camera, parts)): (usize, (&Camera, _))| View {
            index,
            clip_from_world: clip_from_world(camera),
            parts,
        };
        let cameras = scene.cameras.iter().zip(visible.chunks_mut(parts));
        let mut views: Vec<_> = cameras.enumerate().map(view).collect();
        let commands = threads.map(&mut views, |view| {
            if let [whole] = view.parts {
                whole.find(shared, &scene, view.index, &planes(&view.clip_from_world));
            }
            view.encode(shared)
        });
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

impl View<'_> {
    /// Records the draws of all parts.
    fn encode(&self, shared: &DrawOnly) -> wgpu::CommandBuffer {
        shared.write_camera(self.index, &self.clip_from_world);
        let mut encoder = shared.fixture.encoder();
        let mut pass = shared.fixture.pass(&mut encoder, self.index);
        shared.set(&mut pass, self.index);
        for part in &*self.parts {
            let (first_instance, mut first) = (part.first_instance(), 0);
            for (mesh, &end) in part.ends.iter().enumerate() {
                if end > first {
                    shared.draw_mesh(&mut pass, mesh, first_instance + first..first_instance + end);
                    first = end;
                }
            }
        }
        drop(pass);
        encoder.finish()
    }
}

/// Appends the objects that a camera sees of groups from the group `first` on, and counts them by mesh.
#[multiversion(targets("x86_64+avx2"))]
fn cull(
    groups: &[SphereGroup],
    first: usize,
    scene: &SceneRef,
    planes: &Planes,
    in_order: &mut Vec<u32>,
    counts: &mut [u32],
) {
    for (index, group) in groups.iter().enumerate() {
        let mut mask = group.visible(planes);
        while mask != 0 {
            let object = (first + index) * LANES + mask.trailing_zeros() as usize;
            mask &= mask - 1;
            in_order.push(object as u32);
            counts[scene.meshes[object].index() as usize] += 1;
        }
    }
}

impl VisibleObjects {
    /// Where its instances begin in the camera's list: no part has more of them than objects.
    fn first_instance(&self) -> u32 {
        (self.groups.start * LANES) as u32
    }

    /// Finds the objects, orders them by mesh with a counting sort, and uploads them.
    fn find(&mut self, shared: &DrawOnly, scene: &SceneRef<'_>, camera: usize, planes: &Planes) {
        let first_instance = self.first_instance();
        let Self { groups, in_order, by_mesh, ends } = self;
        in_order.clear();
        ends.clear();
        ends.resize(shared.mesh_count(), 0);
        cull(&shared.groups()[groups.clone()], groups.start, scene, planes, in_order, ends);
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
        shared.write_instances(camera, first_instance, by_mesh);
    }
}
