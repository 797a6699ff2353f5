//! What the engine has on the device: meshes, materials, pipelines, and the targets of its views.

use bytemuck::{Pod, Zeroable};
use glam::{Mat4, Vec4};
use wgpu::util::DeviceExt;

use super::engine::{SHADOW, SIZES, Shading};
use super::world::{self, Vertex};

const COLOR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

pub struct Mesh {
    pub vertices: wgpu::Buffer,
    pub indices: wgpu::Buffer,
    pub index_count: u32,
}

pub struct Material {
    pub shading: Shading,
    /// Three textures and a sampler.
    pub group: wgpu::BindGroup,
}

/// A camera's matrix, uniforms and targets.
pub struct View {
    pub clip_from_world: Mat4,
    uniforms: wgpu::Buffer,
    /// The uniforms, and all instances.
    pub group: wgpu::BindGroup,
    /// `None` in the shadow map's view.
    pub color: Option<Target>,
    pub depth: Target,
}

pub struct Target {
    pub texture: wgpu::Texture,
    pub view: wgpu::TextureView,
}

/// What the shaders read of a view.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
pub struct ViewData {
    pub clip_from_world: Mat4,
    pub shadow_from_world: Mat4,
    pub eye: Vec4,
    pub towards_sun: Vec4,
    pub plane: Vec4,
    pub size: Vec4,
}

impl View {
    pub fn new(device: &wgpu::Device, layouts: &Layouts, view: usize, instances: &wgpu::Buffer) -> Self {
        let uniforms = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("view"),
            size: size_of::<ViewData>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let size = SIZES[view];
        Self {
            clip_from_world: Mat4::IDENTITY,
            group: bind_group(device, &layouts.view, &[uniforms.as_entire_binding(), instances.as_entire_binding()]),
            uniforms,
            color: (view != SHADOW).then(|| Target::new(device, size, COLOR_FORMAT, wgpu::TextureUsages::COPY_SRC)),
            depth: Target::new(device, size, DEPTH_FORMAT, wgpu::TextureUsages::empty()),
        }
    }

    pub fn write(&mut self, queue: &wgpu::Queue, data: ViewData) {
        self.clip_from_world = data.clip_from_world;
        queue.write_buffer(&self.uniforms, 0, bytemuck::bytes_of(&data));
    }
}

impl Target {
    /// Passes draw into it, and shaders sample it.
    fn new(
        device: &wgpu::Device,
        [width, height]: [u32; 2],
        format: wgpu::TextureFormat,
        usage: wgpu::TextureUsages,
    ) -> Self {
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label: Some("target"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format,
            usage: usage | wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        Self { view: texture_view(&texture), texture }
    }
}

pub struct Layouts {
    view: wgpu::BindGroupLayout,
    material: wgpu::BindGroupLayout,
    light: wgpu::BindGroupLayout,
}

impl Layouts {
    pub fn new(device: &wgpu::Device) -> Self {
        let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
        let texture = |sample_type| wgpu::BindingType::Texture {
            sample_type,
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        };
        let layout = |types: &[wgpu::BindingType]| {
            let entry = |(binding, &ty)| wgpu::BindGroupLayoutEntry {
                binding,
                visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                ty,
                count: None,
            };
            let entries: Vec<_> = (0..).zip(types).map(entry).collect();
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries })
        };
        let color = texture(wgpu::TextureSampleType::Float { filterable: true });
        let sampler = wgpu::BindingType::Sampler;
        let objects = wgpu::BufferBindingType::Storage { read_only: true };
        Self {
            view: layout(&[buffer(wgpu::BufferBindingType::Uniform), buffer(objects)]),
            material: layout(&[color, color, color, sampler(wgpu::SamplerBindingType::Filtering)]),
            light: layout(&[texture(wgpu::TextureSampleType::Depth), sampler(wgpu::SamplerBindingType::Comparison)]),
        }
    }
}

pub fn create_pipelines(
    device: &wgpu::Device,
    layouts: &Layouts,
) -> ([wgpu::RenderPipeline; 2], [wgpu::RenderPipeline; 3]) {
    let module = device.create_shader_module(wgpu::include_wgsl!("engine.wgsl"));
    let pipeline = |fragment: Option<&str>, draws_color: bool, culls: bool| {
        let groups = [Some(&layouts.view), Some(&layouts.material), Some(&layouts.light)];
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: if draws_color { &groups } else { &groups[..2] },
            immediate_size: 0,
        });
        let targets = [Some(wgpu::ColorTargetState::from(COLOR_FORMAT))];
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: fragment,
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[Some(wgpu::VertexBufferLayout {
                    array_stride: size_of::<Vertex>() as u64,
                    step_mode: wgpu::VertexStepMode::Vertex,
                    attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32x3, 2 => Float32x2],
                })],
            },
            primitive: wgpu::PrimitiveState {
                cull_mode: culls.then_some(wgpu::Face::Back),
                ..wgpu::PrimitiveState::default()
            },
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH_FORMAT,
                depth_write_enabled: Some(true),
                depth_compare: Some(wgpu::CompareFunction::Greater),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: fragment.map(|entry_point| wgpu::FragmentState {
                module: &module,
                entry_point: Some(entry_point),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: if draws_color { &targets } else { &[] },
            }),
            multiview_mask: None,
            cache: None,
        })
    };
    let shadow = [pipeline(None, false, true), pipeline(Some("leaf_shadow"), false, false)];
    let surfaces = [("surface", true), ("leaf", false), ("mirror", true)];
    (shadow, surfaces.map(|(fragment, culls)| pipeline(Some(fragment), true, culls)))
}

/// The shadow map and its sampler.
pub fn light_group(device: &wgpu::Device, layouts: &Layouts, shadow: &View) -> wgpu::BindGroup {
    let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
        compare: Some(wgpu::CompareFunction::GreaterEqual),
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..wgpu::SamplerDescriptor::default()
    });
    let shadow_map = wgpu::BindingResource::TextureView(&shadow.depth.view);
    bind_group(device, &layouts.light, &[shadow_map, wgpu::BindingResource::Sampler(&sampler)])
}

/// The materials of the world, and the mirror last. Its first texture is the picture of the mirrored view.
pub fn create_materials(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    layouts: &Layouts,
    mirrored: &View,
) -> Vec<Material> {
    let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
        address_mode_u: wgpu::AddressMode::Repeat,
        address_mode_v: wgpu::AddressMode::Repeat,
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..wgpu::SamplerDescriptor::default()
    });
    let material = |index: usize| {
        let shading = world::shading(index);
        let mut views = [world::color_texel, world::detail_texel, world::gloss_texel]
            .map(|texel| texture_view(&create_texture(device, queue, |x, y| texel(index, x, y))));
        if let (Shading::Mirror, Some(picture)) = (shading, &mirrored.color) {
            views[0] = picture.view.clone();
        }
        let [color, detail, gloss] = views.each_ref().map(wgpu::BindingResource::TextureView);
        let resources = [color, detail, gloss, wgpu::BindingResource::Sampler(&sampler)];
        Material { shading, group: bind_group(device, &layouts.material, &resources) }
    };
    (0..=world::MIRROR_MATERIAL).map(material).collect()
}

/// A texture of 16 by 16 texels.
fn create_texture(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    texel: impl Fn(usize, usize) -> [u8; 4],
) -> wgpu::Texture {
    let texels: Vec<_> = (0..16 * 16).flat_map(|index| texel(index % 16, index / 16)).collect();
    let descriptor = wgpu::TextureDescriptor {
        label: Some("material"),
        size: wgpu::Extent3d { width: 16, height: 16, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba8Unorm,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    };
    device.create_texture_with_data(queue, &descriptor, wgpu::util::TextureDataOrder::LayerMajor, &texels)
}

fn bind_group(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    resources: &[wgpu::BindingResource<'_>],
) -> wgpu::BindGroup {
    let resources = (0..).zip(resources.iter().cloned());
    let entries: Vec<_> = resources.map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource }).collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

fn texture_view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
