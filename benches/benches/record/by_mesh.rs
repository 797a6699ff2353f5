//! Instancing by hand: a thread culls a camera's objects eight at a time, counts and scatters them by mesh, and records one
//! instanced draw for each mesh. It has no scheduler, and sorts by nothing else.

use drawloom::glam::{Mat4, Vec4};
use drawloom::scene::{Camera, SceneRef};
use drawloom::wgpu;
use multiversion::multiversion;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};

use crate::draw_only::{DrawOnly, MIN_OBJECTS_PER_JOB};
use crate::objects::{GpuObject, Sphere, clip_from_world};
use crate::technique::{Failure, Technique};

pub struct ByMesh {
    shared: DrawOnly,
    /// Groups of objects; kept over all frames.
    groups: Vec<SphereGroup>,
    /// By camera; kept over all frames.
    visible: Vec<VisibleObjects>,
    /// Kept over all frames. `None` for one thread, which needs no pool.
    threads: Option<ThreadPool>,
}

/// The number of objects in a group.
const LANES: usize = 8;

/// Bounding spheres of [`LANES`] objects, an array for each coordinate. Lanes without an object have a negative radius.
#[derive(Clone, Copy)]
struct SphereGroup {
    x: [f32; LANES],
    y: [f32; LANES],
    z: [f32; LANES],
    radius: [f32; LANES],
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
        let empty = SphereGroup { x: [0.0; LANES], y: [0.0; LANES], z: [0.0; LANES], radius: [-1.0; LANES] };
        let groups = vec![empty; shared.gpu_objects.len().div_ceil(LANES)];
        Ok(Self { shared, groups, visible, threads: pool })
    }
}

impl Technique for ByMesh {
    fn frame(&mut self, scene: SceneRef<'_>) -> Result<(), Failure> {
        let Self { shared, groups, visible, threads } = self;
        let commands: Vec<_> = match threads {
            None => {
                let all = groups.iter_mut().zip(shared.gpu_objects.chunks_mut(LANES)).enumerate();
                all.for_each(|(index, (group, objects))| group.describe(&scene, index * LANES, objects));
                shared.write_objects();
                let cameras = scene.cameras.iter().enumerate().zip(visible);
                cameras
                    .map(|((index, camera), visible)| encode(shared, groups, &scene, index, camera, visible))
                    .collect()
            }
            Some(threads) => threads.install(|| {
                let all = groups.par_iter_mut().zip(shared.gpu_objects.par_chunks_mut(LANES)).enumerate();
                all.with_min_len(MIN_OBJECTS_PER_JOB / LANES)
                    .for_each(|(index, (group, objects))| group.describe(&scene, index * LANES, objects));
                shared.write_objects();
                let cameras = scene.cameras.par_iter().enumerate().zip(visible).with_max_len(1);
                cameras
                    .map(|((index, camera), visible)| encode(shared, groups, &scene, index, camera, visible))
                    .collect()
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
    groups: &[SphereGroup],
    scene: &SceneRef<'_>,
    index: usize,
    camera: &Camera,
    visible: &mut VisibleObjects,
) -> wgpu::CommandBuffer {
    let clip_from_world = clip_from_world(camera);
    shared.write_camera(index, &clip_from_world);
    visible.find(shared.mesh_count(), groups, scene, &planes(&clip_from_world));
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

impl SphereGroup {
    /// Computes the objects of a group, from `first` on.
    fn describe(&mut self, scene: &SceneRef<'_>, first: usize, gpu_objects: &mut [GpuObject]) {
        for (lane, gpu_object) in gpu_objects.iter_mut().enumerate() {
            *gpu_object = GpuObject::new(scene, first + lane);
            let Sphere { center, radius } = Sphere::new(scene, first + lane);
            let [x, y, z] = center.as_vec3().to_array();
            (self.x[lane], self.y[lane], self.z[lane], self.radius[lane]) = (x, y, z, radius);
        }
    }
}

/// The planes of a camera that sees to infinity: inward normals of unit length, and distances (Gribb and Hartmann, 2001).
fn planes(clip_from_world: &Mat4) -> [Vec4; 5] {
    let [x, y, z, w] = [0, 1, 2, 3].map(|row| clip_from_world.row(row));
    [w + x, w - x, w + y, w - y, w - z].map(|plane| plane / plane.truncate().length())
}

/// A mask of the spheres of a group that a camera sees.
#[allow(clippy::needless_range_loop)] // Such a loop compiles to vector instructions.
#[inline(always)]
fn visible_spheres(group: &SphereGroup, planes: &[Vec4; 5]) -> u32 {
    let mut nearest = [f32::INFINITY; LANES];
    for plane in planes {
        for lane in 0..LANES {
            let distance = plane.x * group.x[lane] + plane.y * group.y[lane] + plane.z * group.z[lane] + plane.w;
            nearest[lane] = if distance < nearest[lane] { distance } else { nearest[lane] };
        }
    }
    (0..LANES).fold(0, |mask, lane| {
        let sees = (group.radius[lane] >= 0.0) & (nearest[lane] >= -group.radius[lane]);
        mask | u32::from(sees) << lane
    })
}

/// Appends the objects that a camera sees, and counts them by mesh.
#[multiversion(targets("x86_64+avx2"))]
fn cull(groups: &[SphereGroup], scene: &SceneRef, planes: &[Vec4; 5], in_order: &mut Vec<u32>, counts: &mut [u32]) {
    for (index, group) in groups.iter().enumerate() {
        let mut mask = visible_spheres(group, planes);
        while mask != 0 {
            let object = index * LANES + mask.trailing_zeros() as usize;
            mask &= mask - 1;
            in_order.push(object as u32);
            counts[scene.meshes[object].index() as usize] += 1;
        }
    }
}

impl VisibleObjects {
    /// Finds a camera's objects, and orders them by mesh with a counting sort.
    fn find(&mut self, meshes: usize, groups: &[SphereGroup], scene: &SceneRef<'_>, planes: &[Vec4; 5]) {
        let Self { in_order, by_mesh, ends } = self;
        in_order.clear();
        ends.clear();
        ends.resize(meshes, 0);
        cull(groups, scene, planes, in_order, ends);
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
