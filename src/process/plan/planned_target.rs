//! The targets that a plan's processes use.

use std::borrow::Cow;

use super::mip_levels::{check_mip_levels, created_targets, mip_levels_error};
use super::resource_names::views_of_output;
use super::{PlanError, PlannedProcess};
use crate::process::{
    Access, BlendEquation, Declaration, Draws, Format, PipelineProcesses, TargetSize, list_names, previous_name,
};
use crate::scene::{Blend, ViewKind};

/// A target that each view of one kind has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlannedTarget {
    /// Its name.
    pub name: String,
    /// The kind of view.
    pub views: ViewKind,
    /// Its format.
    pub format: Format,
    /// Whether a raw pass may write it as a storage texture.
    pub stored: bool,
    /// Whether all views of the kind share it: one texture array, a layer for each view.
    pub layered: bool,
    /// Its size.
    pub size: TargetSize,
    /// Whether it is [multisampled](crate::process::Declare::multisampled).
    pub multisampled: bool,
    /// Whether it has [mip levels](crate::process::Declare::mipmapped).
    pub mipmapped: bool,
    /// Whether it is an output of the frame: of a pipeline, or [named](crate::RendererBuilder::output) by the engine.
    /// Targets of reflections are none where main views have the same one.
    pub output: bool,
    /// The target whose content is copied here at the end of each frame; `None` for one that processes write.
    pub copy_of: Option<String>,
}

/// The size and the number of samples that all targets of a process share.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AttachmentExtent {
    /// Their size.
    pub size: TargetSize,
    /// Whether they are [multisampled](crate::process::Declare::multisampled).
    pub multisampled: bool,
}

impl AttachmentExtent {
    /// The size of the picture, one sample per pixel.
    pub const PICTURE: Self = Self { size: TargetSize::Picture, multisampled: false };
}

/// The targets of all processes, in the order in which they are first written, then the copies of those whose history
/// is read. `outputs` are the names of the frame's outputs.
///
/// # Errors
/// If processes disagree about a target's format, layers, size or mip levels, give mip levels to one that cannot have
/// them, use depth as colour or colour as depth, draw into targets of different sizes or numbers of samples, resolve
/// one that cannot be resolved, or read the history of a target that is not written, is multisampled or is drawn in
/// layers.
pub(super) fn targets_of(processes: &[PlannedProcess], outputs: &[String]) -> Result<Vec<PlannedTarget>, PlanError> {
    let mut targets = written_targets(processes)?;
    for (planned, name, access) in accesses(processes) {
        let views = access.views(planned.declaration.views);
        let Some(known) = targets.iter_mut().find(|known| known.name == *name && known.views == views) else {
            continue;
        };
        let process = || planned.name.clone();
        known.stored |=
            matches!(access, Access::Write(_) | Access::Change) && known.format.can_be_stored() && !known.multisampled;
        if access.is_depth() && !known.format.is_depth_stencil() || access.is_color() && known.format.is_depth_stencil()
        {
            return Err(PlanError::WrongFormat { process: process(), target: name.clone(), format: known.format });
        }
        let tests_depth_only = matches!(access, Access::TestDepth | Access::MatchDepth);
        let tests_stencil_only = matches!(access, Access::MarkStencil | Access::TestStencil);
        if tests_depth_only && !known.format.has_depth() || tests_stencil_only && !known.format.has_stencil() {
            return Err(PlanError::WrongFormat { process: process(), target: name.clone(), format: known.format });
        }
        if matches!(access, Access::SampleLayers(_)) && !known.layered {
            return Err(PlanError::LayeringMismatch { process: process(), target: name.clone() });
        }
    }
    processes.iter().try_for_each(|planned| check_attachments(planned, &targets))?;
    check_once_a_frame(processes)?;
    for output in outputs {
        let kinds = views_of_output(processes.iter(), output);
        let named = targets.iter_mut().filter(|target| target.name == *output && kinds.contains(&target.views));
        named.for_each(|target| target.output = true);
    }
    let copies = copied_targets(processes, &targets)?;
    targets.extend(copies);
    Ok(targets)
}

fn written_targets(processes: &[PlannedProcess]) -> Result<Vec<PlannedTarget>, PlanError> {
    let mut targets: Vec<PlannedTarget> = Vec::new();
    processes.iter().try_for_each(check_declared_targets)?;
    for (planned, name, access) in accesses(processes) {
        let Some(created) = created_target(planned, name, access) else { continue };
        match targets.iter().find(|known| known.name == created.name && known.views == created.views) {
            Some(known) if known.format != created.format => {
                return Err(PlanError::ConflictingFormats {
                    target: created.name,
                    first: known.format,
                    second: created.format,
                });
            }
            Some(known) if known.layered != created.layered => {
                return Err(PlanError::LayeringMismatch { process: planned.name.clone(), target: created.name });
            }
            Some(known) if known.multisampled != created.multisampled => {
                let problem = "another process creates it with another number of samples";
                return Err(multisampling_error(planned, name, problem));
            }
            Some(known) if known.mipmapped != created.mipmapped => {
                let problem = if created.mipmapped {
                    "another process creates it without them"
                } else {
                    "another process creates it with them"
                };
                return Err(mip_levels_error(planned, name, problem));
            }
            Some(known) if known.size != created.size => {
                let (first, second) = (known.size, created.size);
                return Err(PlanError::ConflictingSizes { target: created.name, first, second });
            }
            Some(_) => {}
            None => targets.push(created),
        }
    }
    Ok(targets)
}

/// # Errors
/// If a process sets the size, the samples or the mip levels of a target wrongly, or of one that it does not create.
pub(super) fn check_declared_targets(planned: &PlannedProcess) -> Result<(), PlanError> {
    check_sizes(planned)?;
    check_multisampling(planned)?;
    check_mip_levels(planned)
}

/// The target that a process creates by an access; `None` if it only uses it.
pub(super) fn created_target(planned: &PlannedProcess, name: &str, access: Access) -> Option<PlannedTarget> {
    Some(PlannedTarget {
        size: size_of(&planned.declaration, name),
        layered: matches!(access, Access::ClearDepthLayer(_)),
        multisampled: planned.declaration.multisampled.iter().any(|target| target == name),
        mipmapped: planned.declaration.mipmapped.iter().any(|target| target == name),
        ..unwritten_target(planned.declaration.views, name, access.format()?)
    })
}

/// A target of the picture's size that no process writes.
fn unwritten_target(views: ViewKind, name: &str, format: Format) -> PlannedTarget {
    PlannedTarget {
        name: name.to_owned(),
        views,
        format,
        stored: false,
        layered: false,
        size: TargetSize::Picture,
        multisampled: false,
        mipmapped: false,
        output: false,
        copy_of: None,
    }
}

fn size_of(declaration: &Declaration, target: &str) -> TargetSize {
    declaration.sizes.iter().find(|(sized, _)| sized == target).map_or(TargetSize::Picture, |(_, size)| *size)
}

/// # Errors
/// If a process sets the size of a target that it does not create, or that is drawn in layers, or sets one that no
/// target can have.
fn check_sizes(planned: &PlannedProcess) -> Result<(), PlanError> {
    for (target, size) in &planned.declaration.sizes {
        let created =
            planned.declaration.accesses.iter().find(|(name, access)| name == target && access.format().is_some());
        let sizes = planned.declaration.sizes.iter().filter(|(sized, _)| sized == target);
        let problem = match created {
            _ if sizes.count() > 1 => "and sets it again".into(),
            None => format!("that it does not create, only: {}", created_targets(&planned.declaration)).into(),
            Some((_, Access::ClearDepthLayer(_))) => {
                "that it draws in layers, which have the size of the pictures".into()
            }
            Some(_) if !size.is_valid() => "to a size without pixels".into(),
            Some(_) => continue,
        };
        return Err(PlanError::InvalidSize { process: planned.name.clone(), target: target.clone(), problem });
    }
    Ok(())
}

/// # Errors
/// If a target is multisampled, or resolved, that cannot be.
fn check_multisampling(planned: &PlannedProcess) -> Result<(), PlanError> {
    let Declaration { accesses, multisampled, resolves, .. } = &planned.declaration;
    let format_of = |target: &String| {
        accesses.iter().find_map(|(name, access)| match access {
            Access::ClearColor(format, _) | Access::ClearDepth(format) if name == target => Some(*format),
            _ => None,
        })
    };
    for target in multisampled {
        let problem: Cow<'static, str> = match format_of(target) {
            None => {
                let is_cleared = |access: &Access| matches!(access, Access::ClearColor(..) | Access::ClearDepth(_));
                let cleared = accesses.iter().filter(|(_, access)| is_cleared(access)).map(|(name, _)| name.as_str());
                format!("it does not clear it, or clears it in layers; it clears {}", list_names(cleared)).into()
            }
            Some(format) if !format.can_be_multisampled() => "not every device multisamples its format".into(),
            Some(_) => continue,
        };
        return Err(multisampling_error(planned, target, problem));
    }
    for (source, into) in resolves {
        let is_drawn = accesses.iter().any(|(name, access)| name == source && access.is_color());
        let problem = match accesses.iter().find(|(name, access)| name == into && access.format().is_some()) {
            _ if !is_drawn => {
                let drawn = planned.declaration.colors().map(|(name, _)| name);
                format!("it does not draw into it as colour, only into {}", list_names(drawn)).into()
            }
            _ if resolves.iter().filter(|(other, _)| other == source).count() > 1 => "it resolves it twice".into(),
            _ if resolves.iter().filter(|(_, other)| other == into).count() > 1 => {
                "it resolves another one into the same target".into()
            }
            Some((_, Access::Resolve(format))) if format.can_be_resolved() => continue,
            Some((_, Access::Resolve(_))) => "not every device resolves its format".into(),
            _ => "it uses the resolved target in another way too".into(),
        };
        return Err(PlanError::Resolve { process: planned.name.clone(), target: source.clone(), problem });
    }
    Ok(())
}

fn multisampling_error(planned: &PlannedProcess, target: &str, problem: impl Into<Cow<'static, str>>) -> PlanError {
    PlanError::Multisampling { process: planned.name.clone(), target: target.to_owned(), problem: problem.into() }
}

/// # Errors
/// If a process draws into targets of different sizes or numbers of samples, tests depth of another, or resolves into
/// another format.
fn check_attachments(planned: &PlannedProcess, targets: &[PlannedTarget]) -> Result<(), PlanError> {
    let mut attached = attached_targets(planned, targets);
    let Some(first) = attached.next() else { return Ok(()) };
    for other in attached {
        let (process, targets) = (planned.name.clone(), [first.name.clone(), other.name.clone()]);
        if other.size != first.size {
            return Err(PlanError::UnequalSizes { process, targets });
        }
        if other.multisampled != first.multisampled {
            return Err(PlanError::UnequalSamples { process, targets });
        }
    }
    let views = planned.declaration.views;
    let found = |name: &String| targets.iter().find(|known| known.name == *name && known.views == views);
    for (source, into) in &planned.declaration.resolves {
        let Some((from, to)) = found(source).zip(found(into)) else { continue };
        let problem = if !from.multisampled {
            "it is not multisampled".into()
        } else if (from.format, from.size, false) != (to.format, to.size, to.multisampled) {
            "the resolved target has another format or size, or is multisampled".into()
        } else {
            continue;
        };
        return Err(PlanError::Resolve { process: planned.name.clone(), target: source.clone(), problem });
    }
    Ok(())
}

/// What the checks of blending and of the stencil need to know of the targets that a process draws into.
pub(super) struct Attachments {
    /// Their extent; that of the picture if it draws into no target.
    pub(super) extent: AttachmentExtent,
    /// The number of colour targets.
    colors: usize,
    /// The colour targets that cannot be blended, by index.
    unblendable: Vec<(usize, String, Format)>,
    has_stencil: bool,
}

impl Attachments {
    pub(super) fn new(planned: &PlannedProcess, targets: &[PlannedTarget]) -> Self {
        let attached = || attached_targets(planned, targets);
        let extent = |target: &PlannedTarget| AttachmentExtent { size: target.size, multisampled: target.multisampled };
        let colors = attached().filter(|target| !target.format.is_depth_stencil()).enumerate();
        let unblendable = colors.filter(|(_, target)| !target.format.can_be_blended());
        Self {
            extent: attached().next().map_or(AttachmentExtent::PICTURE, extent),
            colors: planned.declaration.colors().count(),
            unblendable: unblendable.map(|(index, target)| (index, target.name.clone(), target.format)).collect(),
            has_stencil: attached().any(|target| target.format.has_stencil()),
        }
    }
}

/// # Errors
/// If a process blends with a target that cannot be blended, or has blend equations or masks for another number of
/// targets, or a depth bias that is not finite.
/// Objects without equations are exempt: where the target cannot be blended, their materials' blending is ignored.
pub(super) fn check_blending(
    planned: &PlannedProcess,
    draws: &Draws<'_>,
    attachments: &Attachments,
) -> Result<(), PlanError> {
    let blends = match draws {
        Draws::FullScreen(full_screen) => full_screen.blend != Blend::None,
        Draws::Procedural(procedural) => procedural.blend != Blend::None,
        Draws::Lights(_) => true,
        _ => false,
    };
    let process = || planned.name.clone();
    let (equations, targets) = (draws.blend_equations(), attachments.colors);
    if !equations.is_empty() && equations.len() != targets {
        return Err(PlanError::BlendEquationCount { process: process(), equations: equations.len(), targets });
    }
    if draws.pipeline_state().is_some_and(|state| !state.depth_bias.is_finite()) {
        return Err(PlanError::DepthBias { process: process() });
    }
    let masks = draws.pipeline_state().map_or(0, |state| state.color_masks.len());
    if masks > 0 && masks != targets {
        return Err(PlanError::ColorMaskCount { process: process(), masks, targets });
    }
    for (index, target, format) in &attachments.unblendable {
        if equations.get(*index).map_or(blends, |equation| *equation != BlendEquation::REPLACE) {
            return Err(PlanError::CannotBlend { process: process(), target: target.clone(), format: *format });
        }
    }
    Ok(())
}

/// # Errors
/// If a process tests or writes a stencil that it does not have, or declares that and does not.
pub(super) fn check_stencil(
    planned: &PlannedProcess,
    draws: &Draws<'_>,
    attachments: &Attachments,
) -> Result<(), PlanError> {
    let access = planned.declaration.depth().map(|(_, access)| access);
    let declares_test = matches!(access, Some(Access::MarkStencil | Access::TestStencil));
    let problem = match draws.stencil() {
        Some(_) if !attachments.has_stencil => "but has no depth target with one",
        Some(stencil) if stencil.writes() && !access.is_some_and(Access::writes) => {
            "and writes it, but declares only that it tests depth"
        }
        None if declares_test => "as it declares, but draws without a test of it",
        _ => return Ok(()),
    };
    Err(PlanError::Stencil { process: planned.name.clone(), problem })
}

/// The targets that a process draws into, and the depth that it tests.
fn attached_targets<'a>(
    planned: &'a PlannedProcess,
    targets: &'a [PlannedTarget],
) -> impl Iterator<Item = &'a PlannedTarget> {
    let Declaration { views, accesses, .. } = &planned.declaration;
    let attached = accesses.iter().filter(|(_, access)| access.is_depth() || access.is_color());
    attached.filter_map(|(name, _)| targets.iter().find(|known| known.name == *name && known.views == *views))
}

/// # Errors
/// If a process that draws in each view uses a target, or its history, of a process that draws in one of them only.
fn check_once_a_frame(processes: &[PlannedProcess]) -> Result<(), PlanError> {
    for planned in processes.iter().filter(|planned| planned.declaration.once_a_frame) {
        for target in planned.declaration.written() {
            let history = previous_name(target);
            let uses = |(name, access): &(String, Access)| {
                (name == target || *name == history)
                    && !matches!(
                        access,
                        Access::SampleLayers(_) | Access::SampleView(..) | Access::SampleViewPrevious(..)
                    )
            };
            let draws_in_each = |other: &&PlannedProcess| {
                other.declaration.views == planned.declaration.views && !other.declaration.once_a_frame
            };
            let mut others = processes.iter().filter(draws_in_each);
            if let Some(other) = others.find(|other| other.declaration.accesses.iter().any(uses)) {
                let (process, other) = (planned.name.clone(), other.name.clone());
                return Err(PlanError::OnceAFrame { process, other, target: target.to_owned() });
            }
        }
    }
    Ok(())
}

/// The copies of targets whose content of the frame before is read, in the same view or in others.
///
/// # Errors
/// If a target cannot have a history. What a process samples of other views may be missing: [`check_sampled_views`]
/// reports it.
///
/// [`check_sampled_views`]: super::sampled_views::check_sampled_views
fn copied_targets(processes: &[PlannedProcess], targets: &[PlannedTarget]) -> Result<Vec<PlannedTarget>, PlanError> {
    let mut copies: Vec<PlannedTarget> = Vec::new();
    for (planned, name, access) in accesses(processes).filter(|(.., access)| access.is_previous()) {
        let views = access.views(planned.declaration.views);
        if copies.iter().any(|known| known.name == *name && known.views == views) {
            continue;
        }
        let is_of_other_view = matches!(access, Access::SampleViewPrevious(..));
        let mut written = targets.iter().filter(|known| known.views == views);
        match written.find(|known| previous_name(&known.name) == *name) {
            Some(source) if source.layered && is_of_other_view => {
                let (process, target) = (planned.name.clone(), source.name.clone());
                return Err(PlanError::LayeringMismatch { process, target });
            }
            Some(source) if source.multisampled => {
                return Err(multisampling_error(planned, &source.name, "a multisampled target has no history"));
            }
            Some(source) if !source.layered => {
                let (name, copy_of) = (name.clone(), Some(source.name.clone()));
                copies.push(PlannedTarget { name, copy_of, stored: false, output: false, ..source.clone() });
            }
            _ if is_of_other_view => {}
            _ => {
                let known = targets.iter().filter(|known| known.views == views && !known.layered);
                let known = list_names(known.map(|known| known.name.as_str()));
                return Err(PlanError::NoHistory { process: planned.name.clone(), target: name.clone(), known });
            }
        }
    }
    Ok(copies)
}

/// The targets in layers that processes sample although none of the frame draws them: those that the pipeline names,
/// and those of kinds of views that the frame does not have. What samples them finds one layer of zeros.
pub(super) fn absent_layers(
    pipeline: &PipelineProcesses,
    added: &[(Option<usize>, PlannedProcess)],
    absent: &[PlannedProcess],
) -> Vec<PlannedTarget> {
    let named = pipeline
        .absent_layers
        .iter()
        .map(|named| PlannedTarget { layered: true, ..unwritten_target(named.views, &named.target, named.format) });
    let created = accesses(absent).filter_map(|(planned, name, access)| created_target(planned, name, access));
    let mut targets: Vec<PlannedTarget> = Vec::new();
    for target in named.chain(created.filter(|target| target.layered)) {
        let is_read = added.iter().any(|(_, other)| reads_layers(other, &target));
        let is_drawn = added.iter().any(|(_, other)| {
            other.declaration.views == target.views && other.declaration.written().any(|name| name == target.name)
        });
        let is_known = targets.iter().any(|known| (known.views, &known.name) == (target.views, &target.name));
        if is_read && !is_drawn && !is_known {
            targets.push(target);
        }
    }
    targets
}

/// Whether a process samples a target in layers, or as those of a view.
pub(super) fn reads_layers(planned: &PlannedProcess, target: &PlannedTarget) -> bool {
    planned.declaration.accesses.iter().any(|(name, access)| {
        let (Access::SampleLayers(views) | Access::SampleView(views, _)) = access else { return false };
        *name == target.name && *views == target.views
    })
}

pub(super) fn accesses(processes: &[PlannedProcess]) -> impl Iterator<Item = (&PlannedProcess, &String, Access)> {
    processes
        .iter()
        .flat_map(|planned| planned.declaration.accesses.iter().map(move |(target, access)| (planned, target, *access)))
}
