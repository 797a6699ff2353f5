//! Raw passes that compute, with the frame's objects and data of the engine's own.

use std::error::Error;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, OnceLock};

use drawloom::process::{Declare, Draws, Format, RawPass, RawPassResources, RenderProcess, SHADER_PRELUDE};
use drawloom::scene::{Scene, SceneRef};
use drawloom::{bytemuck, wgpu};
use drawloom_testing::scenes::field;
use drawloom_testing::tinted::TINT;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, pixel};
use crate::image_distance::assert_color;

pub const CASES: &[Case] =
    &[("a_raw_pass_computes_with_objects_columns_and_bytes_of_its_frame", objects_columns_and_bytes)];

/// Writes one pixel for each object: its tint times a factor of the frame; blue is the number of lights of the view.
#[derive(Default)]
struct Palette {
    /// In 255ths.
    factor: AtomicU32,
    pipeline: OnceLock<(wgpu::ComputePipeline, wgpu::BindGroupLayout)>,
}

const SHADER: &str = "
    @group(2) @binding(0) var palette: texture_storage_2d<rgba8unorm, write>;
    @group(2) @binding(1) var<storage, read> tints: array<vec4<f32>>;
    @group(2) @binding(2) var<uniform> factor: vec4<f32>;

    @compute @workgroup_size(1)
    fn main(@builtin(global_invocation_id) id: vec3<u32>) {
        let object = objects[id.x];
        let tint = tints[object.index].rg * factor.x;
        textureStore(palette, vec2<i32>(i32(object.index), 0), vec4<f32>(tint, f32(view.light_count) / 255.0, 1.0));
    }
";

impl RawPass for Palette {
    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &RawPassResources<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        let device = resources.device;
        let (pipeline, layout) = self.pipeline.get_or_init(|| new_pipeline(device, resources.bind_group_layouts));
        let factor = [self.factor.load(Ordering::Relaxed) as f32 / 255.0, 0.0, 0.0, 0.0];
        let factor = resources.buffer_of("factor", wgpu::BufferUsages::UNIFORM, bytemuck::bytes_of(&factor));
        let palette = resources.target("palette")?.create_view(&Default::default());
        let tints = resources.column(TINT)?;
        let entries = [
            wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&palette) },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Buffer(tints) },
            wgpu::BindGroupEntry { binding: 2, resource: factor.as_entire_binding() },
        ];
        let own = device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries });
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(pipeline);
        for (index, group) in (0..).zip(resources.bind_groups.into_iter().chain([&own])) {
            pass.set_bind_group(index, group, &[]);
        }
        pass.dispatch_workgroups(2, 1, 1);
        Ok(())
    }
}

fn new_pipeline(
    device: &wgpu::Device,
    [frame, assets]: [&wgpu::BindGroupLayout; 2],
) -> (wgpu::ComputePipeline, wgpu::BindGroupLayout) {
    let source = ["const ABSOLUTE_TRANSFORMS: bool = false;\n", &SHADER_PRELUDE, "\n", SHADER].concat();
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: Some("palette"),
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let entry =
        |binding, ty| wgpu::BindGroupLayoutEntry { binding, visibility: wgpu::ShaderStages::COMPUTE, ty, count: None };
    let buffer = |ty| wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None };
    let palette = wgpu::BindingType::StorageTexture {
        access: wgpu::StorageTextureAccess::WriteOnly,
        format: wgpu::TextureFormat::Rgba8Unorm,
        view_dimension: wgpu::TextureViewDimension::D2,
    };
    let entries = [
        entry(0, palette),
        entry(1, buffer(wgpu::BufferBindingType::Storage { read_only: true })),
        entry(2, buffer(wgpu::BufferBindingType::Uniform)),
    ];
    let own =
        device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some("palette"), entries: &entries });
    let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("palette"),
        bind_group_layouts: &[Some(frame), Some(assets), Some(&own)],
        immediate_size: 0,
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some("palette"),
        layout: Some(&layout),
        module: &module,
        entry_point: Some("main"),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    (pipeline, own)
}

impl RenderProcess for Palette {
    fn name(&self) -> &str {
        "palette"
    }

    fn declare(&self, declare: &mut Declare) {
        declare.writes("palette", Format::Rgba8Unorm);
        declare.reads_column(TINT);
        declare.once_a_frame();
    }

    fn draws(&self) -> Draws<'_> {
        Draws::Raw(self)
    }
}

fn objects_columns_and_bytes() -> Result<(), Failed> {
    let palette = Arc::new(Palette::default());
    let mut fixture = Fixture::with(2, |builder| builder.process(Arc::clone(&palette)).output("palette"))?;
    let scene: Scene = field(2);
    let lights = scene.lights.len() as u8;
    let tints = [[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0]];
    let columns = [TINT.values(&tints)];
    let mut in_flight = Vec::new();
    for factor in [255, 128, 64] {
        palette.factor.store(factor, Ordering::Relaxed);
        in_flight.push(fixture.renderer.record(SceneRef { columns: &columns, ..scene.as_scene_ref() })?);
    }
    for (recorded, factor) in in_flight.into_iter().zip([255, 128, 64]) {
        let picture = fixture.submit(recorded)?.read(0, "palette")?;
        assert_color(pixel(&picture, 0, 0), [factor, 0, lights])?;
        assert_color(pixel(&picture, 1, 0), [0, factor, lights])?;
    }
    Ok(())
}
