//! Objects whose vertices the engine's own shader moves, in all processes of the pipeline.

use std::sync::Arc;

use crate::process::{CommandDraws, Contained, Declare, Draws, RenderProcess, ShaderResource};
use crate::scene::LayerMask;

/// Vertex code of the engine's own for some objects: skinning, morph targets, wind. The [deferred
/// pipeline](super::Deferred) draws these objects as it draws others, with their shadows, in processes of their own:
/// `skinning: geometry buffer` and so on.
///
/// The objects' [bounds](crate::scene::SceneRef::bounds) contain what the shader returns: culling knows nothing else of
/// it. Deformed objects do not hide others from occlusion culling. Blended ones are drawn after the blended objects
/// that are not deformed. The pipeline's draw lists depend on layers, so they are made anew in each frame in which an
/// object changes.
///
/// ```
/// use drawloom::process::{Declare, Deferred, Deformation};
/// use drawloom::scene::{LayerMask, VertexAttribute};
///
/// const SWAY: VertexAttribute<f32> = VertexAttribute::new("sway");
/// const PLANTS: LayerMask = LayerMask::layer(3);
///
/// struct Wind;
///
/// impl Deformation for Wind {
///     fn name(&self) -> &str {
///         "wind"
///     }
///
///     fn layers(&self) -> LayerMask {
///         PLANTS
///     }
///
///     fn declare(&self, declare: &mut Declare) {
///         declare.reads_attribute(SWAY, 0.0);
///     }
///
///     fn shader(&self) -> &str {
///         "
///             fn deform(in: VertexInput, object: Object) -> VertexInput {
///                 var out = in;
///                 out.position.x += in.sway;
///                 return out;
///             }
///         "
///     }
/// }
///
/// let pipeline = Deferred::to_picture().deformation(Wind);
/// assert!(pipeline.names().contains(&"wind: shadow casters".to_owned()));
/// ```
pub trait Deformation: Send + Sync {
    /// Its name, with which the names of its processes begin.
    fn name(&self) -> &str;

    /// The objects that it deforms: those that belong to one of these layers, and to none of the deformations that were
    /// added earlier. No other process of the pipeline draws them. Objects without layers of their own belong to all
    /// layers, and so to these. Called when a plan is made.
    fn layers(&self) -> LayerMask;

    /// Declares the [attributes](Declare::reads_attribute) and the [columns](Declare::reads_column) that its shader
    /// reads. Called for each process that draws its objects.
    fn declare(&self, declare: &mut Declare);

    /// WGSL with the function `deform`: see [`CommandDraws::deformation`].
    fn shader(&self) -> &str;

    /// The engine's own resources that its shader reads, such as palettes of joints, at `@group(3)`: the first has the
    /// binding `FIRST_RESOURCE` in each process, the others follow.
    fn resources(&self) -> Vec<ShaderResource<'_>> {
        Vec::new()
    }

    /// What the software backend runs: a process's own CPU shader, after the deformation, as
    /// `Some(process.deformed(…))`. Without it, frames return an error on that backend.
    #[cfg(feature = "software")]
    fn cpu_shader(&self, process: crate::process::CpuShader) -> Option<crate::process::CpuShader> {
        let _ = process;
        None
    }
}

/// A deformation that an engine keeps a handle to, in order to change what it does.
impl<D: Deformation + ?Sized> Deformation for Arc<D> {
    fn name(&self) -> &str {
        (**self).name()
    }

    fn layers(&self) -> LayerMask {
        (**self).layers()
    }

    fn declare(&self, declare: &mut Declare) {
        (**self).declare(declare);
    }

    fn shader(&self) -> &str {
        (**self).shader()
    }

    fn resources(&self) -> Vec<ShaderResource<'_>> {
        (**self).resources()
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self, process: crate::process::CpuShader) -> Option<crate::process::CpuShader> {
        (**self).cpu_shader(process)
    }
}

/// A deformation of the engine's, whose destructor may panic.
impl<D: Deformation> Deformation for Contained<D> {
    fn name(&self) -> &str {
        (**self).name()
    }

    fn layers(&self) -> LayerMask {
        (**self).layers()
    }

    fn declare(&self, declare: &mut Declare) {
        (**self).declare(declare);
    }

    fn shader(&self) -> &str {
        (**self).shader()
    }

    fn resources(&self) -> Vec<ShaderResource<'_>> {
        (**self).resources()
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self, process: crate::process::CpuShader) -> Option<crate::process::CpuShader> {
        (**self).cpu_shader(process)
    }
}

/// Splits what each of these processes draws: processes of the same names for the objects that are not deformed, then
/// one for each process and deformation.
pub(super) fn split_by_deformation(
    processes: Vec<Arc<dyn RenderProcess>>,
    deformations: &[Arc<dyn Deformation>],
) -> Vec<Arc<dyn RenderProcess>> {
    if deformations.is_empty() {
        return processes;
    }
    let mut deformed: Vec<Arc<dyn RenderProcess>> = Vec::new();
    let mut earlier = LayerMask::NONE;
    for deformation in deformations {
        // Read once: what this process draws, the others leave out.
        let layers = deformation.layers();
        for process in &processes {
            deformed.push(Arc::new(Deformed {
                name: prefix_of(&**deformation) + process.name(),
                process: Arc::clone(process),
                deformation: Arc::clone(deformation),
                layers,
                excluded: earlier,
            }));
        }
        earlier = earlier | layers;
    }
    processes.into_iter().map(|process| undeformed(process, deformations)).chain(deformed).collect()
}

/// A process without the objects of any of these deformations.
pub(super) fn undeformed(
    process: Arc<dyn RenderProcess>,
    deformations: &[Arc<dyn Deformation>],
) -> Arc<dyn RenderProcess> {
    let layers = deformations.iter().map(|deformation| deformation.layers());
    let excluded = layers.fold(LayerMask::NONE, |all, layers| all | layers);
    if excluded == LayerMask::NONE { process } else { Arc::new(Undeformed { process, excluded }) }
}

/// The name of the process that a process of this name is for the objects of a deformation; `None` if it is not for
/// these.
pub(super) fn undeformed_name<'a>(deformation: &dyn Deformation, name: &'a str) -> Option<&'a str> {
    name.strip_prefix(&prefix_of(deformation))
}

/// What the names of a deformation's processes begin with.
fn prefix_of(deformation: &dyn Deformation) -> String {
    format!("{}: ", deformation.name())
}

/// A process without the objects of some layers.
struct Undeformed {
    process: Arc<dyn RenderProcess>,
    excluded: LayerMask,
}

impl RenderProcess for Undeformed {
    fn name(&self) -> &str {
        self.process.name()
    }

    fn declare(&self, declare: &mut Declare) {
        self.process.declare(declare);
    }

    fn draws(&self) -> Draws<'_> {
        match self.process.draws() {
            Draws::Commands(draws) => {
                let selection = draws.selection.not_in_layers(self.excluded);
                Draws::Commands(CommandDraws { selection, ..draws })
            }
            other => other,
        }
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<crate::process::CpuShader> {
        self.process.cpu_shader()
    }
}

/// A process with the objects of a deformation, over what the process itself draws.
struct Deformed {
    name: String,
    process: Arc<dyn RenderProcess>,
    deformation: Arc<dyn Deformation>,
    layers: LayerMask,
    excluded: LayerMask,
}

impl RenderProcess for Deformed {
    fn name(&self) -> &str {
        &self.name
    }

    fn declare(&self, declare: &mut Declare) {
        self.process.declare(declare);
        declare.without_clears();
        self.deformation.declare(declare);
    }

    fn draws(&self) -> Draws<'_> {
        match self.process.draws() {
            Draws::Commands(draws) => {
                let selection = draws.selection.in_layers(self.layers).not_in_layers(self.excluded);
                let (deformation, resources) = (Some(self.deformation.shader()), self.deformation.resources());
                Draws::Commands(CommandDraws { selection, deformation, resources, ..draws })
            }
            other => other,
        }
    }

    #[cfg(feature = "software")]
    fn cpu_shader(&self) -> Option<crate::process::CpuShader> {
        self.deformation.cpu_shader(self.process.cpu_shader()?)
    }
}
