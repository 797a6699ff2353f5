//! The deferred pipeline (L 4) and the processes that it is made of.
//!
//! `pipeline` puts the processes together that a scene requires. Each process has a file, and a folder with its WGSL
//! and its CPU shader. `shading` is what several of their shaders share.

mod deformation;
mod depth_pre_pass;
mod float_sum;
mod geometry_buffer;
mod geometry_formats;
mod light_classes;
mod light_sum;
mod light_tiles;
mod light_volumes;
mod pipeline;
mod shading;
mod shadow_casters;
pub mod targets;
mod transparency;

pub use deformation::Deformation;
pub use depth_pre_pass::DepthPrePass;
use float_sum::FloatSum;
pub use geometry_buffer::GeometryBuffer;
pub use geometry_formats::GeometryFormats;
use light_classes::LightClasses;
use light_sum::LightSum;
pub use light_tiles::LightTiles;
pub use light_volumes::LightVolumes;
pub use pipeline::Deferred;
pub use shading::{COLORED_SURFACE_SHADER, ILLUMINATION_SHADER, SURFACE_SHADER, lighting_shader};
pub use shadow_casters::ShadowCasters;
pub use transparency::Transparency;
