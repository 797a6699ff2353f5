//! Shared by the techniques that set no state between draws: all meshes in one buffer, all objects in another.

use std::num::NonZeroU64;
use std::ops::Range;

use drawloom::glam::Mat4;
use drawloom::scene::SceneRef;
use drawloom::wgpu;
use drawloom::wgpu::util::{DeviceExt, RenderEncoder};

use crate::fixture::Fixture;
use crate::geometry::Geometry;
use crate::objects::{GpuObject, Sphere, colors};
use crate::spheres::{LANES, SphereGroup};
use crate::technique::Failure;
use crate::threads::Threads;

/// The state that is set once per pass, and the objects.
pub struct DrawOnly {
    pub fixture: Fixture,
    pipeline: wgpu::RenderPipeline,
    geometry: Geometry,
    objects: wgpu::Buffer,
    cameras: Vec<CameraBuffers>,
    /// Bounding spheres of all objects.
    groups: Vec<SphereGroup>,
}

/// Groups of objects in a job, which are 512 objects: fewer are not worth another thread.
const GROUPS_PER_JOB: usize = 512 / LANES;

const BYTES_PER_GROUP: usize = LANES * size_of::<GpuObject>();

/// Groups of objects, from the group `first` on, and for each of them the memory from which its objects are uploaded.
struct Chunk<'a> {
    first: usize,
    groups: &'a mut [SphereGroup],
    staged: Vec<wgpu::WriteOnly<'a, [u8; BYTES_PER_GROUP]>>,
}

struct CameraBuffers {
    clip_from_world: wgpu::Buffer,
    /// The objects to draw, if the shader reads a list of them.
    instances: Option<wgpu::Buffer>,
    group: wgpu::BindGroup,
}

impl DrawOnly {
    /// An instance is an object.
    pub fn new(fixture: Fixture, scene: &SceneRef<'_>) -> Self {
        let object_index = "fn object_index(instance: u32) -> u32 { return instance; }";
        Self::with_object_index(fixture, scene, object_index, false)
    }

    /// Each camera has a list of instances, which are objects.
    pub fn with_instances(fixture: Fixture, scene: &SceneRef<'_>) -> Self {
        Self::with_object_index(fixture, scene, include_str!("by_mesh.wgsl"), true)
    }

    /// `object_index` is the shader's function of that name.
    fn with_object_index(fixture: Fixture, scene: &SceneRef<'_>, object_index: &str, has_instances: bool) -> Self {
        let device = &fixture.device;
        let groups = vec![SphereGroup::EMPTY; scene.object_count().div_ceil(LANES)];
        let gpu_objects = vec![GpuObject::default(); groups.len() * LANES];
        let buffer = |usage: wgpu::BufferUsages, contents: &[u8]| {
            let usage = usage | wgpu::BufferUsages::COPY_DST;
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
        };
        let objects = buffer(wgpu::BufferUsages::STORAGE, bytemuck::cast_slice(&gpu_objects));
        let colors = buffer(wgpu::BufferUsages::STORAGE, bytemuck::cast_slice(&colors(scene)));
        let layout = layout(device, has_instances);
        let camera = |_| {
            let clip_from_world = buffer(wgpu::BufferUsages::UNIFORM, bytemuck::bytes_of(&Mat4::ZERO));
            let none = || vec![0_u32; scene.object_count()];
            let instances = has_instances.then(|| buffer(wgpu::BufferUsages::STORAGE, bytemuck::cast_slice(&none())));
            let mut entries = Vec::new();
            for (binding, buffer) in (0..).zip([&clip_from_world, &objects, &colors].into_iter().chain(&instances)) {
                entries.push(wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() });
            }
            let descriptor = wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &entries };
            let group = device.create_bind_group(&descriptor);
            CameraBuffers { clip_from_world, instances, group }
        };
        let cameras = scene.cameras.iter().map(camera).collect();
        let shader = include_str!("draw_only.wgsl").to_owned() + object_index;
        let pipeline = fixture.pipeline(&[&layout], None, &shader);
        Self { pipeline, geometry: Geometry::new(device, scene), objects, cameras, groups, fixture }
    }

    /// Computes all objects in the memory from which they are uploaded.
    ///
    /// # Errors
    /// Returns an error if there is no such memory.
    pub fn prepare(&mut self, scene: &SceneRef<'_>, threads: &Threads) -> Result<(), Failure> {
        const NO_MEMORY: &str = "wgpu has no memory from which objects could be uploaded";
        let bytes = NonZeroU64::new(self.objects.size()).ok_or(NO_MEMORY)?;
        let mut staging = self.fixture.queue.write_buffer_with(&self.objects, 0, bytes).ok_or(NO_MEMORY)?;
        let (staged, _) = staging.slice(..).into_chunks();
        let mut staged = staged.into_iter();
        let chunk = |(index, groups)| {
            let staged = staged.by_ref().take(GROUPS_PER_JOB).collect();
            Chunk { first: index * GROUPS_PER_JOB, groups, staged }
        };
        let mut chunks: Vec<_> = self.groups.chunks_mut(GROUPS_PER_JOB).enumerate().map(chunk).collect();
        threads.for_each(&mut chunks, |chunk| chunk.describe(scene));
        Ok(())
    }

    pub fn groups(&self) -> &[SphereGroup] {
        &self.groups
    }

    pub fn camera_count(&self) -> usize {
        self.cameras.len()
    }

    pub fn mesh_count(&self) -> usize {
        self.geometry.mesh_count()
    }

    /// Uploads a camera.
    pub fn write_camera(&self, camera: usize, clip_from_world: &Mat4) {
        self.fixture.queue.write_buffer(&self.cameras[camera].clip_from_world, 0, bytemuck::bytes_of(clip_from_world));
    }

    /// Uploads instances of a camera's list, from the instance `first` on.
    pub fn write_instances(&self, camera: usize, first: u32, instances: &[u32]) {
        if let Some(buffer) = &self.cameras[camera].instances {
            let offset = u64::from(first) * size_of::<u32>() as u64;
            self.fixture.queue.write_buffer(buffer, offset, bytemuck::cast_slice(instances));
        }
    }

    /// Sets the state that all draws share.
    pub fn set<'a>(&'a self, encoder: &mut impl RenderEncoder<'a>, camera: usize) {
        encoder.set_pipeline(&self.pipeline);
        encoder.set_bind_group(0, Some(&self.cameras[camera].group), &[]);
        self.geometry.set(encoder);
    }

    pub fn draw<'a>(&self, encoder: &mut impl RenderEncoder<'a>, scene: &SceneRef<'_>, object: usize) {
        let instance = object as u32;
        self.draw_mesh(encoder, scene.meshes[object].index() as usize, instance..instance + 1);
    }

    /// Draws some instances of the mesh in a slot.
    pub fn draw_mesh<'a>(&self, encoder: &mut impl RenderEncoder<'a>, mesh: usize, instances: Range<u32>) {
        self.geometry.draw(encoder, mesh, instances);
    }
}

impl Chunk<'_> {
    fn describe(&mut self, scene: &SceneRef<'_>) {
        for (index, (group, staged)) in self.groups.iter_mut().zip(self.staged.drain(..)).enumerate() {
            let first = (self.first + index) * LANES;
            let mut gpu_objects = [GpuObject::default(); LANES];
            for (lane, object) in (first..scene.object_count()).take(LANES).enumerate() {
                gpu_objects[lane] = GpuObject::new(scene, object);
                group.set(lane, &Sphere::new(scene, object));
            }
            let bytes = bytemuck::bytes_of(&gpu_objects).first_chunk();
            staged.write(*bytes.expect("a group has this many bytes"));
        }
    }
}

fn layout(device: &wgpu::Device, has_instances: bool) -> wgpu::BindGroupLayout {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    };
    let storage = wgpu::BufferBindingType::Storage { read_only: true };
    let entries = [entry(0, wgpu::BufferBindingType::Uniform), entry(1, storage), entry(2, storage), entry(3, storage)];
    let entries = if has_instances { &entries[..] } else { &entries[..3] };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries })
}
