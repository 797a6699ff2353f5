//! Rows `idle` and `asleep`: the CPU time of workers that have little or nothing to do.
//!
//! CPU time is that of all threads of the process, so both rows exist on Linux only.

use std::time::Duration;

use drawloom_benches::work::Work;

use crate::Extent;
use crate::chains::Chain;
use crate::row::{Contender, Row};
use crate::timer::Pace;

const FRAME: Chain = Chain { nodes: 1, jobs: 64 };

/// 60 frames per second of 64 empty jobs each. `sleep only` sleeps as often and runs no jobs: the cost of sleeping
/// alone.
pub fn idle(extent: &Extent, workers: &[usize]) -> Row {
    let interval = Duration::from_secs(1) / 60;
    let pace = Pace::CpuTime { interval, frames: extent.idle_frames };
    let mut row = row("idle", "µs CPU per frame", pace, workers);
    let sleep_only = Contender::new("sleep only", 1, |_work, timer| timer.frames(|| Ok(())));
    row.contenders.push(sleep_only.with_easier_task().with_jobs(0));
    row
}

/// One frame, and then none.
pub fn asleep(extent: &Extent, workers: &[usize]) -> Row {
    row("asleep", "µs CPU per second", Pace::Asleep { idle: extent.asleep }, workers)
}

fn row(name: &'static str, unit: &'static str, pace: Pace<'static>, workers: &[usize]) -> Row {
    Row {
        name,
        unit,
        scale: 1e6,
        pace,
        work: Work::empty(),
        jobs: FRAME.all(),
        order: FRAME.order(),
        contenders: workers.iter().flat_map(|&workers| contenders(workers)).collect(),
    }
}

fn contenders(workers: usize) -> [Contender; 7] {
    [
        FRAME.drawloom(workers),
        FRAME.drawloom_parallel_for(workers),
        FRAME.rayon(workers),
        FRAME.rayon_single(workers),
        FRAME.bevy_tasks(workers),
        FRAME.chili_scope_per_frame(workers),
        FRAME.std_threads(workers),
    ]
}
