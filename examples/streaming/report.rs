//! What the flight took.

use std::error::Error;
use std::time::Duration;

use drawloom::backend::{StreamingBudget, StreamingStatistics};
use drawloom_output::{OutputFile, print_line};
use serde::Serialize;

/// A frame of the flight.
#[derive(Clone, Copy)]
pub struct Sample {
    /// In seconds.
    pub time: f64,
    /// From the update of the world until the device was done.
    pub frame: Duration,
    pub streaming: StreamingStatistics,
    /// Meshes and textures in sight that were not on the device, and nearby tiles that were not made yet.
    pub missing: usize,
    /// Bytes of all tiles that were begun so far.
    pub made_bytes: u64,
}

/// Records every frame.
pub struct Recorder {
    pub budget: StreamingBudget,
    pub samples: Vec<Sample>,
}

/// Sums up the flight.
#[derive(Serialize)]
pub struct Report {
    frames: usize,
    frame_ms: FrameTimes,
    budget_bytes: u64,
    resident_bytes_max: u64,
    uploaded_bytes: u64,
    /// What the tiles of the flight would take on the device together.
    world_bytes: u64,
    evictions: u64,
    /// Frames in which something was missing, after the first second.
    incomplete_frames: usize,
}

#[derive(Serialize)]
struct FrameTimes {
    median: f64,
    p99: f64,
    max: f64,
}

impl Recorder {
    pub fn new(budget: StreamingBudget) -> Self {
        Self { budget, samples: Vec::new() }
    }

    pub fn frames(&self) -> usize {
        self.samples.len()
    }

    pub fn add(&mut self, sample: Sample) {
        self.samples.push(sample);
    }

    pub fn report(&self) -> Report {
        let mut times: Vec<_> = self.samples.iter().map(|sample| sample.frame.as_secs_f64() * 1000.0).collect();
        times.sort_by(f64::total_cmp);
        let quantile =
            |share: f64| times.get(((times.len() as f64 * share) as usize).min(times.len().saturating_sub(1)));
        let quantile = |share| quantile(share).copied().unwrap_or(0.0);
        let last = self.samples.last().map(|sample| (sample.streaming, sample.made_bytes)).unwrap_or_default();
        let resident = self.samples.iter().map(|sample| sample.streaming.resident_bytes());
        let incomplete = self.samples.iter().filter(|sample| sample.time > 1.0 && sample.missing > 0);
        Report {
            frames: self.samples.len(),
            frame_ms: FrameTimes { median: quantile(0.5), p99: quantile(0.99), max: quantile(1.0) },
            budget_bytes: self.budget.mesh_bytes + self.budget.texture_bytes,
            resident_bytes_max: resident.max().unwrap_or(0),
            uploaded_bytes: last.0.uploaded_bytes,
            world_bytes: last.1,
            evictions: last.0.evictions,
            incomplete_frames: incomplete.count(),
        }
    }
}

impl Report {
    pub fn print(&self) {
        let Self { frames, frame_ms: FrameTimes { median, p99, max }, .. } = self;
        let megabytes = |bytes: u64| bytes as f64 / 1e6;
        print_line!(
            "{frames} frames: median {median:.2} ms, 99% below {p99:.2} ms, longest {max:.2} ms ({:.2} medians)",
            max / median
        );
        print_line!(
            "{:.0} MB of land through {:.0} MB: at most {:.0} MB on the device, {:.0} MB uploaded, {} evictions, {} frames incomplete",
            megabytes(self.world_bytes),
            megabytes(self.budget_bytes),
            megabytes(self.resident_bytes_max),
            megabytes(self.uploaded_bytes),
            self.evictions,
            self.incomplete_frames,
        );
    }

    /// Writes it as JSON.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn write(&self, file: &OutputFile) -> Result<(), Box<dyn Error>> {
        Ok(file.write_all(serde_json::to_string_pretty(self)? + "\n")?)
    }
}
