//! What an engine implements so that its frames have the processes that their scenes require.

use std::sync::Arc;

use super::{Format, InjectionPoint, PlanError, RenderProcess, Requirements, SceneContents};
use crate::quality::Quality;
use crate::scene::ViewKind;
use crate::unwind::Contained;
use crate::view::ShadowMaps;

/// The processes of frames, for what each scene requires. [`Deferred`](super::Deferred) is one; an engine that draws in
/// another way implements its own. A renderer has at most one, beside the processes that the engine
/// [adds](crate::RendererBuilder::process).
///
/// In each frame the pipeline is asked what the scene requires. If no frame before required the same, it is asked for
/// the processes, and these are ordered by what they read and write. Pipelines of the device are shared by all frames.
///
/// A call that panics is an error of the frame or of what the engine called, and the next frame is not affected. Apart
/// from [`Self::requirements`], calls with equal arguments return the same: what a pipeline changes its mind about
/// belongs to its requirements, or it is [replaced](crate::Renderer::set_pipeline).
///
/// ```
/// # use drawloom::process::{ClearColor, CommandDraws, Declare, Draws, Format, RenderProcess};
/// use drawloom::process::{DeviceSupport, Pipeline, PipelineProcesses, PlanError, Requirements};
///
/// # struct Opaque;
/// # impl RenderProcess for Opaque {
/// #     fn name(&self) -> &str {
/// #         "opaque"
/// #     }
/// #     fn declare(&self, declare: &mut Declare) {
/// #         declare.clears_color("picture", Format::Rgba8Srgb, ClearColor::Background);
/// #         declare.clears_depth("depth", Format::Depth32Float);
/// #     }
/// #     fn draws(&self) -> Draws<'_> {
/// #         Draws::Commands(CommandDraws::default())
/// #     }
/// # }
/// # struct Blended;
/// # impl RenderProcess for Blended {
/// #     fn name(&self) -> &str {
/// #         "blended"
/// #     }
/// #     fn declare(&self, declare: &mut Declare) {
/// #         declare.draws_over("picture");
/// #         declare.tests_depth("depth");
/// #     }
/// #     fn draws(&self) -> Draws<'_> {
/// #         Draws::Commands(CommandDraws::default())
/// #     }
/// # }
/// /// Draws blended objects in a process of their own, in frames that have some.
/// struct Forward;
///
/// impl Pipeline for Forward {
///     fn build(
///         &self,
///         requirements: &Requirements,
///         _: DeviceSupport,
///         processes: &mut PipelineProcesses,
///     ) -> Result<(), PlanError> {
///         processes.process(Opaque);
///         match requirements.transparency() {
///             true => processes.process(Blended),
///             false => processes.absent("blended"),
///         }
///         processes.output("picture");
///         Ok(())
///     }
/// }
/// # use drawloom::{Renderer, backend::NullBackend, task::Scheduler};
/// let scheduler = std::sync::Arc::new(Scheduler::new(1)?);
/// let (renderer, _) = Renderer::builder(NullBackend).pipeline(Forward).build(scheduler)?;
/// assert_eq!(renderer.plan().processes().len(), 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait Pipeline: Send + Sync {
    /// What a frame of this scene requires. Called once a frame, when pipelines are
    /// [prepared](crate::Renderer::prepare_pipelines), and for [an empty scene](SceneContents::EMPTY) whenever the
    /// renderer's processes, outputs or quality change. Kinds of views of the scene's cameras are required in any case.
    fn requirements(&self, scene: &SceneContents<'_>) -> Requirements {
        Requirements::of(scene, self.shadow_maps().is_some())
    }

    /// Adds the processes and outputs of frames with these requirements.
    ///
    /// # Errors
    /// If there is no such frame.
    fn build(
        &self,
        requirements: &Requirements,
        device: DeviceSupport,
        processes: &mut PipelineProcesses,
    ) -> Result<(), PlanError>;

    /// # Errors
    /// If a setting of the pipeline is invalid. Called when a renderer gets the pipeline, and whenever its processes,
    /// outputs or quality change.
    fn check(&self) -> Result<(), PlanError> {
        Ok(())
    }

    /// What every frame requires, whatever its scene. Called as [`check`](Self::check) is, and for another backend.
    fn kept(&self, device: DeviceSupport) -> Requirements {
        let _ = device;
        Requirements::default()
    }

    /// How shadow maps are drawn; `None`, the default, if no light casts shadows. Otherwise lights that cast shadows
    /// have [classes](crate::view::LightClass) of their own. Called as [`check`](Self::check) is, and in each frame by
    /// [`requirements`](Self::requirements) unless that is the pipeline's own.
    fn shadow_maps(&self) -> Option<ShadowMaps> {
        None
    }

    /// The pipeline for frames of a quality; `None`, the default, for this one itself.
    fn with_quality(&self, quality: &Quality) -> Option<Arc<dyn Pipeline>> {
        let _ = quality;
        None
    }

    /// Requirements whose plans together have every shader that a plan may have, for
    /// [`prepare_pipelines`](crate::Renderer::prepare_pipelines). The first of them requires everything: whoever gives
    /// a renderer the pipeline hears of errors in that plan. The default is [`Requirements::all`].
    fn to_prepare(&self) -> Vec<Requirements> {
        vec![Requirements::all()]
    }

    /// Whether blended objects are added in half floats only because the device cannot blend floats: then one is
    /// [counted](crate::view::IssueReason::HalfFloatBlending). Called as [`check`](Self::check) is, and for another
    /// backend.
    fn lacks_float_blending(&self, device: DeviceSupport) -> bool {
        let _ = device;
        false
    }
}

/// A pipeline that an engine keeps a handle to, in order to change what it requires.
impl<P: Pipeline + ?Sized> Pipeline for Arc<P> {
    fn requirements(&self, scene: &SceneContents<'_>) -> Requirements {
        (**self).requirements(scene)
    }

    fn build(
        &self,
        requirements: &Requirements,
        device: DeviceSupport,
        processes: &mut PipelineProcesses,
    ) -> Result<(), PlanError> {
        (**self).build(requirements, device, processes)
    }

    fn check(&self) -> Result<(), PlanError> {
        (**self).check()
    }

    fn kept(&self, device: DeviceSupport) -> Requirements {
        (**self).kept(device)
    }

    fn shadow_maps(&self) -> Option<ShadowMaps> {
        (**self).shadow_maps()
    }

    fn with_quality(&self, quality: &Quality) -> Option<Arc<dyn Pipeline>> {
        (**self).with_quality(quality)
    }

    fn to_prepare(&self) -> Vec<Requirements> {
        (**self).to_prepare()
    }

    fn lacks_float_blending(&self, device: DeviceSupport) -> bool {
        (**self).lacks_float_blending(device)
    }
}

/// What a pipeline needs to know of the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct DeviceSupport {
    /// Whether the backend can [blend floats](crate::backend::BackendExtras::can_blend_floats).
    pub float_blending: bool,
}

impl DeviceSupport {
    pub(crate) fn new(float_blending: bool) -> Self {
        Self { float_blending }
    }
}

/// The processes and outputs of a pipeline's frame, in slots whose order is known.
///
/// Of two processes in slots that use one target, of which the earlier one writes it, the earlier one goes first: also
/// where reads and writes leave the order open, as of processes that draw over one target. A slot may be empty because
/// the scene does not require its process; the engine's own processes can be ordered
/// [after](super::Declare::after) and [before](super::Declare::before) it all the same. Processes in slots draw in
/// [reflections](ViewKind::Reflection) what they draw in main views, as far as others sample it.
#[derive(Default)]
pub struct PipelineProcesses {
    pub(in crate::process) slots: Vec<Slot>,
    pub(in crate::process) absent_layers: Vec<AbsentLayers>,
    pub(in crate::process) outputs: Vec<String>,
}

impl PipelineProcesses {
    /// Adds a process, in a slot of its name.
    pub fn process(&mut self, process: impl RenderProcess + 'static) {
        let process = Contained::new(process);
        let name = process.name().to_owned();
        self.slots.push(Slot { process: Some(Arc::new(process)), ..Slot::empty(name) });
    }

    /// Adds a process of the engine's in the slot of the process whose place it takes. The targets that it names are
    /// checked even if no output depends on it.
    pub fn process_in(&mut self, slot: impl Into<String>, process: impl RenderProcess + 'static) {
        let process: Arc<dyn RenderProcess> = Arc::new(Contained::new(process));
        self.slots.push(Slot { process: Some(process), is_replacement: true, ..Slot::empty(slot.into()) });
    }

    /// Adds an empty slot: the frame has no process of this name, and another frame may have it.
    pub fn absent(&mut self, name: impl Into<String>) {
        self.slots.push(Slot::empty(name.into()));
    }

    /// Adds a place for processes of the engine's, which come after all slots before it and before those behind it.
    pub fn injection_point(&mut self, point: InjectionPoint) {
        point.slots().into_iter().for_each(|name| self.absent(name));
    }

    /// Keeps the processes in the slots of this name that are there so far, although no output depends on them.
    pub fn keep(&mut self, name: &str) {
        self.slots.iter_mut().filter(|slot| slot.name == name).for_each(|slot| slot.keep = true);
    }

    /// Names a target in layers that no process of this frame draws, and another frame's may. A process that
    /// [samples](super::Declare::samples_layers) it finds one layer of zeros.
    pub fn absent_layers(&mut self, views: ViewKind, target: impl AsRef<str>, format: Format) {
        self.absent_layers.push(AbsentLayers { views, target: target.as_ref().to_owned(), format });
    }

    /// Names an output. Processes that lead to no output are dropped.
    pub fn output(&mut self, target: impl AsRef<str>) {
        self.outputs.push(target.as_ref().to_owned());
    }
}

/// A slot for a process.
pub(in crate::process) struct Slot {
    /// The name that others know the slot by, also if its process has another one.
    pub(in crate::process) name: String,
    /// `None` if the frame has no process there.
    pub(in crate::process) process: Option<Arc<dyn RenderProcess>>,
    /// Whether the process stays although no output depends on it.
    pub(in crate::process) keep: bool,
    /// Whether the process takes the place of one of the pipeline's own.
    pub(in crate::process) is_replacement: bool,
}

impl Slot {
    fn empty(name: String) -> Self {
        Self { name, process: None, keep: false, is_replacement: false }
    }
}

/// See [`PipelineProcesses::absent_layers`].
pub(in crate::process) struct AbsentLayers {
    pub(in crate::process) views: ViewKind,
    pub(in crate::process) target: String,
    pub(in crate::process) format: Format,
}
