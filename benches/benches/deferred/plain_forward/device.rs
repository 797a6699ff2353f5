//! A device with the targets, the buffers and the pipelines of a forward renderer.

use std::error::Error;
use std::sync::mpsc;

use bytemuck::{Pod, Zeroable};
use drawloom::backend::WgpuBackend;
use drawloom::glam::Vec3;
use drawloom::process::{SHADER_PRELUDE, SURFACE_SHADER};
use drawloom::scene::{Material, Mesh, SceneRef, Vertex};
use drawloom::view::GpuView;
use drawloom::view::internal::{GpuLight, GpuObject};
use drawloom::wgpu;
use drawloom::wgpu::util::DeviceExt;

use super::visible_scene::VisibleScene;

const RADIANCE: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
const PICTURE: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;

pub struct Device {
    device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub size: [u32; 2],
    pub index_count: u32,
    surface_shader: String,
    radiance: wgpu::TextureView,
    depth: wgpu::TextureView,
    picture: wgpu::Texture,
    picture_view: wgpu::TextureView,
    view: wgpu::Buffer,
    objects: wgpu::Buffer,
    drawn: wgpu::Buffer,
    lights: wgpu::Buffer,
    vertices: wgpu::Buffer,
    indices: wgpu::Buffer,
    scene_layout: wgpu::BindGroupLayout,
    scene_group: wgpu::BindGroup,
    material_layout: wgpu::BindGroupLayout,
    material_group: wgpu::BindGroup,
    tone_mapping: wgpu::RenderPipeline,
    tone_group: wgpu::BindGroup,
}

/// A pipeline that draws objects into the radiance.
pub struct SurfacePipeline<'a> {
    /// With the entry point `fragment`.
    pub shader: &'a str,
    /// The technique's own bindings.
    pub layout: Option<&'a wgpu::BindGroupLayout>,
    /// Whether it adds to what was drawn at exactly the same depth, with the entry point `lit_vertex` instead of
    /// `vertex`.
    pub adds: bool,
}

/// `Material` in the prelude.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct GpuMaterial {
    diffuse: Vec3,
    opacity: f32,
    emission: Vec3,
    alpha_cutoff: f32,
    double_sided: u32,
    blend: u32,
    textures: [u32; Material::MAX_TEXTURES],
}

const NO_TEXTURE: u32 = u32::MAX;

impl Device {
    /// # Errors
    /// Returns an error if the scene has other than one mesh, or no camera.
    pub fn new(backend: &WgpuBackend, scene: &SceneRef<'_>) -> Result<Self, Box<dyn Error>> {
        let (device, queue) = (backend.device().clone(), backend.queue().clone());
        let size = scene.cameras.first().ok_or("there is no camera")?.size;
        let mut meshes = scene.assets.iter::<Mesh>();
        let (Some((_, mesh)), None) = (meshes.next(), meshes.next()) else {
            return Err("the plain renderer draws scenes of one mesh".into());
        };
        let initialized = |usage, contents: &[u8]| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents, usage })
        };
        let materials: Vec<_> = scene.assets.iter::<Material>().map(|(_, material)| gpu_material(material)).collect();
        let materials = initialized(wgpu::BufferUsages::STORAGE, bytemuck::cast_slice(&materials));
        let buffer = |usage, size: usize| new_buffer(&device, usage, size);
        let view = buffer(wgpu::BufferUsages::UNIFORM, size_of::<GpuView>());
        let objects = buffer(wgpu::BufferUsages::STORAGE, scene.object_count() * size_of::<GpuObject>());
        let drawn = buffer(wgpu::BufferUsages::STORAGE, scene.object_count() * size_of::<u32>());
        let lights = buffer(wgpu::BufferUsages::STORAGE, scene.lights.len().max(1) * size_of::<GpuLight>());

        let storage = wgpu::BufferBindingType::Storage { read_only: true };
        let scene_layout = buffer_layout(&device, &[wgpu::BufferBindingType::Uniform, storage, storage, storage]);
        let scene_group = buffer_group(&device, &scene_layout, &[&view, &objects, &drawn, &lights]);
        let (material_layout, material_group) = material_group(&device, &materials);

        let sampled = wgpu::TextureUsages::TEXTURE_BINDING;
        let radiance = view_of(&new_target(&device, size, RADIANCE, sampled));
        let depth = view_of(&new_target(&device, size, DEPTH, wgpu::TextureUsages::empty()));
        let picture = new_target(&device, size, PICTURE, wgpu::TextureUsages::COPY_SRC);
        let parameters = initialized(wgpu::BufferUsages::UNIFORM, bytemuck::bytes_of(&[1.0_f32, 0.0, 0.0, 0.0]));
        let (tone_mapping, tone_group) = tone_mapping(&device, &parameters, &radiance);
        Ok(Self {
            size,
            index_count: mesh.indices().len() as u32,
            surface_shader: [ABSOLUTE_TRANSFORMS, &SHADER_PRELUDE, SURFACE_SHADER].concat(),
            radiance,
            depth,
            picture_view: view_of(&picture),
            picture,
            vertices: initialized(wgpu::BufferUsages::VERTEX, bytemuck::cast_slice(mesh.vertices())),
            indices: initialized(wgpu::BufferUsages::INDEX, bytemuck::cast_slice(mesh.indices())),
            view,
            objects,
            drawn,
            lights,
            scene_layout,
            scene_group,
            material_layout,
            material_group,
            tone_mapping,
            tone_group,
            queue,
            device,
        })
    }

    /// What shaders of objects begin with.
    pub fn surface_shader(&self) -> &str {
        &self.surface_shader
    }

    pub fn buffer(&self, usage: wgpu::BufferUsages, size: usize) -> wgpu::Buffer {
        new_buffer(&self.device, usage, size)
    }

    pub fn layout(&self, buffers: &[wgpu::BufferBindingType]) -> wgpu::BindGroupLayout {
        buffer_layout(&self.device, buffers)
    }

    pub fn group(&self, layout: &wgpu::BindGroupLayout, buffers: &[&wgpu::Buffer]) -> wgpu::BindGroup {
        buffer_group(&self.device, layout, buffers)
    }

    pub fn surface_pipeline(&self, pipeline: &SurfacePipeline<'_>) -> wgpu::RenderPipeline {
        let &SurfacePipeline { shader, layout, adds } = pipeline;
        let groups = [Some(&self.scene_layout), Some(&self.material_layout), layout];
        let groups = if layout.is_some() { &groups[..] } else { &groups[..2] };
        let component = wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: wgpu::BlendFactor::One,
            ..Default::default()
        };
        let blend = adds.then_some(wgpu::BlendState { color: component, alpha: component });
        let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x2];
        let vertices = wgpu::VertexBufferLayout {
            array_stride: size_of::<Vertex>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &attributes,
        };
        let depth = wgpu::DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(!adds),
            depth_compare: Some(if adds { wgpu::CompareFunction::Equal } else { wgpu::CompareFunction::Greater }),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        };
        new_pipeline(
            &self.device,
            shader,
            groups,
            if adds { "lit_vertex" } else { "vertex" },
            &[Some(vertices)],
            Some(depth),
            wgpu::ColorTargetState { blend, ..RADIANCE.into() },
        )
    }

    pub fn upload(&self, scene: &VisibleScene) {
        self.queue.write_buffer(&self.view, 0, bytemuck::cast_slice(scene.view.as_slice()));
        self.queue.write_buffer(&self.objects, 0, bytemuck::cast_slice(&scene.objects));
        self.queue.write_buffer(&self.drawn, 0, bytemuck::cast_slice(&scene.drawn));
        self.queue.write_buffer(&self.lights, 0, bytemuck::cast_slice(&scene.lights));
    }

    pub fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    /// Begins the pass over the radiance, with everything set that all techniques share.
    pub fn begin_radiance<'a>(&self, encoder: &'a mut wgpu::CommandEncoder, background: Vec3) -> wgpu::RenderPass<'a> {
        let [r, g, b] = background.to_array().map(f64::from);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(color_attachment(&self.radiance, wgpu::Color { r, g, b, a: 1.0 }))],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Discard }),
                stencil_ops: None,
            }),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_bind_group(0, &self.scene_group, &[]);
        pass.set_bind_group(1, &self.material_group, &[]);
        pass.set_vertex_buffer(0, self.vertices.slice(..));
        pass.set_index_buffer(self.indices.slice(..), wgpu::IndexFormat::Uint32);
        pass
    }

    pub fn tone_map(&self, encoder: &mut wgpu::CommandEncoder) {
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(color_attachment(&self.picture_view, wgpu::Color::BLACK))],
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&self.tone_mapping);
        pass.set_bind_group(2, &self.tone_group, &[]);
        pass.draw(0..3, 0..1);
    }

    /// Waits until the device is idle.
    ///
    /// # Errors
    /// Returns an error if the device is lost.
    pub fn wait(&self) -> Result<(), wgpu::PollError> {
        self.device.poll(wgpu::PollType::wait_indefinitely()).map(drop)
    }

    /// Reads the picture.
    ///
    /// # Errors
    /// Returns an error if it cannot be read.
    pub fn read(&self) -> Result<Vec<u8>, Box<dyn Error>> {
        let row = self.size[0] * 4;
        if !row.is_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT) {
            return Err(format!("a picture {} pixels wide needs padding", self.size[0]).into());
        }
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(row * self.size[1]),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let mut encoder = self.encoder();
        let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(row), rows_per_image: None };
        let target = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
        encoder.copy_texture_to_buffer(self.picture.as_image_copy(), target, self.picture.size());
        self.queue.submit([encoder.finish()]);
        let (sender, receiver) = mpsc::channel();
        buffer.slice(..).map_async(wgpu::MapMode::Read, move |result| {
            // The receiver waits below.
            let _ = sender.send(result);
        });
        self.wait()?;
        receiver.recv()??;
        Ok(buffer.get_mapped_range(..)?.to_vec())
    }
}

/// The prelude needs it.
const ABSOLUTE_TRANSFORMS: &str = "const ABSOLUTE_TRANSFORMS: bool = false;\n";

fn gpu_material(material: &Material) -> GpuMaterial {
    GpuMaterial {
        diffuse: material.diffuse,
        opacity: material.opacity,
        emission: material.emission,
        alpha_cutoff: 0.0,
        double_sided: u32::from(material.double_sided),
        blend: material.blend as u32,
        textures: [NO_TEXTURE; Material::MAX_TEXTURES],
    }
}

fn new_buffer(device: &wgpu::Device, usage: wgpu::BufferUsages, size: usize) -> wgpu::Buffer {
    let usage = usage | wgpu::BufferUsages::COPY_DST;
    // Initialized before it is in a bind group: otherwise that would be part of every frame.
    device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents: &vec![0; size], usage })
}

fn new_target(
    device: &wgpu::Device,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: usage | wgpu::TextureUsages::RENDER_ATTACHMENT,
        view_formats: &[],
    })
}

fn view_of(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

fn color_attachment(view: &wgpu::TextureView, clear: wgpu::Color) -> wgpu::RenderPassColorAttachment<'_> {
    wgpu::RenderPassColorAttachment {
        view,
        depth_slice: None,
        resolve_target: None,
        ops: wgpu::Operations { load: wgpu::LoadOp::Clear(clear), store: wgpu::StoreOp::Store },
    }
}

fn layout(device: &wgpu::Device, bindings: impl Iterator<Item = wgpu::BindingType>) -> wgpu::BindGroupLayout {
    let visibility = wgpu::ShaderStages::VERTEX_FRAGMENT;
    let entry = |(binding, ty)| wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None };
    let entries: Vec<_> = (0..).zip(bindings).map(entry).collect();
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
}

fn group(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    resources: Vec<wgpu::BindingResource<'_>>,
) -> wgpu::BindGroup {
    let entry = |(binding, resource)| wgpu::BindGroupEntry { binding, resource };
    let entries: Vec<_> = (0..).zip(resources).map(entry).collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

fn buffer_binding(ty: wgpu::BufferBindingType) -> wgpu::BindingType {
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

fn texture_binding(view_dimension: wgpu::TextureViewDimension, filterable: bool) -> wgpu::BindingType {
    let sample_type = wgpu::TextureSampleType::Float { filterable };
    wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false }
}

fn buffer_layout(device: &wgpu::Device, buffers: &[wgpu::BufferBindingType]) -> wgpu::BindGroupLayout {
    layout(device, buffers.iter().copied().map(buffer_binding))
}

fn buffer_group(device: &wgpu::Device, layout: &wgpu::BindGroupLayout, buffers: &[&wgpu::Buffer]) -> wgpu::BindGroup {
    group(device, layout, buffers.iter().map(|buffer| buffer.as_entire_binding()).collect())
}

/// The materials, and textures that none of them has: the shaders are those of the other pipelines, which may have
/// textures.
fn material_group(device: &wgpu::Device, materials: &wgpu::Buffer) -> (wgpu::BindGroupLayout, wgpu::BindGroup) {
    let storage = buffer_binding(wgpu::BufferBindingType::Storage { read_only: true });
    let array = texture_binding(wgpu::TextureViewDimension::D2Array, true);
    let sampler = wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering);
    let bindings = [[array; Material::MAX_TEXTURES], [sampler; Material::MAX_TEXTURES]];
    let layout = layout(device, [storage].into_iter().chain(bindings.into_iter().flatten()));
    let texture = new_target(device, [1, 1], wgpu::TextureFormat::Rgba8UnormSrgb, wgpu::TextureUsages::TEXTURE_BINDING);
    let dimension = Some(wgpu::TextureViewDimension::D2Array);
    let view = texture.create_view(&wgpu::TextureViewDescriptor { dimension, ..Default::default() });
    let sampler = device.create_sampler(&wgpu::SamplerDescriptor::default());
    let mut resources = vec![materials.as_entire_binding()];
    resources.extend([(); Material::MAX_TEXTURES].map(|()| wgpu::BindingResource::TextureView(&view)));
    resources.extend([(); Material::MAX_TEXTURES].map(|()| wgpu::BindingResource::Sampler(&sampler)));
    let group = group(device, &layout, resources);
    (layout, group)
}

fn tone_mapping(
    device: &wgpu::Device,
    parameters: &wgpu::Buffer,
    radiance: &wgpu::TextureView,
) -> (wgpu::RenderPipeline, wgpu::BindGroup) {
    let uniform = buffer_binding(wgpu::BufferBindingType::Uniform);
    let layout = layout(device, [uniform, texture_binding(wgpu::TextureViewDimension::D2, false)].into_iter());
    let resources = vec![parameters.as_entire_binding(), wgpu::BindingResource::TextureView(radiance)];
    let group = group(device, &layout, resources);
    let own = include_str!("../../../../src/process/post/tone_mapping/tone_mapping.wgsl");
    let shader = [ABSOLUTE_TRANSFORMS, &SHADER_PRELUDE, own].concat();
    let pipeline =
        new_pipeline(device, &shader, &[None, None, Some(&layout)], "full_screen", &[], None, PICTURE.into());
    (pipeline, group)
}

fn new_pipeline(
    device: &wgpu::Device,
    shader: &str,
    groups: &[Option<&wgpu::BindGroupLayout>],
    vertex: &str,
    vertices: &[Option<wgpu::VertexBufferLayout<'_>>],
    depth_stencil: Option<wgpu::DepthStencilState>,
    target: wgpu::ColorTargetState,
) -> wgpu::RenderPipeline {
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(shader.into()),
    });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: groups,
        immediate_size: 0,
    });
    let cull_mode = depth_stencil.is_some().then_some(wgpu::Face::Back);
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: None,
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some(vertex),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: vertices,
        },
        primitive: wgpu::PrimitiveState { cull_mode, ..wgpu::PrimitiveState::default() },
        depth_stencil,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(target)],
        }),
        multiview_mask: None,
        cache: None,
    })
}
