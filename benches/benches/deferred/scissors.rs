//! Lights within scissor rectangles: what light volumes are better than according to L 4.2.1.
//!
//! These processes take the place of those with light volumes in the deferred pipeline, and run the same fragment
//! shader. An engine's code finds the rectangle of each light, and a raw pass draws a triangle that covers the picture,
//! a draw a light.

use std::error::Error;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use drawloom::RendererBuilder;
use drawloom::backend::{Picture, WgpuBackend};
use drawloom::process::{
    Declare, Deferred, Draws, GeometryFormats, ILLUMINATION_SHADER, LightVolumes, RawPass, RawPassResources,
    RenderProcess, SHADER_PRELUDE,
};
use drawloom::scene::{LightKind, SceneRef};
use drawloom::view::LightClass;
use drawloom::view::internal::GpuLight;
use drawloom::view::{GpuView, RenderView};
use drawloom::wgpu;
use drawloom_benches::stopwatch::FrameTime;

use crate::contender::{Contender, Counts};
use crate::drawloom_pipeline::DrawloomPipeline;
use crate::plain_forward::picture;
use crate::plain_forward::visible_scene::lights_in;

/// What rejects pixels before they are shaded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rejection {
    Rectangle,
    /// Also the depth test: surfaces farther away than the light reaches.
    RectangleAndDepth,
}

/// The rectangles of a frame's lights, which the engine hands to its passes.
#[derive(Clone, Debug, Default)]
pub struct Rectangles {
    lights: Arc<Mutex<Vec<LightRectangle>>>,
}

#[derive(Clone, Copy, Debug)]
struct LightRectangle {
    /// [`GpuLight::kind`].
    kind: u32,
    /// The light's index among those that reach the view.
    light: u32,
    /// x, y, width and height in pixels.
    pixels: [u32; 4],
}

impl LightRectangle {
    fn is_drawn(&self) -> bool {
        let [_, _, width, height] = self.pixels;
        width > 0 && height > 0
    }
}

impl Rectangles {
    /// Lights without shadow maps are in the view's buffer by kind, and those of a kind in the order of the scene.
    fn update(&self, scene: &SceneRef<'_>) -> Result<(), Box<dyn Error>> {
        let view = RenderView::new(scene.cameras.first().ok_or("there is no camera")?);
        let mut lights: Vec<GpuLight> = lights_in(scene, &view).collect();
        lights.sort_by_key(|light| light.kind);
        let view = GpuView::new(&view, scene.ambient, lights.len()).ok_or("the camera is too far from the origin")?;
        let picture = picture::Picture::new(&view);
        let mut rectangles = self.lights.lock().unwrap_or_else(PoisonError::into_inner);
        rectangles.clear();
        rectangles.extend((0..).zip(&lights).map(|(index, light)| {
            let pixels = picture.rectangle(light);
            LightRectangle { kind: light.kind, light: index, pixels }
        }));
        Ok(())
    }
}

/// The deferred pipeline, with scissor rectangles for point lights and spot lights.
pub fn scissors(
    builder: RendererBuilder<WgpuBackend>,
    rectangles: &Rectangles,
    rejection: Rejection,
) -> RendererBuilder<WgpuBackend> {
    let deferred = [LightKind::Point, LightKind::Spot].into_iter().fold(Deferred::to_picture(), |deferred, kind| {
        let name = LightVolumes::name_of(LightClass { kind, shadowed: false });
        let rectangles = rectangles.clone();
        let process = ScissorLights {
            name: format!("{name} in rectangles"),
            kind,
            rejection,
            rectangles,
            kept: Mutex::default(),
        };
        deferred.replace(name, process)
    });
    builder.pipeline(deferred)
}

/// Draws the lights of one kind.
struct ScissorLights {
    name: String,
    kind: LightKind,
    rejection: Rejection,
    rectangles: Rectangles,
    kept: Mutex<Option<Kept>>,
}

/// What is made anew only if the targets are others.
struct Kept {
    targets: [wgpu::Texture; TARGETS.len()],
    depth: wgpu::TextureView,
    radiance: wgpu::TextureView,
    pipeline: wgpu::RenderPipeline,
    group: wgpu::BindGroup,
}

const TARGETS: [&str; 4] = ["depth", "normal", "diffuse", "radiance"];

impl RenderProcess for ScissorLights {
    fn name(&self) -> &str {
        &self.name
    }

    fn declare(&self, declare: &mut Declare) {
        let [depth, normal, diffuse, radiance] = TARGETS;
        [depth, normal, diffuse].into_iter().for_each(|target| declare.reads(target));
        declare.changes(radiance);
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Raw(self)
    }
}

impl RawPass for ScissorLights {
    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &RawPassResources<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        let [depth, normal, diffuse, radiance] = TARGETS.map(|target| resources.target(target));
        let targets = [depth?, normal?, diffuse?, radiance?];
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        let is_current = |kept: &Kept| kept.targets.iter().eq(targets);
        let kept = match kept.take().filter(is_current) {
            Some(current) => kept.insert(current),
            None => kept.insert(self.new_kept(resources, targets)),
        };
        let ops = wgpu::Operations { load: wgpu::LoadOp::Load, store: wgpu::StoreOp::Store };
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &kept.radiance,
                depth_slice: None,
                resolve_target: None,
                ops,
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &kept.depth,
                depth_ops: None,
                stencil_ops: None,
            }),
            ..wgpu::RenderPassDescriptor::default()
        });
        pass.set_pipeline(&kept.pipeline);
        let [view, materials] = resources.bind_groups;
        for (index, group) in (0..).zip([view, materials, &kept.group]) {
            pass.set_bind_group(index, group, &[]);
        }
        let rectangles = self.rectangles.lights.lock().unwrap_or_else(PoisonError::into_inner);
        let is_drawn = |rectangle: &&LightRectangle| rectangle.kind == self.kind as u32 && rectangle.is_drawn();
        for &LightRectangle { light, pixels: [x, y, width, height], .. } in rectangles.iter().filter(is_drawn) {
            pass.set_scissor_rect(x, y, width, height);
            pass.draw(0..3, light..light + 1);
        }
        Ok(())
    }
}

impl ScissorLights {
    fn new_kept(&self, resources: &RawPassResources<'_>, targets: [&wgpu::Texture; TARGETS.len()]) -> Kept {
        let device = resources.device;
        let view_of = |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
        let views = targets.map(view_of);
        let sample_types = [wgpu::TextureSampleType::Depth, UNFILTERABLE, UNFILTERABLE].into_iter().zip(1..).map(
            |(sample_type, binding)| {
                let view_dimension = wgpu::TextureViewDimension::D2;
                let ty = wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false };
                wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::FRAGMENT, ty, count: None }
            },
        );
        let entries: Vec<_> = sample_types.collect();
        let layout =
            device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: None, entries: &entries });
        let entries: Vec<_> = (1..)
            .zip(&views[..3])
            .map(|(binding, view)| {
                let resource = wgpu::BindingResource::TextureView(view);
                wgpu::BindGroupEntry { binding, resource }
            })
            .collect();
        let group =
            device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout: &layout, entries: &entries });
        let pipeline = self.new_pipeline(resources, &layout, [targets[0].format(), targets[3].format()]);
        let [depth, _, _, radiance] = views;
        Kept { targets: targets.map(wgpu::Texture::clone), depth, radiance, pipeline, group }
    }

    fn new_pipeline(
        &self,
        resources: &RawPassResources<'_>,
        own: &wgpu::BindGroupLayout,
        [depth, radiance]: [wgpu::TextureFormat; 2],
    ) -> wgpu::RenderPipeline {
        let device = resources.device;
        let shader = [
            ABSOLUTE_TRANSFORMS,
            &SHADER_PRELUDE,
            &GeometryFormats::default().normal_encoding_wgsl(),
            ILLUMINATION_SHADER,
            include_str!("../../../src/process/deferred/shading/no_shadow.wgsl"),
            include_str!("../../../src/process/deferred/light_volumes/light_volumes.wgsl"),
            include_str!("scissors.wgsl"),
        ];
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: None,
            source: wgpu::ShaderSource::Wgsl(shader.concat().into()),
        });
        let [view, materials] = resources.bind_group_layouts;
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: None,
            bind_group_layouts: &[Some(view), Some(materials), Some(own)],
            immediate_size: 0,
        });
        let depth_compare = match self.rejection {
            Rejection::Rectangle => wgpu::CompareFunction::Always,
            // Depth is reversed, and 0 where there is no surface.
            Rejection::RectangleAndDepth => wgpu::CompareFunction::Less,
        };
        let component = wgpu::BlendComponent {
            src_factor: wgpu::BlendFactor::One,
            dst_factor: wgpu::BlendFactor::One,
            operation: wgpu::BlendOperation::Add,
        };
        let blend = Some(wgpu::BlendState { color: component, alpha: component });
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: None,
            layout: Some(&layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: depth,
                depth_write_enabled: Some(false),
                depth_compare: Some(depth_compare),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(wgpu::ColorTargetState { blend, ..radiance.into() })],
            }),
            multiview_mask: None,
            cache: None,
        })
    }
}

const UNFILTERABLE: wgpu::TextureSampleType = wgpu::TextureSampleType::Float { filterable: false };

/// The prelude needs it.
const ABSOLUTE_TRANSFORMS: &str = "const ABSOLUTE_TRANSFORMS: bool = false;\n";

/// The pipeline and the engine's code. A frame's time has both.
pub struct ScissorPipeline {
    pipeline: DrawloomPipeline,
    rectangles: Rectangles,
}

impl ScissorPipeline {
    pub fn new(pipeline: DrawloomPipeline, rectangles: Rectangles) -> Self {
        Self { pipeline, rectangles }
    }
}

impl Contender for ScissorPipeline {
    fn frame(&mut self, scene: SceneRef<'_>) -> Result<FrameTime, Box<dyn Error>> {
        let start = Instant::now();
        self.rectangles.update(&scene)?;
        let updated = start.elapsed();
        let FrameTime { cpu, borrowed, device } = self.pipeline.frame(scene)?;
        Ok(FrameTime { cpu: cpu + updated, borrowed: borrowed + updated, device })
    }

    fn counts(&self) -> Counts {
        let rectangles = self.rectangles.lights.lock().unwrap_or_else(PoisonError::into_inner);
        let counts = self.pipeline.counts();
        Counts { draws: counts.draws + rectangles.iter().filter(|rectangle| rectangle.is_drawn()).count(), ..counts }
    }

    fn picture(&self) -> Result<Picture, Box<dyn Error>> {
        self.pipeline.picture()
    }
}
