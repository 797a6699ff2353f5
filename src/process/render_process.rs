//! What an engine implements to add a step to its frames.

use std::sync::Arc;

use super::{Declare, Draws};
use crate::unwind::Contained;

/// A step of a frame, from the objects that a view sees to a recorded pass (L 3.3).
///
/// A process draws once in each view of its kind, or [once a frame](Declare::once_a_frame). All workers share it while
/// a frame is recorded, so it keeps what changes over frames behind a lock or in an atomic.
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
    /// Its name in errors, reports and the graph, unique among the processes of a frame.
    fn name(&self) -> &str;

    /// Declares the views that it draws in, and what it reads and writes. Called once for every plan that it is part
    /// of: when the renderer is built or gets another pipeline or quality, and when a scene requires other processes
    /// beside it.
    fn declare(&self, declare: &mut Declare);

    /// What it draws. Called once per frame, and by
    /// [`Renderer::prepare_pipelines`](crate::Renderer::prepare_pipelines), in the background also beside a frame: so a
    /// call should change nothing. The result may change: new parameters cost nothing, another shader or blending needs
    /// new pipelines.
    fn draws(&self) -> Draws<'_>;

    /// What the software backend runs in place of the process's WGSL. Without one, frames with this process return an
    /// error on that backend. Called once per frame, by the software backend only.
    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<super::CpuShader> {
        None
    }
}

/// A process that an engine keeps a handle to, in order to change what it draws.
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

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<super::CpuShader> {
        (**self).cpu_shader()
    }
}

/// A process of the engine's, whose destructor may panic.
impl<P: RenderProcess> RenderProcess for Contained<P> {
    fn name(&self) -> &str {
        (**self).name()
    }

    fn declare(&self, declare: &mut Declare) {
        (**self).declare(declare);
    }

    fn draws(&self) -> Draws<'_> {
        (**self).draws()
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<super::CpuShader> {
        (**self).cpu_shader()
    }
}
