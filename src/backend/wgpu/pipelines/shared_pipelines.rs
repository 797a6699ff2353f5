//! Compiled shaders and pipelines that several backends share.

use std::collections::HashMap;
use std::sync::Arc;

use parking_lot::Mutex;

use super::compiled_shader::CompiledShader;
use super::pipeline_inputs::PipelineInputs;
use super::pipeline_variant::PipelineVariant;

/// The compiled shaders and pipelines of several backends, in the order in which they were compiled. Clones are the
/// same library.
#[derive(Clone, Default)]
pub(crate) struct SharedPipelines(Arc<Mutex<Vec<SharedProcess>>>);

struct SharedProcess {
    inputs: PipelineInputs,
    shader: CompiledShader,
    pipelines: HashMap<PipelineVariant, wgpu::RenderPipeline>,
}

impl SharedPipelines {
    /// The compiled shader of a process.
    pub(super) fn shader(&self, inputs: &PipelineInputs) -> Option<CompiledShader> {
        let processes = self.0.lock();
        processes.iter().find(|process| process.inputs == *inputs).map(|process| process.shader.clone())
    }

    /// A pipeline of a process.
    pub(super) fn pipeline(&self, inputs: &PipelineInputs, variant: &PipelineVariant) -> Option<wgpu::RenderPipeline> {
        let processes = self.0.lock();
        processes.iter().find(|process| process.inputs == *inputs)?.pipelines.get(variant).cloned()
    }

    /// Adds what the device has accepted. Pipelines that another backend has added meanwhile are not replaced.
    pub(super) fn add(
        &self,
        inputs: &PipelineInputs,
        shader: &CompiledShader,
        pipelines: &HashMap<PipelineVariant, wgpu::RenderPipeline>,
    ) {
        let mut processes = self.0.lock();
        let index = processes.iter().position(|process| process.inputs == *inputs).unwrap_or_else(|| {
            let (inputs, shader) = (inputs.clone(), shader.clone());
            processes.push(SharedProcess { inputs, shader, pipelines: HashMap::new() });
            processes.len() - 1
        });
        for (variant, pipeline) in pipelines {
            processes[index].pipelines.entry(variant.clone()).or_insert_with(|| pipeline.clone());
        }
    }

    pub(crate) fn clear(&self) {
        self.0.lock().clear();
    }

    /// The number of pipelines.
    pub(crate) fn pipeline_count(&self) -> usize {
        self.0
            .lock()
            .iter()
            .map(|process| process.pipelines.len() + usize::from(process.shader.compute.is_some()))
            .sum()
    }
}
