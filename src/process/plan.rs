//! From a list of processes to what a frame does, in order.

use std::sync::Arc;
#[cfg(feature = "wgpu")]
use std::sync::Weak;
use std::sync::atomic::{AtomicU64, Ordering};

use super::planned_target::targets_of;
use super::{
    Access, Declaration, Declare, Draws, Format, PlanError, PlannedTarget, ProcessError, RenderProcess, ShadowCasters,
};
use crate::graph::{FrameGraph, NodeId};
use crate::scene::ViewKind;
use crate::task::{JobPanic, catch};

/// What every frame does: processes in the order they are submitted, and the targets they use.
pub struct FramePlan {
    identity: u64,
    #[cfg_attr(not(feature = "wgpu"), expect(dead_code, reason = "only the wgpu backend keeps something for a plan"))]
    alive: Arc<()>,
    processes: Vec<PlannedProcess>,
    targets: Vec<PlannedTarget>,
    dropped: Vec<String>,
    dot: String,
}

impl FramePlan {
    /// Orders processes by what they read and write. Those that lead to none of the outputs are dropped. Where that leaves
    /// the order open, the earlier [`ViewKind`] goes first, then the one that was added first (M 10.4).
    ///
    /// `chain` are processes whose order is known: where two of them write one target, the earlier goes first. Some of its
    /// places may be empty, for want of anything to do; others may come after or before such a place all the same. To be in
    /// the chain says nothing of who else writes a target.
    ///
    /// # Errors
    /// See [`PlanError`].
    pub fn new(
        chain: Vec<Place>,
        processes: Vec<Arc<dyn RenderProcess>>,
        outputs: &[String],
    ) -> Result<Self, PlanError> {
        let (places, in_chain): (Vec<_>, Vec<_>) = chain.into_iter().map(|place| (place.name, place.process)).unzip();
        let chained = in_chain.into_iter().enumerate().filter_map(|(place, process)| Some((Some(place), process?)));
        let others = processes.into_iter().map(|process| (None, process));
        let mut declared: Vec<_> = chained
            .chain(others)
            .map(|(place, process)| Ok((place, declared(process)?)))
            .collect::<Result<_, PlanError>>()?;
        declared.sort_by_key(|(_, planned)| planned.declaration.views);
        let mut graph = FrameGraph::new();
        let mut added: Vec<Added> = Vec::new();
        for (place, PlannedProcess { process, declaration }) in declared {
            let name = process.name().to_owned();
            let id = graph.add(name.clone(), PlannedProcess { process, declaration: declaration.clone() });
            for (target, access) in &declaration.accesses {
                let resource = graph.resource(resource_name(access.views(declaration.views), target));
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
            added.push(Added { place, name, id, declaration });
        }
        let stand_in = stand_in(&places, &added);
        if let Some(target) = &stand_in {
            let resource = graph.resource(resource_name(target.views, &target.name));
            graph.import(resource);
        }
        for (before, after) in orders(&places, &added)? {
            graph.order(before, after);
        }
        for output in outputs {
            let written = added.iter().filter(|added| added.declaration.written().any(|target| target == output));
            let mut kinds: Vec<_> = written.map(|added| added.declaration.views).collect();
            if kinds.is_empty() {
                kinds.push(ViewKind::Main);
            }
            for kind in kinds {
                let resource = graph.resource(resource_name(kind, output));
                graph.output(resource);
            }
        }

        let schedule = graph.compile().map_err(|error| PlanError::Graph(error.problem))?;
        let declarations: Vec<_> = schedule.nodes().map(|(_, planned)| &planned.declaration).collect();
        let dot = schedule.to_labelled_dot(|before, after| shared(declarations[before], declarations[after]));
        let dropped = schedule.dropped().to_vec();
        let processes: Vec<_> = schedule.into_nodes().map(|(_, process)| process).collect();
        if processes.is_empty() {
            return Err(PlanError::Empty);
        }
        let mut targets = targets_of(&processes)?;
        targets.extend(stand_in);
        // Only told apart, never ordered by.
        let identity = NEXT_IDENTITY.fetch_add(1, Ordering::Relaxed);
        Ok(Self { identity, alive: Arc::default(), processes, targets, dropped, dot })
    }

    /// A number that no other plan of this program has.
    pub fn identity(&self) -> u64 {
        self.identity
    }

    /// Ends with the plan: for who keeps something only as long as there is the plan.
    #[cfg(feature = "wgpu")]
    pub(crate) fn alive(&self) -> Weak<()> {
        Arc::downgrade(&self.alive)
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

    /// Whether views of this kind are drawn at all.
    pub fn draws_views(&self, kind: ViewKind) -> bool {
        self.processes.iter().any(|planned| planned.declaration.views == kind)
    }

    /// The targets that views of each kind have.
    pub fn targets(&self) -> &[PlannedTarget] {
        &self.targets
    }

    /// The names of the processes that lead to no output.
    pub fn dropped(&self) -> &[String] {
        &self.dropped
    }

    /// The processes as a graph in the DOT language, with the targets that one leaves to the next.
    pub fn to_dot(&self) -> &str {
        &self.dot
    }
}

/// Where a process stands among others whose order is known.
#[derive(Clone)]
pub struct Place {
    /// What the place is called: as the process that comes with the crate, whoever stands there.
    pub name: String,
    /// Who stands there.
    pub process: Option<Arc<dyn RenderProcess>>,
}

static NEXT_IDENTITY: AtomicU64 = AtomicU64::new(0);

/// A process and what it declared.
pub struct PlannedProcess {
    /// The process.
    pub process: Arc<dyn RenderProcess>,
    /// What it declared.
    pub declaration: Declaration,
}

impl PlannedProcess {
    fn draws(&self) -> Result<Draws<'_>, ProcessError> {
        let process = || self.process.name().to_owned();
        let panicked = |panic: JobPanic| ProcessError::Panicked { process: process(), message: panic.message };
        let draws = catch(|| self.process.draws()).map_err(panicked)?;
        let raw = match draws {
            Draws::Commands(_) | Draws::FullScreen(_) | Draws::Lights(_) => false,
            #[cfg(feature = "wgpu")]
            Draws::Raw(_) => true,
        };
        let fits = |access: &Access| access.is_raw() == raw;
        match self.declaration.accesses.iter().find(|(_, access)| !fits(access)) {
            Some((target, _)) => Err(ProcessError::Misdeclared { process: process(), target: target.clone() }),
            None => Ok(draws),
        }
    }
}

/// One process in one view: what is recorded as a unit, and finished on one worker.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Pass {
    /// The process: its index in [`FramePlan::processes`]. Passes are submitted in this order first.
    pub process: usize,
    /// The view: its index among the frame's views.
    pub view: usize,
}

/// A process on its way into the graph.
struct Added {
    /// In the chain.
    place: Option<usize>,
    name: String,
    id: NodeId,
    declaration: Declaration,
}

/// The shadow map that somebody reads and nobody draws, because no light casts shadows: then there still is a texture to
/// bind.
fn stand_in(places: &[String], added: &[Added]) -> Option<PlannedTarget> {
    let is_map = |(target, access): &(String, Access)| {
        target == ShadowCasters::TARGET && *access == Access::SampleLayers(ViewKind::Shadow)
    };
    let is_read = added.iter().any(|other| other.declaration.accesses.iter().any(is_map));
    let is_drawn = added.iter().any(|other| {
        other.declaration.views == ViewKind::Shadow
            && other.declaration.written().any(|target| target == ShadowCasters::TARGET)
    });
    let may_be_drawn = places.iter().any(|place| place == ShadowCasters::NAME);
    (is_read && !is_drawn && may_be_drawn).then(|| PlannedTarget {
        name: ShadowCasters::TARGET.to_owned(),
        views: ViewKind::Shadow,
        format: Format::Depth32Float,
        stored: false,
        layered: true,
    })
}

/// Who goes before whom: by the chain, and by what processes say themselves.
fn orders(places: &[String], added: &[Added]) -> Result<Vec<(NodeId, NodeId)>, PlanError> {
    let mut orders = Vec::new();
    for earlier in added {
        let follows = |later: &&Added| later.place.is_some() && earlier.place.is_some() && later.place > earlier.place;
        for later in added.iter().filter(follows) {
            let both = |target: &str| later.declaration.written().any(|other| other == target);
            if earlier.declaration.views == later.declaration.views && earlier.declaration.written().any(both) {
                orders.push((earlier.id, later.id));
            }
        }
    }
    for own in added {
        for before in &own.declaration.after {
            let known = find(places, added, before, |wanted, place| place <= wanted);
            orders.extend(known.map_err(|place| place.unknown(own, before))?.map(|before| (before, own.id)));
        }
        for after in &own.declaration.before {
            let known = find(places, added, after, |wanted, place| place >= wanted);
            orders.extend(known.map_err(|place| place.unknown(own, after))?.map(|after| (own.id, after)));
        }
    }
    // Who comes before a place comes before who comes after it, even if nobody stands there to be between them.
    let empty = |name: &String| {
        let place = places.iter().position(|place| place == name)?;
        added.iter().all(|other| other.place != Some(place) && other.name != *name).then_some(place)
    };
    for earlier in added {
        let Some(before) = earlier.declaration.before.iter().filter_map(empty).min() else { continue };
        let comes_after =
            |later: &&Added| later.declaration.after.iter().filter_map(empty).any(|after| before <= after);
        let later = added.iter().filter(|later| later.id != earlier.id).filter(comes_after);
        orders.extend(later.map(|later| (earlier.id, later.id)));
    }
    Ok(orders)
}

/// The process of this name; where it is an empty place of the chain, the nearest on the side of it that `is_on_side` says.
///
/// # Errors
/// If the name is nobody's.
fn find(
    places: &[String],
    added: &[Added],
    name: &str,
    is_on_side: impl Fn(usize, usize) -> bool,
) -> Result<Option<NodeId>, NoSuchName> {
    if let Some(found) = added.iter().find(|other| other.name == name) {
        return Ok(Some(found.id));
    }
    let wanted = places.iter().position(|place| place == name).ok_or(NoSuchName)?;
    let on_side = added.iter().filter_map(|other| other.place.map(|place| (place, other.id)));
    let nearest =
        on_side.filter(|(place, _)| is_on_side(wanted, *place)).min_by_key(|(place, _)| place.abs_diff(wanted));
    Ok(nearest.map(|(_, id)| id))
}

/// A name that is nobody's.
struct NoSuchName;

impl NoSuchName {
    fn unknown(self, process: &Added, other: &str) -> PlanError {
        PlanError::UnknownProcess { process: process.name.clone(), other: other.to_owned() }
    }
}

/// Asks a process once for what it reads and writes.
fn declared(process: Arc<dyn RenderProcess>) -> Result<PlannedProcess, PlanError> {
    let mut declare = Declare::default();
    catch(|| process.declare(&mut declare))
        .map_err(|panic| ProcessError::Panicked { process: process.name().to_owned(), message: panic.message })?;
    let declaration = declare.finish();
    if declaration.accesses.iter().filter(|(_, access)| access.is_depth()).count() > 1 {
        return Err(PlanError::TwoDepths { process: process.name().to_owned() });
    }
    Ok(PlannedProcess { process, declaration })
}

/// The targets that one process writes and another then uses, in the words of a drawing.
fn shared(before: &Declaration, after: &Declaration) -> String {
    let mut names: Vec<_> = after
        .accesses
        .iter()
        .filter_map(|(target, access)| {
            let same_views = access.views(after.views) == before.views;
            (same_views && before.written().any(|written| written == target)).then_some(target.as_str())
        })
        .collect();
    // A target may be tested and sampled at once.
    names.sort_unstable();
    names.dedup();
    names.join(", ")
}

/// Views of different kinds have different targets, even where their names are the same.
fn resource_name(kind: ViewKind, target: &str) -> String {
    match kind {
        ViewKind::Main => target.to_owned(),
        other => format!("{}: {target}", other.name()),
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;
    use crate::process::{
        ClearColor, CommandDraws, Draws, Format, GeometryBuffer, GeometryFormats, LightVolumes, ToneMapping,
    };
    use crate::scene::LightKind;

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

    fn plan(processes: Vec<Arc<dyn RenderProcess>>) -> Result<FramePlan, PlanError> {
        FramePlan::new(Vec::new(), processes, &["picture".to_owned()])
    }

    fn shipped() -> Vec<Arc<dyn RenderProcess>> {
        let formats = GeometryFormats::default();
        let lights = LightVolumes::new(LightKind::Point, formats);
        vec![Arc::new(ToneMapping::default()), Arc::new(lights), Arc::new(GeometryBuffer::new(formats))]
    }

    #[test]
    fn the_order_follows_from_reads_and_writes_alone() {
        let plan = plan(shipped()).unwrap();
        let names: Vec<_> = plan.processes().iter().map(|planned| planned.process.name()).collect();
        assert_eq!(names, ["geometry buffer", "point lights", "tone mapping"]);
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
        processes.push(Arc::new(Made("overlay", |declare: &mut Declare| {
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
        assert!(error.contains("nothing writes \"radiance\"") && error.contains("point lights"), "{error}");

        let mut processes = shipped();
        processes.push(Arc::new(Made("fog", |declare: &mut Declare| declare.after("weather"))));
        let error = plan(processes).err().unwrap();
        assert_eq!(error, PlanError::UnknownProcess { process: "fog".into(), other: "weather".into() });

        let mut processes = shipped();
        processes.push(Arc::new(Made("again", |declare: &mut Declare| {
            declare.clears_color("diffuse", Format::R32Float, ClearColor::Background);
            declare.after("geometry buffer");
            declare.keep();
        })));
        let error = plan(processes).err().unwrap();
        assert!(matches!(&error, PlanError::TwoFormats { target, .. } if target == "diffuse"), "{error}");

        let mut processes = shipped();
        processes.push(Arc::new(Made("blind", |declare: &mut Declare| {
            declare.tests_depth("diffuse");
            declare.keep();
        })));
        let error = plan(processes).err().unwrap();
        assert!(matches!(&error, PlanError::WrongFormat { process, .. } if process == "blind"), "{error}");

        let error = FramePlan::new(Vec::new(), shipped(), &["painting".to_owned()]).err().unwrap().to_string();
        assert!(error.contains("painting"), "{error}");
        assert!(plan(Vec::new()).is_err());
    }
}
