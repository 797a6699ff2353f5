//! CPU shaders: Rust versions of the WGSL shaders, which the software backend runs in their place.
//!
//! `interface` has what a process implements, `inputs` what it is given, `prelude` the functions of `drawloom.wgsl`,
//! `built_in` those of WGSL itself, `level_sampling` how mip levels are sampled, and `deformation` what moves vertices
//! before a shader gets them.

pub(super) mod built_in;
mod deformation;
mod inputs;
mod interface;
mod level_sampling;
mod prelude;
#[cfg(test)]
pub(super) mod test_inputs;

pub use deformation::DeformationCpuShader;
pub use inputs::{
    FullScreenPixel, MAX_ATTRIBUTES, Materials, ObjectPixel, PassInputs, SampledTexture, ShaderLight, ShaderMaterial,
    ShaderObject, ShaderView, VARYINGS, VertexInput, VertexOutput,
};
pub use interface::{CpuShader, FullScreenCpuShader, LightCpuShader, ObjectCpuShader};
pub use prelude::{bounded_uv, direction_from_octahedral, octahedral_from_direction};

pub(crate) use interface::TypedCpuShader;
