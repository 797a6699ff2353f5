//! The device of the renderer by hand: targets, buffers and pipelines.

use std::error::Error;
use std::mem::offset_of;
use std::ops::Range;

use bytemuck::{Pod, Zeroable};
use drawloom::scene::{Mesh, SceneRef, Vertex};
use drawloom::view::RenderView;
use drawloom::wgpu;
use drawloom::wgpu::util::DeviceExt;
use drawloom_benches::backends::BackendName;

const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// How much larger than an object its tested box is, so that an object does not hide its own box.
const BOX_SCALE: f32 = 1.01;

/// The vertices of a box as a strip.
const BOX_VERTICES: u32 = 14;

pub struct Device {
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipeline: wgpu::RenderPipeline,
    box_pipeline: wgpu::RenderPipeline,
    bind_group: wgpu::BindGroup,
    view: wgpu::Buffer,
    listed: wgpu::Buffer,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    meshes: Vec<MeshPart>,
    /// The part of each object.
    mesh_of: Vec<u32>,
    color: wgpu::TextureView,
    depth: wgpu::TextureView,
}

/// A mesh in the buffers of all.
struct MeshPart {
    base_vertex: i32,
    indices: Range<u32>,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct GpuView {
    clip_from_relative: [f32; 16],
    eye: [f32; 4],
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct GpuObject {
    position: [f32; 4],
    orientation: [f32; 4],
    scale: [f32; 4],
    box_center: [f32; 4],
    box_half: [f32; 4],
}

impl Device {
    /// # Errors
    /// Returns an error if there is no device, or an object without a mesh.
    pub fn new(backend: BackendName, scene: &SceneRef<'_>, size: [u32; 2]) -> Result<Self, Box<dyn Error>> {
        let (device, queue) = backend.device()?;
        let (mut vertices, mut indices, mut objects) = (Vec::new(), Vec::new(), Vec::new());
        let (mut handles, mut meshes, mut mesh_of) = (Vec::new(), Vec::new(), Vec::new());
        for object in 0..scene.object_count() {
            let handle = scene.meshes[object];
            let mesh = scene.assets.get(handle)?;
            let known = handles.iter().position(|&known| known == handle);
            let index = match known {
                Some(known) => known,
                None => {
                    handles.push(handle);
                    meshes.push(append_mesh(mesh, &mut vertices, &mut indices));
                    meshes.len() - 1
                }
            };
            mesh_of.push(index as u32);
            let [low, high] = mesh.corners();
            objects.push(GpuObject {
                position: scene.positions[object].as_vec3().extend(1.0).to_array(),
                orientation: scene.orientations[object].to_array(),
                scale: scene.scales[object].extend(0.0).to_array(),
                box_center: ((low + high) / 2.0).extend(0.0).to_array(),
                box_half: ((high - low) / 2.0 * BOX_SCALE).extend(0.0).to_array(),
            });
        }
        let init = |contents: &[u8], usage| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
        };
        let vertices = init(bytemuck::cast_slice(&vertices), wgpu::BufferUsages::VERTEX);
        let indices = init(bytemuck::cast_slice(&indices), wgpu::BufferUsages::INDEX);
        let objects = init(bytemuck::cast_slice(&objects), wgpu::BufferUsages::STORAGE);
        let buffer = |size: usize, usage| {
            let usage = usage | wgpu::BufferUsages::COPY_DST;
            device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: size as u64,
                usage,
                mapped_at_creation: false,
            })
        };
        let view = buffer(size_of::<GpuView>(), wgpu::BufferUsages::UNIFORM);
        // An object is drawn or tested or both.
        let listed = buffer(mesh_of.len() * 2 * size_of::<u32>(), wgpu::BufferUsages::STORAGE);

        let visibility = wgpu::ShaderStages::VERTEX;
        let storage = wgpu::BufferBindingType::Storage { read_only: true };
        let entry = |(binding, ty)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility,
            ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
            count: None,
        };
        let entries: Vec<_> = (0..).zip([wgpu::BufferBindingType::Uniform, storage, storage]).map(entry).collect();
        let layout =
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries });
        let resources = (0..).zip([&view, &objects, &listed]);
        let entries: Vec<_> = resources
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        let bind_group =
            device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &entries });
        let [color, depth] = [COLOR, DEPTH].map(|format| new_target(&device, size, format));
        Ok(Self {
            pipeline: new_pipeline(&device, &layout, Drawn::Objects),
            box_pipeline: new_pipeline(&device, &layout, Drawn::Boxes),
            bind_group,
            view,
            listed,
            vertices,
            indices,
            meshes,
            mesh_of,
            color,
            depth,
            device,
            queue,
        })
    }

    pub fn wgpu(&self) -> &wgpu::Device {
        &self.device
    }

    pub fn mesh_count(&self) -> usize {
        self.meshes.len()
    }

    /// The index of an object's mesh.
    pub fn mesh_of(&self, object: u32) -> usize {
        self.mesh_of[object as usize] as usize
    }

    pub fn upload(&self, view: &RenderView, listed: &[u32]) {
        let gpu_view = GpuView {
            clip_from_relative: view.clip_from_relative().to_cols_array(),
            eye: view.camera.position.as_vec3().extend(1.0).to_array(),
        };
        self.queue.write_buffer(&self.view, 0, bytemuck::bytes_of(&gpu_view));
        self.queue.write_buffer(&self.listed, 0, bytemuck::cast_slice(listed));
    }

    pub fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    /// Draws this number of objects of each mesh, from the first of the list on.
    pub fn draw(&self, encoder: &mut wgpu::CommandEncoder, counts: impl Iterator<Item = usize>) {
        let load = wgpu::LoadOp::Clear(wgpu::Color::BLACK);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.color,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load, store: wgpu::StoreOp::Store },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.bind_group, &[]);
        pass.set_vertex_buffer(0, Some(self.vertices.slice(..)));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        let mut first = 0;
        for (mesh, count) in self.meshes.iter().zip(counts) {
            let end = first + count as u32;
            pass.draw_indexed(mesh.indices.clone(), mesh.base_vertex, first..end);
            first = end;
        }
    }

    /// Begins a pass that tests boxes against the depths of what was drawn.
    pub fn begin_queries<'a>(
        &self,
        encoder: &'a mut wgpu::CommandEncoder,
        queries: &wgpu::QuerySet,
    ) -> wgpu::RenderPass<'a> {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: None,
                stencil_ops: None,
            }),
            occlusion_query_set: Some(queries),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&self.box_pipeline);
        pass.set_bind_group(0, &self.bind_group, &[]);
        pass
    }

    /// Draws the boxes of a part of the list.
    pub fn draw_boxes(&self, pass: &mut wgpu::RenderPass<'_>, listed: Range<u32>) {
        pass.draw(0..BOX_VERTICES, listed);
    }

    pub fn submit(&self, commands: wgpu::CommandBuffer) {
        self.queue.submit([commands]);
    }

    /// Waits until the device is idle.
    ///
    /// # Errors
    /// Returns an error if the device is lost.
    pub fn wait(&self) -> Result<(), wgpu::PollError> {
        self.device.poll(wgpu::PollType::wait_indefinitely()).map(drop)
    }
}

fn append_mesh(mesh: &Mesh, vertices: &mut Vec<Vertex>, indices: &mut Vec<u32>) -> MeshPart {
    let (base_vertex, first) = (vertices.len() as i32, indices.len() as u32);
    vertices.extend_from_slice(mesh.vertices());
    indices.extend(mesh.triangles().flatten());
    MeshPart { base_vertex, indices: first..indices.len() as u32 }
}

fn new_target(device: &wgpu::Device, [width, height]: [u32; 2], format: wgpu::TextureFormat) -> wgpu::TextureView {
    let texture = device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    });
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// What a pipeline draws.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Drawn {
    Objects,
    /// Both sides of boxes, which change nothing.
    Boxes,
}

fn new_pipeline(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, drawn: Drawn) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(include_str!("plain.wgsl").into()),
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(layout)],
        immediate_size: 0,
    });
    let draws_objects = drawn == Drawn::Objects;
    let attributes = [wgpu::VertexAttribute {
        format: wgpu::VertexFormat::Float32x3,
        offset: offset_of!(Vertex, position) as u64,
        shader_location: 0,
    }];
    let vertices = wgpu::VertexBufferLayout {
        array_stride: size_of::<Vertex>() as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes: &attributes,
    };
    let (buffers, targets) = ([Some(vertices)], [Some(COLOR.into())]);
    let compilation_options = wgpu::PipelineCompilationOptions::default();
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some(if draws_objects { "vertex" } else { "box_vertex" }),
            compilation_options: compilation_options.clone(),
            buffers: if draws_objects { &buffers } else { &[] },
        },
        primitive: if draws_objects {
            wgpu::PrimitiveState { cull_mode: Some(wgpu::Face::Back), ..wgpu::PrimitiveState::default() }
        } else {
            wgpu::PrimitiveState { topology: wgpu::PrimitiveTopology::TriangleStrip, ..wgpu::PrimitiveState::default() }
        },
        depth_stencil: Some(wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(draws_objects),
            depth_compare: Some(if draws_objects {
                wgpu::CompareFunction::Greater
            } else {
                wgpu::CompareFunction::GreaterEqual
            }),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: draws_objects.then_some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options,
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}
