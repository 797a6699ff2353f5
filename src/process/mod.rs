//! Render processes: what an engine adds to the graph, and the ones that come with the crate (L 3.3).
//!
//! A process says which views it is for, which targets it reads and writes, and what it draws. Everything it says is data;
//! a backend turns it into pipelines, bundles and passes.

mod built_in;
mod declare;
mod deferred;
mod depth_pre_pass;
mod depth_pre_pass_twin;
mod drawloom_twin;
mod draws;
mod error;
mod format;
mod geometry_buffer;
mod geometry_buffer_twin;
mod illumination_twin;
#[cfg(feature = "wgpu")]
mod light_volume;
mod light_volumes;
mod light_volumes_twin;
mod plan;
mod planned_target;
mod post;
#[cfg(feature = "wgpu")]
mod raw_pass;
mod render_process;
mod requirements;
mod shadow;
mod shadow_casters;
mod shadow_map_twin;
mod shadow_twin;
mod stored_normal;
mod surface_twin;
mod transparency;
mod transparency_twin;
mod twin;
#[cfg(all(test, not(drawloom_loom)))]
mod twin_samples;

pub use declare::{Access, ClearColor, Declaration, Declare};
pub use deferred::Deferred;
pub use depth_pre_pass::DepthPrePass;
pub use drawloom_twin::{direction_from_octahedral, octahedral_from_direction};
pub use draws::{CommandDraws, Draws, FullScreen, LightDraws};
pub use error::{PlanError, ProcessError};
pub use format::Format;
pub use geometry_buffer::{GeometryBuffer, GeometryFormats};
pub use light_volumes::LightVolumes;
pub use plan::{FramePlan, Pass, Place, PlannedProcess};
pub use planned_target::PlannedTarget;
pub use post::{Exposure, Fxaa, PostStep, ToneMapping};
#[cfg(feature = "wgpu")]
pub use raw_pass::{RawPass, Resolved};
pub use render_process::{RenderProcess, SHADER_PRELUDE};
pub use requirements::Requirements;
pub use shadow_casters::ShadowCasters;
pub use transparency::Transparency;
pub use twin::{
    Corner, FullScreenPixel, FullScreenTwin, LightTwin, LightValues, MaterialValues, Materials, ObjectPixel,
    ObjectTwin, ObjectValues, PassValues, Sampled, Twin, VARYINGS, VertexValues, ViewValues,
};

pub(crate) use twin::TwinShader;

#[cfg(feature = "wgpu")]
pub(crate) use light_volume::LightVolume;
