//! The cost of fences that nobody waits for.

use std::error::Error;
use std::sync::Arc;
use std::time::Instant;

use drawloom::process::Deferred;
use drawloom::task::Scheduler;
use drawloom::{FencePoint, Renderer};
use drawloom_benches::backends::BackendName;
use drawloom_benches::city;
use drawloom_benches::moving::{Motion, Moving};
use drawloom_benches::statistics::median;
use indicatif::ProgressBar;
use serde::Serialize;

/// The time from a recorded frame until it is submitted.
#[derive(Serialize)]
pub struct Row {
    pub place: &'static str,
    pub frame_us: f64,
}

const PLACES: [(&str, Option<FencePoint<'static>>); 3] =
    [("none", None), ("at the end", Some(FencePoint::End)), ("after the shadow map", Some(FencePoint::View(1)))];

pub fn measure(quick: bool, progress: &ProgressBar) -> Result<Vec<Row>, Box<dyn Error>> {
    let frames = if quick { 20 } else { 20_000 };
    let scheduler = Arc::new(Scheduler::new(1)?);
    let (mut renderer, submitter) =
        Renderer::builder(BackendName::Noop.open()?).pipeline(Deferred::to_picture()).build(scheduler)?;
    let mut world = Moving::new(city::new(100, [160, 90])?, Motion::Cameras);
    let mut times = PLACES.map(|_| Vec::with_capacity(frames));
    progress.inc_length(frames as u64);
    for frame in 0..frames {
        // The order of the places turns, as each frame leaves the caches to the next one.
        for index in 0..PLACES.len() {
            let index = (index + frame) % PLACES.len();
            world.step();
            let mut recorded = renderer.record(world.as_scene_ref())?;
            let start = Instant::now();
            let fence = PLACES[index].1.map(|place| recorded.fence_at(place)).transpose()?;
            submitter.submit(recorded)?;
            times[index].push(start.elapsed().as_secs_f64() * 1e6);
            drop(fence);
        }
        progress.inc(1);
    }
    let rows = PLACES.iter().zip(times).map(|((place, _), times)| Row { place, frame_us: median(times) });
    Ok(rows.collect())
}
