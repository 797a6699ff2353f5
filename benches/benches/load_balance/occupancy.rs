//! How many jobs a frame has, and how long its workers have none.

use drawloom::timeline::Run;
use drawloom_benches::statistics::median;

/// The jobs of some frames, and the idle time of their workers.
#[derive(Clone, Default)]
pub struct Occupancy {
    jobs: Vec<f64>,
    /// By worker and frame: seconds, between the first job and the last, in which the worker ran none.
    idle: Vec<Vec<f64>>,
}

impl Occupancy {
    pub fn add(&mut self, run: &Run) {
        self.jobs.push(run.chunks.len() as f64);
        self.idle.resize_with(run.workers, Vec::new);
        for (worker, idle) in self.idle.iter_mut().enumerate() {
            let own = run.chunks.iter().filter(|chunk| chunk.worker == worker);
            let busy: f64 = own.map(|chunk| (chunk.ended - chunk.started).as_secs_f64()).sum();
            idle.push((run.duration().as_secs_f64() - busy).max(0.0));
        }
    }

    /// The median number of jobs in a frame.
    pub fn jobs(&self) -> f64 {
        median(self.jobs.iter().copied())
    }

    /// The median idle time of each worker in a frame, in milliseconds.
    pub fn idle_ms(&self) -> Vec<f64> {
        self.idle.iter().map(|frames| median(frames.iter().copied()) * 1e3).collect()
    }
}
