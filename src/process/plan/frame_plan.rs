//! From a list of processes to what a frame does, in order.

use std::collections::HashMap;
#[cfg(feature = "wgpu")]
use std::sync::Weak;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use super::frame_passes::view_groups;
use super::planned_process::ProcessId;
use super::planned_target::{Attachments, absent_layers, check_blending, check_stencil, reads_layers, targets_of};
use super::process_graph::{compile, node_name};
use super::resource_names::passed_on_resources;
use super::sampled_views::{absent_targets, check_sampled_views};
use super::shared_declarations::{SharedDeclarations, check_columns, check_material_types};
use super::unknown_targets::check_left_out;
use super::{AttachmentExtent, FramePasses, PlanError, PlannedProcess, PlannedTarget, TargetIndices, ViewGroup};
use crate::graph::{GraphProblem, Schedule};
use crate::process::{BufferLayout, DeclaredAttribute, Draws, PipelineProcesses, RenderProcess};
use crate::scene::{ColumnLayout, MaterialLayout, SceneRef, ViewKind};
use crate::unwind::{discard_all, emit};
use crate::view::RenderView;

/// What every frame does: its processes in the order they are submitted, and the targets that they use.
pub struct FramePlan {
    identity: u64,
    #[cfg_attr(not(feature = "wgpu"), expect(dead_code, reason = "only the wgpu backend caches something for a plan"))]
    alive: Arc<()>,
    processes: Vec<PlannedProcess>,
    view_groups: Vec<ViewGroup>,
    /// Pairs of processes, by index: the first comes before the second.
    dependencies: Vec<(usize, usize)>,
    targets: Vec<PlannedTarget>,
    shared: SharedDeclarations,
    /// Of each process.
    attachments: Vec<Attachments>,
    /// What is wrong with the processes that are left out.
    left_out: Result<(), PlanError>,
    /// The graph of the processes, whose nodes are the indices of the processes before they were ordered.
    schedule: Schedule<usize>,
    /// Whether no process is left out because the frame lacks its views.
    has_all_views: bool,
    /// Written on first use.
    dot: OnceLock<String>,
}

impl FramePlan {
    /// Orders processes by what they read and write, and drops those on which no output depends. Where reads and writes
    /// leave the order open, the earlier [`ViewKind`] goes first, then the process that was added first (M 10.4).
    ///
    /// # Errors
    /// See [`PlanError`].
    pub fn new(processes: Vec<Arc<dyn RenderProcess>>, outputs: &[String]) -> Result<Self, PlanError> {
        let plan = Self::of_pipeline(PipelineProcesses::default(), processes, outputs, |_| true)?;
        plan.check_left_out()?;
        Ok(plan)
    }

    /// The plan of frames that have the kinds of views that `is_present` tells, with the processes of a pipeline.
    ///
    /// The slots of the pipeline are a chain, whose order is known: a process that uses a target goes behind those
    /// before it in the chain that write it. The chain does not order its processes against writers of the same target
    /// that are outside of it.
    ///
    /// What processes sample of the kinds of views that are not present, they find empty. Orders and outputs that name
    /// what only those kinds have are ignored.
    ///
    /// # Errors
    /// See [`PlanError`].
    pub(crate) fn of_pipeline(
        mut pipeline: PipelineProcesses,
        processes: Vec<Arc<dyn RenderProcess>>,
        outputs: &[String],
        is_present: impl Fn(ViewKind) -> bool,
    ) -> Result<Self, PlanError> {
        let slots = std::mem::take(&mut pipeline.slots);
        let slot_names: Vec<_> = slots.iter().map(|slot| slot.name.clone()).collect();
        let are_replacements: Vec<_> = slots.iter().map(|slot| slot.is_replacement).collect();
        let mut added: Vec<(Option<usize>, PlannedProcess)> = Vec::new();
        for (index, slot) in slots.into_iter().enumerate() {
            let Some(process) = slot.process else { continue };
            let mut of_kinds = PlannedProcess::of_each_kind(&process, true)?;
            let own = of_kinds.iter_mut().filter(|planned| planned.is_of_own_kind);
            own.for_each(|planned| planned.declaration.keep |= slot.keep);
            added.extend(of_kinds.into_iter().map(|planned| (Some(index), planned)));
        }
        for process in &processes {
            let of_kinds = PlannedProcess::of_each_kind(process, false)?;
            added.extend(of_kinds.into_iter().map(|planned| (None, planned)));
        }
        let is_drawn = |(_, planned): &(_, PlannedProcess)| is_present(planned.declaration.views);
        let (mut added, absent): (Vec<_>, Vec<_>) = added.into_iter().partition(is_drawn);
        let absent: Vec<_> = absent.into_iter().map(|(_, planned)| planned).collect();
        added.sort_by_key(|(_, planned)| planned.declaration.views);
        let is_output = |output: &&String| {
            let writes = |planned: &PlannedProcess| planned.is_output_writer(output);
            added.iter().any(|(_, planned)| writes(planned)) || !absent.iter().any(writes)
        };
        let outputs: Vec<_> = outputs.iter().chain(&pipeline.outputs).filter(is_output).cloned().collect();
        let absent_layers = absent_layers(&pipeline, &added, &absent);
        let schedule = compile(&slot_names, &added, &absent, &absent_layers, &outputs)?;
        let shipped = added.iter().filter(|(_, planned)| slot_names.contains(&planned.name));
        let shipped: Vec<_> = shipped.map(|(_, planned)| node_name(&added, planned)).collect();
        for process in schedule.dropped().iter().filter(|name| !shipped.contains(name)) {
            let message = "no output depends on this process, so it is not drawn";
            emit(|| tracing::warn!(target: "drawloom", %process, "{message}"));
        }
        let dependencies_of = |after| schedule.dependencies(after).iter().map(move |&before| (before, after));
        let edges: Vec<_> = (0..schedule.len()).flat_map(dependencies_of).collect();
        let mut processes: Vec<_> = schedule.nodes().map(|(_, index)| added[*index].1.clone()).collect();
        // What a pipeline draws in further kinds of views may lack what the engine's own processes draw in one kind.
        let is_of_engine = |(slot, planned): &(Option<usize>, PlannedProcess)| {
            slot.is_none_or(|slot| are_replacements[slot] && planned.is_of_own_kind)
        };
        let is_left_out = |index: usize| schedule.nodes().all(|(_, kept)| *kept != index);
        let is_checked = |index: usize| is_of_engine(&added[index]) && is_left_out(index);
        let left_out = check_left_out(&added, is_checked, &absent, &absent_layers);
        if processes.is_empty() && absent.is_empty() {
            return Err(left_out.err().unwrap_or(PlanError::Empty));
        }
        let view_groups = view_groups(&processes, &edges);
        let mut targets = targets_of(&processes, &outputs)?;
        let is_read = |target: &PlannedTarget| processes.iter().any(|planned| reads_layers(planned, target));
        targets.extend(absent_layers.into_iter().filter(is_read));
        targets.extend(absent_targets(&processes, &absent, &targets));
        check_sampled_views(&processes, &targets)?;
        let shared = SharedDeclarations::new(&processes)?;
        let attachments = processes.iter().map(|planned| Attachments::new(planned, &targets)).collect();
        // Relaxed: identities are compared for equality only.
        let identity = NEXT_IDENTITY.fetch_add(1, Ordering::Relaxed);
        for (index, planned) in processes.iter_mut().enumerate() {
            planned.id = ProcessId { plan: identity, index };
            planned.targets = TargetIndices::new(planned, &targets)?;
        }
        Ok(Self {
            identity,
            alive: Arc::default(),
            processes,
            view_groups,
            dependencies: edges,
            targets,
            shared,
            attachments,
            left_out,
            schedule,
            has_all_views: absent.is_empty(),
            dot: OnceLock::new(),
        })
    }

    /// Checks the processes that are left out because no output depends on them, for a plan that has all processes
    /// which any frame has.
    ///
    /// # Errors
    /// If one of them names a target that no process creates.
    pub(crate) fn check_left_out(&self) -> Result<(), PlanError> {
        self.left_out.clone()
    }

    /// A number that no other plan of this program has.
    pub fn identity(&self) -> u64 {
        self.identity
    }

    /// Whether no process is left out because the frame lacks its views: then frames with other views have this plan
    /// too, unless a pipeline's requirements differ.
    pub(crate) fn has_all_views(&self) -> bool {
        self.has_all_views
    }

    /// Gives the processes the ids that are known of their names and kinds of views, and makes the others known.
    pub(crate) fn share_process_ids(&mut self, known: &mut HashMap<(ViewKind, String), ProcessId>) {
        for planned in &mut self.processes {
            planned.id = *known.entry((planned.declaration.views, planned.name.clone())).or_insert(planned.id);
        }
    }

    /// A token that expires with the plan: a cache that holds it can drop what it made for the plan.
    #[cfg(feature = "wgpu")]
    pub(crate) fn alive(&self) -> Weak<()> {
        Arc::downgrade(&self.alive)
    }

    /// The processes in the order in which a view's queue has their passes.
    pub fn processes(&self) -> &[PlannedProcess] {
        &self.processes
    }

    /// The order in which views are submitted: the groups one after the other, except where a view
    /// [samples](crate::process::Declare::samples_view) another one. Each view is submitted with its whole queue,
    /// except in groups that are submitted [process by process](super::ViewOrder::ProcessByProcess).
    pub fn view_groups(&self) -> &[ViewGroup] {
        &self.view_groups
    }

    /// The passes of a frame with these views, in submission order: each process in each view of its kind whose picture
    /// is not cached. A view comes after those that it [samples](crate::process::Declare::samples_view).
    ///
    /// # Errors
    /// If views sample each other in a circle.
    pub(crate) fn passes(&self, views: &[RenderView]) -> Result<FramePasses, GraphProblem> {
        let parts = self.view_groups.iter().flat_map(|group| group.parts(&self.processes, views)).collect();
        FramePasses::new(&self.processes, &self.dependencies, views, parts)
    }

    /// What every process draws in this frame, in order: calls [`RenderProcess::draws`] of each.
    ///
    /// # Errors
    /// If a process panics, or its draws do not fit its declaration or its targets.
    pub fn draws<'a>(&'a self) -> Result<Vec<Draws<'a>>, PlanError> {
        let checked = |(planned, attachments): (&'a PlannedProcess, &'a Attachments)| {
            let draws = planned.draws()?;
            check_blending(planned, &draws, attachments)?;
            check_stencil(planned, &draws, attachments)?;
            Ok(draws)
        };
        self.processes.iter().zip(&self.attachments).map(checked).collect()
    }

    /// Whether any process draws in views of this kind.
    pub fn draws_views(&self, kind: ViewKind) -> bool {
        self.processes.iter().any(|planned| planned.declaration.views == kind)
    }

    /// The targets that views of each kind have.
    pub fn targets(&self) -> &[PlannedTarget] {
        &self.targets
    }

    /// The index of the target of this name in views of a kind.
    #[cfg(any(feature = "wgpu", feature = "software"))]
    pub(crate) fn target_index(&self, views: ViewKind, name: &str) -> Option<usize> {
        super::target_indices::target_index(&self.targets, views, name)
    }

    /// The targets that are copied at the end of each frame: the index of each copy, and that of what is copied.
    #[cfg(any(feature = "wgpu", feature = "software"))]
    pub(crate) fn histories(&self) -> impl Iterator<Item = (usize, usize)> {
        let source = |copy: &PlannedTarget| self.target_index(copy.views, copy.copy_of.as_deref()?);
        self.targets.iter().enumerate().filter_map(move |(index, copy)| Some((index, source(copy)?)))
    }

    /// The pixels of the targets that a process, by index, draws into; those of the picture if it draws into none.
    pub fn attachment_extent(&self, process: usize) -> AttachmentExtent {
        self.attachments[process].extent
    }

    /// The columns of objects that the processes read, each once.
    pub fn columns(&self) -> &[ColumnLayout] {
        &self.shared.columns
    }

    /// The material types that the processes read, each once.
    pub fn material_types(&self) -> &[MaterialLayout] {
        &self.shared.material_types
    }

    /// The attributes of vertices that the processes read, each once.
    pub fn attributes(&self) -> &[DeclaredAttribute] {
        &self.shared.attributes
    }

    /// The buffers that the processes share, each once.
    pub fn buffers(&self) -> &[BufferLayout] {
        &self.shared.buffers
    }

    /// # Errors
    /// If a scene with these material types lacks what the processes read, select or order by, or has it in another
    /// size.
    pub(crate) fn check_scene(
        &self,
        draws: &[Draws<'_>],
        scene: &SceneRef<'_>,
        material_types: &[MaterialLayout],
    ) -> Result<(), PlanError> {
        check_columns(&self.processes, draws, scene)?;
        check_material_types(&self.processes, draws, material_types)
    }

    /// Whether a raw pass uses the target.
    #[cfg(feature = "wgpu")]
    pub(crate) fn has_raw_access(&self, target: &PlannedTarget) -> bool {
        super::sampled_views::has_raw_access(&self.processes, target)
    }

    /// The names of the processes that were dropped because no output depends on them.
    pub fn dropped(&self) -> &[String] {
        self.schedule.dropped()
    }

    /// The processes as a graph in the DOT language; edges are labelled with the targets that one process leaves to the
    /// next.
    pub fn to_dot(&self) -> &str {
        self.dot.get_or_init(|| {
            let declaration = |index: usize| &self.processes[index].declaration;
            self.schedule.to_labelled_dot(|before, after| passed_on_resources(declaration(before), declaration(after)))
        })
    }
}

static NEXT_IDENTITY: AtomicU64 = AtomicU64::new(0);

/// The last plan with a process drops it, on whatever thread that is.
impl Drop for FramePlan {
    fn drop(&mut self) {
        discard_all(self.processes.drain(..));
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::ViewOrder;
    use super::super::test_process::TestProcess;
    use super::*;
    use crate::process::{ClearColor, Declare, Format, GeometryBuffer, GeometryFormats, LightVolumes, ToneMapping};
    use crate::scene::{Camera, LightKind};

    fn plan(processes: Vec<Arc<dyn RenderProcess>>) -> Result<FramePlan, PlanError> {
        FramePlan::new(processes, &["picture".to_owned()])
    }

    fn shipped() -> Vec<Arc<dyn RenderProcess>> {
        let formats = GeometryFormats::default();
        let lights = LightVolumes::new(LightKind::Point, formats);
        vec![Arc::new(ToneMapping::default()), Arc::new(lights), Arc::new(GeometryBuffer::new(formats))]
    }

    #[test]
    fn reads_and_writes_determine_the_order() {
        let plan = plan(shipped()).unwrap();
        let names: Vec<_> = plan.processes().iter().map(|planned| planned.name.as_str()).collect();
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
    fn a_process_that_no_output_depends_on_is_dropped_with_its_targets() {
        let mut processes = shipped();
        processes.push(Arc::new(TestProcess("overlay", |declare: &mut Declare| {
            declare.clears_color("overlay", Format::Rgba8Unorm, ClearColor::Background);
        })));
        let plan = plan(processes).unwrap();
        assert_eq!(plan.dropped(), ["overlay"]);
        assert!(plan.targets().iter().all(|target| target.name != "overlay"));
    }

    #[test]
    fn errors_name_the_process_or_target() {
        let mut processes = shipped();
        processes.pop();
        let error = plan(processes).err().unwrap().to_string();
        assert!(error.contains("no process writes target \"radiance\"") && error.contains("point lights"), "{error}");

        let mut processes = shipped();
        processes.push(Arc::new(TestProcess("fog", |declare: &mut Declare| declare.after("weather"))));
        let error = plan(processes).err().unwrap();
        assert_eq!(error, PlanError::UnknownProcess { process: "fog".into(), other: "weather".into() });

        let mut processes = shipped();
        processes.push(Arc::new(TestProcess("again", |declare: &mut Declare| {
            declare.clears_color("diffuse", Format::R32Float, ClearColor::Background);
            declare.after("geometry buffer");
            declare.keep();
        })));
        let error = plan(processes).err().unwrap();
        assert!(matches!(&error, PlanError::ConflictingFormats { target, .. } if target == "diffuse"), "{error}");

        let mut processes = shipped();
        processes.push(Arc::new(TestProcess("depth test", |declare: &mut Declare| {
            declare.tests_depth("diffuse");
            declare.keep();
        })));
        let error = plan(processes).err().unwrap();
        assert!(matches!(&error, PlanError::WrongFormat { process, .. } if process == "depth test"), "{error}");

        let error = FramePlan::new(shipped(), &["unknown".to_owned()]).err().unwrap().to_string();
        assert!(error.contains("unknown"), "{error}");
        assert!(plan(Vec::new()).is_err());
    }

    /// A process of some kind of view that writes and reads these targets; layered ones are written by clearing, and
    /// read as layers of the kind that is given.
    fn view_process(
        name: &'static str,
        kind: ViewKind,
        writes: Option<&'static str>,
        reads: Option<(&'static str, ViewKind)>,
    ) -> Arc<dyn RenderProcess> {
        Arc::new(TestProcess(name, move |declare: &mut Declare| {
            declare.views(kind);
            if let Some(target) = writes {
                declare.clears_depth_layer(target, Format::Depth32Float);
            }
            if let Some((target, kind)) = reads {
                declare.samples_layers(kind, target);
            }
            declare.keep();
        }))
    }

    fn groups_of(processes: Vec<Arc<dyn RenderProcess>>) -> Vec<(Vec<ViewKind>, ViewOrder)> {
        let plan = FramePlan::new(processes, &[]).unwrap();
        plan.view_groups().iter().map(|group| (group.kinds.clone(), group.order)).collect()
    }

    #[test]
    fn views_are_submitted_after_the_views_that_they_read() {
        use ViewKind::{Main, Reflection, Shadow};
        use ViewOrder::ViewByView;
        let processes = || {
            vec![
                view_process("reflection", Reflection, Some("mirrors"), Some(("portals", Main))),
                view_process("picture", Main, Some("portals"), Some(("maps", Shadow))),
                view_process("casters", Shadow, Some("maps"), None),
            ]
        };
        let one_by_one = [Shadow, Main, Reflection].map(|kind| (vec![kind], ViewByView));
        assert_eq!(groups_of(processes()), one_by_one);

        let plan = FramePlan::new(processes(), &[]).unwrap();
        let view = |kind| RenderView::new(&Camera { kind, ..Camera::looking_at("", DVec3::Z, DVec3::ZERO) });
        let views = [view(Main), view(Main), view(Reflection), view(Shadow)];
        let order: Vec<_> = plan.passes(&views).unwrap().passes.iter().map(|pass| pass.view_index).collect();
        assert_eq!(order, [3, 0, 1, 2]);
    }

    #[test]
    fn views_that_read_each_other_are_submitted_process_by_process() {
        use ViewKind::{Main, Reflection, Shadow};
        use ViewOrder::{ProcessByProcess, ViewByView};
        let mutual = vec![
            view_process("first", Main, Some("a"), None),
            view_process("mirror", Reflection, Some("b"), Some(("a", Main))),
            view_process("second", Main, Some("c"), Some(("b", Reflection))),
            view_process("casters", Shadow, Some("maps"), None),
        ];
        let plan = FramePlan::new(mutual, &[]).unwrap();
        let groups = plan.view_groups();
        assert_eq!((groups[0].kinds.as_slice(), groups[0].order), ([Shadow].as_slice(), ViewByView));
        assert_eq!((groups[1].kinds.as_slice(), groups[1].order), ([Reflection, Main].as_slice(), ProcessByProcess));
        let view = |kind| RenderView::new(&Camera { kind, ..Camera::looking_at("", DVec3::Z, DVec3::ZERO) });
        let views = [view(Main), view(Main), view(Reflection)];
        let names: Vec<_> = plan
            .passes(&views)
            .unwrap()
            .passes
            .iter()
            .map(|pass| (plan.processes()[pass.process_index].name.as_str(), pass.view_index))
            .collect();
        assert_eq!(names, [("first", 0), ("first", 1), ("mirror", 2), ("second", 0), ("second", 1)]);

        let own_layers = vec![
            view_process("write", Main, Some("layers"), None),
            view_process("read", Main, None, Some(("layers", Main))),
        ];
        assert_eq!(groups_of(own_layers), [(vec![Main], ProcessByProcess)]);
    }
}
