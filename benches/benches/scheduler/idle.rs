//! Rows `idle` and `asleep`: what workers take from others that have little or nothing to do.
//!
//! The processor's time is that of all threads of the process, so both rows exist on Linux only.

use std::time::Duration;

use drawloom_benches::work::Work;

use crate::Extent;
use crate::passes::Shape;
use crate::turns::{Contender, Row};
use crate::watch::Pace;

const FRAME: Shape = Shape { passes: 1, jobs: 64 };

/// 60 frames a second, each of 64 empty jobs. `sleep only` sleeps as often and has none: what it takes is the sleeping's.
pub fn idle(extent: &Extent) -> Row {
    let every = Duration::from_secs(1) / 60;
    let pace = Pace::Processor { every, frames: extent.idle_frames };
    let mut row = row("idle", "µs CPU a frame", pace);
    let sleep_only = Contender::new("sleep only", |_work, watch| watch.frames(|| Ok(())));
    row.contenders.push(sleep_only.with_workers(1).with_easier_task().with_jobs(0));
    row
}

/// A frame, and then none.
pub fn asleep(extent: &Extent) -> Row {
    row("asleep", "µs CPU a second", Pace::Asleep { still: extent.asleep })
}

fn row(name: &'static str, unit: &'static str, pace: Pace<'static>) -> Row {
    Row {
        name,
        unit,
        scale: 1e6,
        pace,
        work: Work::empty(),
        jobs: FRAME.all(),
        order: FRAME.order(),
        contenders: vec![
            FRAME.drawloom(),
            FRAME.drawloom_parallel_for(),
            FRAME.rayon(),
            FRAME.rayon_single(),
            FRAME.bevy_tasks(),
            FRAME.chili_scope_a_frame(),
            FRAME.std_threads(),
        ],
    }
}
