//! Compute shaders.

use std::borrow::Cow;

use super::{BufferOffset, ShaderResource};

/// A compute shader, run once in each of the process's views, or [once a frame](super::Declare::once_a_frame). It
/// samples targets, and reads and changes [buffers](super::StorageBuffer).
///
/// The software backend has no compute shaders: a frame with one returns an error that names it.
#[derive(Clone, Debug, PartialEq)]
pub struct ComputeDispatch<'a> {
    /// WGSL, appended to [`SHADER_PRELUDE`](super::SHADER_PRELUDE), with the entry point `compute`.
    pub shader: &'a str,
    /// How many workgroups run it.
    pub workgroups: Workgroups,
    /// The bytes of the uniform at `@group(2) @binding(0)`; if empty, there is no such binding.
    pub parameters: Cow<'a, [u8]>,
    /// The engine's own resources that the shader reads.
    pub resources: Vec<ShaderResource<'a>>,
}

impl Default for ComputeDispatch<'_> {
    /// One workgroup.
    fn default() -> Self {
        Self {
            shader: "",
            workgroups: Workgroups::Count([1; 3]),
            parameters: Cow::Borrowed(&[]),
            resources: Vec::new(),
        }
    }
}

/// The number of workgroups of a compute shader.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Workgroups {
    /// Along x, y and z.
    Count([u32; 3]),
    /// The same as three `u32` in a buffer, which the process [declares](super::Declare::reads_arguments).
    Indirect(BufferOffset),
}

impl Workgroups {
    /// The size of the arguments in a buffer.
    pub(super) const ARGUMENT_BYTES: u64 = 12;
}
