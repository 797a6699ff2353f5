//! Render processes: what an engine adds to a frame, and the processes that come with the crate (L 3.3).
//!
//! A process says which views it draws in, which targets it reads and writes, and what it draws. All of that is data; a
//! backend turns it into pipelines, bundles and passes.
//!
//! - the interface: [`RenderProcess`], [`Declare`], [`Draws`], and, with the feature `software`, `CpuShader`;
//! - [`Pipeline`]: the processes of a frame for what its scene requires;
//! - the plan: [`FramePlan`] orders a frame's processes and lists their targets;
//! - what comes with the crate: the [`Deferred`] pipeline, a file and a folder for each of its processes, and its
//!   post-processing.

mod access;
mod access_error;
mod blend_equation;
mod compute_dispatch;
#[cfg(feature = "software")]
mod cpu_shader;
mod declaration;
mod declare_sampled_views;
mod deferred;
mod draws;
mod face_culling;
mod format;
mod injection_point;
mod item_set_id;
mod items;
mod mip_levels;
mod parameters;
mod pipeline;
mod pipeline_state;
mod plan;
mod post;
mod prelude;
mod procedural_draws;
#[cfg(feature = "wgpu")]
mod raw_access;
#[cfg(feature = "wgpu")]
mod raw_pass;
mod render_process;
mod requirements;
mod sampled_view;
mod shader_resource;
mod stencil;
mod storage_buffer;
mod target;
mod target_size;

pub use access::ClearColor;
pub use access_error::AccessError;
pub use blend_equation::{BlendComponent, BlendEquation, BlendFactor};
pub use compute_dispatch::{ComputeDispatch, Workgroups};
#[cfg(feature = "software")]
pub use cpu_shader::{
    CpuShader, DeformationCpuShader, FullScreenCpuShader, FullScreenPixel, LightCpuShader, MAX_ATTRIBUTES, Materials,
    ObjectCpuShader, ObjectPixel, PassInputs, SampledTexture, ShaderLight, ShaderMaterial, ShaderObject, ShaderView,
    VARYINGS, VertexInput, VertexOutput, bounded_uv, direction_from_octahedral, octahedral_from_direction,
};
use declaration::source_of_previous;
pub use declaration::{Declare, previous_name};
pub use deferred::{
    COLORED_SURFACE_SHADER, Deferred, Deformation, DepthPrePass, GeometryBuffer, GeometryFormats, ILLUMINATION_SHADER,
    LightTiles, LightVolumes, SURFACE_SHADER, ShadowCasters, Transparency, lighting_shader, targets,
};
pub use draws::{CommandDraws, Draws, FullScreen, LightDraws, MaskedEntryPoints};
pub use face_culling::FaceCulling;
pub use format::Format;
pub use injection_point::InjectionPoint;
pub(crate) use item_set_id::ItemSetId;
#[cfg(feature = "wgpu")]
pub(crate) use items::ItemBindGroups;
#[cfg(feature = "wgpu")]
pub use items::{ItemContext, ItemRecorder, RecordItems, RecordItemsInPass};
pub use items::{ItemDraws, ItemOrder, ItemRange, ItemViews, Items};
pub use parameters::Parameters;
pub use pipeline::{DeviceSupport, Pipeline, PipelineProcesses};
pub use pipeline_state::{ColorMask, DepthBias, PipelineState};
pub use plan::PlanError;
pub(crate) use plan::{FramePasses, ProcessId, ViewArray};
pub use plan::{FramePlan, Pass};
pub use post::{Exposure, Fxaa, PostStep, ToneMapping};
pub use prelude::SHADER_PRELUDE;
pub use procedural_draws::{DrawCount, Primitive, ProceduralDraws};
#[cfg(feature = "wgpu")]
pub use raw_pass::{RawPass, RawPassResources};
pub use render_process::RenderProcess;
pub use requirements::{Requirements, SceneContents};
pub use shader_resource::ShaderResource;
pub use stencil::{Comparison, Stencil, StencilOperation};
pub use storage_buffer::{BufferOffset, StorageBuffer};
pub use target::Target;
pub(crate) use target::list_names;
pub use target_size::TargetSize;

pub use crate::unwind::Contained;

#[cfg(feature = "software")]
pub(crate) use cpu_shader::TypedCpuShader;
pub(crate) use internal::*;
#[cfg(feature = "wgpu")]
pub(crate) use prelude::{FIRST_OWN_LOCATION, prelude_with};
#[cfg(feature = "wgpu")]
pub(crate) use raw_access::{RawAccess, RequestLog};

/// The plan of a frame, which a backend reads: for backends, and for the tests of this repository. No part of the
/// interface.
#[doc(hidden)]
pub mod internal {
    pub use super::access::Access;
    pub use super::declaration::{Declaration, DeclaredAttribute};
    pub use super::plan::{AttachmentExtent, PlannedProcess, PlannedTarget, SampledViews, ViewGroup, ViewOrder};
    pub use super::sampled_view::{SampledShape, SampledView};
    pub use super::storage_buffer::{BufferAccess, BufferLayout};
}
