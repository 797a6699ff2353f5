//! A renderer, and the times of its frames.

use std::error::Error;
use std::iter::repeat_n;
use std::mem;
use std::sync::Arc;
use std::time::{Duration, Instant};

use drawloom::backend::{WgpuBackend, WgpuSubmission};
use drawloom::process::Deferred;
use drawloom::task::Scheduler;
use drawloom::timeline::Run;
use drawloom::view::ShadowMaps;
use drawloom::{Granularity, Renderer, RendererBuilder, Submitter};
use drawloom_benches::cpu_time::CpuUse;
use drawloom_benches::moving::Moving;
use drawloom_benches::stopwatch::{mean_frame, timed_frame};

use crate::world::PICTURE;

/// A renderer with timed frames.
pub struct Runner {
    pub renderer: Renderer<WgpuBackend>,
    pub submitter: Submitter<WgpuBackend>,
}

/// How a renderer divides its work.
#[derive(Clone, Copy, Debug)]
pub struct Division {
    pub instancing: bool,
    pub granularity: Granularity,
    /// See [`Deferred::geometry_shares`].
    pub geometry_shares: usize,
}

impl Division {
    /// The crate's own, without instancing.
    pub const OWN: Self = Self { instancing: false, granularity: Granularity::Adaptive, geometry_shares: 1 };
}

/// Mean times of several frames, in seconds.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    pub frame: f64,
    /// The part of the frame in which the world is borrowed.
    pub borrowed: f64,
    /// From the hand-over of the scene until the device has drawn it.
    pub until_drawn: f64,
}

/// Frames of which two are in flight, as drivers keep them by themselves (L 6): what takes longest, the CPU's part or
/// the device's, says how many there are.
#[derive(Clone, Copy, Debug)]
pub struct InFlight {
    /// Mean time of a frame, in seconds.
    pub frame: f64,
    /// The share of all cores' time that this process used, its driver included; NaN where that cannot be measured.
    pub cpu_use: f64,
}

/// Frames that are measured in flight, at least.
const LEAST_IN_FLIGHT: u32 = 4;

/// What the timeline tells about a frame.
pub struct Profile {
    /// The time outside of its jobs, in seconds: a part of `record`, and `submit`.
    pub serial: f64,
    /// How busy each worker is, as a share of the frame. The first is the calling thread, with the serial part.
    pub loads: Vec<f64>,
    /// The share of the work, of all threads together, that is calls of wgpu: [`API_STAGES`] and submission.
    pub api_share: f64,
}

/// The stages that consist of calls of wgpu. The uploads of objects as they are described are in a stage with other
/// work, which is left out.
const API_STAGES: [&str; 4] = ["upload", "prepare", "record", "finish"];

impl Runner {
    /// # Errors
    /// Returns an error if the renderer cannot be built.
    pub fn new(backend: WgpuBackend, scheduler: &Arc<Scheduler>, division: Division) -> Result<Self, Box<dyn Error>> {
        let Division { instancing, granularity, geometry_shares } = division;
        let shadow_maps = Some(ShadowMaps { side: PICTURE, ..ShadowMaps::default() });
        let shares = u32::try_from(geometry_shares)?;
        let deferred = Deferred::to_picture().shadow_maps(shadow_maps).geometry_shares(shares);
        let builder: RendererBuilder<_> = Renderer::builder(backend).pipeline(deferred);
        let (renderer, submitter) =
            builder.instancing(instancing).granularity(granularity).build(Arc::clone(scheduler))?;
        Ok(Self { renderer, submitter })
    }

    /// Draws one frame, and more until they have taken `at_least`.
    ///
    /// # Errors
    /// Returns an error if a frame cannot be drawn, or if a view does not see all objects.
    pub fn sample(&mut self, world: &mut Moving, at_least: Duration) -> Result<Sample, Box<dyn Error>> {
        let (mut borrowed, mut until_drawn, mut frames) = (Duration::ZERO, Duration::ZERO, 0);
        let frame = mean_frame(at_least, || {
            world.step();
            let scene = world.as_scene_ref();
            let Self { renderer, submitter } = self;
            let (submitted, time) = timed_frame(renderer, submitter, scene, WgpuSubmission::wait)?;
            let visible = submitted.statistics.views.iter().map(|view| view.visible);
            // The camera's view, and one a light.
            if !visible.clone().eq(repeat_n(scene.object_count(), 1 + scene.lights.len())) {
                let visible: Vec<_> = visible.collect();
                return Err(format!("of {} objects, views see {visible:?}", scene.object_count()).into());
            }
            borrowed += time.borrowed;
            until_drawn += time.borrowed + time.device;
            frames += 1;
            Ok::<_, Box<dyn Error>>(time.cpu)
        })?;
        let mean = |time: Duration| time.as_secs_f64() / f64::from(frames);
        Ok(Sample { frame, borrowed: mean(borrowed), until_drawn: mean(until_drawn) })
    }

    /// Draws frames for at least this long, each of which waits until the device has drawn the one before the last.
    ///
    /// # Errors
    /// Returns an error if a frame cannot be drawn.
    pub fn in_flight(&mut self, world: &mut Moving, at_least: Duration) -> Result<InFlight, Box<dyn Error>> {
        let mut submit = || {
            world.step();
            let recorded = self.renderer.record(world.as_scene_ref())?;
            Ok::<_, Box<dyn Error>>(self.submitter.submit(recorded)?.submission)
        };
        let (mut before, mut last) = (submit()?, submit()?);
        before.wait()?;
        let (start, cpu_use, mut frames) = (Instant::now(), CpuUse::begin(), 0);
        while frames < LEAST_IN_FLIGHT || start.elapsed() < at_least {
            before = mem::replace(&mut last, submit()?);
            before.wait()?;
            frames += 1;
        }
        let in_flight = InFlight { frame: start.elapsed().as_secs_f64() / f64::from(frames), cpu_use: cpu_use.share() };
        last.wait()?;
        Ok(in_flight)
    }

    /// Draws a frame, and tells where its time goes.
    ///
    /// # Errors
    /// Returns an error if the frame cannot be drawn.
    pub fn profile(&mut self, world: &mut Moving) -> Result<Profile, Box<dyn Error>> {
        world.step();
        let timeline = Arc::clone(self.renderer.scheduler().timeline());
        timeline.start();
        let recorded = self.renderer.record(world.as_scene_ref())?;
        let submitted = self.submitter.submit(recorded)?;
        timeline.stop();
        submitted.submission.wait()?;
        let log = timeline.take();
        let in_runs: Duration = log.runs.iter().map(Run::duration).sum();
        let in_spans = |name: Option<&str>| -> Duration {
            let spans = log.spans.iter().filter(|span| name.is_none_or(|name| span.name == name));
            spans.map(|span| span.ended - span.began).sum()
        };
        let (frame, serial, mut api) = (in_spans(None), in_spans(None) - in_runs, in_spans(Some("submit")));
        let mut busy = vec![Duration::ZERO; log.workers.len()];
        busy[0] = serial;
        for run in &log.runs {
            for chunk in &run.chunks {
                busy[chunk.worker] += chunk.duration();
                let stage = run.graph.nodes[chunk.node].labels.stage.as_deref();
                if stage.is_some_and(|stage| API_STAGES.contains(&stage)) {
                    api += chunk.duration();
                }
            }
        }
        let has = |stage: &str| {
            let mut nodes = log.runs.iter().flat_map(|run| &run.graph.nodes);
            nodes.any(|node| node.labels.stage.as_deref() == Some(stage))
        };
        if let Some(stage) = API_STAGES.into_iter().find(|stage| !has(stage)) {
            return Err(format!("no job of the frame is of the stage {stage:?}").into());
        }
        let share = |part: Duration, of: Duration| part.as_secs_f64() / of.as_secs_f64();
        Ok(Profile {
            serial: serial.as_secs_f64(),
            loads: busy.iter().map(|&busy| share(busy, frame)).collect(),
            api_share: share(api, busy.iter().sum()),
        })
    }
}
