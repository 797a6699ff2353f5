//! The compiled shader of a process.

use super::compile_shader::compile_shader;
use super::pipeline_inputs::PipelineInputs;
use super::pipeline_key::VertexSource;
use super::undeclared_discards::warn_of_undeclared_discards;
use super::unused_bindings::warn_of_unused_bindings;
use crate::backend::BackendError;
use crate::backend::wgpu::resources::BindGroupLayouts;
use crate::process::{Declaration, Draws};

/// The compiled shader of a process, and what all its pipelines have in common. Clones are the same on the device.
#[derive(Clone)]
pub(super) struct CompiledShader {
    pub(super) module: wgpu::ShaderModule,
    pub(super) layout: wgpu::PipelineLayout,
    /// Of a compute shader.
    pub(super) compute: Option<wgpu::ComputePipeline>,
}

impl CompiledShader {
    /// Compiles the shader of a process whose own bind groups, 2 and 3, have these layouts.
    ///
    /// # Errors
    /// If it does not compile.
    pub(super) fn new(
        device: &wgpu::Device,
        layouts: &BindGroupLayouts,
        own: [Option<&wgpu::BindGroupLayout>; 2],
        declaration: &Declaration,
        inputs: &PipelineInputs,
        draws: &Draws<'_>,
    ) -> Result<Self, BackendError> {
        let PipelineInputs { name, key, attributes, .. } = inputs;
        let clamps_corners = !(inputs.has_clamped_pipelines() && inputs.clamps_pixels());
        let before = key.prelude(attributes.iter().map(|attribute| attribute.layout), clamps_corners);
        let module = compile_shader(device, name, &before, &key.own_shaders())?;
        warn_of_unused_bindings(name, declaration, &before, &key.own_shaders());
        warn_of_undeclared_discards(name, draws, &before, &key.own_shaders());
        let groups = [Some(&layouts.frame), Some(&layouts.assets), own[0], own[1]];
        let used = 2 + own.iter().rposition(Option::is_some).map_or(0, |last| last + 1);
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(name),
            bind_group_layouts: &groups[..used],
            immediate_size: 0,
        });
        let compute = (key.vertices == VertexSource::Compute).then(|| {
            device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: None,
                layout: Some(&layout),
                module: &module,
                entry_point: Some("compute"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            })
        });
        Ok(Self { module, layout, compute })
    }
}
