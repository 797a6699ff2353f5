//! Devices that draw nothing, lack features, or have low limits.

use std::collections::BTreeSet;
use std::sync::Arc;

use drawloom::backend::{
    Backend, BackendError, EncodingStrategy, NullBackend, RecordingStrategy, SoftwareBackend, WgpuBackend,
};
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::Deferred;
use drawloom::scene::{Camera, Light, ViewKind};
use drawloom::task::Scheduler;
use drawloom::view::{IssueReason, ShadowMaps};
use drawloom::{FrameError, Granularity, Renderer, wgpu};
use drawloom_testing::adapter;
use drawloom_testing::scenes::{field, textured};
use libtest_mimic::Failed;

use crate::Case;
use crate::buffers::{Count, DrawColumns};

pub const CASES: &[Case] = &[
    ("the_noop_device_accepts_every_frame", noop),
    ("a_device_with_a_low_limit_is_refused_naming_the_limit", low_limits),
    ("timing_passes_without_timestamps_is_refused_naming_the_feature", no_timestamps),
    ("a_panic_of_wgpu_over_an_indirect_draw_is_an_error", indirect_draw_on_noop),
    ("a_picture_beyond_the_devices_limit_is_refused", large_picture),
    ("objects_beyond_a_storage_buffer_are_counted_and_named", many_objects),
    ("lights_beyond_the_devices_layers_have_no_shadow_map_and_are_counted", many_shadow_maps),
    ("shadow_cameras_of_an_engine_beyond_the_devices_layers_are_refused", many_shadow_cameras),
    ("a_lost_device_is_an_error", lost_device),
    ("textures_beyond_the_layers_of_an_array_are_drawn", many_textures),
];

fn noop() -> Result<(), Failed> {
    let (device, queue) = adapter::noop_device().map_err(|error| error.to_string())?;
    for granularity in [Granularity::PerCamera, Granularity::Chunk(100)] {
        let backend = WgpuBackend::new(device.clone(), queue.clone())?;
        let scheduler = Arc::new(Scheduler::new(2)?);
        let (mut renderer, submitter) =
            Renderer::builder(backend).pipeline(Deferred::to_picture()).granularity(granularity).build(scheduler)?;
        for count in [0, 10, 2000, 500] {
            let recorded = renderer.record(field(count).as_scene_ref())?;
            let submitted = submitter.submit(recorded)?;
            submitted.submission.wait()?;
            if submitted.statistics.objects != count {
                return Err(format!("{} objects of {count}", submitted.statistics.objects).into());
            }
        }
    }
    Ok(())
}

fn low_limits() -> Result<(), Failed> {
    let (device, queue) =
        noop_with(wgpu::Limits { max_storage_buffers_per_shader_stage: 3, ..WgpuBackend::REQUIRED_LIMITS })?;
    match WgpuBackend::new(device, queue).err() {
        Some(BackendError::Limit { limit, allowed: 3, needed: 4 }) if limit.contains("storage_buffers") => Ok(()),
        other => Err(format!("{other:?}").into()),
    }
}

fn no_timestamps() -> Result<(), Failed> {
    let scheduler = Scheduler::new(1)?;
    // wgpu's noop backend claims every feature.
    for (features, reason) in [(wgpu::Features::empty(), ""), (WgpuBackend::TIMING_FEATURES, "noop")] {
        let (device, queue) = noop_device(WgpuBackend::REQUIRED_LIMITS, features)?;
        let clock = WgpuBackend::new(device.clone(), queue.clone())?.device_clock(scheduler.timeline());
        for refused in [clock.err(), WgpuBackend::new(device, queue)?.time_passes().err()] {
            match refused {
                Some(BackendError::MissingFeature { missing })
                    if missing.contains("TIMESTAMP_QUERY") && missing.contains(reason) => {}
                other => return Err(format!("{features:?}: {other:?}").into()),
            }
        }
    }
    Ok(())
}

/// On its noop backend, wgpu's validation of indirect draws panics when a pass is finished, on the thread that finishes
/// it.
fn indirect_draw_on_noop() -> Result<(), Failed> {
    for encoding in [EncodingStrategy::PerPass, EncodingStrategy::OnSubmit] {
        let (device, queue) = noop_with(WgpuBackend::REQUIRED_LIMITS)?;
        let builder = Renderer::builder(WgpuBackend::new(device, queue)?.encoding_strategy(encoding));
        let builder = builder.process(Count { once_a_frame: true }).process(DrawColumns).output("picture");
        let (mut renderer, submitter) = builder.build(Arc::new(Scheduler::new(2)?))?;
        let scene = field(1);
        for _ in 0..2 {
            if renderer.record(scene.as_scene_ref()).is_ok_and(|frame| submitter.submit(frame).is_ok()) {
                return Err(format!("{encoding:?}: wgpu accepts it now").into());
            }
        }
    }
    Ok(())
}

fn large_picture() -> Result<(), Failed> {
    let (device, queue) = noop_with(WgpuBackend::REQUIRED_LIMITS)?;
    let scheduler = Arc::new(Scheduler::new(1)?);
    let (mut renderer, _) =
        Renderer::builder(WgpuBackend::new(device, queue)?).pipeline(Deferred::to_picture()).build(scheduler)?;
    let mut scene = field(10);
    scene.cameras[0].size = [5000, 10];
    match renderer.record(scene.as_scene_ref()).err() {
        Some(FrameError::Backend(BackendError::TargetTooLarge { width: 5000, height: 10, .. })) => Ok(()),
        other => Err(format!("{other:?}").into()),
    }
}

fn many_objects() -> Result<(), Failed> {
    let (device, queue) = noop_with(WgpuBackend::REQUIRED_LIMITS)?;
    let scheduler = Arc::new(Scheduler::new(2)?);
    let (mut renderer, submitter) =
        Renderer::builder(WgpuBackend::new(device, queue)?).pipeline(Deferred::to_picture()).build(scheduler)?;
    let (few, mut many) = (field(1000), field(1000));
    many.duplicate_objects(WgpuBackend::REQUIRED_LIMITS.max_storage_buffer_binding_size as usize / 64 / 1000 + 1);
    let capacity = WgpuBackend::REQUIRED_LIMITS.max_storage_buffer_binding_size as usize / 64;
    for scene in [&few, &many, &few] {
        let statistics = submitter.submit(renderer.record(scene.as_scene_ref())?)?.statistics;
        let beyond = scene.object_count().saturating_sub(capacity);
        let first_beyond = scene.as_scene_ref().meshes.get(capacity);
        let name = first_beyond.and_then(|mesh| Some(scene.assets().get(*mesh).ok()?.name()));
        let found: Vec<_> = statistics
            .scene_issues
            .iter()
            .map(|known| (known.reason, known.count, known.first, known.name.as_deref()))
            .collect();
        let expected = [(IssueReason::ObjectLimit, beyond, capacity, name)];
        if found != expected[..usize::from(beyond > 0)] || statistics.objects != scene.object_count() {
            return Err(format!("{} objects: {found:?}", scene.object_count()).into());
        }
    }
    Ok(())
}

fn many_shadow_maps() -> Result<(), Failed> {
    let (device, queue) = noop_with(WgpuBackend::REQUIRED_LIMITS)?;
    if device.limits().max_texture_array_layers != 256 {
        return Err("the device has other limits than WebGPU requires".into());
    }
    count_shadow_maps(WgpuBackend::new(device, queue)?, 256)?;
    let (device, queue) = noop_with(wgpu::Limits { max_texture_array_layers: 600, ..WgpuBackend::REQUIRED_LIMITS })?;
    count_shadow_maps(WgpuBackend::new(device, queue)?, 600)?;
    count_shadow_maps(NullBackend, 256)?;
    count_shadow_maps(SoftwareBackend::new(Arc::new(Scheduler::new(1)?)), 256)
}

/// Records scenes of many lights, whose cameras all see what they reach. Which lights have maps is told by taking the
/// cameras and, for each, the lights one after the other.
fn count_shadow_maps<B: Backend>(backend: B, layers: usize) -> Result<(), Failed> {
    let cascades = 2;
    let maps = ShadowMaps { side: 1, cascades: 2, ..ShadowMaps::default() };
    let deferred = Deferred::to_picture().shadow_maps(Some(maps));
    let (mut renderer, submitter) =
        Renderer::builder(backend).pipeline(deferred).build(Arc::new(Scheduler::new(2)?))?;
    let lamp = Light::Point { position: DVec3::Y, intensity: Vec3::ONE, range: 20.0, casts_shadow: true };
    let unshadowed = Light::Point { position: DVec3::Y, intensity: Vec3::ONE, range: 20.0, casts_shadow: false };
    let sun = Light::Directional { direction: Vec3::NEG_Y, illuminance: Vec3::ONE, casts_shadow: true };
    let full = layers / 6;
    let cases: [(usize, Vec<(Light, usize)>); 11] = [
        (1, vec![(SPOT, layers)]),
        (1, vec![(SPOT, layers + 1)]),
        (1, vec![(SPOT, layers % 6), (lamp, full)]),
        (1, vec![(SPOT, layers % 6 + 1), (lamp, full)]),
        (1, vec![(lamp, full + 1), (SPOT, 9), (sun, 1)]),
        (1, vec![(unshadowed, 5), (lamp, full), (unshadowed, 5), (sun, 3), (SPOT, 1)]),
        (2, vec![(sun, layers / cascades / 2 + 1)]),
        (3, vec![(lamp, full), (sun, 1), (SPOT, layers % 6)]),
        (3, vec![(sun, 2), (lamp, full + 3)]),
        (100, vec![(sun, 2), (SPOT, 100)]),
        (1, vec![(sun, 1)]),
    ];
    for (index, (players, lights)) in cases.into_iter().enumerate() {
        let mut scene = field(3);
        scene.lights = lights.into_iter().flat_map(|(light, count)| vec![light; count]).collect();
        let camera = Camera { near: 1.0, ..scene.cameras[0].clone() };
        let player = |player: usize| Camera {
            name: format!("player {player}"),
            near: 0.5 + 0.001 * player as f32,
            ..camera.clone()
        };
        scene.cameras = (0..players).map(player).collect();
        let (mut room, mut without, mut with) = (layers, BTreeSet::new(), BTreeSet::new());
        for player in 0..players {
            for (index, light) in scene.lights.iter().enumerate().filter(|(_, light)| light.casts_shadow()) {
                let (needed, key) = match light {
                    Light::Directional { .. } => (cascades, (index, player)),
                    Light::Point { .. } => (6, (index, 0)),
                    _ => (1, (index, 0)),
                };
                if with.contains(&key) {
                    continue;
                }
                if needed <= room {
                    room -= needed;
                    with.insert(key);
                } else {
                    without.insert(index);
                }
            }
        }
        let recorded = renderer.record(scene.as_scene_ref())?;
        let statistics = recorded.statistics();
        let found = statistics.views.iter().filter(|view| view.kind == ViewKind::Shadow).count();
        let expected: Vec<_> =
            without.first().map(|first| (IssueReason::ShadowMapLimit, without.len(), *first)).into_iter().collect();
        let scene_issues = statistics.scene_issues.iter().map(|found| (found.reason, found.count, found.first));
        let scene_issues: Vec<_> = scene_issues.collect();
        if found != layers - room || scene_issues != expected {
            return Err(format!("case {index}: {found} of {} maps, {scene_issues:?}", layers - room).into());
        }
        if statistics.lights != scene.lights.len() {
            return Err(format!("case {index}: {} lights", statistics.lights).into());
        }
        submitter.submit(recorded)?;
    }
    Ok(())
}

fn many_shadow_cameras() -> Result<(), Failed> {
    let (device, queue) = noop_with(WgpuBackend::REQUIRED_LIMITS)?;
    let maps = ShadowMaps { side: 1, ..ShadowMaps::default() };
    let deferred = Deferred::to_picture().shadow_maps(Some(maps));
    let (mut renderer, submitter) =
        Renderer::builder(WgpuBackend::new(device, queue)?).pipeline(deferred).build(Arc::new(Scheduler::new(2)?))?;
    for (own, expected) in [(250, 6), (256, 0), (257, 0), (10, 7)] {
        let mut scene = field(3);
        scene.cameras.truncate(1);
        let camera = Camera { size: [1, 1], kind: ViewKind::Shadow, ..scene.cameras[0].clone() };
        scene.cameras.extend((0..own).map(|index| Camera { name: format!("own {index}"), ..camera.clone() }));
        scene.lights = vec![SPOT; 7];
        match renderer.record(scene.as_scene_ref()) {
            Ok(recorded) if own <= 256 => {
                let maps = recorded.statistics().views.len() - 1 - own;
                if maps != expected {
                    return Err(format!("{maps} maps beside {own} cameras of the engine's own").into());
                }
                submitter.submit(recorded)?;
            }
            Err(FrameError::Backend(BackendError::TooManyLayers { allowed: 256, views: 257, .. })) if own == 257 => {}
            other => return Err(format!("{own} cameras of the engine's own: {:?}", other.err()).into()),
        }
    }
    Ok(())
}

const SPOT: Light = Light::Spot {
    position: DVec3::new(0.0, 10.0, 0.0),
    direction: Vec3::NEG_Y,
    intensity: Vec3::ONE,
    range: 20.0,
    inner_angle: 0.3,
    outer_angle: 0.4,
    casts_shadow: true,
};

fn many_textures() -> Result<(), Failed> {
    let (device, queue) = noop_with(WgpuBackend::REQUIRED_LIMITS)?;
    let layers = device.limits().max_texture_array_layers;
    let scheduler = Arc::new(Scheduler::new(1)?);
    let (mut renderer, _) =
        Renderer::builder(WgpuBackend::new(device, queue)?).pipeline(Deferred::to_picture()).build(scheduler)?;
    let recorded = renderer.record(textured(layers + 2).0.as_scene_ref())?;
    match recorded.statistics().scene_issues.as_slice() {
        [] => Ok(()),
        other => Err(format!("{other:?}").into()),
    }
}

fn lost_device() -> Result<(), Failed> {
    for recording in [RecordingStrategy::Direct, RecordingStrategy::Bundles, RecordingStrategy::CachedBundles] {
        for encoding in [EncodingStrategy::PerPass, EncodingStrategy::Split, EncodingStrategy::OnSubmit] {
            lost_device_with(recording, encoding)
                .map_err(|failed| format!("{recording:?} {encoding:?}: {failed:?}"))?;
        }
    }
    Ok(())
}

fn lost_device_with(recording: RecordingStrategy, encoding: EncodingStrategy) -> Result<(), Failed> {
    let (device, queue) = noop_with(WgpuBackend::REQUIRED_LIMITS)?;
    let scheduler = Arc::new(Scheduler::new(2)?);
    let backend = WgpuBackend::new(device.clone(), queue)?.recording_strategy(recording).encoding_strategy(encoding);
    let (mut renderer, submitter) = Renderer::builder(backend).pipeline(Deferred::to_picture()).build(scheduler)?;
    let scene = field(500);
    submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission.wait()?;
    let recorded = renderer.record(scene.as_scene_ref())?;
    device.destroy();
    if let Ok(submitted) = submitter.submit(recorded) {
        match (submitted.submission.wait(), submitted.submission.read(0, "picture")) {
            (Err(BackendError::DeviceLost { .. }), Err(BackendError::DeviceLost { .. })) => {}
            other => return Err(format!("{other:?}").into()),
        }
    }
    match renderer.record(scene.as_scene_ref()) {
        Err(FrameError::Panicked { stage, message }) => Err(format!("{stage} panicked: {message}").into()),
        Err(_) => Ok(()),
        Ok(_) => Err("a frame was recorded on a lost device".into()),
    }
}

fn noop_with(required_limits: wgpu::Limits) -> Result<(wgpu::Device, wgpu::Queue), Failed> {
    noop_device(required_limits, wgpu::Features::empty())
}

fn noop_device(
    required_limits: wgpu::Limits,
    required_features: wgpu::Features,
) -> Result<(wgpu::Device, wgpu::Queue), Failed> {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = wgpu::Backends::NOOP;
    descriptor.backend_options.noop = wgpu::NoopBackendOptions { enable: true, ..Default::default() };
    let instance = wgpu::Instance::new(descriptor);
    let adapter = pollster::block_on(instance.request_adapter(&wgpu::RequestAdapterOptions::default()))?;
    let descriptor = wgpu::DeviceDescriptor { required_limits, required_features, ..wgpu::DeviceDescriptor::default() };
    Ok(pollster::block_on(adapter.request_device(&descriptor))?)
}
