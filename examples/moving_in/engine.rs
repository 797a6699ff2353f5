//! A small engine as people write them: boxed drawables, materials with three textures each, a shadow map and a mirror.
//! It updates and draws its drawables; [`on_wgpu`] and [`on_drawloom`] cull, sort and begin passes.
//!
//! [`on_wgpu`]: super::on_wgpu
//! [`on_drawloom`]: super::on_drawloom

use std::error::Error;
use std::f32::consts::TAU;
use std::ops::Range;
use std::sync::mpsc;

use glam::camera::rh::{proj::directx, view};
use glam::{Mat4, Vec3, Vec4};
use wgpu::util::{DeviceExt, RenderEncoder};

use super::drawables::{Drawable, Instance, Sphere};
use super::resources::{self, Layouts, Material, Mesh, View, ViewData};
use super::world;

// The views of a frame, in the order in which they are drawn.
pub const SHADOW: usize = 0;
pub const MIRROR: usize = 1;
pub const MAIN: usize = 2;
/// Width and height of each view's picture.
pub const SIZES: [[u32; 2]; 3] = [[2048; 2], [320, 200], [640, 400]];
/// Red, green, blue and alpha, linear.
pub const SKY: [f64; 4] = [0.35, 0.55, 0.8, 1.0];

pub const FIELD_OF_VIEW: f32 = TAU / 6.0;
pub const NEAR: f32 = 0.1;
pub const TOWARDS_SUN: Vec3 = Vec3::new(0.48, 0.64, 0.6);

/// The pipelines of a material: one for colours, one for the shadow map.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shading {
    Surface,
    Leaf,
    Mirror,
}

pub struct Engine {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    meshes: Vec<Mesh>,
    materials: Vec<Material>,
    /// By [`Shading`].
    pipelines: [wgpu::RenderPipeline; 3],
    /// By [`Shading`]: a mirror casts no shadow.
    shadow_pipelines: [wgpu::RenderPipeline; 2],
    pub views: [View; 3],
    /// The shadow map and its sampler.
    light: wgpu::BindGroup,
    instances: wgpu::Buffer,

    drawables: Vec<Box<dyn Drawable>>,
    /// The number of drawables that move. They are the first ones.
    pub moving: usize,
    // Of each drawable:
    pub spheres: Vec<Sphere>,
    /// The bits of the views that may show it.
    pub view_masks: Vec<u32>,
    /// Drawables are drawn in the order of their keys: by pipeline, then by material, then by mesh. They have 32 bits.
    pub keys: Vec<u64>,
    instance_ranges: Vec<Range<u32>>,

    /// The position of the main camera.
    pub eye: Vec3,
    /// Half of the width of the square that the shadow map covers.
    pub shadow_reach: f32,
}

impl Engine {
    /// An engine with a world of about this many drawables.
    pub fn new(device: wgpu::Device, queue: wgpu::Queue, count: usize) -> Self {
        let layouts = Layouts::new(&device);
        let (shadow_pipelines, pipelines) = resources::create_pipelines(&device, &layouts);
        let side = (count.max(16) as f32).sqrt().ceil() as usize;
        let (drawables, moving) = world::create_drawables(side);

        let (mut data, mut instance_ranges) = (Vec::new(), Vec::new());
        for drawable in &drawables {
            let first = data.len() as u32;
            drawable.write_instances(&mut data);
            instance_ranges.push(first..data.len() as u32);
        }
        let instances = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("instances"),
            contents: bytemuck::cast_slice(&data),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
        });
        let views = [SHADOW, MIRROR, MAIN].map(|view| View::new(&device, &layouts, view, &instances));
        let materials = resources::create_materials(&device, &queue, &layouts, &views[MIRROR]);
        let key = |drawable: &dyn Drawable| {
            let (material, mesh) = (drawable.material(), drawable.mesh());
            (materials[material].shading as u64) << 28 | (material as u64) << 12 | mesh as u64
        };
        let mut engine = Self {
            meshes: world::create_meshes(&device),
            pipelines,
            shadow_pipelines,
            light: resources::light_group(&device, &layouts, &views[SHADOW]),
            views,
            instances,
            moving,
            spheres: drawables.iter().map(|drawable| drawable.bounding_sphere()).collect(),
            view_masks: drawables.iter().map(|drawable| drawable.views()).collect(),
            keys: drawables.iter().map(|drawable| key(drawable.as_ref())).collect(),
            instance_ranges,
            materials,
            drawables,
            eye: Vec3::ZERO,
            shadow_reach: side as f32 * 1.5 + 8.0,
            device,
            queue,
        };
        engine.update(0.0);
        engine
    }

    /// Moves the camera and the drawables to their positions at `time`, in seconds, and writes the buffers.
    pub fn update(&mut self, time: f32) {
        let mut instances: Vec<Instance> = Vec::with_capacity(self.moving);
        for (drawable, sphere) in self.drawables[..self.moving].iter_mut().zip(&mut self.spheres) {
            drawable.update(time);
            *sphere = drawable.bounding_sphere();
            drawable.write_instances(&mut instances);
        }
        self.queue.write_buffer(&self.instances, 0, bytemuck::cast_slice(&instances));

        let angle = time * 0.1;
        self.eye = Vec3::new(angle.cos() * 20.0, 8.0, angle.sin() * 20.0);
        let aspect = SIZES[MAIN][0] as f32 / SIZES[MAIN][1] as f32;
        let projection = directx::perspective_infinite_reverse(FIELD_OF_VIEW, aspect, NEAR);
        let main = projection * view::look_at_mat4(self.eye, Vec3::ZERO, Vec3::Y);
        // The world is mirrored at its ground, and the picture from left to right, so front faces stay front faces.
        let mirror = Mat4::from_scale(Vec3::new(-1.0, 1.0, 1.0)) * main * Mat4::from_scale(Vec3::new(1.0, -1.0, 1.0));
        let reach = self.shadow_reach;
        // Near and far are swapped: depth is reversed, as in the other views.
        let projection = directx::orthographic(-reach, reach, -reach, reach, 2.0 * reach, 1.0);
        let shadow = projection * view::look_at_mat4(self.shadow_eye(), Vec3::ZERO, Vec3::Y);

        for (index, clip_from_world) in [shadow, mirror, main].into_iter().enumerate() {
            let [width, height] = SIZES[index].map(|pixels| pixels as f32);
            self.views[index].write(
                &self.queue,
                ViewData {
                    clip_from_world,
                    shadow_from_world: shadow,
                    eye: self.eye.extend(1.0),
                    towards_sun: TOWARDS_SUN.extend(0.0),
                    plane: if index == MIRROR { Vec4::Y } else { Vec4::W },
                    size: Vec4::new(width, height, 0.0, 0.0),
                },
            );
        }
    }

    /// The position of the shadow map's camera.
    pub fn shadow_eye(&self) -> Vec3 {
        TOWARDS_SUN * self.shadow_reach
    }

    /// Draws drawables of a view, in this order.
    pub fn draw_all<'a>(
        &'a self,
        encoder: &mut dyn RenderEncoder<'a>,
        view: usize,
        drawables: impl IntoIterator<Item = u32>,
    ) {
        let mut pass = DrawPass::new(encoder, self, view);
        for index in drawables {
            let index = index as usize;
            self.drawables[index].draw(&mut pass, self.instance_ranges[index].clone());
        }
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

/// The pass that drawables draw into. It skips what is set already.
pub struct DrawPass<'a, 'p> {
    encoder: &'p mut dyn RenderEncoder<'a>,
    engine: &'a Engine,
    view: usize,
    shading: Option<Shading>,
    material: Option<usize>,
    mesh: Option<usize>,
    index_count: u32,
}

impl<'a, 'p> DrawPass<'a, 'p> {
    fn new(encoder: &'p mut dyn RenderEncoder<'a>, engine: &'a Engine, view: usize) -> Self {
        encoder.set_bind_group(0, Some(&engine.views[view].group), &[]);
        if view != SHADOW {
            encoder.set_bind_group(2, Some(&engine.light), &[]);
        }
        Self { encoder, engine, view, shading: None, material: None, mesh: None, index_count: 0 }
    }

    pub fn set_material(&mut self, material: usize) {
        if self.material.replace(material) == Some(material) {
            return;
        }
        let Material { shading, group } = &self.engine.materials[material];
        if self.shading.replace(*shading) != Some(*shading) {
            let Engine { pipelines, shadow_pipelines, .. } = self.engine;
            let pipelines = if self.view == SHADOW { &shadow_pipelines[..] } else { pipelines };
            self.encoder.set_pipeline(&pipelines[*shading as usize]);
        }
        self.encoder.set_bind_group(1, Some(group), &[]);
    }

    pub fn set_mesh(&mut self, mesh: usize) {
        if self.mesh.replace(mesh) == Some(mesh) {
            return;
        }
        let Mesh { vertices, indices, index_count } = &self.engine.meshes[mesh];
        self.encoder.set_vertex_buffer(0, Some(vertices.slice(..)));
        self.encoder.set_index_buffer(indices.slice(..), wgpu::IndexFormat::Uint16);
        self.index_count = *index_count;
    }

    /// Draws these instances of the mesh.
    pub fn draw(&mut self, instances: Range<u32>) {
        self.encoder.draw_indexed(0..self.index_count, 0, instances);
    }
}
