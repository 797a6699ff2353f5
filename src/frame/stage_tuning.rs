//! What is tuned by measurement in the frames of one stage graph.

use std::sync::Arc;

use super::cost_model::CostModel;
use super::culling::OcclusionControls;
use super::tables::FrameTables;
use crate::backend::{Backend, CallPanic, GuardedBackend};
use crate::graph::ModeChoice;
use crate::process::{FramePlan, Pass};
use crate::timeline::{FrameTuning, Labels, TuningAlternative, TuningChoice, TuningSubject};
use crate::view::RenderView;

/// What is tuned by measurement in the frames of one stage graph, beside the run mode, which its schedule tunes.
pub(super) struct StageTuning {
    pub(super) costs: CostModel,
    pub(super) occlusion: OcclusionControls,
    labels: TuningLabels,
}

/// What the parts of a frame are called in [`FrameTuning`].
pub(super) struct TuningLabels {
    /// By node of the cost model.
    nodes: Vec<Arc<Labels>>,
    passes: Vec<Arc<Labels>>,
    views: Vec<Arc<Labels>>,
}

impl TuningLabels {
    /// The labels of a graph. Those of nodes are in the order of the cost model.
    pub(super) fn new(nodes: Vec<Arc<Labels>>, plan: &FramePlan, passes: &[Pass], views: &[RenderView]) -> Self {
        let labels = |process: Option<&str>, view: &RenderView| {
            let (process, view) = (process.map(Arc::from), Some(Arc::from(view.name())));
            Arc::new(Labels { process, stage: None, view })
        };
        let name = |pass: &Pass| plan.processes()[pass.process_index].name.as_str();
        Self {
            nodes,
            passes: passes.iter().map(|pass| labels(Some(name(pass)), &views[pass.view_index])).collect(),
            views: views.iter().map(|view| labels(None, view)).collect(),
        }
    }
}

impl StageTuning {
    /// The tuning of nodes whose cost kinds have these indices, and of views with these occlusion tests.
    pub(super) fn new(kind_of_node: Vec<usize>, occlusion: OcclusionControls, labels: TuningLabels) -> Self {
        Self { costs: CostModel::new(kind_of_node), occlusion, labels }
    }

    /// What was chosen for the frame that has run. Chooses for the next frame by what was measured.
    ///
    /// # Errors
    /// If the backend panics.
    pub(super) fn update<B: Backend>(
        &mut self,
        run_mode: Option<ModeChoice>,
        tables: &FrameTables,
        backend: &GuardedBackend<B>,
        frame: &B::Frame,
    ) -> Result<FrameTuning, CallPanic> {
        let occlusion = self.occlusion.choices(tables, &self.labels.views);
        let mut recording = Vec::new();
        for (pass, labels) in self.labels.passes.iter().enumerate() {
            recording.extend(backend.recording_choice(frame, pass, labels)?);
        }
        let choices = run_mode.map(run_mode_choice).into_iter().chain(occlusion).chain(recording).collect();
        let job_sizes = self.costs.take_sizes(&self.labels.nodes).collect();
        self.occlusion.update(tables);
        self.costs.update();
        Ok(FrameTuning { choices, job_sizes })
    }
}

fn run_mode_choice(choice: ModeChoice) -> TuningChoice {
    let ModeChoice { parallel, is_trial, serial_nanoseconds, parallel_nanoseconds } = choice;
    let alternatives = vec![
        TuningAlternative { name: "serial".into(), nanoseconds: serial_nanoseconds },
        TuningAlternative { name: "parallel".into(), nanoseconds: Some(parallel_nanoseconds) },
    ];
    let (subject, chosen) = (TuningSubject::RunMode, usize::from(parallel));
    TuningChoice { subject, labels: Arc::default(), alternatives, chosen, is_trial }
}
