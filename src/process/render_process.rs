//! What an engine writes to add a step to its frames.

use std::sync::Arc;

use super::{CpuShader, Declare, Draws};

/// A step of the frame: it owns its trip from the objects a view sees to a recorded pass.
///
/// A process draws once in each view of its kind. It is shared by all workers while a frame is recorded, so what changes
/// from frame to frame is behind a lock or an atomic of its own.
///
/// ```
/// use drawloom::process::{ClearColor, CommandDraws, Declare, Draws, Format, RenderProcess};
///
/// /// Draws the depth of everything, with the engine's own shader.
/// struct DepthOnly;
///
/// impl RenderProcess for DepthOnly {
///     fn name(&self) -> &str {
///         "depth only"
///     }
///
///     fn declare(&self, declare: &mut Declare) {
///         declare.clears_depth("depth", Format::Depth32Float);
///     }
///
///     fn draws(&self) -> Draws<'_> {
///         Draws::Commands(CommandDraws {
///             shader: "
///                 @vertex
///                 fn vertex(in: VertexInput) -> @builtin(position) vec4<f32> {
///                     let object = drawn_object(in.instance);
///                     return clip_position(relative_position(object, in.position));
///                 }
///             ",
///             fragment: None,
///             ..CommandDraws::default()
///         })
///     }
/// }
/// ```
pub trait RenderProcess: Send + Sync {
    /// What it is called in errors, reports and the graph; no two processes of a graph share a name.
    fn name(&self) -> &str;

    /// Says which views it is for, and what it reads and writes. Asked once for every plan that it becomes part of:
    /// when the renderer is built, and when a scene requires other processes beside it.
    fn declare(&self, declare: &mut Declare);

    /// Says what it draws. Asked once a frame, and may change: new parameters cost nothing, another shader or blending
    /// makes new pipelines.
    fn draws(&self) -> Draws<'_>;

    /// What the software backend runs in the place of the process's WGSL; without one, frames with this process fail there, and
    /// say so. Asked once a frame, by that backend alone.
    fn cpu_shader(&self) -> Option<CpuShader> {
        None
    }
}

/// A process that an engine keeps a hold of, to change what it draws from frame to frame.
impl<P: RenderProcess + ?Sized> RenderProcess for Arc<P> {
    fn name(&self) -> &str {
        (**self).name()
    }

    fn declare(&self, declare: &mut Declare) {
        (**self).declare(declare);
    }

    fn draws(&self) -> Draws<'_> {
        (**self).draws()
    }

    fn cpu_shader(&self) -> Option<CpuShader> {
        (**self).cpu_shader()
    }
}
