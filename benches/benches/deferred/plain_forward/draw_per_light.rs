//! Adds light by light: all objects are drawn once without lights, and then, for each light, the objects that its
//! sphere reaches, within the rectangle of the picture that it reaches. (In L 2 each light draws all objects: N × L.)

use std::error::Error;

use drawloom::process::ILLUMINATION_SHADER;
use drawloom::scene::SceneRef;
use drawloom::view::internal::GpuLight;
use drawloom::wgpu;
use multiversion::multiversion;

use super::device::{Device, SurfacePipeline};
use super::picture::Picture;
use super::visible_scene::{Spheres, VisibleScene};
use super::{Lighting, LightingCounts};

pub struct DrawPerLight {
    without_lights: wgpu::RenderPipeline,
    one_light: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
    instances: wgpu::Buffer,
    /// Kept over all frames: an object, and its light.
    lit: Vec<[u32; 2]>,
    light_draws: Vec<LightDraw>,
}

struct LightDraw {
    /// The end of its range of `lit`.
    end: u32,
    /// x, y, width and height in pixels.
    rectangle: [u32; 4],
}

impl DrawPerLight {
    pub fn new(device: &Device, scene: &SceneRef<'_>) -> Self {
        let shading = |own| [device.surface_shader(), ILLUMINATION_SHADER, own].concat();
        let storage = wgpu::BufferBindingType::Storage { read_only: true };
        let layout = device.layout(&[storage]);
        // The largest number there can be.
        let count = (scene.object_count() * scene.lights.len()).max(1);
        let instances = device.buffer(wgpu::BufferUsages::STORAGE, count * size_of::<[u32; 2]>());
        Self {
            without_lights: device.surface_pipeline(&SurfacePipeline {
                shader: &[device.surface_shader(), include_str!("without_lights.wgsl")].concat(),
                layout: None,
                adds: false,
            }),
            one_light: device.surface_pipeline(&SurfacePipeline {
                shader: &shading(include_str!("one_light.wgsl")),
                layout: Some(&layout),
                adds: true,
            }),
            group: device.group(&layout, &[&instances]),
            instances,
            lit: Vec::new(),
            light_draws: Vec::new(),
        }
    }
}

impl Lighting for DrawPerLight {
    fn prepare(&mut self, queue: &wgpu::Queue, scene: &VisibleScene) -> Result<(), Box<dyn Error>> {
        let view = scene.view.as_ref().ok_or("there is no view")?;
        let picture = Picture::new(view);
        self.lit.clear();
        self.light_draws.clear();
        for (index, light) in scene.lights.iter().enumerate() {
            push_reached(light, index as u32, &scene.spheres, &scene.drawn, &mut self.lit);
            self.light_draws.push(LightDraw { end: self.lit.len() as u32, rectangle: picture.rectangle(light) });
        }
        queue.write_buffer(&self.instances, 0, bytemuck::cast_slice(&self.lit));
        Ok(())
    }

    fn draw(&self, pass: &mut wgpu::RenderPass<'_>, scene: &VisibleScene, index_count: u32) -> LightingCounts {
        pass.set_pipeline(&self.without_lights);
        pass.draw_indexed(0..index_count, 0, 0..scene.drawn.len() as u32);
        pass.set_pipeline(&self.one_light);
        pass.set_bind_group(2, &self.group, &[]);
        let (mut draws, mut first) = (1, 0);
        for &LightDraw { end, rectangle: [x, y, width, height] } in &self.light_draws {
            if end > first && width > 0 && height > 0 {
                pass.set_scissor_rect(x, y, width, height);
                pass.draw_indexed(0..index_count, 0, first..end);
                draws += 1;
            }
            first = end;
        }
        LightingCounts { draws, commands: scene.drawn.len() + self.lit.len() }
    }
}

/// Appends the objects whose spheres a light's sphere intersects.
#[multiversion(targets("x86_64+avx2"))]
fn push_reached(light: &GpuLight, index: u32, spheres: &Spheres, drawn: &[u32], lit: &mut Vec<[u32; 2]>) {
    let [x, y, z, radii] =
        [&spheres.x, &spheres.y, &spheres.z, &spheres.radii].map(|axis| axis.as_chunks::<{ Spheres::GROUP }>().0);
    let [center_x, center_y, center_z] = light.position.to_array();
    for (group, (((x, y), z), radii)) in x.iter().zip(y).zip(z).zip(radii).enumerate() {
        let mut reached = [false; Spheres::GROUP];
        for lane in 0..Spheres::GROUP {
            let (x, y, z) = (x[lane] - center_x, y[lane] - center_y, z[lane] - center_z);
            let reach = radii[lane] + light.range;
            reached[lane] = x * x + y * y + z * z <= reach * reach;
        }
        if reached != [false; Spheres::GROUP] {
            let objects = drawn[group * Spheres::GROUP..].iter().zip(reached);
            lit.extend(objects.filter(|(_, reached)| *reached).map(|(&object, _)| [object, index]));
        }
    }
}
