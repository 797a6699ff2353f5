//! The device's times of each pass, on the timeline's clock.

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{
    Backend, BackendError, DeviceClock, DevicePassTimes, EncodingStrategy, RecordingStrategy, WgpuBackend,
    WgpuSubmission,
};
use drawloom::process::internal::ViewOrder;
use drawloom::process::{
    ClearColor, Declare, Deferred, Draws, Format, FullScreen, RawPass, RawPassResources, RenderProcess,
};
use drawloom::scene::{Camera, Scene};
use drawloom::task::Scheduler;
use drawloom::timeline::DeviceLog;
use drawloom::{RecordedFrame, Renderer, wgpu};
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, backend, device};
use crate::strategies::{drawn_by_a_new_renderer, expect, fixture_of, many_batches, pictures, strategies};

pub const CASES: &[Case] = &[
    ("every_pass_is_timed_once_with_every_strategy", all_strategies),
    ("frames_in_flight_have_their_own_times", frames_in_flight),
    ("more_passes_than_a_query_set_holds_are_timed", many_passes),
    ("raw_passes_are_timed_if_the_device_supports_it", raw_passes),
    ("reading_times_of_untimed_or_lost_frames_is_an_error", no_times),
];

/// Whether the machine's adapter writes timestamps.
pub fn has_timestamps() -> bool {
    device().is_ok_and(|(device, _)| device.features().contains(wgpu::Features::TIMESTAMP_QUERY))
}

/// A timing backend on the machine's adapter.
fn timing() -> Result<WgpuBackend, Failed> {
    Ok(backend()?.time_passes()?)
}

/// The names of process and view of every pass of a frame, in submission order.
fn names_of(fixture: &Fixture, recorded: &RecordedFrame<WgpuBackend>) -> Vec<(String, String)> {
    let views = &recorded.statistics().views;
    // One view after the other, in the order of their groups.
    let groups = fixture.renderer.plan().view_groups();
    assert!(groups.iter().all(|group| group.order == ViewOrder::ViewByView));
    let queues = groups
        .iter()
        .flat_map(|group| recorded.queues().iter().filter(|queue| group.kinds.contains(&views[queue.view].kind)));
    let processes = fixture.renderer.plan().processes();
    let names = |(process, view): (usize, usize)| (processes[process].name.clone(), views[view].name.clone());
    let passes = queues.flat_map(|queue| &queue.passes);
    passes.map(|(pass, _)| names((pass.process_index, pass.view_index))).collect()
}

fn names_in(times: &DevicePassTimes) -> Vec<(String, String)> {
    times.passes.iter().map(|pass| (pass.process.clone(), pass.view.clone())).collect()
}

/// Draws a frame, and checks its times: each pass once, in order, within the time of drawing.
fn timed(fixture: &mut Fixture, scene: &Scene) -> Result<(WgpuSubmission, DeviceLog), Failed> {
    let scheduler = Arc::clone(fixture.renderer.scheduler());
    let timeline = scheduler.timeline();
    let clock =
        |fixture: &Fixture| -> Result<DeviceClock, Failed> { Ok(fixture.renderer.backend().device_clock(timeline)?) };
    let earlier = clock(fixture)?;
    let recorded = fixture.record(scene)?;
    let expected = names_of(fixture, &recorded);
    let before = timeline.now();
    let submission = fixture.submit(recorded)?;
    submission.wait()?;
    let after = timeline.now();
    let times = submission.pass_times()?;
    expect(submission.pass_times()? == times, || "a second read returns other times".to_owned())?;
    expect(times.skipped == 0, || format!("{} passes were skipped", times.skipped))?;
    expect(names_in(&times) == expected, || format!("{:?} instead of {expected:?}", names_in(&times)))?;
    let ordered = times.passes.iter().all(|pass| Duration::ZERO < pass.began && pass.began <= pass.ended);
    expect(ordered, || format!("out of order: {times:?}"))?;

    let log = earlier.until(clock(fixture)?).log([(7, times)]);
    let [mut of_log, mut of_frame] =
        [log.passes.iter().map(|pass| (pass.process.clone(), pass.view.clone())).collect::<Vec<_>>(), expected];
    of_log.sort();
    of_frame.sort();
    expect(of_log == of_frame, || format!("the log has {of_log:?}"))?;
    expect(log.passes.iter().all(|pass| pass.frame == 7), || "passes of another frame".to_owned())?;
    expect(log.passes.is_sorted_by_key(|pass| pass.began), || "not sorted by begin".to_owned())?;
    expect(log.name == fixture.renderer.backend().adapter_name(), || log.name.clone())?;
    for pass in &log.passes {
        let while_drawn = pass.began + log.error >= before && pass.ended <= after + log.error;
        expect(while_drawn, || format!("not from {before:?} to {after:?}, ± {:?}: {pass:?}", log.error))?;
    }
    Ok((submission, log))
}

fn all_strategies() -> Result<(), Failed> {
    let scene = many_batches();
    let expected = drawn_by_a_new_renderer(&scene)?;
    for (recording, encoding) in strategies() {
        let backend = timing()?;
        let mut fixture = fixture_of(backend.recording_strategy(recording).encoding_strategy(encoding))?;
        for frame in 0..2 {
            let named =
                |failed: Failed| Failed::from(format!("{recording:?}, {encoding:?}, frame {frame}: {failed:?}"));
            timed(&mut fixture, &scene).map_err(named)?;
            let split = fixture.renderer.backend().pass_statistics().iter().any(|pass| pass.encoders > 1);
            expect(split == (encoding == EncodingStrategy::Split), || {
                format!("{encoding:?}, and passes are split: {split}")
            })?;
        }
        let recorded = fixture.record(&scene)?;
        let same = pictures(&fixture, recorded, &scene)? == expected;
        expect(same, || format!("{recording:?}, {encoding:?}: with times the picture differs"))?;
    }
    Ok(())
}

fn frames_in_flight() -> Result<(), Failed> {
    let backend = timing()?;
    let mut fixture = fixture_of(backend)?;
    // Each scene has other passes: one has another view, one no lights.
    let mut scenes = vec![everything(), everything(), everything()];
    let another = Camera { name: "another".to_owned(), ..scenes[1].cameras[0].clone() };
    scenes[1].cameras.push(another);
    scenes[2].lights.clear();
    for round in 0..3 {
        let mut submitted = Vec::new();
        for scene in &scenes {
            let recorded = fixture.record(scene)?;
            let names = names_of(&fixture, &recorded);
            // A frame in between is never submitted.
            drop(fixture.record(&scenes[round])?);
            submitted.push((names, fixture.submit(recorded)?));
        }
        let counts: Vec<_> = submitted.iter().map(|(names, _)| names.len()).collect();
        expect(counts[0] < counts[1] && counts[2] < counts[0], || format!("{counts:?} passes"))?;
        let mut earlier: Vec<DevicePassTimes> = Vec::new();
        for (names, submission) in &submitted {
            let times = submission.pass_times()?;
            expect(names_in(&times) == *names, || format!("round {round}: {times:?} instead of {names:?}"))?;
            expect(!earlier.contains(&times), || "two frames have the same times".to_owned())?;
            earlier.push(times);
        }
        for ((_, submission), times) in submitted.iter().zip(earlier) {
            expect(submission.pass_times()? == times, || "another frame's times".to_owned())?;
        }
    }
    Ok(())
}

fn many_passes() -> Result<(), Failed> {
    let backend = timing()?;
    let mut fixture =
        fixture_of(backend.recording_strategy(RecordingStrategy::Direct).encoding_strategy(EncodingStrategy::PerPass))?;
    let mut scene = field(20);
    let camera = scene.cameras[0].clone();
    for cameras in [2, 130, 30] {
        let named = |number| Camera { name: format!("camera {number}"), size: [4, 4], ..camera.clone() };
        scene.cameras = (0..cameras).map(named).collect();
        let (_, log) = timed(&mut fixture, &scene)?;
        let min_passes = cameras * fixture.renderer.plan().processes().len() / 2;
        expect(log.passes.len() >= min_passes, || format!("{} passes of {cameras} cameras", log.passes.len()))?;
        expect(cameras < 130 || log.passes.len() > 512, || format!("only {} passes", log.passes.len()))?;
    }
    Ok(())
}

/// A process with a raw pass, or with a drawn one.
struct OwnPass {
    is_raw: bool,
}

impl RenderProcess for OwnPass {
    fn name(&self) -> &str {
        if self.is_raw { "raw" } else { "drawn" }
    }

    fn declare(&self, declare: &mut Declare) {
        if self.is_raw {
            declare.writes("raw", Format::Rgba8Unorm);
        } else {
            declare.clears_color("drawn", Format::Rgba8Unorm, ClearColor::Background);
            declare.samples("raw");
        }
    }

    fn draws(&self) -> Draws<'_> {
        let shader = "
            @group(2) @binding(1) var raw: texture_2d<f32>;
            @fragment fn fragment(in: FullScreenPixel) -> @location(0) vec4<f32> {
                return textureLoad(raw, vec2<i32>(0, 0), 0);
            }
        ";
        match self.is_raw {
            true => Draws::Raw(self),
            false => Draws::FullScreen(FullScreen { shader, ..Default::default() }),
        }
    }
}

impl RawPass for OwnPass {
    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &RawPassResources<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        let target = resources.target("raw")?;
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &target.create_view(&wgpu::TextureViewDescriptor::default()),
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::RED), store: wgpu::StoreOp::Store },
            })],
            ..wgpu::RenderPassDescriptor::default()
        });
        Ok(())
    }
}

fn raw_passes() -> Result<(), Failed> {
    let all = device()?.0.features() & WgpuBackend::TIMING_FEATURES;
    for features in [wgpu::Features::TIMESTAMP_QUERY, all] {
        let (device, queue) = device_with(features)?;
        let builder = Renderer::builder(WgpuBackend::new(device, queue)?.time_passes()?)
            .process(OwnPass { is_raw: true })
            .process(OwnPass { is_raw: false })
            .output("drawn");
        let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(2)?))?;
        let mut fixture = Fixture { renderer, submitter };
        let mut scene = field(3);
        scene.cameras.truncate(1);
        let (times_raw, view) = (features == WgpuBackend::TIMING_FEATURES, scene.cameras[0].name.clone());
        let recorded = fixture.record(&scene)?;
        let times = fixture.submit(recorded)?.pass_times()?;
        let expected = [("raw", times_raw), ("drawn", true)].into_iter().filter(|(_, is_timed)| *is_timed);
        let expected: Vec<_> = expected.map(|(process, _)| (process.to_owned(), view.clone())).collect();
        expect(names_in(&times) == expected && times.skipped == 0, || format!("{features:?}: {times:?}"))?;
    }
    Ok(())
}

fn no_times() -> Result<(), Failed> {
    let mut untimed = Fixture::new()?;
    let recorded = untimed.record(&field(3))?;
    match untimed.submit(recorded)?.pass_times() {
        Err(BackendError::NotTimed) => {}
        other => return Err(format!("{other:?}").into()),
    }
    let (device, queue) = device_with(wgpu::Features::TIMESTAMP_QUERY)?;
    let backend = WgpuBackend::new(device.clone(), queue)?.time_passes()?;
    let scheduler = Arc::new(Scheduler::new(2)?);
    let builder = Renderer::builder(backend).pipeline(Deferred::to_picture());
    let (renderer, submitter) = builder.build(Arc::clone(&scheduler))?;
    let mut fixture = Fixture { renderer, submitter };
    let recorded = fixture.record(&field(3))?;
    let submission = fixture.submit(recorded)?;
    device.destroy();
    let times = submission.pass_times();
    expect(matches!(times, Err(BackendError::DeviceLost { .. })), || format!("{times:?}"))?;
    let clock = fixture.renderer.backend().device_clock(scheduler.timeline());
    expect(clock.is_err(), || format!("{clock:?}"))
}

/// A device on the machine's adapter with only these features.
fn device_with(required_features: wgpu::Features) -> Result<(wgpu::Device, wgpu::Queue), Failed> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let options = wgpu::RequestAdapterOptions {
        power_preference: wgpu::PowerPreference::HighPerformance,
        ..wgpu::RequestAdapterOptions::default()
    };
    let adapter = pollster::block_on(instance.request_adapter(&options))?;
    let descriptor = wgpu::DeviceDescriptor {
        required_features,
        required_limits: adapter.limits(),
        ..wgpu::DeviceDescriptor::default()
    };
    Ok(pollster::block_on(adapter.request_device(&descriptor))?)
}
