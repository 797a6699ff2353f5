//! Vertices that a shader makes itself.

use std::borrow::Cow;

use super::{BlendEquation, BufferOffset, PipelineState, ShaderResource, Stencil};
use crate::command::Cull;
use crate::scene::Blend;

/// Vertices that come from no mesh: the vertex shader makes them from their numbers, and from buffers, columns and
/// resources. For particles, lines of a debugger, or objects that a compute shader has chosen. They are drawn in each
/// of the process's views, whatever the view sees.
///
/// The software backend does not draw them: a frame with one returns an error that names it.
#[derive(Clone, Debug, PartialEq)]
pub struct ProceduralDraws<'a> {
    /// WGSL, appended to [`SHADER_PRELUDE`](super::SHADER_PRELUDE), with the entry point `vertex`, whose inputs are
    /// `@builtin(vertex_index)` and `@builtin(instance_index)`.
    pub shader: &'a str,
    /// The fragment entry point; `None` draws only depth.
    pub fragment: Option<&'a str>,
    /// How many vertices and instances there are.
    pub count: DrawCount,
    /// What the vertices form.
    pub primitive: Primitive,
    /// Which triangles are culled.
    pub cull: Cull,
    /// How they blend with the targets' content.
    pub blend: Blend,
    /// How they mix with each colour target, in the order declared; if empty, as `blend` says.
    pub blend_equations: Vec<BlendEquation>,
    /// Whether depth is written. What is blended writes none, unless there are `blend_equations`.
    pub writes_depth: bool,
    /// The stencil test; `None` for none.
    pub stencil: Option<Stencil>,
    /// How depth is compared and moved, and which channels are written.
    pub pipeline_state: PipelineState,
    /// The bytes of the uniform at `@group(2) @binding(0)`; if empty, there is no such binding.
    pub parameters: Cow<'a, [u8]>,
    /// The engine's own resources that the shader reads.
    pub resources: Vec<ShaderResource<'a>>,
}

impl Default for ProceduralDraws<'_> {
    /// No vertices.
    fn default() -> Self {
        Self {
            shader: "",
            fragment: Some("fragment"),
            count: DrawCount::Count { vertices: 0, instances: 0 },
            primitive: Primitive::Triangles,
            cull: Cull::Back,
            blend: Blend::None,
            blend_equations: Vec::new(),
            writes_depth: true,
            stencil: None,
            pipeline_state: PipelineState::default(),
            parameters: Cow::Borrowed(&[]),
            resources: Vec::new(),
        }
    }
}

/// The number of vertices and instances that are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DrawCount {
    /// Both from 0.
    Count {
        /// The number of vertices of an instance.
        vertices: u32,
        /// The number of instances.
        instances: u32,
    },
    /// Four `u32` in a buffer, which the process [declares](super::Declare::reads_arguments): the number of vertices,
    /// that of instances, the first vertex, and the first instance, which is 0 on devices without
    /// `INDIRECT_FIRST_INSTANCE`.
    Indirect(BufferOffset),
}

impl DrawCount {
    /// The size of the arguments in a buffer.
    pub(super) const ARGUMENT_BYTES: u64 = 16;
}

/// What vertices form.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Primitive {
    /// Three vertices a triangle.
    #[default]
    Triangles,
    /// A triangle for each vertex but the first two, with the two before it.
    TriangleStrip,
    /// Two vertices a line, one pixel wide.
    Lines,
    /// A line for each vertex but the first, from the one before it.
    LineStrip,
    /// A pixel for each vertex.
    Points,
}
