//! The mip levels of targets, generated on the device.

use super::bind_groups::texture_format;
use crate::process::Format;

/// The pipelines that generate mip levels: one for each format of a target that has had some.
pub(super) struct MipPipelines {
    module: wgpu::ShaderModule,
    bind_group_layout: wgpu::BindGroupLayout,
    layout: wgpu::PipelineLayout,
    of_formats: Vec<(Format, wgpu::RenderPipeline)>,
}

impl MipPipelines {
    pub(super) fn new(device: &wgpu::Device) -> Self {
        let module = device.create_shader_module(wgpu::include_wgsl!("target_mip_levels.wgsl"));
        let finer = wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: false },
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        };
        let bind_group_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("mip levels"),
            entries: &[finer],
        });
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("mip levels"),
            bind_group_layouts: &[Some(&bind_group_layout)],
            ..wgpu::PipelineLayoutDescriptor::default()
        });
        Self { module, bind_group_layout, layout, of_formats: Vec::new() }
    }

    /// The pipeline for targets of this format, created if there is none yet.
    fn of_format(&mut self, device: &wgpu::Device, format: Format) -> wgpu::RenderPipeline {
        if let Some((_, pipeline)) = self.of_formats.iter().find(|(known, _)| *known == format) {
            return pipeline.clone();
        }
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("mip levels"),
            layout: Some(&self.layout),
            vertex: wgpu::VertexState {
                module: &self.module,
                entry_point: Some("vertex"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &self.module,
                entry_point: Some("fragment"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(texture_format(format).into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        self.of_formats.push((format, pipeline.clone()));
        pipeline
    }
}

/// What generates the mip levels of a target, made with its texture, so that a pass that does creates nothing.
pub(crate) struct MipGenerator {
    pipeline: wgpu::RenderPipeline,
    /// From level 1 on: the level to draw into, and the one before it.
    levels: Vec<(wgpu::TextureView, wgpu::BindGroup)>,
}

impl MipGenerator {
    /// Of one layer of a texture with the format of a target.
    pub(super) fn new(
        device: &wgpu::Device,
        pipelines: &mut MipPipelines,
        (texture, layer): (&wgpu::Texture, u32),
        format: Format,
    ) -> Self {
        let view = |level: u32| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                label: Some("mip level"),
                dimension: Some(wgpu::TextureViewDimension::D2),
                base_mip_level: level,
                mip_level_count: Some(1),
                base_array_layer: layer,
                array_layer_count: Some(1),
                ..wgpu::TextureViewDescriptor::default()
            })
        };
        let mut finer = view(0);
        let levels = (1..texture.mip_level_count()).map(|level| {
            let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("mip level"),
                layout: &pipelines.bind_group_layout,
                entries: &[wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&finer) }],
            });
            finer = view(level);
            (finer.clone(), bind_group)
        });
        let levels = levels.collect();
        Self { pipeline: pipelines.of_format(device, format), levels }
    }

    /// Generates all levels from level 0, one after the other.
    pub(crate) fn generate(&self, encoder: &mut wgpu::CommandEncoder) {
        for (level, finer) in &self.levels {
            let attachment = wgpu::RenderPassColorAttachment {
                view: level,
                depth_slice: None,
                resolve_target: None,
                // Every pixel is drawn.
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
            };
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("mip level"),
                color_attachments: &[Some(attachment)],
                ..wgpu::RenderPassDescriptor::default()
            });
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, finer, &[]);
            pass.draw(0..3, 0..1);
        }
    }
}
