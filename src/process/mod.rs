//! Render processes: what an engine adds to the graph, and the ones that come with the crate (L 3.3).
//!
//! A process says which views it is for, which targets it reads and writes, and what it draws. Everything it says is data;
//! a backend turns it into pipelines, bundles and passes.

mod declare;
mod deferred;
mod depth_pre_pass;
mod draws;
mod error;
mod format;
mod geometry_buffer;
#[cfg(feature = "wgpu")]
mod light_volume;
mod light_volumes;
mod plan;
mod planned_target;
mod post;
#[cfg(feature = "wgpu")]
mod raw_pass;
mod render_process;
mod requirements;
mod shadow;
mod shadow_casters;
mod transparency;

pub use declare::{Access, ClearColor, Declaration, Declare};
pub use deferred::Deferred;
pub use depth_pre_pass::DepthPrePass;
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

#[cfg(feature = "wgpu")]
pub(crate) use light_volume::LightVolume;
