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
    pub fn new(mut processes: Vec<Box<dyn RenderProcess>>, outputs: &[String]) -> Result<Self, PlanError> {
        processes.sort_by_key(|process| declaration_of(process.as_ref()).views);
        let mut graph = FrameGraph::new();
        let mut added = Vec::new();
        for process in processes {
            let name = process.name().to_owned();
            let declaration = declaration_of(process.as_ref());
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
    /// If one panics, naming it.
    pub fn draws<'a>(&'a self) -> Result<Vec<Draws<'a>>, ProcessPanic> {
        let ask = |planned: &'a PlannedProcess| {
            let named =
                |panic: JobPanic| ProcessPanic { process: planned.process.name().to_owned(), message: panic.message };
            catch(|| planned.process.draws()).map_err(named)
        };
        self.processes.iter().map(ask).collect()
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

/// A target that each view of one kind has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PlannedTarget {
    /// Its name.
    pub name: String,
    /// The kind of view.
    pub views: ViewKind,
    /// Its format.
    pub format: Format,
    /// Whether a process draws into it.
    pub drawn: bool,
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
    /// No process is left, because none leads to an output.
    #[error("no process leads to an output")]
    Empty,
}

/// A process panicked when it was asked what it draws.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("process {process:?} panicked when it was asked what it draws: {message}")]
pub struct ProcessPanic {
    /// The process.
    pub process: String,
    /// What the panic said.
    pub message: String,
}

fn declaration_of(process: &dyn RenderProcess) -> Declaration {
    let mut declare = Declare::default();
    process.declare(&mut declare);
    declare.finish()
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
            None => targets.push(PlannedTarget { name: target.clone(), views, format, drawn: false }),
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
        known.drawn |= wants_depth.is_some();
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
