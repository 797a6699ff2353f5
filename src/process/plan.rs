//! From a list of processes to what a frame does, in order.

use super::{Access, Declaration, Declare, Draws, Format, RenderProcess};
use crate::graph::{FrameGraph, GraphProblem};
use crate::scene::ViewKind;
use crate::task::{JobPanic, catch};

/// What every frame does: processes in the order they are submitted, and the targets they use.
pub struct FramePlan {
    processes: Vec<PlannedProcess>,
    targets: Vec<PlannedTarget>,
    dropped: Vec<String>,
    dot: String,
}

impl FramePlan {
    /// Orders the processes by what they read and write. Those that lead to none of the outputs are dropped. Where that
    /// leaves the order open, the earlier [`ViewKind`] goes first, then the one that was added first (M 10.4).
    ///
    /// # Errors
    /// See [`PlanError`].
    pub fn new(processes: Vec<Box<dyn RenderProcess>>, outputs: &[String]) -> Result<Self, PlanError> {
        let mut declared = processes.into_iter().map(declared).collect::<Result<Vec<_>, _>>()?;
        declared.sort_by_key(|planned| planned.declaration.views);
        let mut graph = FrameGraph::new();
        let mut added = Vec::new();
        for PlannedProcess { process, declaration } in declared {
            let name = process.name().to_owned();
            let id = graph.add(name.clone(), PlannedProcess { process, declaration: declaration.clone() });
            for (target, access) in &declaration.accesses {
                let resource = graph.resource(resource_name(declaration.views, target));
                if access.reads() {
                    graph.read(id, resource);
                }
                if access.writes() {
                    graph.write(id, resource);
                }
            }
            if declaration.keep {
                graph.keep(id);
            }
            added.push((name, id, declaration));
        }
        for (name, id, declaration) in &added {
            for before in &declaration.after {
                let known = added.iter().find(|(other, ..)| other == before);
                let (_, before, _) =
                    known.ok_or_else(|| PlanError::UnknownProcess { process: name.clone(), after: before.clone() })?;
                graph.order(*before, *id);
            }
        }
        for output in outputs {
            let written = added.iter().filter(|(_, _, declaration)| {
                declaration.accesses.iter().any(|(target, access)| target == output && access.writes())
            });
            let mut kinds: Vec<_> = written.map(|(_, _, declaration)| declaration.views).collect();
            if kinds.is_empty() {
                kinds.push(ViewKind::Main);
            }
            for kind in kinds {
                let resource = graph.resource(resource_name(kind, output));
                graph.output(resource);
            }
        }

        let schedule = graph.compile().map_err(|error| PlanError::Graph(error.problem))?;
        let (dropped, dot) = (schedule.dropped().to_vec(), schedule.to_dot());
        let processes: Vec<_> = schedule.into_processes().map(|(_, process)| process).collect();
        if processes.is_empty() {
            return Err(PlanError::Empty);
        }
        let targets = targets_of(&processes)?;
        Ok(Self { processes, targets, dropped, dot })
    }

    /// The processes in the order they are submitted.
    pub fn processes(&self) -> &[PlannedProcess] {
        &self.processes
    }

    /// Asks every process what it draws in this frame, in order.
    ///
    /// # Errors
    /// If one panics, or draws in a way that it did not declare.
    pub fn draws<'a>(&'a self) -> Result<Vec<Draws<'a>>, ProcessError> {
        self.processes.iter().map(PlannedProcess::draws).collect()
    }

    /// The targets that views of each kind have.
    pub fn targets(&self) -> &[PlannedTarget] {
        &self.targets
    }

    /// The names of the processes that lead to no output.
    pub fn dropped(&self) -> &[String] {
        &self.dropped
    }

    /// The processes and their targets as a graph in the DOT language.
    pub fn to_dot(&self) -> &str {
        &self.dot
    }
}

/// A process and what it declared.
pub struct PlannedProcess {
    /// The process.
    pub process: Box<dyn RenderProcess>,
    /// What it declared.
    pub declaration: Declaration,
}

impl PlannedProcess {
    fn draws(&self) -> Result<Draws<'_>, ProcessError> {
        let process = || self.process.name().to_owned();
        let panicked = |panic: JobPanic| ProcessError::Panicked { process: process(), message: panic.message };
        let draws = catch(|| self.process.draws()).map_err(panicked)?;
        let raw = match draws {
            Draws::Commands(_) | Draws::FullScreen(_) => false,
            #[cfg(feature = "wgpu")]
            Draws::Raw(_) => true,
        };
        let fits = |access: &Access| match access {
            Access::ClearColor(..) | Access::DrawOver | Access::ClearDepth(_) | Access::TestDepth | Access::Sample => {
                !raw
            }
            Access::Write(_) | Access::Change | Access::Read => raw,
        };
        match self.declaration.accesses.iter().find(|(_, access)| !fits(access)) {
            Some((target, _)) => Err(ProcessError::Misdeclared { process: process(), target: target.clone() }),
            None => Ok(draws),
        }
    }
}

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
}

/// One process in one view: what is recorded as a unit, and finished on one worker.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Pass {
    /// The process: its index in [`FramePlan::processes`]. Passes are submitted in this order first.
    pub process: usize,
    /// The view: its index among the frame's views.
    pub view: usize,
}

/// Why no frame can be made of these processes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// What they read and write does not fit together.
    #[error(transparent)]
    Graph(#[from] GraphProblem),
    /// A process wants to come after one that is not there.
    #[error("process {process:?} is to come after {after:?}, which is not in the graph")]
    UnknownProcess {
        /// The process.
        process: String,
        /// The one that is not there.
        after: String,
    },
    /// Two processes give a target two formats.
    #[error("target {target:?} is both {first:?} and {second:?}")]
    TwoFormats {
        /// The target.
        target: String,
        /// One format.
        first: Format,
        /// The other.
        second: Format,
    },
    /// A target is used as depth with a format that holds colour, or the other way round.
    #[error("process {process:?} uses target {target:?} as what its format {format:?} is not")]
    WrongFormat {
        /// The process.
        process: String,
        /// The target.
        target: String,
        /// Its format.
        format: Format,
    },
    /// A process has two depth targets.
    #[error("process {process:?} has more than one depth target")]
    TwoDepths {
        /// The process.
        process: String,
    },
    /// A process could not say what it reads and writes.
    #[error(transparent)]
    Process(#[from] ProcessError),
    /// No process is left, because none leads to an output.
    #[error("no process leads to an output")]
    Empty,
}

/// What is wrong with what a process says of itself.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ProcessError {
    /// It panicked when it was asked.
    #[error("process {process:?} panicked when it was asked what it does: {message}")]
    Panicked {
        /// The process.
        process: String,
        /// What the panic said.
        message: String,
    },
    /// A raw pass declares that it draws into or samples a target, or another process that it writes, changes or reads one
    /// by commands of its own.
    #[error("process {process:?} does not use target {target:?} in the way that it declares")]
    Misdeclared {
        /// The process.
        process: String,
        /// The target.
        target: String,
    },
}

/// Asks a process once for what it reads and writes.
fn declared(process: Box<dyn RenderProcess>) -> Result<PlannedProcess, PlanError> {
    let mut declare = Declare::default();
    catch(|| process.declare(&mut declare))
        .map_err(|panic| ProcessError::Panicked { process: process.name().to_owned(), message: panic.message })?;
    let declaration = declare.finish();
    let is_depth = |(_, access): &&(String, Access)| matches!(access, Access::ClearDepth(_) | Access::TestDepth);
    if declaration.accesses.iter().filter(is_depth).count() > 1 {
        return Err(PlanError::TwoDepths { process: process.name().to_owned() });
    }
    Ok(PlannedProcess { process, declaration })
}

/// Views of different kinds have different targets, even where their names are the same.
fn resource_name(kind: ViewKind, target: &str) -> String {
    match kind {
        ViewKind::Main => target.to_owned(),
        other => format!("{}: {target}", other.name()),
    }
}

fn targets_of(processes: &[PlannedProcess]) -> Result<Vec<PlannedTarget>, PlanError> {
    let mut targets: Vec<PlannedTarget> = Vec::new();
    let accesses = || {
        processes.iter().flat_map(|planned| {
            planned.declaration.accesses.iter().map(move |(target, access)| (planned, target, *access))
        })
    };
    for (planned, target, access) in accesses() {
        let Some(format) = access.format() else { continue };
        let views = planned.declaration.views;
        match targets.iter().find(|known| known.name == *target && known.views == views) {
            Some(known) if known.format != format => {
                return Err(PlanError::TwoFormats { target: target.clone(), first: known.format, second: format });
            }
            Some(_) => {}
            None => targets.push(PlannedTarget { name: target.clone(), views, format, stored: false }),
        }
    }
    for (planned, target, access) in accesses() {
        let views = planned.declaration.views;
        let Some(known) = targets.iter_mut().find(|known| known.name == *target && known.views == views) else {
            continue;
        };
        let wants_depth = match access {
            Access::ClearColor(..) | Access::DrawOver => Some(false),
            Access::ClearDepth(_) | Access::TestDepth => Some(true),
            _ => None,
        };
        known.stored |= matches!(access, Access::Write(_) | Access::Change) && known.format.can_be_stored();
        if wants_depth.is_some_and(|depth| depth != known.format.is_depth()) {
            let process = planned.process.name().to_owned();
            return Err(PlanError::WrongFormat { process, target: target.clone(), format: known.format });
        }
    }
    Ok(targets)
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;
    use crate::process::{ClearColor, CommandDraws, Draws, GeometryBuffer, Lighting, ToneMapping};

    struct Made<F>(&'static str, F);

    impl<F: Fn(&mut Declare) + Send + Sync> RenderProcess for Made<F> {
        fn name(&self) -> &str {
            self.0
        }

        fn declare(&self, declare: &mut Declare) {
            (self.1)(declare);
        }

        fn draws(&self) -> Draws<'_> {
            Draws::Commands(CommandDraws::default())
        }
    }

    fn plan(processes: Vec<Box<dyn RenderProcess>>) -> Result<FramePlan, PlanError> {
        FramePlan::new(processes, &["picture".to_owned()])
    }

    fn shipped() -> Vec<Box<dyn RenderProcess>> {
        vec![Box::new(ToneMapping::default()), Box::new(Lighting), Box::new(GeometryBuffer)]
    }

    #[test]
    fn the_order_follows_from_reads_and_writes_alone() {
        let plan = plan(shipped()).unwrap();
        let names: Vec<_> = plan.processes().iter().map(|planned| planned.process.name()).collect();
        assert_eq!(names, ["geometry buffer", "lighting", "tone mapping"]);
        let targets: Vec<_> = plan.targets().iter().map(|target| (target.name.as_str(), target.format)).collect();
        assert_eq!(
            targets,
            [
                ("normal", Format::Rg16Float),
                ("diffuse", Format::Rgba8Srgb),
                ("radiance", Format::Rgba16Float),
                ("depth", Format::Depth32Float),
                ("picture", Format::Rgba8Srgb),
            ]
        );
    }

    #[test]
    fn what_leads_to_no_output_is_dropped_and_its_targets_with_it() {
        let mut processes = shipped();
        processes.push(Box::new(Made("overlay", |declare: &mut Declare| {
            declare.clears_color("overlay", Format::Rgba8Unorm, ClearColor::Background);
        })));
        let plan = plan(processes).unwrap();
        assert_eq!(plan.dropped(), ["overlay"]);
        assert!(plan.targets().iter().all(|target| target.name != "overlay"));
    }

    #[test]
    fn mistakes_are_named() {
        let mut processes = shipped();
        processes.pop();
        let error = plan(processes).err().unwrap().to_string();
        assert!(error.contains("nothing writes \"radiance\"") && error.contains("lighting"), "{error}");

        let mut processes = shipped();
        processes.push(Box::new(Made("fog", |declare: &mut Declare| declare.after("weather"))));
        let error = plan(processes).err().unwrap();
        assert_eq!(error, PlanError::UnknownProcess { process: "fog".into(), after: "weather".into() });

        let mut processes = shipped();
        processes.push(Box::new(Made("again", |declare: &mut Declare| {
            declare.clears_color("diffuse", Format::R32Float, ClearColor::Background);
            declare.after("geometry buffer");
            declare.keep();
        })));
        let error = plan(processes).err().unwrap();
        assert!(matches!(&error, PlanError::TwoFormats { target, .. } if target == "diffuse"), "{error}");

        let mut processes = shipped();
        processes.push(Box::new(Made("blind", |declare: &mut Declare| {
            declare.tests_depth("diffuse");
            declare.keep();
        })));
        let error = plan(processes).err().unwrap();
        assert!(matches!(&error, PlanError::WrongFormat { process, .. } if process == "blind"), "{error}");

        let error = FramePlan::new(shipped(), &["painting".to_owned()]).err().unwrap().to_string();
        assert!(error.contains("painting"), "{error}");
        assert!(plan(Vec::new()).is_err());
    }
}
