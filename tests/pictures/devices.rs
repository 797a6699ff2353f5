//! Devices that draw nothing, lack features, or have low limits.

use std::sync::Arc;

use drawloom::backend::{BackendError, EncodingStrategy, RecordingStrategy, WgpuBackend};
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::Deferred;
use drawloom::scene::Light;
use drawloom::task::Scheduler;
use drawloom::view::{Rejection, RejectionReason, ShadowMaps};
use drawloom::{FrameError, Granularity, Renderer, wgpu};
use drawloom_testing::adapter;
use drawloom_testing::scenes::{field, textured};
use libtest_mimic::Failed;

use crate::Case;

pub const CASES: &[Case] = &[
    ("the_noop_device_accepts_every_frame", noop),
    ("a_device_with_a_low_limit_is_refused_naming_the_limit", low_limits),
    ("a_recording_strategy_without_its_feature_is_refused_naming_the_feature", no_indirect_draws),
    ("timing_passes_without_timestamps_is_refused_naming_the_feature", no_timestamps),
    ("a_panic_of_wgpu_over_indirect_draws_is_an_error", indirect_draws_on_noop),
    ("a_picture_beyond_the_devices_limit_is_refused", large_picture),
    ("objects_beyond_a_storage_buffer_are_counted_and_named", many_objects),
    ("more_shadow_maps_than_texture_layers_are_refused_and_later_frames_are_drawn", many_shadow_maps),
    ("a_lost_device_is_an_error", lost_device),
    ("textures_beyond_the_devices_layers_are_counted", many_textures),
];

fn noop() -> Result<(), Failed> {
    let (device, queue) = adapter::noop_device().map_err(|error| error.to_string())?;
    for granularity in [Granularity::PerCamera, Granularity::Chunk(100)] {
        let backend = WgpuBackend::new(device.clone(), queue.clone())?;
        let scheduler = Arc::new(Scheduler::new(2)?);
        let (mut renderer, submitter) =
            Renderer::builder(backend).deferred(Deferred::to_picture()).granularity(granularity).build(scheduler)?;
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

fn no_indirect_draws() -> Result<(), Failed> {
    let (device, queue) = noop_with(WgpuBackend::REQUIRED_LIMITS)?;
    for recording in [RecordingStrategy::Direct, RecordingStrategy::Bundles, RecordingStrategy::CachedBundles] {
        WgpuBackend::new(device.clone(), queue.clone())?.recording_strategy(recording)?;
    }
    match WgpuBackend::new(device, queue)?.recording_strategy(RecordingStrategy::Indirect).err() {
        Some(BackendError::MissingFeature { missing }) if missing.contains("INDIRECT_FIRST_INSTANCE") => Ok(()),
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

/// On its noop backend, wgpu's validation of indirect draws panics when a pass is finished, on the thread that finishes it.
fn indirect_draws_on_noop() -> Result<(), Failed> {
    for encoding in [EncodingStrategy::PerPass, EncodingStrategy::OnSubmit] {
        let (device, queue) = noop_device(WgpuBackend::REQUIRED_LIMITS, WgpuBackend::OPTIONAL_FEATURES)?;
        let backend = WgpuBackend::new(device, queue)?
            .recording_strategy(RecordingStrategy::Indirect)?
            .encoding_strategy(encoding);
        let (mut renderer, submitter) =
            Renderer::builder(backend).deferred(Deferred::to_picture()).build(Arc::new(Scheduler::new(2)?))?;
        let scene = field(500);
        for _ in 0..2 {
            if renderer.record(scene.as_scene_ref()).is_ok_and(|frame| submitter.submit(frame).is_ok()) {
                return Err(format!("{encoding:?}: wgpu accepts them now").into());
            }
        }
    }
    Ok(())
}

fn large_picture() -> Result<(), Failed> {
    let (device, queue) = noop_with(WgpuBackend::REQUIRED_LIMITS)?;
    let scheduler = Arc::new(Scheduler::new(1)?);
    let (mut renderer, _) =
        Renderer::builder(WgpuBackend::new(device, queue)?).deferred(Deferred::to_picture()).build(scheduler)?;
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
        Renderer::builder(WgpuBackend::new(device, queue)?).deferred(Deferred::to_picture()).build(scheduler)?;
    let (few, mut many) = (field(1000), field(1000));
    many.duplicate_objects(WgpuBackend::REQUIRED_LIMITS.max_storage_buffer_binding_size as usize / 64 / 1000 + 1);
    let capacity = WgpuBackend::REQUIRED_LIMITS.max_storage_buffer_binding_size as usize / 64;
    for scene in [&few, &many, &few] {
        let statistics = submitter.submit(renderer.record(scene.as_scene_ref())?)?.statistics;
        let beyond = scene.object_count().saturating_sub(capacity);
        let first_beyond = scene.as_scene_ref().meshes.get(capacity);
        let name = first_beyond.and_then(|mesh| Some(scene.assets().get(*mesh).ok()?.name()));
        let found: Vec<_> = statistics
            .rejections
            .iter()
            .map(|known| (known.reason, known.count, known.first, known.name.as_deref()))
            .collect();
        let expected = [(RejectionReason::ObjectLimit, beyond, capacity, name)];
        if found != expected[..usize::from(beyond > 0)] || statistics.objects != scene.object_count() {
            return Err(format!("{} objects: {found:?}", scene.object_count()).into());
        }
    }
    Ok(())
}

fn many_shadow_maps() -> Result<(), Failed> {
    let (device, queue) = noop_with(WgpuBackend::REQUIRED_LIMITS)?;
    let layers = device.limits().max_texture_array_layers as usize;
    let scheduler = Arc::new(Scheduler::new(2)?);
    let maps = ShadowMaps { side: 1, ..ShadowMaps::default() };
    let deferred = Deferred::to_picture().shadow_maps(Some(maps));
    let (mut renderer, submitter) =
        Renderer::builder(WgpuBackend::new(device, queue)?).deferred(deferred).build(scheduler)?;
    let mut scene = field(3);
    // Lamps have six maps each, all or none.
    let (full, spots) = (layers / 6, layers % 6);
    let lamp = Light::Point { position: DVec3::Y, intensity: Vec3::ONE, range: 20.0, casts_shadow: true };
    for (lamps, spots) in [(0, layers), (0, layers + 1), (0, layers + 1), (full, spots), (full, spots + 1), (0, layers)]
    {
        scene.lights = [vec![SPOT; spots], vec![lamp; lamps]].concat();
        let maps = 6 * lamps + spots;
        match renderer.record(scene.as_scene_ref()) {
            Ok(recorded) if maps == layers => {
                submitter.submit(recorded)?;
            }
            Err(FrameError::Backend(error @ BackendError::TooManyLayers { allowed, views, lights: of_lights, .. }))
                if (allowed, views, of_lights) == (layers as u64, layers as u64 + 1, (lamps + spots) as u64)
                    && maps > layers =>
            {
                let expected = format!("the shadow maps of {} lights", lamps + spots);
                let message = error.to_string();
                if !(message.contains(&expected) && message.contains("max_texture_array_layers is 256")) {
                    return Err(message.into());
                }
            }
            other => return Err(format!("{maps} maps: {:?}", other.err()).into()),
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
        Renderer::builder(WgpuBackend::new(device, queue)?).deferred(Deferred::to_picture()).build(scheduler)?;
    let recorded = renderer.record(textured(layers + 2).0.as_scene_ref())?;
    match recorded.statistics().rejections.as_slice() {
        [Rejection { reason: RejectionReason::TextureLimit, count: 2, .. }] => Ok(()),
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
    let backend = WgpuBackend::new(device.clone(), queue)?.recording_strategy(recording)?.encoding_strategy(encoding);
    let (mut renderer, submitter) = Renderer::builder(backend).deferred(Deferred::to_picture()).build(scheduler)?;
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
