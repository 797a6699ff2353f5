//! The granularities differ in the number of jobs by what they mean, in each stage (M 10.5).

use std::collections::BTreeMap;
use std::sync::Arc;

use drawloom::backend::{Backend, NullBackend};
use drawloom::process::Deferred;
use drawloom::quality::Quality;
use drawloom::task::Scheduler;
use drawloom::timeline::Run;
use drawloom::{Granularity, Renderer, Submitter};
use drawloom_testing::scenes::field;

/// What a frame divides.
struct Frame {
    /// By process, view and stage.
    jobs: BTreeMap<[String; 3], usize>,
    /// By view.
    visible: BTreeMap<String, usize>,
    /// By process and view, of its draw list.
    commands: BTreeMap<[String; 2], usize>,
    batches: BTreeMap<[String; 2], usize>,
}

const OBJECTS: usize = 3_000;

fn renderer_of<B: Backend>(
    backend: B,
    granularity: Granularity,
    quality: Quality,
    instancing: bool,
) -> (Renderer<B>, Submitter<B>) {
    let builder = Renderer::builder(backend).pipeline(Deferred::to_picture()).quality(quality);
    let scheduler = Arc::new(Scheduler::new(2).unwrap());
    builder.granularity(granularity).instancing(instancing).build(scheduler).unwrap()
}

/// The first frame of the field, before any cost is known.
fn first_frame(granularity: Granularity, quality: Quality, instancing: bool) -> Frame {
    let scene = field(OBJECTS);
    let (mut renderer, _submitter) = renderer_of(NullBackend, granularity, quality, instancing);
    renderer.scheduler().timeline().start();
    let recorded = renderer.record(scene.as_scene_ref()).unwrap();
    let views = &recorded.statistics().views;
    let visible = views.iter().map(|view| (view.name.to_string(), view.visible)).collect();
    let log = renderer.scheduler().timeline().take();
    let (mut commands, mut batches) = (BTreeMap::new(), BTreeMap::new());
    for process in renderer.plan().processes().iter().map(|process| &process.name) {
        for (index, view) in scene.cameras.iter().enumerate() {
            if let Some(list) = renderer.draw_list(process, index) {
                let key = [process.to_string(), view.name.to_string()];
                commands.insert(key.clone(), list.objects.len());
                batches.insert(key, list.batches.len());
            }
        }
    }
    Frame { jobs: jobs_of(&log.runs[0]), visible, commands, batches }
}

/// The number of jobs of each node, by process, view and stage.
fn jobs_of(run: &Run) -> BTreeMap<[String; 3], usize> {
    let nodes = run.graph.nodes.iter().enumerate();
    let labelled = nodes.map(|(index, node)| {
        let labels = [&node.labels.process, &node.labels.view, &node.labels.stage];
        (labels.map(|label| label.as_deref().unwrap_or_default().to_owned()), run.chunks_of(index).len())
    });
    labelled.collect()
}

/// The stages that divide draws, and those before, which have none.
const OF_DRAWS: [&str; 5] = ["fill", "sort", "instance", "bin", "record"];
const BEFORE_DRAWS: [&str; 3] = ["objects", "upload", "visibility"];

/// Compares the number of jobs of each stage with what the granularity says of its draws.
fn check(granularity: Granularity, quality: Quality, instancing: bool, jobs_of_draws: impl Fn(usize) -> usize) {
    let frame = first_frame(granularity, quality, instancing);
    let adaptive = first_frame(Granularity::Adaptive, quality, instancing);
    let mut checked = 0;
    for ([process, view, stage], &jobs) in &frame.jobs {
        let pass = [process.clone(), view.clone()];
        let draws = match stage.as_str() {
            "fill" | "bin" => frame.visible[view],
            "sort" | "instance" => frame.commands[&pass],
            "record" => frame.batches.get(&pass).copied().unwrap_or_default(),
            _ => {
                if BEFORE_DRAWS.contains(&stage.as_str()) {
                    let is_per_view = granularity == Granularity::PerCamera && !view.is_empty();
                    let expected =
                        if is_per_view { 1 } else { adaptive.jobs[&[process.clone(), view.clone(), stage.clone()]] };
                    assert_eq!(jobs, expected, "{granularity:?}: {stage} of {view:?}");
                }
                continue;
            }
        };
        assert!(OF_DRAWS.contains(&stage.as_str()));
        // Without draws, sorting and ordering by bin are one job that finds none, and recording is none.
        let expected =
            if draws == 0 { usize::from(stage != "record" && stage != "fill") } else { jobs_of_draws(draws) };
        assert_eq!(jobs, expected, "{granularity:?}: {stage} of {process:?} in {view:?}, {draws} draws");
        checked += usize::from(draws > 64);
    }
    assert!(checked >= 4, "{checked}");
}

#[test]
fn granularities_differ_by_what_they_mean_in_each_stage() {
    // Opaque objects are ordered by depth, or by bin.
    for quality in [Quality::exact(), Quality::balanced()] {
        for instancing in [false, true] {
            check(Granularity::PerDraw, quality, instancing, |draws| draws);
            check(Granularity::PerCamera, quality, instancing, |_| 1);
            for chunk in [7, 64, 300] {
                // 300 draws are two bundles of 150.
                check(Granularity::Chunk(chunk), quality, instancing, |draws| draws.div_ceil(chunk));
            }
        }
    }
}

#[cfg(feature = "wgpu")]
#[test]
fn a_job_records_one_draw_whatever_is_cheaper() {
    use drawloom::backend::WgpuBackend;
    use drawloom_testing::adapter;

    let scene = field(400);
    let recording_jobs = |granularity| {
        let (device, queue) = adapter::noop_device().unwrap();
        let backend = WgpuBackend::new(device, queue).unwrap();
        let (mut renderer, submitter) = renderer_of(backend, granularity, Quality::balanced(), false);
        // Long enough for every strategy to have been tried.
        for _ in 0..60 {
            submitter.submit(renderer.record(scene.as_scene_ref()).unwrap()).unwrap();
        }
        renderer.scheduler().timeline().start();
        let _recorded = renderer.record(scene.as_scene_ref()).unwrap();
        let log = renderer.scheduler().timeline().take();
        let view = &scene.cameras[0].name;
        let batches = renderer.draw_list("geometry buffer", 0).unwrap().batches.len();
        (jobs_of(&log.runs[0])[&["geometry buffer".to_owned(), view.to_string(), "record".to_owned()]], batches)
    };
    let (jobs, batches) = recording_jobs(Granularity::PerDraw);
    assert!(jobs == batches && batches > 100, "{jobs} jobs for {batches} draws");
    let (jobs, batches) = recording_jobs(Granularity::Chunk(20));
    assert_eq!(jobs, batches.div_ceil(20));
}
