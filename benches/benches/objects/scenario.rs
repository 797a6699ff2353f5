//! L's two scenarios, by the number of objects.

use std::error::Error;
use std::sync::Arc;
use std::time::Duration;

use drawloom::backend::Record;
use drawloom::task::Scheduler;
use drawloom_benches::backends::BackendName;
use drawloom_benches::stopwatch::middle;
use drawloom_testing::random::Random;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::ceiling::ceiling;
use crate::turns::{Painter, Turn};
use crate::{Extent, world};

pub const WORKERS: usize = 2;

/// A row of L's table.
#[derive(Serialize)]
pub struct Row {
    pub objects: usize,
    pub backend: BackendName,
    pub instancing: bool,
    pub single_fps: f64,
    pub multi_fps: f64,
    pub ratio: f64,
    pub ceiling: f64,
    /// How long the world was held.
    pub single_held_ms: f64,
    pub multi_held_ms: f64,
    /// The same as a share of the frame.
    pub single_held_share: f64,
    pub multi_held_share: f64,
}

/// # Errors
/// If a frame cannot be drawn.
pub fn measure(
    extent: &Extent,
    backend: BackendName,
    objects: usize,
    progress: &ProgressBar,
) -> Result<[Row; 2], Box<dyn Error>> {
    let (warm_up, rounds, turn) = (backend.of(extent.warm_up), backend.of(extent.rounds), backend.of(extent.turn));
    progress.set_message(format!("{objects} objects, {}", backend.name()));
    let (one, two) = (Arc::new(Scheduler::new(1)?), Arc::new(Scheduler::new(WORKERS)?));
    let mut painters = [
        Painter::new(backend.open()?.record(Record::Direct)?, &one, false)?,
        Painter::new(backend.open()?, &two, false)?,
        Painter::new(backend.open()?, &two, true)?,
    ];
    progress.inc_length((rounds * painters.len()) as u64);
    let mut world = world::new(objects)?;
    for _ in 0..warm_up {
        for painter in &mut painters {
            painter.turn(&mut world, Duration::ZERO)?;
        }
    }
    let mut turns: [Vec<Turn>; 3] = Default::default();
    let mut serial = Vec::new();
    let mut random = Random::new();
    for _ in 0..rounds {
        for index in random.order(painters.len()) {
            turns[index].push(painters[index].turn(&mut world, turn)?);
            progress.inc(1);
        }
        serial.push(painters[0].serial_part(&mut world)?);
    }
    let frame = |turns: &[Turn]| middle(turns.iter().map(|turn| turn.frame));
    let held = |turns: &[Turn]| middle(turns.iter().map(|turn| turn.held));
    let held_share = |turns: &[Turn]| middle(turns.iter().map(|turn| turn.held / turn.frame));
    let [single, multi @ ..] = &turns;
    let ceiling = ceiling(frame(single), middle(serial), two.wake_up_cost().as_secs_f64());
    let row = |instancing: bool| {
        let multi = &multi[usize::from(instancing)];
        Row {
            objects,
            backend,
            instancing,
            single_fps: frame(single).recip(),
            multi_fps: frame(multi).recip(),
            ratio: middle(single.iter().zip(multi).map(|(single, multi)| single.frame / multi.frame)),
            ceiling,
            single_held_ms: held(single) * 1e3,
            multi_held_ms: held(multi) * 1e3,
            single_held_share: held_share(single),
            multi_held_share: held_share(multi),
        }
    };
    Ok([row(false), row(true)])
}
