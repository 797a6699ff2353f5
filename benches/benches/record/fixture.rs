//! A device and the targets of each camera, which all hand-written techniques share.

use drawloom::backend::WgpuBackend;
use drawloom::scene::{Camera, SceneRef, Vertex};
use drawloom::wgpu;

use crate::pictures;
use crate::technique::Failure;

pub const COLOR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// A device, and the targets of each camera.
pub struct Fixture {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pictures: Vec<Picture>,
}

struct Picture {
    texture: wgpu::Texture,
    color: wgpu::TextureView,
    depth: wgpu::TextureView,
}

impl Fixture {
    /// Creates targets on the backend's device for the scene's cameras.
    pub fn new(backend: &WgpuBackend, scene: &SceneRef<'_>) -> Result<Self, Failure> {
        let device = backend.device().clone();
        let picture = |camera: &Camera| {
            let [width, height] = camera.size;
            let texture = |format, usage| {
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
            };
            let color = texture(COLOR, wgpu::TextureUsages::COPY_SRC);
            let depth = texture(DEPTH, wgpu::TextureUsages::empty());
            let view = |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
            Picture { color: view(&color), depth: view(&depth), texture: color }
        };
        let pictures = scene.cameras.iter().map(picture).collect();
        Ok(Self { queue: backend.queue().clone(), pictures, device })
    }

    /// A pipeline for the scene's vertex format, and for a buffer of instances, if there is one.
    pub fn pipeline(
        &self,
        layouts: &[&wgpu::BindGroupLayout],
        instances: Option<wgpu::VertexBufferLayout<'_>>,
        shader: &str,
    ) -> wgpu::RenderPipeline {
        let module = self.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(shader.into()),
        });
        let layouts: Vec<_> = layouts.iter().copied().map(Some).collect();
        let layout = self.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &layouts,
            immediate_size: 0,
        });
        let attributes = wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3];
        let vertices = wgpu::VertexBufferLayout {
            array_stride: size_of::<Vertex>() as u64,
            step_mode: wgpu::VertexStepMode::Vertex,
            attributes: &attributes,
        };
        self.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[Some(vertices), instances],
            },
            primitive: wgpu::PrimitiveState { cull_mode: Some(wgpu::Face::Back), ..wgpu::PrimitiveState::default() },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(COLOR.into())],
            }),
            multiview_mask: None,
            cache: None,
        })
    }

    /// An encoder of bundles for [`pass`](Self::pass).
    pub fn bundle_encoder(&self) -> wgpu::RenderBundleEncoder<'_> {
        self.device.create_render_bundle_encoder(&wgpu::RenderBundleEncoderDescriptor {
            label: None,
            color_formats: &[Some(COLOR)],
            depth_stencil: Some(wgpu::RenderBundleDepthStencil {
                format: DEPTH,
                depth_read_only: false,
                stencil_read_only: true,
            }),
            sample_count: 1,
            multiview: None,
        })
    }

    /// Begins a camera's pass, which clears its targets.
    pub fn pass<'a>(&self, encoder: &'a mut wgpu::CommandEncoder, camera: usize) -> wgpu::RenderPass<'a> {
        let picture = &self.pictures[camera];
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &picture.color,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &picture.depth,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
                stencil_ops: None,
            }),
            ..wgpu::RenderPassDescriptor::default()
        })
    }

    pub fn encoder(&self) -> wgpu::CommandEncoder {
        self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default())
    }

    /// The layout of a bind group with one uniform.
    pub fn uniform_layout(&self, has_dynamic_offset: bool, visibility: wgpu::ShaderStages) -> wgpu::BindGroupLayout {
        let ty = wgpu::BindingType::Buffer {
            ty: wgpu::BufferBindingType::Uniform,
            has_dynamic_offset,
            min_binding_size: None,
        };
        let entries = &[wgpu::BindGroupLayoutEntry { binding: 0, visibility, ty, count: None }];
        self.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries })
    }

    /// Waits until the device is idle.
    pub fn wait(&self) -> Result<(), Failure> {
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        Ok(())
    }

    /// Reads a camera's picture.
    pub fn read(&self, camera: usize) -> Result<Vec<u8>, Failure> {
        pictures::read(&self.device, &self.queue, &self.pictures[camera].texture)
    }
}
