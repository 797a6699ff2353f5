//! Vertex positions as a device computes them, with the WGSL of frames.

use std::error::Error;

use drawloom::bytemuck;
use drawloom::glam::Vec4;
use drawloom::process::SHADER_PRELUDE;
use drawloom::view::GpuView;
use drawloom::view::internal::GpuObject;
use drawloom::wgpu;
use drawloom::wgpu::util::{BufferInitDescriptor, DeviceExt};

use super::vertex::{ShaderInput, VertexShader};

/// A compute stage behind the text that every shader of a frame begins with. Each dispatch computes one vertex, with
/// the functions that the vertex shader of [`SURFACE_SHADER`](drawloom::process::SURFACE_SHADER) calls.
pub struct ShaderOnDevice {
    device: wgpu::Device,
    queue: wgpu::Queue,
    pipeline: wgpu::ComputePipeline,
    /// Those of `@group(0)`, `@group(1)` and `@group(2)`.
    layouts: [wgpu::BindGroupLayout; 3],
}

const COMPUTE_STAGE: &str = "
    struct Corner {
        position: vec3<f32>,
        index: u32,
    }

    @group(2) @binding(0) var<uniform> corner: Corner;
    @group(2) @binding(1) var<storage, read_write> clip_positions: array<vec4<f32>>;

    @compute @workgroup_size(1)
    fn place_corner() {
        let object = drawn_object(corner.index);
        clip_positions[corner.index] = clip_position(relative_position(object, corner.position));
    }
";

/// `Corner` in WGSL.
#[repr(C)]
#[derive(Clone, Copy)]
struct Corner {
    position: [f32; 3],
    index: u32,
}

impl ShaderOnDevice {
    /// Compiles it for a device.
    pub fn new(device: wgpu::Device, queue: wgpu::Queue) -> Self {
        use wgpu::{BufferBindingType, ShaderStages};
        let source = ["const ABSOLUTE_TRANSFORMS: bool = false;\n", &SHADER_PRELUDE, COMPUTE_STAGE].concat();
        let source = wgpu::ShaderSource::Wgsl(source.into());
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor { label: Some("precision"), source });
        let uniform = (BufferBindingType::Uniform, true);
        let storage = |read_only| (BufferBindingType::Storage { read_only }, false);
        let groups = [vec![uniform, storage(true), storage(true)], vec![], vec![uniform, storage(false)]];
        let layouts = groups.map(|bindings| {
            let entry = |(binding, (ty, has_dynamic_offset))| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: ShaderStages::COMPUTE,
                ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset, min_binding_size: None },
                count: None,
            };
            let entries: Vec<_> = (0..).zip(bindings).map(entry).collect();
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
        });
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &layouts.each_ref().map(Some),
            immediate_size: 0,
        });
        let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
            label: Some("precision"),
            layout: Some(&layout),
            module: &module,
            entry_point: Some("place_corner"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            cache: None,
        });
        Self { device, queue, pipeline, layouts }
    }

    fn buffer(&self, usage: wgpu::BufferUsages, contents: &[u8]) -> wgpu::Buffer {
        self.device.create_buffer_init(&BufferInitDescriptor { label: None, contents, usage })
    }
}

impl VertexShader for ShaderOnDevice {
    fn clip_positions(&mut self, inputs: &[ShaderInput<'_>]) -> Result<Vec<Vec4>, Box<dyn Error>> {
        use wgpu::BufferUsages;
        if inputs.is_empty() {
            return Ok(Vec::new());
        }
        let alignment = self.device.limits().min_uniform_buffer_offset_alignment as usize;
        let stride = size_of::<GpuView>().next_multiple_of(alignment);
        let (mut views, mut corners) = (Vec::new(), Vec::new());
        for (index, ShaderInput { case, view, .. }) in inputs.iter().enumerate() {
            let corner = Corner { position: case.vertex.to_array(), index: index as u32 };
            views.extend_from_slice(bytemuck::bytes_of(view));
            corners.extend(corner.position.map(f32::to_bits).map(u32::to_le_bytes).as_flattened());
            corners.extend(corner.index.to_le_bytes());
            views.resize((index + 1) * stride, 0);
            corners.resize((index + 1) * stride, 0);
        }
        let objects: Vec<GpuObject> = inputs.iter().map(|input| input.object).collect();
        let drawn: Vec<u32> = (0..inputs.len() as u32).collect();
        let [views, corners] = [views, corners].map(|bytes| self.buffer(BufferUsages::UNIFORM, &bytes));
        let objects = self.buffer(BufferUsages::STORAGE, bytemuck::cast_slice(&objects));
        let drawn = self.buffer(BufferUsages::STORAGE, bytemuck::cast_slice(&drawn));
        let bytes = vec![0xff; inputs.len() * size_of::<Vec4>()];
        let positions = self.buffer(BufferUsages::STORAGE | BufferUsages::COPY_SRC, &bytes);
        let read_back = self.buffer(BufferUsages::MAP_READ | BufferUsages::COPY_DST, &bytes);

        let group = |layout: &wgpu::BindGroupLayout, resources: &[wgpu::BindingResource<'_>]| {
            let entries = (0..).zip(resources.iter().cloned());
            let entries: Vec<_> =
                entries.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
            self.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
        };
        let slice = |buffer, size: usize| {
            let size = wgpu::BufferSize::new(size as u64);
            wgpu::BindingResource::Buffer(wgpu::BufferBinding { buffer, offset: 0, size })
        };
        let [of_frame, of_assets, own] = &self.layouts;
        let frame = [slice(&views, size_of::<GpuView>()), objects.as_entire_binding(), drawn.as_entire_binding()];
        let own_resources = [slice(&corners, size_of::<Corner>()), positions.as_entire_binding()];
        let groups = [group(of_frame, &frame), group(of_assets, &[]), group(own, &own_resources)];

        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(1, &groups[1], &[]);
        for index in 0..inputs.len() {
            let offset = [(index * stride) as u32];
            pass.set_bind_group(0, &groups[0], &offset);
            pass.set_bind_group(2, &groups[2], &offset);
            pass.dispatch_workgroups(1, 1, 1);
        }
        drop(pass);
        encoder.copy_buffer_to_buffer(&positions, 0, &read_back, 0, bytes.len() as u64);
        self.queue.submit([encoder.finish()]);
        read_back.map_async(wgpu::MapMode::Read, .., |_| {});
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        let mapped = read_back.get_mapped_range(..)?;
        let numbers = mapped.as_chunks().0.iter().map(|&number| f32::from_le_bytes(number)).collect::<Vec<_>>();
        Ok(numbers.as_chunks().0.iter().map(|&position| Vec4::from_array(position)).collect())
    }
}
