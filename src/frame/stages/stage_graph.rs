//! The frame's stage graph: which stages a frame has, and which waits for which; kept for frames that have the same.

use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

use super::context::FrameContext;
use super::culling::{CullingOptions, OcclusionControls, allows_triangle_culling};
use super::granularity::{Granularity, StageGroup, StageTuning, TuningLabels};
use super::stage::{Stage, StageNode, StageOwner};
use super::tables::{FrameTables, PassMode, ViewLevels, orders_by_bin};
use crate::backend::Backend;
use crate::command::Selection;
use crate::frame::nodes::borrowed_nodes::{BorrowedNodes, NodeKeys};
use crate::frame::static_groups::ListConditions;
use crate::frame::{CpuNode, FrameError, NodeContext};
use crate::graph::{FrameGraph, Node, NodeError, NodeId, Schedule};
use crate::process::{Draws, FramePasses, FramePlan, Pass, SampledViews};
use crate::quality::{DepthPrecision, Quality};
use crate::scene::{LayerMask, Projection, SceneRef, ViewKind, run_node_job};
use crate::task::Worker;
use crate::timeline::Labels;
use crate::view::{LevelSelector, RenderView, ViewId};

/// The stages of a frame for one plan and one list of views, compiled to a schedule, with what is measured about them.
pub(in crate::frame) struct StageGraph<B: Backend> {
    pub(in crate::frame) schedule: Schedule<FrameNode<B>>,
    pub(in crate::frame) tuning: StageTuning,
    /// In submission order.
    pub(in crate::frame) passes: Arc<[Pass]>,
    /// One for each pass.
    modes: Vec<PassMode>,
    pub(in crate::frame) sampled_views: SampledViews,
    pub(in crate::frame) plan: Arc<FramePlan>,
    /// For each view whether a pass of it draws commands.
    view_draws_commands: Vec<bool>,
    /// The cost kinds of the tuning, by stage and by the index of the process.
    cost_kinds: HashMap<(Arc<str>, Option<usize>), usize>,
    /// What else the graph was built for.
    key: GraphKey,
}

/// What a cost kind is known by in all graphs: the stage or CPU node, and the kind of views and the name of the
/// process.
type CostKindName<'a> = (&'a str, Option<(ViewKind, &'a str)>);

/// What decides, beside the plan, which stages a frame has. Equal keys of one plan have equal graphs.
#[derive(Debug)]
struct GraphKey {
    views: Vec<ViewKey>,
    /// Of each process.
    draws: Vec<DrawsKey>,
    features: FrameFeatures,
    nodes: NodeKeys,
}

/// What decides which stages the passes of a process have, and what they may leave out.
#[derive(Clone, Copy, Debug, PartialEq)]
struct DrawsKey {
    selection: Option<Selection>,
    draws_items: bool,
    is_raw: bool,
    hides: bool,
    draws_where_hidden: bool,
}

/// The optional parts of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::frame) struct FrameFeatures {
    pub(in crate::frame) culling: CullingOptions,
    /// Whether views choose levels of detail.
    pub(in crate::frame) chooses_levels: bool,
    /// The order of opaque objects.
    pub(in crate::frame) opaque_order: DepthPrecision,
    /// Whether the scene has static groups.
    pub(in crate::frame) has_static_groups: bool,
}

/// What decides which stages a view has.
#[derive(Debug)]
struct ViewKey {
    /// That of the latest view that the key fits.
    id: ViewId,
    name: String,
    kind: ViewKind,
    /// Whether its picture is cached.
    is_cached: bool,
    is_paraboloid: bool,
    has_oblique_near_plane: bool,
    layers: LayerMask,
    samples_views: bool,
}

impl ViewKey {
    fn new(view: &RenderView) -> Self {
        Self {
            id: view.id,
            name: view.name().to_owned(),
            kind: view.kind(),
            is_cached: view.is_cached(),
            is_paraboloid: is_paraboloid(view),
            has_oblique_near_plane: view.has_oblique_near_plane(),
            layers: view.camera.layers,
            samples_views: view.camera.samples_views,
        }
    }

    fn fits(&self, view: &RenderView) -> bool {
        (self.id == view.id || (self.name.as_str(), self.kind) == (view.name(), view.kind()))
            && self.is_cached == view.is_cached()
            && (self.is_paraboloid, self.has_oblique_near_plane) == (is_paraboloid(view), view.has_oblique_near_plane())
            && (self.layers, self.samples_views) == (view.camera.layers, view.camera.samples_views)
    }
}

impl DrawsKey {
    fn new(draws: &Draws<'_>) -> Self {
        let (hides, draws_where_hidden) = (draws.hides(), draws.draws_where_hidden());
        let draws_items = matches!(draws, Draws::Items(_));
        Self { selection: draws.selection(), draws_items, is_raw: draws.is_raw(), hides, draws_where_hidden }
    }
}

fn is_paraboloid(view: &RenderView) -> bool {
    view.camera.projection == Projection::Paraboloid
}

impl GraphKey {
    /// # Errors
    /// If a node panics when it is asked for its name.
    fn new(
        draws: &[Draws<'_>],
        views: &[RenderView],
        features: FrameFeatures,
        nodes: BorrowedNodes<'_>,
    ) -> Result<Self, FrameError> {
        Ok(Self {
            views: views.iter().map(ViewKey::new).collect(),
            draws: draws.iter().map(DrawsKey::new).collect(),
            features,
            nodes: nodes.keys()?,
        })
    }

    /// Whether the key matches the inputs of a frame. Allocates nothing.
    fn fits(
        &self,
        draws: &[Draws<'_>],
        views: &[RenderView],
        features: FrameFeatures,
        nodes: BorrowedNodes<'_>,
    ) -> bool {
        self.features == features
            && self.nodes.fit(nodes)
            && self.views.len() == views.len()
            && self.views.iter().zip(views).all(|(key, view)| key.fits(view))
            && self.draws.iter().copied().eq(draws.iter().map(DrawsKey::new))
    }
}

impl<B: Backend> StageGraph<B> {
    /// The graph of a frame.
    ///
    /// # Errors
    /// If no process draws in a view, views sample each other in a circle, or the nodes make no graph.
    pub(in crate::frame) fn of_frame(
        plan: &Arc<FramePlan>,
        draws: &[Draws<'_>],
        views: &[RenderView],
        features: FrameFeatures,
        nodes: BorrowedNodes<'_>,
    ) -> Result<Self, FrameError> {
        Self::new(plan, draws, views, GraphKey::new(draws, views, features, nodes)?)
    }

    /// Whether it is the graph of a frame. Allocates nothing.
    pub(in crate::frame) fn fits(
        &self,
        plan: &FramePlan,
        draws: &[Draws<'_>],
        views: &[RenderView],
        features: FrameFeatures,
        nodes: BorrowedNodes<'_>,
    ) -> bool {
        self.plan.identity() == plan.identity() && self.key.fits(draws, views, features, nodes)
    }

    /// Remembers the ids of the views of a frame that the graph fits.
    pub(in crate::frame) fn set_view_ids(&mut self, views: &[RenderView]) {
        self.key.views.iter_mut().zip(views).for_each(|(key, view)| key.id = view.id);
    }

    /// Builds the graph: each process has a pass in each view of its kind that is not cached, and the stages of a pass
    /// run one after the other. Nothing else waits: the order of passes binds submission, not recording.
    ///
    /// # Errors
    /// If no process draws in a view, views sample each other in a circle, or the nodes make no graph.
    fn new(
        plan: &Arc<FramePlan>,
        draws: &[Draws<'_>],
        views: &[RenderView],
        key: GraphKey,
    ) -> Result<Self, FrameError> {
        let FramePasses { passes, sampled_views } = plan.passes(views).map_err(FrameError::CircularViews)?;
        for view in views {
            if !view.is_cached() && !plan.draws_views(view.kind()) {
                return Err(FrameError::NoProcess { view: view.name().to_owned(), kind: view.kind() });
            }
        }
        let occlusion = OcclusionControls::new(key.features.culling, plan, draws, &passes, views);
        let mut builder = GraphBuilder::default();
        let FrameFeatures { culling, chooses_levels, opaque_order, has_static_groups } = key.features;
        let mode_of = |pass: &Pass| {
            let selection = draws[pass.process_index].selection();
            let by_bin = |selection| orders_by_bin(selection, &views[pass.view_index], opaque_order);
            PassMode {
                draws_objects: selection.is_some(),
                draws_items: matches!(draws[pass.process_index], Draws::Items(_)),
                is_raw: draws[pass.process_index].is_raw(),
                orders_by_bin: selection.is_some_and(by_bin),
                has_static_groups,
                chooses_levels,
                tests_occlusion: occlusion.is_possible(pass.view_index),
                has_cullable_meshes: culling.culls_triangles(),
            }
        };
        let modes: Vec<_> = passes.iter().map(mode_of).collect();
        let draws_items = modes.iter().any(|mode: &PassMode| mode.draws_items);
        let of_frame = PassMode { draws_items, has_static_groups, ..PassMode::default() };
        let frame = builder.add(NodeOwner::default(), (StageOwner::Frame, 0), of_frame);
        let mut view_owners = vec![None; views.len()];
        for (index, (pass, mode)) in passes.iter().zip(&modes).enumerate() {
            let (view, process) = (&views[pass.view_index], plan.processes()[pass.process_index].name.as_str());
            // The stages of a view stand right before those of its first pass: a serial run has what they write in its
            // caches.
            let owner = if mode.draws_objects {
                let owner = view_owners[pass.view_index].get_or_insert_with(|| {
                    let owner = frame.of_view(pass.view_index, view, mode.tests_occlusion);
                    builder.add(owner, (StageOwner::View, pass.view_index), *mode)
                });
                owner.of_process(pass.process_index, process)
            } else {
                // What such a pass costs has nothing to do with occlusion.
                frame.of_view(pass.view_index, view, false).of_process(pass.process_index, process)
            };
            builder.add(owner, (StageOwner::Pass, index), *mode);
        }
        builder.add_cpu_nodes(&key.nodes)?;
        let GraphBuilder { graph, cost_kinds, kind_of_node, labels, .. } = builder;
        let labels = TuningLabels::new(labels, plan, &passes, views);
        Ok(Self {
            schedule: graph.compile().map_err(|error| key.nodes.error_of(error.problem))?,
            tuning: StageTuning::new(kind_of_node, occlusion, labels),
            view_draws_commands: view_owners.iter().map(Option::is_some).collect(),
            cost_kinds,
            passes: passes.into(),
            modes,
            sampled_views,
            plan: Arc::clone(plan),
            key,
        })
    }

    /// Takes over what was measured in the frames of another graph, where both have the same stages and views. So a
    /// frame that requires something else does not try out again what is known.
    pub(in crate::frame) fn inherit_measurements(&mut self, before: &Self) {
        self.schedule.inherit_measurements(&before.schedule);
        let kinds_before: HashMap<_, _> = before.cost_kind_names().collect();
        let pairs = self.cost_kind_names().filter_map(|(name, kind)| Some((kind, *kinds_before.get(&name)?)));
        let pairs: Vec<_> = pairs.collect();
        self.tuning.costs.inherit_estimates(&before.tuning.costs, pairs);
        let views_before: HashMap<_, _> = before.key.views.iter().map(|view| view.id).zip(0..).collect();
        let kept = self.key.views.iter().map(|view| views_before.get(&view.id).copied());
        self.tuning.occlusion.inherit_measurements(&before.tuning.occlusion, kept);
    }

    /// The cost kinds by their names.
    fn cost_kind_names(&self) -> impl Iterator<Item = (CostKindName<'_>, usize)> {
        self.cost_kinds.iter().map(|((stage, process), kind)| {
            let planned = process.map(|index| &self.plan.processes()[index]);
            ((&**stage, planned.map(|planned| (planned.declaration.views, planned.name.as_str()))), *kind)
        })
    }

    /// The name of a stage's node, of a pass in these views.
    pub(in crate::frame) fn node_name(&self, stage: &str, pass: usize, views: &[RenderView]) -> String {
        let Pass { process_index: process, view_index: view } = self.passes[pass];
        let owner = NodeOwner::default().of_view(view, &views[view], false);
        owner.of_process(process, &self.plan.processes()[process].name).name_of(stage)
    }

    /// Begins a frame of these views in the tables. The object table has begun it already.
    ///
    /// # Errors
    /// If the predicate of a view's filter panics.
    pub(in crate::frame) fn begin_frame(
        &self,
        tables: &mut FrameTables,
        scene: &SceneRef<'_>,
        (views, draws): (&[RenderView], &[Draws<'_>]),
        quality: &Quality,
        workers: usize,
        granularity: Granularity,
    ) -> Result<(), FrameError> {
        let FrameFeatures { culling, chooses_levels, .. } = self.key.features;
        let culls_triangles = culling.culls_triangles();
        tables.begin_frame(&self.plan, views, &self.passes, workers);
        let frame = tables.version(0).frame;
        for ((pass, mode), table) in self.passes.iter().zip(&self.modes).zip(&mut tables.passes) {
            let view = &views[pass.view_index];
            let selection = self.key.draws[pass.process_index].selection.map(|selection| view.selection_of(selection));
            let culls_triangles = culls_triangles && allows_triangle_culling(&self.plan, draws, view, pass);
            let of_pass = (*mode, selection, culls_triangles);
            table.begin_frame(frame, of_pass, tables.objects.len(), granularity);
        }
        let (has_layers, texture_divisions) = (!scene.layers.is_empty(), tables.objects.texture_sets().divisions());
        let conditions = ListConditions { culls_triangles, chooses_levels, has_layers, texture_divisions };
        tables.begin_static_groups(scene, conditions, &self.passes)?;
        self.tuning.occlusion.begin_frame(tables, scene.assets, views);
        if chooses_levels {
            tables.levels.set_views(views, |levels| *levels = ViewLevels::default());
        } else {
            tables.levels.clear();
        }
        for (index, view) in views.iter().enumerate() {
            if self.view_draws_commands[index] {
                let tests_occlusion = tables.culling.tests_occlusion(index);
                let version = tables.version(index);
                let (visibility, objects) = (&mut tables.visibility[index], (&tables.objects, &tables.static_groups));
                let begun =
                    visibility.begin_frame(view, objects, scene.assets, quality.culling, tests_occlusion, version);
                begun.map_err(|panic| FrameError::FilterPanicked {
                    view: view.name().to_owned(),
                    message: panic.message,
                })?;
                if chooses_levels {
                    let (selector, objects) = (LevelSelector::new(view, quality), tables.objects.len());
                    tables.levels[index].begin_frame(selector, &tables.visibility[index], objects);
                }
            } else {
                let version = tables.version(index);
                tables.visibility[index].clear(version);
            }
        }
        Ok(())
    }
}

/// The graph under construction.
struct GraphBuilder<B: Backend> {
    graph: FrameGraph<FrameNode<B>>,
    /// A stage of one process has the same cost kind in all views, whatever its nodes.
    cost_kinds: HashMap<(Arc<str>, Option<usize>), usize>,
    /// By node, in the order in which nodes were added: the index of its cost kind, and what it belongs to.
    kind_of_node: Vec<usize>,
    labels: Vec<Arc<Labels>>,
    /// The names of the stages, which nodes share.
    stage_names: HashMap<&'static str, Arc<str>>,
    /// The nodes of each stage.
    nodes_of_stages: HashMap<&'static str, Vec<NodeId>>,
}

/// What a node belongs to: the frame, a view or a pass.
#[derive(Clone, Debug, Default)]
struct NodeOwner {
    /// The view's index, and its name in graphs.
    view: Option<(usize, Arc<str>)>,
    process: Option<usize>,
    labels: Labels,
    tuned_view: Option<usize>,
    /// The stages of the owner and of those around it, by name: what later stages can wait for.
    stages: Vec<(&'static str, NodeId)>,
}

impl NodeOwner {
    fn of_view(&self, index: usize, view: &RenderView, tests_occlusion: bool) -> Self {
        let mut owner = self.clone();
        owner.view = Some((index, format!("view {index} {:?}", view.name()).into()));
        owner.labels.view = Some(view.name().into());
        owner.tuned_view = tests_occlusion.then_some(index);
        owner
    }

    fn of_process(&self, index: usize, name: &str) -> Self {
        let mut owner = self.clone();
        owner.process = Some(index);
        owner.labels.process = Some(name.into());
        owner
    }

    /// The name of a stage's node.
    fn name_of(&self, stage: &str) -> String {
        match (&self.labels.process, &self.view) {
            (Some(process), Some((_, view))) => format!("{process}, {view}, {stage}"),
            (None, Some((_, view))) => format!("{stage}, {view}"),
            _ => stage.to_owned(),
        }
    }
}

impl<B: Backend> Default for GraphBuilder<B> {
    fn default() -> Self {
        Self {
            graph: FrameGraph::new(),
            cost_kinds: HashMap::new(),
            kind_of_node: Vec::new(),
            labels: Vec::new(),
            stage_names: HashMap::new(),
            nodes_of_stages: HashMap::new(),
        }
    }
}

impl<B: Backend> GraphBuilder<B> {
    /// Adds the stages of the frame, a view or a pass that this mode needs, each after the stage that it names, and
    /// returns the owner with them.
    fn add(&mut self, mut owner: NodeOwner, (kind, of): (StageOwner, usize), mode: PassMode) -> NodeOwner {
        for stage in Stage::<B>::all_of(kind) {
            // Also of stages that this frame does without, so that no node has such a name.
            self.nodes_of_stages.entry(stage.name).or_default();
            if !(stage.is_needed)(mode) {
                continue;
            }
            let mut labels_of = |stage: &'static str| {
                let name = self.stage_names.entry(stage).or_insert_with(|| stage.into());
                Labels { stage: Some(Arc::clone(name)), ..owner.labels.clone() }
            };
            let labels = labels_of(stage.name);
            // The stage whose jobs a node sizes is the one that it shares its cost kind with.
            let cost_labels = labels_of(stage.cost_kind);
            let node = self.add_to_costs(owner.process, cost_labels);
            let tuned_view = owner.tuned_view.filter(|_| stage.depends_on_occlusion(mode));
            let view = owner.view.as_ref().map(|(index, _)| *index);
            let payload = FrameNode::Stage(StageNode { stage, of, node, view, tuned_view });
            let id = self.graph.add(owner.name_of(stage.name), payload);
            self.nodes_of_stages.entry(stage.name).or_default().push(id);
            self.graph.label(id, labels);
            self.graph.keep(id);
            let find = |name: &&str| owner.stages.iter().rev().find(|(known, _)| known == name);
            if let Some((_, before)) = stage.after.iter().find_map(find) {
                self.graph.order(*before, id);
            }
            owner.stages.push((stage.name, id));
        }
        owner
    }

    /// Adds the engine's own nodes, after all stages.
    ///
    /// # Errors
    /// If one of them declares what it cannot.
    fn add_cpu_nodes(&mut self, keys: &NodeKeys) -> Result<(), FrameError> {
        let mut ids = Vec::new();
        for (lent, name) in keys.names().enumerate() {
            let labels = Labels { stage: Some(Arc::clone(name)), ..Labels::default() };
            let node = self.add_to_costs(None, labels.clone());
            let id = self.graph.add(&**name, FrameNode::Cpu(CpuNodeIndex { lent, node }));
            self.graph.label(id, labels);
            self.graph.keep(id);
            ids.push(id);
        }
        keys.order(&mut self.graph, &ids, &self.nodes_of_stages)
    }

    /// Adds a node to the cost model, and returns its index there. Its labels name the stage or CPU node whose cost
    /// kind it has.
    fn add_to_costs(&mut self, process: Option<usize>, labels: Labels) -> usize {
        let name = labels.stage.clone().unwrap_or_default();
        let next_kind = self.cost_kinds.len();
        self.kind_of_node.push(*self.cost_kinds.entry((name, process)).or_insert(next_kind));
        self.labels.push(Arc::new(labels));
        self.labels.len() - 1
    }
}

/// The graphs of recent frames, the latest first. A scene changes what it requires and changes back, and finds its
/// graph again.
pub(in crate::frame) struct StageGraphCache<B: Backend> {
    latest_first: Vec<StageGraph<B>>,
    /// Whether they are of plans that no later frame has.
    is_outdated: bool,
}

impl<B: Backend> Default for StageGraphCache<B> {
    fn default() -> Self {
        Self { latest_first: Vec::new(), is_outdated: false }
    }
}

impl<B: Backend> StageGraphCache<B> {
    const CAPACITY: usize = 16;

    /// The graph of a frame, built if the cache does not have it.
    ///
    /// # Errors
    /// If no process draws in a view, views sample each other in a circle, or the nodes make no graph.
    pub(in crate::frame) fn get(
        &mut self,
        plan: &Arc<FramePlan>,
        draws: &[Draws<'_>],
        views: &[RenderView],
        features: FrameFeatures,
        nodes: BorrowedNodes<'_>,
    ) -> Result<&mut StageGraph<B>, FrameError> {
        let found = self.latest_first.iter().position(|graph| graph.fits(plan, draws, views, features, nodes));
        match found {
            Some(index) => self.latest_first[..=index].rotate_right(1),
            None => {
                let mut graph = StageGraph::of_frame(plan, draws, views, features, nodes)?;
                if let Some(before) = self.latest_first.first() {
                    graph.inherit_measurements(before);
                }
                let kept = if std::mem::take(&mut self.is_outdated) { 0 } else { Self::CAPACITY - 1 };
                self.latest_first.truncate(kept);
                self.latest_first.insert(0, graph);
            }
        }
        let graph = &mut self.latest_first[0];
        graph.set_view_ids(views);
        Ok(graph)
    }

    /// Drops the graphs, because later frames have other plans. The latest one stays until there is another, which
    /// inherits what was measured.
    pub(in crate::frame) fn outdate(&mut self) {
        self.latest_first.truncate(1);
        self.is_outdated = true;
    }

    /// Discards what was measured in a frame that failed.
    pub(in crate::frame) fn discard_costs(&mut self) {
        if let Some(graph) = self.latest_first.first_mut() {
            graph.tuning.costs.discard_frame();
        }
    }

    /// The graph of the latest frame; `None` before the first one.
    pub(in crate::frame) fn latest(&self) -> Option<&StageGraph<B>> {
        self.latest_first.first()
    }
}

/// A node of the frame's stage graph.
pub(in crate::frame) enum FrameNode<B: Backend> {
    Stage(StageNode<B>),
    Cpu(CpuNodeIndex),
}

/// A CPU node, by indices.
#[derive(Clone, Copy, Debug)]
pub(in crate::frame) struct CpuNodeIndex {
    /// Among those that are lent.
    pub(in crate::frame) lent: usize,
    /// In the cost model.
    pub(in crate::frame) node: usize,
}

impl CpuNodeIndex {
    fn get<'a, B: Backend>(self, frame: &FrameContext<'a, B>) -> (&'a dyn CpuNode, NodeContext<'a>) {
        let BorrowedNodes { nodes, declarations } = frame.nodes;
        let accesses = declarations.of_node(self.lent);
        (nodes[self.lent], NodeContext { request: frame.request, tables: frame.tables, accesses })
    }
}

impl<B: Backend> Node<FrameContext<'_, B>> for FrameNode<B> {
    fn width(&self, frame: &FrameContext<'_, B>) -> usize {
        match self {
            Self::Stage(stage) => stage.width(frame),
            Self::Cpu(index) => {
                let (node, frame) = index.get(frame);
                node.width(&frame)
            }
        }
    }

    fn chunk(&self, frame: &FrameContext<'_, B>) -> usize {
        match self {
            Self::Stage(stage) => stage.chunk(frame),
            Self::Cpu(index) => {
                let (node, node_frame) = index.get(frame);
                let by_cost = || frame.items_per_job_by_cost(index.node, node.width(&node_frame));
                node.items_per_job().unwrap_or_else(by_cost)
            }
        }
    }

    fn chunked_by_cost(&self, frame: &FrameContext<'_, B>) -> bool {
        match self {
            Self::Stage(stage) => stage.chunked_by_cost(frame),
            Self::Cpu(index) => index.get(frame).0.items_per_job().is_none(),
        }
    }

    fn run(&self, frame: &FrameContext<'_, B>, items: Range<usize>, worker: &Worker) -> Result<(), NodeError> {
        match self {
            Self::Stage(stage) => stage.run(frame, items, worker),
            Self::Cpu(index) => {
                let (node, node_frame) = index.get(frame);
                let count = items.len();
                let (result, took) =
                    frame.clock.measure(StageGroup::Nodes, || run_node_job(|| node.run(&node_frame, items, worker)));
                if node.items_per_job().is_none() {
                    frame.costs.add_sample(index.node, count, took);
                }
                result
            }
        }
    }
}
