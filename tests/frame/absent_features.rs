//! What a scene does not use costs nothing: its frames have the passes, stages, draws, pipelines, buffers and textures
//! that they have with a renderer that lacks the feature. wgpu itself counts what the device has.

use std::sync::Arc;

use drawloom::ViewBudget;
use drawloom::backend::{EncodingStrategy, RecordingStrategy, WgpuBackend, WgpuResources};
use drawloom::scene::{LightKind, SceneRef, ViewKind};
use drawloom::task::Scheduler;
use drawloom::view::LightClass;
use drawloom::wgpu;
use drawloom_testing::absent_features::{AbsentFeature, Setup, VIEW_ARRAYS, absent_features};
use drawloom_testing::adapter;

/// What one frame has, and what the device has after it.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Cost {
    /// The view and the process of each.
    passes: Vec<(String, String)>,
    stages: String,
    targets: Vec<(String, String)>,
    shadow_views: usize,
    lights: usize,
    draws: usize,
    commands: usize,
    uploaded: u64,
    resources: WgpuResources,
    on_device: OnDevice,
}

/// The numbers of wgpu's objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct OnDevice {
    buffers: usize,
    textures: usize,
    texture_views: usize,
    samplers: usize,
    bind_groups: usize,
    bind_group_layouts: usize,
    pipeline_layouts: usize,
    shader_modules: usize,
    render_pipelines: usize,
    compute_pipelines: usize,
    render_bundles: usize,
    query_sets: usize,
}

impl OnDevice {
    fn of(instance: &wgpu::Instance) -> Self {
        let report = instance.generate_report().unwrap();
        let hub = report.hub_report();
        Self {
            buffers: hub.buffers.num_kept_from_user,
            textures: hub.textures.num_kept_from_user,
            texture_views: hub.texture_views.num_kept_from_user,
            samplers: hub.samplers.num_kept_from_user,
            bind_groups: hub.bind_groups.num_kept_from_user,
            bind_group_layouts: hub.bind_group_layouts.num_kept_from_user,
            pipeline_layouts: hub.pipeline_layouts.num_kept_from_user,
            shader_modules: hub.shader_modules.num_kept_from_user,
            render_pipelines: hub.render_pipelines.num_kept_from_user,
            compute_pipelines: hub.compute_pipelines.num_kept_from_user,
            render_bundles: hub.render_bundles.num_kept_from_user,
            query_sets: hub.query_sets.num_kept_from_user,
        }
    }
}

/// The costs of the first frames of a renderer.
fn costs(feature: &AbsentFeature, setup: &Setup) -> [Cost; 4] {
    let (instance, device, queue) = adapter::noop_instance_and_device(wgpu::Features::empty()).unwrap();
    // Fixed strategies: which ones are tried depends on times.
    let backend = WgpuBackend::new(device, queue).unwrap();
    let backend = backend.recording_strategy(RecordingStrategy::CachedBundles);
    let backend = backend.encoding_strategy(EncodingStrategy::PerPass);
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let (mut renderer, submitter) = setup.builder(backend).build(scheduler).unwrap();
    let mut budget = ViewBudget::new(1e6).unwrap();
    [(); 4].map(|()| {
        let mut cameras = feature.cameras(setup);
        if setup.has_budget {
            cameras = budget.cameras(&setup.views(&feature.scene)).unwrap();
            renderer.add_choices(budget.choices());
        }
        let recorded = renderer.record(SceneRef { cameras: &cameras, ..feature.scene.as_scene_ref() }).unwrap();
        let plan = renderer.plan();
        let views = &recorded.statistics().views;
        let named = |pass: drawloom::process::Pass| {
            (views[pass.view_index].name.clone(), plan.processes()[pass.process_index].name.clone())
        };
        let passes = recorded.queues().iter().flat_map(|queue| &queue.passes).map(|(pass, _)| named(*pass)).collect();
        let targets = plan.targets().iter().map(|target| (target.views.name().to_owned(), target.name.clone()));
        let (targets, stages) = (targets.collect(), renderer.stage_graph_to_dot().unwrap());
        let submitted = submitter.submit(recorded).unwrap();
        budget.update(&submitted.statistics);
        submitted.submission.wait().unwrap();
        let views = &submitted.statistics.views;
        Cost {
            passes,
            stages,
            targets,
            shadow_views: views.iter().filter(|view| view.kind == ViewKind::Shadow).count(),
            lights: views.iter().map(|view| view.lights).sum(),
            draws: views.iter().map(|view| view.batches).sum(),
            commands: views.iter().map(|view| view.commands).sum(),
            uploaded: submitted.statistics.uploaded,
            resources: renderer.backend().resources(),
            on_device: OnDevice::of(&instance),
        }
    })
}

#[test]
fn what_a_scene_does_not_use_costs_nothing() {
    for feature in absent_features() {
        let [with, mut without] = [&feature.with, &feature.without].map(|setup| costs(&feature, setup));
        if feature.name == VIEW_ARRAYS {
            for without in &mut without {
                without.on_device.textures += 1;
                without.on_device.texture_views += 1;
            }
        }
        for (frame, (with, without)) in with.iter().zip(&without).enumerate() {
            assert!(!with.passes.is_empty() && with.on_device.buffers > 0);
            let context = format!("{}, frame {frame}", feature.name);
            // These are short, so they come first.
            assert_eq!(with.on_device, without.on_device, "{context}");
            assert_eq!(with.resources, without.resources, "{context}");
            assert_eq!(with, without, "{context}");
        }
    }
}

/// The counts see what they are there for: a scene that has all classes of lights costs more with them.
#[test]
fn what_a_scene_uses_costs_something() {
    for (feature, class) in absent_features().into_iter().zip(LightClass::all()) {
        let scene = drawloom_testing::scenes::everything::everything();
        let used = AbsentFeature { scene, ..feature };
        let [with, without] = [&used.with, &used.without].map(|setup| costs(&used, setup)[0].clone());
        assert!(with.passes.len() > without.passes.len(), "{}", used.name);
        // Classes of bounded lights have the same pipeline, one with shadow maps and one without.
        let pipelines = [&with, &without].map(|costs| costs.on_device.render_pipelines);
        let has_own_pipelines = class.kind == LightKind::Directional;
        assert!(pipelines[0] >= pipelines[1] + usize::from(has_own_pipelines), "{}: {pipelines:?}", used.name);
        assert!(with.on_device.bind_groups > without.on_device.bind_groups, "{}", used.name);
    }
}
