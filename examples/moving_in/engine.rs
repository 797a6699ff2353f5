//! A small engine as people write them with plain wgpu, without Drawloom: meshes, materials with three textures each,
//! a shadow map, a mirror, and a loop that culls, sorts and draws on one thread.

use std::error::Error;
use std::f32::consts::TAU;
use std::mem::take;
use std::ops::Range;
use std::sync::mpsc;

use bytemuck::{Pod, Zeroable};
use glam::camera::rh::{proj::directx, view};
use glam::{Mat4, Quat, Vec3, Vec4, Vec4Swizzles};
use wgpu::util::DeviceExt;

use super::content;

pub const COLOR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8UnormSrgb;
pub const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;
/// Red, green, blue and alpha, linear.
pub const SKY: [f64; 4] = [0.35, 0.55, 0.8, 1.0];

// The views of a frame, in the order in which they are drawn.
pub const SHADOW: usize = 0;
pub const MIRROR: usize = 1;
pub const MAIN: usize = 2;
/// Width and height of each view's picture.
pub const SIZES: [[u32; 2]; 3] = [[2048; 2], [320, 200], [640, 400]];

pub const FIELD_OF_VIEW: f32 = TAU / 6.0;
pub const NEAR: f32 = 0.1;
pub const TOWARDS_SUN: Vec3 = Vec3::new(0.48, 0.64, 0.6);

/// How many materials there are beside the mirror, and which of them are leaves.
pub const MATERIALS: usize = 64;
pub const LEAF_MATERIALS: Range<usize> = 56..MATERIALS;
/// Of this many objects, one moves.
pub const OBJECTS_PER_MOVING: usize = 8;

/// What a material is drawn with; the values order objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shading {
    Surface,
    Leaf,
    Mirror,
}

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

pub struct Object {
    pub mesh: usize,
    pub material: usize,
    /// The views that may show it: a bit each.
    pub views: u32,
    pub position: Vec3,
    pub scale: Vec3,
    pub tint: Vec3,
}

impl Object {
    /// Centre and radius of its bounding sphere.
    pub fn sphere(&self) -> (Vec3, f32) {
        (self.position, self.scale.length())
    }

    fn data(&self) -> ObjectData {
        let turn = Quat::from_rotation_y(self.position.x * 0.7);
        let world_from_object = Mat4::from_scale_rotation_translation(self.scale, turn, self.position);
        ObjectData { world_from_object, tint: self.tint.extend(1.0) }
    }
}

/// As the shaders have it.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct ObjectData {
    world_from_object: Mat4,
    tint: Vec4,
}

/// As the shaders have it.
#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct ViewData {
    clip_from_world: Mat4,
    shadow_from_world: Mat4,
    eye: Vec4,
    towards_sun: Vec4,
    plane: Vec4,
    size: Vec4,
}

/// A camera's uniforms and targets.
pub struct View {
    clip_from_world: Mat4,
    uniforms: wgpu::Buffer,
    /// The uniforms, and the data of all objects.
    pub group: wgpu::BindGroup,
    /// None in the shadow map's.
    pub color: Option<Target>,
    pub depth: Target,
}

pub struct Target {
    pub texture: wgpu::Texture,
    view: wgpu::TextureView,
}

pub struct Engine {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub meshes: Vec<Mesh>,
    pub materials: Vec<Material>,
    pub objects: Vec<Object>,
    /// How many objects move: the first ones.
    pub moving: usize,
    /// By [`Shading`].
    pub pipelines: [wgpu::RenderPipeline; 3],
    /// By [`Shading`]: a mirror casts no shadow.
    pub shadow_pipelines: [wgpu::RenderPipeline; 2],
    pub views: [View; 3],
    /// The shadow map and its sampler.
    pub light: wgpu::BindGroup,
    /// Where the main camera is, and half of the width of the world.
    pub eye: Vec3,
    pub extent: f32,
    object_buffer: wgpu::Buffer,
    /// The objects that a view sees, each with its key; kept for its memory.
    visible: Vec<(u64, u32)>,
}

impl Engine {
    /// An engine with a world of about this many objects.
    pub fn new(device: wgpu::Device, queue: wgpu::Queue, count: usize) -> Self {
        let layouts = Layouts::new(&device);
        let (shadow_pipelines, pipelines) = create_pipelines(&device, &layouts);
        let side = (count.max(16) as f32).sqrt().ceil() as usize;
        let objects = content::create_objects(side);
        let data: Vec<_> = objects.iter().map(Object::data).collect();
        let object_buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("objects"),
            contents: bytemuck::cast_slice(&data),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        });
        let views = [SHADOW, MIRROR, MAIN].map(|view| create_view(&device, &layouts, view, &object_buffer));
        let light = {
            let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
                compare: Some(wgpu::CompareFunction::GreaterEqual),
                mag_filter: wgpu::FilterMode::Linear,
                min_filter: wgpu::FilterMode::Linear,
                ..wgpu::SamplerDescriptor::default()
            });
            let shadow_map = wgpu::BindingResource::TextureView(&views[SHADOW].depth.view);
            let resources = [shadow_map, wgpu::BindingResource::Sampler(&sampler)];
            bind_group(&device, &layouts.light, &resources)
        };
        let materials = create_materials(&device, &queue, &layouts, views[MIRROR].color.as_ref());
        let meshes = content::create_meshes(&device);
        let mut engine = Self {
            device,
            queue,
            meshes,
            materials,
            moving: objects.len() / OBJECTS_PER_MOVING,
            objects,
            pipelines,
            shadow_pipelines,
            views,
            light,
            eye: Vec3::ZERO,
            extent: side as f32,
            object_buffer,
            visible: Vec::new(),
        };
        engine.update(0.0);
        engine
    }

    /// Moves the camera and the objects that move, and writes what the shaders read.
    pub fn update(&mut self, time: f32) {
        for (index, object) in self.objects[..self.moving].iter_mut().enumerate() {
            object.position.y = 2.0 + (time + index as f32).sin();
        }
        let data: Vec<_> = self.objects[..self.moving].iter().map(Object::data).collect();
        self.queue.write_buffer(&self.object_buffer, 0, bytemuck::cast_slice(&data));

        let angle = time * 0.1;
        self.eye = Vec3::new(angle.cos() * 20.0, 8.0, angle.sin() * 20.0);
        let aspect = SIZES[MAIN][0] as f32 / SIZES[MAIN][1] as f32;
        let projection = directx::perspective_infinite_reverse(FIELD_OF_VIEW, aspect, NEAR);
        let main = projection * view::look_at_mat4(self.eye, Vec3::ZERO, Vec3::Y);
        // The world is mirrored at its ground, and the picture from left to right, so front faces stay front faces.
        let mirrored = Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0)) * main * Mat4::from_scale(Vec3::new(1.0, -1.0, 1.0));
        let reach = self.shadow_reach();
        // Near and far are swapped: depth is reversed, as in the other views.
        let projection = directx::orthographic(-reach, reach, -reach, reach, 2.0 * reach, 1.0);
        let shadow = projection * view::look_at_mat4(self.shadow_eye(), Vec3::ZERO, Vec3::Y);

        for (index, clip_from_world) in [shadow, mirrored, main].into_iter().enumerate() {
            let view = &mut self.views[index];
            view.clip_from_world = clip_from_world;
            let [width, height] = SIZES[index].map(|pixels| pixels as f32);
            let data = ViewData {
                clip_from_world,
                shadow_from_world: shadow,
                eye: self.eye.extend(1.0),
                towards_sun: TOWARDS_SUN.extend(0.0),
                plane: if index == MIRROR { Vec4::Y } else { Vec4::W },
                size: Vec4::new(width, height, 0.0, 0.0),
            };
            self.queue.write_buffer(&view.uniforms, 0, bytemuck::bytes_of(&data));
        }
    }

    /// Half of the width of what the shadow map covers.
    pub fn shadow_reach(&self) -> f32 {
        self.extent * 1.5 + 8.0
    }

    pub fn shadow_eye(&self) -> Vec3 {
        TOWARDS_SUN * self.shadow_reach()
    }

    /// Objects are drawn in the order of their keys: what has one pipeline follows each other, and so do the objects of
    /// one material.
    pub fn key(&self, object: &Object) -> u64 {
        (self.materials[object.material].shading as u64) << 32 | object.material as u64
    }

    /// Draws a frame.
    pub fn draw(&mut self) {
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut visible = take(&mut self.visible);
        for index in [SHADOW, MIRROR, MAIN] {
            self.cull(index, &mut visible);
            visible.sort_unstable();
            let view = &self.views[index];
            let [r, g, b, a] = SKY;
            let colors = [view.color.as_ref().map(|target| wgpu::RenderPassColorAttachment {
                view: &target.view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a }),
                    store: wgpu::StoreOp::Store,
                },
            })];
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                color_attachments: if index == SHADOW { &[] } else { &colors },
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &view.depth.view,
                    depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(0.0), store: wgpu::StoreOp::Store }),
                    stencil_ops: None,
                }),
                ..wgpu::RenderPassDescriptor::default()
            });
            self.draw_objects(&mut pass, index, &visible);
        }
        self.visible = visible;
        self.queue.submit([encoder.finish()]);
    }

    /// Finds the objects whose bounding spheres a view sees.
    fn cull(&self, view: usize, visible: &mut Vec<(u64, u32)>) {
        let rows = self.views[view].clip_from_world.transpose();
        let [x, y, z, w] = [rows.x_axis, rows.y_axis, rows.z_axis, rows.w_axis];
        // The normal of an infinite far plane is 0: all spheres are in front of it.
        let planes = [w + x, w - x, w + y, w - y, w - z, z].map(|plane| (plane, plane.xyz().length()));
        visible.clear();
        for (index, object) in self.objects.iter().enumerate() {
            let (center, radius) = object.sphere();
            let is_seen = |(plane, length): &(Vec4, f32)| plane.dot(center.extend(1.0)) >= -radius * length;
            if object.views & 1 << view != 0 && planes.iter().all(is_seen) {
                visible.push((self.key(object), index as u32));
            }
        }
    }

    /// Draws objects in this order, and sets only what differs from one to the next.
    fn draw_objects(&self, pass: &mut wgpu::RenderPass<'_>, view: usize, objects: &[(u64, u32)]) {
        pass.set_bind_group(0, &self.views[view].group, &[]);
        if view != SHADOW {
            pass.set_bind_group(2, &self.light, &[]);
        }
        let (mut last_shading, mut last_material, mut last_mesh) = (None, None, None);
        for &(_, index) in objects {
            let object = &self.objects[index as usize];
            let (material, mesh) = (&self.materials[object.material], &self.meshes[object.mesh]);
            if last_shading.replace(material.shading) != Some(material.shading) {
                pass.set_pipeline(self.pipeline(view, material.shading));
            }
            if last_material.replace(object.material) != Some(object.material) {
                pass.set_bind_group(1, &material.group, &[]);
            }
            if last_mesh.replace(object.mesh) != Some(object.mesh) {
                pass.set_vertex_buffer(0, mesh.vertices.slice(..));
                pass.set_index_buffer(mesh.indices.slice(..), wgpu::IndexFormat::Uint16);
            }
            pass.draw_indexed(0..mesh.index_count, 0, index..index + 1);
        }
    }

    pub fn pipeline(&self, view: usize, shading: Shading) -> &wgpu::RenderPipeline {
        if view == SHADOW { &self.shadow_pipelines[shading as usize] } else { &self.pipelines[shading as usize] }
    }

    /// The bytes of the main view's picture.
    pub fn read_picture(&self) -> Result<Vec<u8>, Box<dyn Error>> {
        let [width, height] = SIZES[MAIN];
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("picture"),
            size: u64::from(width * height * 4),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let layout =
            wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(width * 4), rows_per_image: Some(height) };
        let color = &self.views[MAIN].color.as_ref().ok_or("the main view has no picture")?.texture;
        let mut encoder = self.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let target = wgpu::TexelCopyBufferInfo { buffer: &buffer, layout };
        encoder.copy_texture_to_buffer(color.as_image_copy(), target, color.size());
        self.queue.submit([encoder.finish()]);
        let (sender, receiver) = mpsc::channel();
        buffer.slice(..).map_async(wgpu::MapMode::Read, move |result| drop(sender.send(result)));
        self.device.poll(wgpu::PollType::wait_indefinitely())?;
        receiver.recv()??;
        Ok(buffer.get_mapped_range(..)?.to_vec())
    }
}

struct Layouts {
    view: wgpu::BindGroupLayout,
    material: wgpu::BindGroupLayout,
    light: wgpu::BindGroupLayout,
}

impl Layouts {
    fn new(device: &wgpu::Device) -> Self {
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

fn create_pipelines(
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
                    array_stride: size_of::<content::Vertex>() as u64,
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

fn create_view(device: &wgpu::Device, layouts: &Layouts, view: usize, objects: &wgpu::Buffer) -> View {
    let [width, height] = SIZES[view];
    let target = |format, usage| {
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
        Target { view: texture_view(&texture), texture }
    };
    let uniforms = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("view"),
        size: size_of::<ViewData>() as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    View {
        clip_from_world: Mat4::IDENTITY,
        group: bind_group(device, &layouts.view, &[uniforms.as_entire_binding(), objects.as_entire_binding()]),
        uniforms,
        color: (view != SHADOW).then(|| target(COLOR_FORMAT, wgpu::TextureUsages::COPY_SRC)),
        depth: target(DEPTH_FORMAT, wgpu::TextureUsages::empty()),
    }
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

/// Surfaces and leaves, and the mirror last. What it shows is the texture of its colours.
fn create_materials(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    layouts: &Layouts,
    mirrored: Option<&Target>,
) -> Vec<Material> {
    let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
        address_mode_u: wgpu::AddressMode::Repeat,
        address_mode_v: wgpu::AddressMode::Repeat,
        mag_filter: wgpu::FilterMode::Linear,
        min_filter: wgpu::FilterMode::Linear,
        ..wgpu::SamplerDescriptor::default()
    });
    let material = |index: usize| {
        let shading = match index {
            MATERIALS => Shading::Mirror,
            _ if LEAF_MATERIALS.contains(&index) => Shading::Leaf,
            _ => Shading::Surface,
        };
        let color = mirrored.filter(|_| shading == Shading::Mirror).map(|target| target.texture.clone());
        let color = color.unwrap_or_else(|| {
            content::create_texture(device, queue, |x, y| content::color_texel(index, shading, x, y))
        });
        let detail = content::create_texture(device, queue, |x, y| {
            let [across, along] = [x, y].map(|at| 128 + (content::hash(at * 16 + index) % 64) as u8 - 32);
            [across, along, 128, 255]
        });
        let gloss =
            content::create_texture(device, queue, |x, y| [(content::hash(index * 31 + y * 16 + x) % 160) as u8; 4]);
        let views = [color, detail, gloss].map(|texture| texture_view(&texture));
        let [color, detail, gloss] = views.each_ref().map(wgpu::BindingResource::TextureView);
        let resources = [color, detail, gloss, wgpu::BindingResource::Sampler(&sampler)];
        Material { shading, group: bind_group(device, &layouts.material, &resources) }
    };
    (0..=MATERIALS).map(material).collect()
}
