//! The compiled shader of a process.

use super::compile_shader::{compile_shader, complete_text, shader_label};
use super::pipeline_inputs::PipelineInputs;
use super::pipeline_key::VertexSource;
use super::shared_pipelines::{SharedComputePipeline, SharedGroupLayout, SharedLayout, SharedModule, SharedPipelines};
use super::undeclared_discards::warn_of_undeclared_discards;
use super::unused_bindings::warn_of_unused_bindings;
use crate::backend::BackendError;
use crate::backend::wgpu::resources::BindGroupLayouts;
use crate::process::{Declaration, Draws};

/// The compiled shader of a process, and what all its pipelines have in common.
pub(super) struct CompiledShader {
    pub(super) module: SharedModule,
    pub(super) layout: SharedLayout,
    /// Of a compute shader.
    pub(super) compute: Option<SharedComputePipeline>,
}

impl CompiledShader {
    /// Compiles the shader of a process whose own bind groups, 2 and 3, have these layouts, unless it is compiled
    /// already.
    ///
    /// # Errors
    /// If it does not compile.
    pub(super) fn new(
        device: &wgpu::Device,
        (shared, layouts): (&SharedPipelines, &BindGroupLayouts),
        own: [Option<&SharedGroupLayout>; 2],
        declaration: &Declaration,
        inputs: &PipelineInputs,
        draws: &Draws<'_>,
    ) -> Result<Self, BackendError> {
        let PipelineInputs { name, key, attributes, .. } = inputs;
        let clamps_corners = !(inputs.has_clamped_pipelines() && inputs.clamps_pixels());
        let attributes = attributes.iter().map(|attribute| attribute.layout);
        let before = key.prelude(attributes, inputs.array_count, clamps_corners);
        let shaders = key.own_shaders();
        let compile = |complete: &str| compile_shader(device, name, complete, &before, &shaders);
        let module = shared.module(complete_text(&before, &shaders), compile)?;
        warn_of_unused_bindings(name, declaration, &before, &shaders);
        warn_of_undeclared_discards(name, draws, &before, &shaders);
        let (label, own) =
            (shader_label(name), own.map(|layout| layout.map(|layout| wgpu::BindGroupLayout::clone(layout))));
        let layout = shared.layout(device, &label, layouts, own)?;
        let is_compute = key.vertices == VertexSource::Compute;
        let compute = is_compute.then(|| shared.compute_pipeline(device, &label, &layout, &module)).transpose()?;
        Ok(Self { module, layout, compute })
    }
}
