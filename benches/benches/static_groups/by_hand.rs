//! The loop that an engine writes without Drawloom: ready bundles, one for each block and view.

use std::error::Error;
use std::time::{Duration, Instant};

use drawloom::glam::{DVec3, Mat4, Vec3, Vec4};
use drawloom::wgpu;
use drawloom::wgpu::util::RenderEncoder;
use drawloom_testing::adapter;

use crate::world::World;

const SHADER: &str = "
    @group(0) @binding(0) var<uniform> view: mat4x4<f32>;
    @group(0) @binding(1) var<storage, read> objects: array<array<vec4<f32>, 4>>;
    @vertex
    fn vertex(@location(0) position: vec3<f32>, @builtin(instance_index) instance: u32) -> @builtin(position) vec4<f32> {
        return view * vec4<f32>(position + objects[instance][0].xyz, 1.0);
    }
    @fragment
    fn fragment() -> @location(0) vec4<f32> {
        return vec4<f32>(1.0);
    }";

/// As many bytes as Drawloom has for each object.
type Object = [[f32; 4]; 4];

const OBJECT_BYTES: u64 = size_of::<Object>() as u64;
const INDICES_OF_BOX: u32 = 36;

pub struct ByHand {
    world: World,
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipeline: wgpu::RenderPipeline,
    geometry: [wgpu::Buffer; 2],
    objects: wgpu::Buffer,
    views: Vec<View>,
    /// Centre and radius of each block.
    bounds: Vec<(DVec3, f64)>,
    /// Memory for the boxes that move.
    staging: Vec<Object>,
}

struct View {
    uniform: wgpu::Buffer,
    bind_group: wgpu::BindGroup,
    color: wgpu::TextureView,
    depth: wgpu::TextureView,
    bundles: Vec<wgpu::RenderBundle>,
}

impl ByHand {
    pub fn new(world: World) -> Result<Self, Box<dyn Error>> {
        let (device, queue) = adapter::noop_device()?;
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(SHADER.into()),
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: None,
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[Some(wgpu::VertexBufferLayout {
                    array_stride: 12,
                    step_mode: wgpu::VertexStepMode::Vertex,
                    attributes: &wgpu::vertex_attr_array![0 => Float32x3],
                })],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: wgpu::TextureFormat::Depth32Float,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: None,
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(wgpu::TextureFormat::Rgba8Unorm.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        let buffer = |size: u64, usage| {
            let descriptor = wgpu::BufferDescriptor {
                label: None,
                size,
                usage: usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            };
            let buffer = device.create_buffer(&descriptor);
            queue.write_buffer(&buffer, 0, &vec![0; size as usize]);
            buffer
        };
        let count = world.positions().len() as u64;
        let objects = buffer(count * OBJECT_BYTES, wgpu::BufferUsages::STORAGE);
        let meshes = World::MESHES as u64;
        let geometry = [
            buffer(meshes * 24 * 12, wgpu::BufferUsages::VERTEX),
            buffer(meshes * u64::from(INDICES_OF_BOX) * 4, wgpu::BufferUsages::INDEX),
        ];
        let bounds = (0..world.blocks).map(|block| {
            let of_block = &world.positions()[block * world.in_block..(block + 1) * world.in_block];
            let low = of_block.iter().copied().fold(DVec3::INFINITY, DVec3::min);
            let high = of_block.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
            ((low + high) / 2.0, (high - low).length() / 2.0 + 2.0)
        });
        let bounds = bounds.collect();
        let mut by_hand =
            Self { views: Vec::new(), bounds, staging: Vec::new(), world, device, queue, pipeline, geometry, objects };
        for index in 0..by_hand.world.scene.cameras.len() {
            let view = by_hand.new_view(index);
            by_hand.views.push(view);
        }
        Ok(by_hand)
    }

    fn new_view(&self, index: usize) -> View {
        let device = &self.device;
        let [width, height] = self.world.scene.cameras[index].size;
        let texture = |format| {
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
        };
        let uniform = device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: 64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        self.queue.write_buffer(&uniform, 0, &[0; 64]);
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.pipeline.get_bind_group_layout(0),
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: self.objects.as_entire_binding() },
            ],
        });
        let bundles = (0..self.world.blocks).map(|block| {
            let mut encoder = device.create_render_bundle_encoder(&wgpu::RenderBundleEncoderDescriptor {
                label: None,
                color_formats: &[Some(wgpu::TextureFormat::Rgba8Unorm)],
                depth_stencil: Some(wgpu::RenderBundleDepthStencil {
                    format: wgpu::TextureFormat::Depth32Float,
                    depth_read_only: false,
                    stencil_read_only: true,
                }),
                sample_count: 1,
                multiview: None,
            });
            let first = (block * self.world.in_block) as u32;
            self.draw(&mut encoder, &bind_group, first, self.world.in_block as u32);
            encoder.finish(&wgpu::RenderBundleDescriptor::default())
        });
        let bundles = bundles.collect();
        let [color, depth] = [wgpu::TextureFormat::Rgba8Unorm, wgpu::TextureFormat::Depth32Float].map(texture);
        View { uniform, bind_group, color, depth, bundles }
    }

    /// Draws boxes that are ordered by mesh, as an engine would store them.
    fn draw<'a>(
        &'a self,
        encoder: &mut impl RenderEncoder<'a>,
        bind_group: &'a wgpu::BindGroup,
        first: u32,
        count: u32,
    ) {
        encoder.set_pipeline(&self.pipeline);
        encoder.set_bind_group(0, Some(bind_group), &[]);
        encoder.set_vertex_buffer(0, Some(self.geometry[0].slice(..)));
        encoder.set_index_buffer(self.geometry[1].slice(..), wgpu::IndexFormat::Uint32);
        let meshes = World::MESHES as u32;
        for mesh in 0..meshes {
            let [start, end] = [mesh, mesh + 1].map(|mesh| first + count * mesh / meshes);
            let first_index = mesh * INDICES_OF_BOX;
            encoder.draw_indexed(first_index..first_index + INDICES_OF_BOX, mesh as i32 * 24, start..end);
        }
    }

    /// One frame.
    pub fn frame(&mut self) -> Result<Duration, Box<dyn Error>> {
        self.world.step();
        let start = Instant::now();
        self.staging.clear();
        let moving = self.world.moving_positions().iter();
        self.staging.extend(moving.map(|position| {
            let [x, y, z] = position.as_vec3().to_array();
            [[x, y, z, 1.0], [0.0, 0.0, 0.0, 1.0], [1.0; 4], [0.0; 4]]
        }));
        let first_moving = (self.world.blocks * self.world.in_block) as u64;
        self.queue.write_buffer(&self.objects, first_moving * OBJECT_BYTES, bytemuck::cast_slice(&self.staging));
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        for (view, camera) in self.views.iter().zip(&self.world.scene.cameras) {
            // A field of view of 90°, depth reversed, and no far plane.
            let clip_from_camera = Mat4::from_cols(Vec4::X, Vec4::Y, Vec4::NEG_W, Vec4::Z * camera.near);
            let world_from_camera = Mat4::from_rotation_translation(camera.orientation, camera.position.as_vec3());
            let clip_from_world = clip_from_camera * world_from_camera.inverse();
            self.queue.write_buffer(&view.uniform, 0, bytemuck::cast_slice(&clip_from_world.to_cols_array()));
            let (right, up, forward) =
                (camera.orientation * Vec3::X, camera.orientation * Vec3::Y, camera.orientation * Vec3::NEG_Z);
            let is_visible = |(center, radius): &(DVec3, f64)| {
                let relative = (*center - camera.position).as_vec3();
                let (ahead, reach) = (relative.dot(forward), *radius as f32 * std::f32::consts::SQRT_2);
                relative.dot(right).abs() <= ahead + reach && relative.dot(up).abs() <= ahead + reach
            };
            let visible = self.bounds.iter().zip(&view.bundles).filter(|(bounds, _)| is_visible(bounds));
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &view.color,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                        store: wgpu::StoreOp::Store,
                    },
                })],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &view.depth,
                    depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
                    stencil_ops: None,
                }),
                ..wgpu::RenderPassDescriptor::default()
            });
            pass.execute_bundles(visible.map(|(_, bundle)| bundle));
            self.draw(&mut pass, &view.bind_group, first_moving as u32, World::MOVING as u32);
        }
        self.queue.submit([encoder.finish()]);
        Ok(start.elapsed())
    }
}
