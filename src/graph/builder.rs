//! The graph as an engine builds it.

use std::{
    collections::{HashMap, VecDeque},
    fmt,
    sync::atomic::{AtomicUsize, Ordering},
};

use crate::timeline::Labels;

use super::error::GraphProblem;

/// Processes, the resources they read and write, and the order that follows.
///
/// `P` is what a process carries: anything for a graph that is only put in order, a [`Node`](super::Node) for one that runs.
///
/// # Who comes before whom
///
/// A process can *write* a resource, *modify* it (read and write it) or *read* it. Of each resource, the writers come
/// first, then the modifiers, then the readers, and each of them waits for all it needs:
///
/// - every modifier for every writer,
/// - every reader for every writer and every modifier.
///
/// Two writers, or two modifiers, have no order of their own: something else must order them, [`order`](Self::order) for
/// one, or the graph does not compile.
///
/// A reader or modifier that [`order`](Self::order) puts before a writer, directly or through others, keeps that order and
/// sees the earlier version. A reader that is put before a writer is before the modifiers of what that writer
/// makes, too.
///
/// # What is kept
///
/// The frame is for its outputs: a process is kept if an output, or a process that is [kept](Self::keep) whatever it
/// writes, needs what it writes, directly or through others. All that must be waited for is needed, and so is, for a
/// modifier, what the last modifiers before it left. Without an output and without a kept process all are dropped;
/// [`Schedule::dropped`](super::Schedule::dropped) names those that were.
///
/// What [`order`](Self::order) says puts processes in order but keeps none. A dropped process still hands on the order: if
/// `a` comes before it, and it before `b`, then `a` comes before `b`.
///
/// ```
/// use drawloom::graph::FrameGraph;
///
/// let mut graph = FrameGraph::new();
/// let [depth, image] = ["depth", "image"].map(|name| graph.resource(name));
/// graph.output(image);
///
/// let light = graph.add("light", "what a process carries");
/// graph.read(light, depth);
/// graph.write(light, image);
/// let geometry = graph.add("geometry", "can be anything");
/// graph.write(geometry, depth);
/// graph.add("overlay", "and this one leads to no output");
///
/// let schedule = graph.compile()?;
/// let order: Vec<&str> = schedule.processes().map(|(name, _)| name).collect();
/// assert_eq!(order, ["geometry", "light"]);
/// assert_eq!(schedule.dropped(), ["overlay"]);
/// # Ok::<(), drawloom::graph::CompileError<&str>>(())
/// ```
pub struct FrameGraph<P> {
    /// Tells this graph's ids from those of all others.
    identity: usize,
    processes_added: usize,
    pub(super) processes: Vec<Process<P>>,
    pub(super) resources: Vec<Resource>,
    resource_by_name: HashMap<String, usize>,
    pub(super) accesses: Vec<Access>,
    /// Pairs of positions in `processes`: the first comes before the second.
    pub(super) orders: Vec<(usize, usize)>,
    /// Calls that were given an id that means nothing here, oldest first.
    pub(super) misuses: VecDeque<GraphProblem>,
}

/// A process of one [`FrameGraph`], and of the [`Schedule`](super::Schedule) it compiles to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ProcessId {
    pub(super) graph: usize,
    /// How many processes had been added to the graph before it.
    pub(super) serial: usize,
}

/// A resource of one [`FrameGraph`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ResourceId {
    graph: usize,
    index: usize,
}

pub(super) struct Process<P> {
    pub(super) name: String,
    pub(super) labels: Labels,
    pub(super) id: ProcessId,
    pub(super) kept: bool,
    pub(super) payload: P,
}

pub(super) struct Resource {
    pub(super) name: String,
    pub(super) imported: bool,
    pub(super) output: bool,
}

/// One call of `read` or `write`, by positions in `processes` and `resources`.
#[derive(Clone, Copy)]
pub(super) struct Access {
    pub(super) resource: usize,
    pub(super) process: usize,
    pub(super) writes: bool,
}

impl<P> FrameGraph<P> {
    /// An empty graph.
    pub fn new() -> Self {
        // No loom atomic: those cannot stand in a static, and nothing is handed over here.
        static GRAPHS: AtomicUsize = AtomicUsize::new(0);
        Self {
            // Relaxed: only that no two graphs get one number matters.
            identity: GRAPHS.fetch_add(1, Ordering::Relaxed),
            processes_added: 0,
            processes: Vec::new(),
            resources: Vec::new(),
            resource_by_name: HashMap::new(),
            accesses: Vec::new(),
            orders: Vec::new(),
            misuses: VecDeque::new(),
        }
    }

    /// The resource of that name, which is made by naming it.
    pub fn resource(&mut self, name: impl Into<String>) -> ResourceId {
        let name = name.into();
        let index = *self.resource_by_name.entry(name).or_insert_with_key(|name| {
            self.resources.push(Resource { name: name.clone(), imported: false, output: false });
            self.resources.len() - 1
        });
        ResourceId { graph: self.identity, index }
    }

    /// Says that the resource comes from outside: it is there before the frame starts and needs no writer.
    pub fn import(&mut self, resource: ResourceId) {
        match self.resource_position(resource) {
            Some(position) => self.resources[position].imported = true,
            None => self.misuses.push_back(GraphProblem::UnknownResource { call: "import(?)".to_owned() }),
        }
    }

    /// Says that the resource is what the frame is for.
    pub fn output(&mut self, resource: ResourceId) {
        match self.resource_position(resource) {
            Some(position) => self.resources[position].output = true,
            None => self.misuses.push_back(GraphProblem::UnknownResource { call: "output(?)".to_owned() }),
        }
    }

    /// Adds a process. No two processes of a graph that compiles have one name.
    pub fn add(&mut self, name: impl Into<String>, process: P) -> ProcessId {
        let id = ProcessId { graph: self.identity, serial: self.processes_added };
        self.processes_added += 1;
        let labels = Labels::default();
        self.processes.push(Process { name: name.into(), labels, id, kept: false, payload: process });
        id
    }

    /// Takes a process out, with all that was said about it, and gives it back: `None` if it is not there.
    pub fn remove(&mut self, process: ProcessId) -> Option<P> {
        let removed = self.process_position(process)?;
        let moved = |position: usize| position - usize::from(position > removed);
        self.accesses.retain(|access| access.process != removed);
        for access in &mut self.accesses {
            access.process = moved(access.process);
        }
        self.orders.retain(|(before, after)| *before != removed && *after != removed);
        for (before, after) in &mut self.orders {
            (*before, *after) = (moved(*before), moved(*after));
        }
        Some(self.processes.remove(removed).payload)
    }

    /// Says that the process reads the resource.
    pub fn read(&mut self, process: ProcessId, resource: ResourceId) {
        self.access("read", process, resource, false);
    }

    /// Says that the process writes the resource. One that also reads it modifies it in place.
    pub fn write(&mut self, process: ProcessId, resource: ResourceId) {
        self.access("write", process, resource, true);
    }

    /// Says that one process runs before another, whatever they read and write. It keeps neither.
    pub fn order(&mut self, before: ProcessId, after: ProcessId) {
        match (self.process_position(before), self.process_position(after)) {
            (Some(before), Some(after)) => self.orders.push((before, after)),
            (before, after) => {
                let call = format!("order({}, {})", self.process_text(before), self.process_text(after));
                self.misuses.push_back(GraphProblem::UnknownProcess { call });
            }
        }
    }

    /// Keeps the process whatever it writes, for what it does besides.
    pub fn keep(&mut self, process: ProcessId) {
        match self.process_position(process) {
            Some(position) => self.processes[position].kept = true,
            None => self.misuses.push_back(GraphProblem::UnknownProcess { call: "keep(?)".to_owned() }),
        }
    }

    /// Says what the process is a part of, for [timelines](crate::timeline) and spans.
    pub fn label(&mut self, process: ProcessId, labels: Labels) {
        match self.process_position(process) {
            Some(position) => self.processes[position].labels = labels,
            None => self.misuses.push_back(GraphProblem::UnknownProcess { call: "label(?)".to_owned() }),
        }
    }

    fn access(&mut self, call: &str, process: ProcessId, resource: ResourceId, writes: bool) {
        match (self.process_position(process), self.resource_position(resource)) {
            (Some(process), Some(resource)) => self.accesses.push(Access { resource, process, writes }),
            (process, resource) => {
                let resource_text =
                    resource.map_or_else(|| "?".to_owned(), |position| format!("{:?}", self.resources[position].name));
                let text = format!("{call}({}, {resource_text})", self.process_text(process));
                self.misuses.push_back(match process {
                    None => GraphProblem::UnknownProcess { call: text },
                    Some(_) => GraphProblem::UnknownResource { call: text },
                });
            }
        }
    }

    fn process_position(&self, process: ProcessId) -> Option<usize> {
        if process.graph != self.identity {
            return None;
        }
        self.processes.binary_search_by_key(&process.serial, |process| process.id.serial).ok()
    }

    fn resource_position(&self, resource: ResourceId) -> Option<usize> {
        (resource.graph == self.identity).then_some(resource.index)
    }

    fn process_text(&self, position: Option<usize>) -> String {
        position.map_or_else(|| "?".to_owned(), |position| format!("{:?}", self.processes[position].name))
    }
}

impl<P> Default for FrameGraph<P> {
    fn default() -> Self {
        Self::new()
    }
}

impl<P> fmt::Debug for FrameGraph<P> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let processes: Vec<&str> = self.processes.iter().map(|process| process.name.as_str()).collect();
        let resources: Vec<&str> = self.resources.iter().map(|resource| resource.name.as_str()).collect();
        formatter
            .debug_struct("FrameGraph")
            .field("processes", &processes)
            .field("resources", &resources)
            .finish_non_exhaustive()
    }
}
