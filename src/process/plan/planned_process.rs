//! A process and its declaration, and its passes.

use std::iter;
use std::sync::Arc;

use super::PlanError;
#[cfg(feature = "wgpu")]
use crate::process::RequestLog;
use crate::process::{Access, BufferAccess, BufferOffset, ClearColor, Declaration, Declare, Draws, RenderProcess};
use crate::scene::ViewKind;
use crate::task::{JobPanic, catch};

/// A process and what it declared, for one kind of view.
#[derive(Clone)]
pub struct PlannedProcess {
    /// The process.
    pub process: Arc<dyn RenderProcess>,
    /// Its name, read once.
    pub name: String,
    /// What it declared.
    pub declaration: Declaration,
    /// The targets that it uses.
    pub(crate) targets: TargetIndices,
    /// What it is known by in all plans of a renderer.
    pub(crate) id: ProcessId,
    /// Whether it draws in the kind of views that it declares, and not in a further one.
    pub(super) is_of_own_kind: bool,
    /// What its raw pass asks for.
    #[cfg(feature = "wgpu")]
    pub(crate) requests: Arc<RequestLog>,
}

/// The targets that a process uses, as indices of the [plan's](super::FramePlan::targets). Its declaration names them;
/// backends find them by index, once the plan is made.
#[derive(Clone, Debug, Default)]
pub(crate) struct TargetIndices {
    /// All of them, and how they are used, in the order declared. What the process samples of other views may be a
    /// target of views of another kind, if no process draws in those.
    pub(crate) accesses: Vec<(usize, Access)>,
    /// The colour targets in the order of the shader's outputs.
    pub(crate) colors: Vec<ColorTarget>,
    /// The depth target, and how it is used.
    pub(crate) depth: Option<(usize, Access)>,
}

/// A target that a process draws into as colour.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(not(feature = "wgpu"), expect(dead_code, reason = "only the wgpu backend resolves targets"))]
pub(crate) struct ColorTarget {
    pub(crate) index: usize,
    /// What it is cleared to, if it is cleared.
    pub(crate) clear: Option<ClearColor>,
    /// The target that it is resolved into.
    pub(crate) resolved_into: Option<usize>,
}

/// What a process of a name, for one kind of view, is known by in all plans of a renderer: the first of these plans
/// that has it, by its identity, and the index of the process there.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) struct ProcessId {
    pub(super) plan: u64,
    pub(super) index: usize,
}

impl PlannedProcess {
    /// Calls a process's `name` and `declare`, once. Returns the process for each kind of view that it draws in; if it
    /// `is_chained`, also for the kinds that share the chain of the kind that it declares. What draws once a frame does
    /// so in the kind that it declares.
    ///
    /// # Errors
    /// If one of them panics, or `declare` declares more than one depth target.
    pub(super) fn of_each_kind(process: &Arc<dyn RenderProcess>, is_chained: bool) -> Result<Vec<Self>, PlanError> {
        let name =
            catch(|| process.name().to_owned()).map_err(|JobPanic { message, .. }| PlanError::Panicked { message })?;
        let mut declare = Declare::default();
        catch(|| process.declare(&mut declare))
            .map_err(|panic| PlanError::ProcessPanicked { process: name.clone(), message: panic.message })?;
        let declaration = declare.finish();
        if declaration.accesses.iter().filter(|(_, access)| access.is_depth()).count() > 1 {
            return Err(PlanError::MultipleDepthTargets { process: name });
        }
        if let Some(value) = declaration.depth_clear_value {
            let clears =
                |(_, access): &(String, Access)| matches!(access, Access::ClearDepth(_) | Access::ClearDepthLayer(_));
            let problem = match declaration.accesses.iter().any(clears) {
                true if (0.0..=1.0).contains(&value) => None,
                true => Some("it is not from 0 to 1"),
                false => Some("it clears no depth target"),
            };
            if let Some(problem) = problem {
                return Err(PlanError::DepthClearValue { process: name, value: value.to_string(), problem });
            }
        }
        let Declaration { views, also_views, .. } = &declaration;
        let shares_chain = |kind: &ViewKind| is_chained && kind.rules().shares_chain_of == Some(*views);
        let further = also_views.iter().copied().chain(ViewKind::ALL.into_iter().filter(shares_chain));
        let further = further.filter(|_| !declaration.once_a_frame);
        let mut kinds: Vec<_> = iter::once(*views).chain(further).collect();
        kinds.sort_unstable();
        kinds.dedup();
        let own_kind = *views;
        let of_kind = |views| {
            // The engine has not said that the process has side effects in the kinds that share the chain.
            let keep = declaration.keep && (views == own_kind || also_views.contains(&views));
            let declaration = Declaration { views, keep, ..declaration.clone() };
            Self {
                process: Arc::clone(process),
                name: name.clone(),
                targets: TargetIndices::default(),
                id: ProcessId::default(),
                is_of_own_kind: views == own_kind,
                #[cfg(feature = "wgpu")]
                requests: Arc::new(RequestLog::new(&declaration)),
                declaration,
            }
        };
        Ok(kinds.into_iter().map(of_kind).collect())
    }

    /// Whether it makes a target an output of this name: it writes it in the kind of views that it declares.
    pub(super) fn is_output_writer(&self, output: &str) -> bool {
        self.is_of_own_kind && self.declaration.written().any(|target| target == output)
    }

    /// What the process draws in this frame.
    ///
    /// # Errors
    /// If the process panics, its draws do not fit its declaration, as only raw passes use targets by their own
    /// commands, or it has a resource of a size that no buffer can have.
    pub(super) fn draws(&self) -> Result<Draws<'_>, PlanError> {
        let process = || self.name.clone();
        let panicked = |panic: JobPanic| PlanError::ProcessPanicked { process: process(), message: panic.message };
        let draws = catch(|| self.process.draws()).map_err(panicked)?;
        let is_raw = match draws {
            Draws::Commands(_) | Draws::FullScreen(_) | Draws::Lights(_) => false,
            Draws::Procedural(_) | Draws::Compute(_) | Draws::Items(_) => false,
            #[cfg(feature = "wgpu")]
            Draws::Raw(_) => true,
        };
        // Both kinds read histories and layers, as nothing else declares these: raw passes ask for them by name.
        let is_of_both = |access: &Access| matches!(access, Access::SamplePrevious | Access::SampleLayers(_));
        let fits = |access: &Access| access.is_raw() == is_raw || is_of_both(access);
        if let Some((target, _)) = self.declaration.accesses.iter().find(|(_, access)| !fits(access)) {
            return Err(PlanError::Misdeclared { process: process(), target: target.clone() });
        }
        let attached = |(_, access): &&(String, Access)| access.is_depth() || access.is_color();
        if let (Draws::Compute(_), Some((target, _))) = (&draws, self.declaration.accesses.iter().find(attached)) {
            return Err(PlanError::ComputeDraws { process: process(), target: target.clone() });
        }
        if let Some((offset, bytes)) = draws.arguments()
            && let Some(problem) = self.problem_of_arguments(offset, bytes)
        {
            return Err(PlanError::Arguments { process: process(), buffer: offset.buffer.name, problem });
        }
        for (resource, own) in draws.resources().iter().enumerate() {
            let Some(bytes) = own.bytes().map(<[u8]>::len) else { continue };
            if bytes == 0 || !bytes.is_multiple_of(4) {
                return Err(PlanError::ResourceSize { process: process(), resource, bytes });
            }
        }
        Ok(draws)
    }

    /// What is wrong with arguments of this many bytes; `None` if nothing is.
    fn problem_of_arguments(&self, offset: BufferOffset, bytes: u64) -> Option<&'static str> {
        if !self.declaration.buffers.contains(&(offset.buffer, BufferAccess::Arguments)) {
            Some("which it does not declare")
        } else if !offset.bytes.is_multiple_of(4) {
            Some("at an offset that is not a multiple of 4")
        } else if offset.bytes.saturating_add(bytes) > offset.buffer.bytes {
            Some("past its end")
        } else {
            None
        }
    }
}

/// One process in one view: recorded as a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Pass {
    /// The process's index in [`FramePlan::processes`](super::FramePlan::processes).
    pub process_index: usize,
    /// The view's index among the frame's views.
    pub view_index: usize,
}
