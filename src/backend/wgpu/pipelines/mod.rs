//! The pipelines and bind groups of render processes.

mod attachment_formats;
mod binding_limits;
mod compile_shader;
mod compiled_shader;
mod interner;
mod pipeline_cache;
mod pipeline_inputs;
mod pipeline_key;
mod pipeline_variant;
mod process_pipelines;
mod shared_pipelines;
mod undeclared_discards;
mod unused_bindings;
mod vertex_buffers;

pub(crate) use compile_shader::shader_label;
pub(crate) use pipeline_cache::{PipelineCache, pipeline_count};
pub(crate) use pipeline_key::fixed_state;
pub(crate) use pipeline_variant::PipelineVariant;
pub(crate) use process_pipelines::ProcessPipelines;
pub(crate) use shared_pipelines::{SharedPipelines, SharedRenderPipeline};
