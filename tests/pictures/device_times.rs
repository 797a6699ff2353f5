//! When the device drew which pass, on the timeline's axis.

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::{
    Backend, BackendError, DeviceClock, DevicePassTimes, EncodingStrategy, RecordingStrategy, WgpuBackend,
    WgpuSubmission,
};
use drawloom::process::{
    ClearColor, Declare, Deferred, Draws, Format, FullScreen, RawPass, RawPassResources, RenderProcess,
};
use drawloom::scene::{Camera, Scene};
use drawloom::task::Scheduler;
use drawloom::timeline::DeviceLog;
use drawloom::{Recorded, Renderer, wgpu};
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::field;
use libtest_mimic::Failed;

use crate::Case;
use crate::studio::Studio;
use crate::techniques::{device, drawn_anew, expect, many_batches, pictures, studio_of, techniques};

pub const CASES: &[Case] = &[
    ("every_pass_is_timed_once_however_it_is_recorded", however_recorded),
    ("times_of_frames_on_their_way_stay_apart", on_their_way),
    ("more_passes_than_a_query_set_holds_are_timed", many_passes),
    ("raw_passes_are_timed_where_the_device_can", raw_passes),
    ("times_of_frames_that_were_not_timed_or_are_lost_are_an_error", no_times),
];

/// A timing backend on the machine's adapter; `None` where that writes no timestamps, and then it has to say so.
fn timing() -> Result<Option<WgpuBackend>, Failed> {
    let (device, queue) = device()?;
    let has_them = device.features().contains(wgpu::Features::TIMESTAMP_QUERY);
    match WgpuBackend::new(device, queue)?.time_passes() {
        Ok(backend) if has_them => Ok(Some(backend)),
        Err(BackendError::MissingFeature { missing }) if !has_them && missing.contains("TIMESTAMP_QUERY") => Ok(None),
        Ok(_) => Err("passes are timed without timestamps".into()),
        Err(other) => Err(other.into()),
    }
}

/// Process and view of every pass of a frame, in the order they are submitted.
fn names_of(studio: &Studio, recorded: &Recorded<WgpuBackend>) -> Vec<(String, String)> {
    let mut passes: Vec<_> =
        recorded.queues().iter().flat_map(|queue| queue.passes.iter().map(|(pass, _)| *pass)).collect();
    passes.sort();
    let processes = studio.renderer.plan().processes();
    let views = &recorded.statistics().views;
    let names =
        |(process, view): (usize, usize)| (processes[process].process.name().to_owned(), views[view].name.clone());
    passes.into_iter().map(|pass| names((pass.process_index, pass.view_index))).collect()
}

fn told(times: &DevicePassTimes) -> Vec<(String, String)> {
    times.passes.iter().map(|pass| (pass.process.clone(), pass.view.clone())).collect()
}

/// Draws a frame, and checks its times: every pass once, in order, while it was drawn.
fn timed(studio: &mut Studio, scene: &Scene) -> Result<(WgpuSubmission, DeviceLog), Failed> {
    let scheduler = Arc::clone(studio.renderer.scheduler());
    let timeline = scheduler.timeline();
    let clock =
        |studio: &Studio| -> Result<DeviceClock, Failed> { Ok(studio.renderer.backend().device_clock(timeline)?) };
    let earlier = clock(studio)?;
    let recorded = studio.record(scene)?;
    let expected = names_of(studio, &recorded);
    let before = timeline.now();
    let submission = studio.submit(recorded)?;
    submission.wait()?;
    let after = timeline.now();
    let times = submission.pass_times()?;
    expect(submission.pass_times()? == times, || "asked again, the device says something else".to_owned())?;
    expect(times.skipped == 0, || format!("{} passes were skipped", times.skipped))?;
    expect(told(&times) == expected, || format!("{:?} instead of {expected:?}", told(&times)))?;
    let ordered = times.passes.iter().all(|pass| Duration::ZERO < pass.began && pass.began <= pass.ended);
    expect(ordered, || format!("out of order: {times:?}"))?;

    let log = earlier.until(clock(studio)?).log([(7, times)]);
    let [mut of_log, mut of_frame] =
        [log.passes.iter().map(|pass| (pass.process.clone(), pass.view.clone())).collect::<Vec<_>>(), expected];
    of_log.sort();
    of_frame.sort();
    expect(of_log == of_frame, || format!("the log has {of_log:?}"))?;
    expect(log.passes.iter().all(|pass| pass.frame == 7), || "passes of another frame".to_owned())?;
    expect(log.passes.is_sorted_by_key(|pass| pass.began), || "not by when they began".to_owned())?;
    expect(log.name == studio.renderer.backend().adapter_name(), || log.name.clone())?;
    for pass in &log.passes {
        let while_drawn = pass.began + log.error >= before && pass.ended <= after + log.error;
        expect(while_drawn, || format!("not from {before:?} to {after:?}, ± {:?}: {pass:?}", log.error))?;
    }
    Ok((submission, log))
}

fn however_recorded() -> Result<(), Failed> {
    let scene = many_batches();
    let expected = drawn_anew(&scene)?;
    for (record, encode) in techniques()? {
        let Some(backend) = timing()? else { return Ok(()) };
        let mut studio = studio_of(backend.recording_strategy(record)?.encoding_strategy(encode))?;
        for frame in 0..2 {
            let named = |failed: Failed| Failed::from(format!("{record:?}, {encode:?}, frame {frame}: {failed:?}"));
            timed(&mut studio, &scene).map_err(named)?;
            let split = studio.renderer.backend().pass_statistics().iter().any(|pass| pass.encoders > 1);
            expect(split == (encode == EncodingStrategy::Split), || {
                format!("{encode:?}, and passes are split: {split}")
            })?;
        }
        let recorded = studio.record(&scene)?;
        let same = pictures(&studio, recorded, &scene)? == expected;
        expect(same, || format!("{record:?}, {encode:?}: with times the picture is another one"))?;
    }
    Ok(())
}

fn on_their_way() -> Result<(), Failed> {
    let Some(backend) = timing()? else { return Ok(()) };
    let mut studio = studio_of(backend)?;
    // Of other passes each: one more view, no lights.
    let mut scenes = vec![everything(), everything(), everything()];
    let another = Camera { name: "another".to_owned(), ..scenes[1].cameras[0].clone() };
    scenes[1].cameras.push(another);
    scenes[2].lights.clear();
    for round in 0..3 {
        let mut submitted = Vec::new();
        for scene in &scenes {
            let recorded = studio.record(scene)?;
            let names = names_of(&studio, &recorded);
            // One that is never submitted lies between them.
            drop(studio.record(&scenes[round])?);
            submitted.push((names, studio.submit(recorded)?));
        }
        let counts: Vec<_> = submitted.iter().map(|(names, _)| names.len()).collect();
        expect(counts[0] < counts[1] && counts[2] < counts[0], || format!("{counts:?} passes"))?;
        let mut earlier: Vec<DevicePassTimes> = Vec::new();
        for (names, submission) in &submitted {
            let times = submission.pass_times()?;
            expect(told(&times) == *names, || format!("round {round}: {times:?} instead of {names:?}"))?;
            expect(!earlier.contains(&times), || "two frames were drawn at once".to_owned())?;
            earlier.push(times);
        }
        for ((_, submission), times) in submitted.iter().zip(earlier) {
            expect(submission.pass_times()? == times, || "another frame's times".to_owned())?;
        }
    }
    Ok(())
}

fn many_passes() -> Result<(), Failed> {
    let Some(backend) = timing()? else { return Ok(()) };
    let mut studio =
        studio_of(backend.recording_strategy(RecordingStrategy::Direct)?.encoding_strategy(EncodingStrategy::PerPass))?;
    let mut scene = field(20);
    let camera = scene.cameras[0].clone();
    for cameras in [2, 130, 30] {
        let named = |number| Camera { name: format!("camera {number}"), size: [4, 4], ..camera.clone() };
        scene.cameras = (0..cameras).map(named).collect();
        let (_, log) = timed(&mut studio, &scene)?;
        let least = cameras * studio.renderer.plan().processes().len() / 2;
        expect(log.passes.len() >= least, || format!("{} passes of {cameras} cameras", log.passes.len()))?;
        expect(cameras < 130 || log.passes.len() > 512, || format!("only {} passes", log.passes.len()))?;
    }
    Ok(())
}

/// A pass that encodes itself, and one that does not.
struct Own {
    is_raw: bool,
}

impl RenderProcess for Own {
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

impl RawPass for Own {
    fn encode(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        resources: &RawPassResources<'_>,
    ) -> Result<(), Box<dyn Error + Send + Sync>> {
        let target = resources.target("raw").ok_or("the target is missing")?;
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
    if timing()?.is_none() {
        return Ok(());
    }
    let all = device()?.0.features() & WgpuBackend::TIMING_FEATURES;
    for features in [wgpu::Features::TIMESTAMP_QUERY, all] {
        let (device, queue) = device_with(features)?;
        let builder = Renderer::builder(WgpuBackend::new(device, queue)?.time_passes()?)
            .process(Own { is_raw: true })
            .process(Own { is_raw: false })
            .output("drawn");
        let (renderer, submitter) = builder.build(Arc::new(Scheduler::new(2)?))?;
        let mut studio = Studio { renderer, submitter };
        let mut scene = field(3);
        scene.cameras.truncate(1);
        let (times_raw, view) = (features == WgpuBackend::TIMING_FEATURES, scene.cameras[0].name.clone());
        let recorded = studio.record(&scene)?;
        let times = studio.submit(recorded)?.pass_times()?;
        let expected = [("raw", times_raw), ("drawn", true)].into_iter().filter(|(_, is_timed)| *is_timed);
        let expected: Vec<_> = expected.map(|(process, _)| (process.to_owned(), view.clone())).collect();
        expect(told(&times) == expected && times.skipped == 0, || format!("{features:?}: {times:?}"))?;
    }
    Ok(())
}

fn no_times() -> Result<(), Failed> {
    let mut untimed = Studio::new()?;
    let recorded = untimed.record(&field(3))?;
    match untimed.submit(recorded)?.pass_times() {
        Err(BackendError::NotTimed) => {}
        other => return Err(format!("{other:?}").into()),
    }
    if timing()?.is_none() {
        return Ok(());
    }
    let (device, queue) = device_with(wgpu::Features::TIMESTAMP_QUERY)?;
    let backend = WgpuBackend::new(device.clone(), queue)?.time_passes()?;
    let scheduler = Arc::new(Scheduler::new(2)?);
    let builder = Renderer::builder(backend).deferred(Deferred::to_picture());
    let (renderer, submitter) = builder.build(Arc::clone(&scheduler))?;
    let mut studio = Studio { renderer, submitter };
    let recorded = studio.record(&field(3))?;
    let submission = studio.submit(recorded)?;
    device.destroy();
    let times = submission.pass_times();
    expect(matches!(times, Err(BackendError::DeviceLost { .. })), || format!("{times:?}"))?;
    let clock = studio.renderer.backend().device_clock(scheduler.timeline());
    expect(clock.is_err(), || format!("{clock:?}"))
}

/// The machine's adapter with these features alone.
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
