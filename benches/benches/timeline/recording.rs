//! Frames with the recorder off and on, interleaved.

use std::error::Error;
use std::ops::Range;
use std::time::{Duration, Instant};

use drawloom::graph::{FrameGraph, Node, NodeError, Schedule};
use drawloom::task::{Scheduler, Worker};
use drawloom_benches::harness::Harness;
use drawloom_benches::statistics::median;
use drawloom_benches::work::Work;

use crate::report::TimedFigures;

type Failure = Box<dyn Error + Send + Sync>;

/// How long a run lasts, at least.
const RUN: Duration = Duration::from_millis(15);

/// A schedule that runs with the recorder off and on.
pub struct Timed {
    name: &'static str,
    chunks: usize,
    schedule: Schedule<Chunks>,
    scheduler: Scheduler,
    work: Work,
    /// Nanoseconds a frame in each round.
    off: Vec<f64>,
    on: Vec<f64>,
}

impl Timed {
    /// The scheduler benchmark's row `frame`, and empty chunks on one worker and on two.
    ///
    /// # Errors
    /// Returns an error if a scheduler cannot be started.
    pub fn all() -> Result<Vec<Self>, Failure> {
        Ok(vec![
            Self::new("frame", 24, 24, Work::busy(Duration::from_nanos(2_900)), 2)?,
            Self::new("empty, one worker", 1, 2_048, Work::empty(), 1)?,
            Self::new("empty, two workers", 1, 2_048, Work::empty(), 2)?,
        ])
    }

    fn new(name: &'static str, passes: usize, chunks: usize, work: Work, workers: usize) -> Result<Self, Failure> {
        let mut graph = FrameGraph::new();
        let nodes: Vec<_> = (0..passes).map(|pass| graph.add(pass.to_string(), Chunks { count: chunks })).collect();
        nodes.windows(2).for_each(|pair| graph.order(pair[0], pair[1]));
        nodes.iter().for_each(|&node| graph.keep(node));
        let mut schedule = graph.compile()?;
        // Both runs must use the same run mode to be comparable.
        schedule.always_parallel(workers > 1);
        let scheduler = Scheduler::new(workers)?;
        let mut timed =
            Self { name, chunks: passes * chunks, schedule, scheduler, work, off: Vec::new(), on: Vec::new() };
        // Warms up caches, job sizes, and the memory of the rings.
        timed.run(false)?;
        timed.run(true)?;
        Ok(timed)
    }

    /// Runs once with the recorder off and once with it on.
    ///
    /// # Errors
    /// Returns an error if a frame fails, or if the recorder drops a chunk.
    pub fn round(&mut self, harness: &mut Harness) -> Result<(), Failure> {
        let frames = harness.round(&mut [false, true], |&mut is_on| self.run(is_on))?;
        self.off.push(frames[0]);
        self.on.push(frames[1]);
        Ok(())
    }

    /// Returns nanoseconds per frame.
    fn run(&mut self, is_on: bool) -> Result<f64, Failure> {
        let timeline = self.scheduler.timeline();
        if is_on {
            timeline.start();
        }
        // Three quarters of the ring's capacity; the rest is for idle times.
        let max_frames = ((1 << 16) * 3 / 4 / self.chunks).max(1);
        let (start, mut frames) = (Instant::now(), 0);
        while frames < max_frames && start.elapsed() < RUN {
            self.schedule.run(&self.scheduler, &self.work)?;
            frames += 1;
        }
        let frame = start.elapsed().as_nanos() as f64 / frames as f64;
        timeline.stop();
        let log = timeline.take();
        let chunks: usize = log.runs.iter().map(|run| run.chunks.len()).sum();
        let expected = if is_on { frames * self.chunks } else { 0 };
        if (chunks, log.all_dropped()) != (expected, 0) {
            return Err(format!("{}: {chunks} of {expected} chunks were recorded", self.name).into());
        }
        Ok(frame)
    }

    /// Bytes that the recorder has allocated per worker.
    pub fn ring_bytes(&self) -> usize {
        self.scheduler.timeline().bytes() / self.scheduler.workers()
    }

    /// The medians so far.
    pub fn figures(&self) -> TimedFigures {
        let differences = self.on.iter().zip(&self.off).map(|(on, off)| on - off);
        let (frame, difference) = (median(self.off.iter().copied()), median(differences));
        TimedFigures {
            row: self.name,
            chunks: self.chunks,
            frame,
            a_chunk: difference * self.scheduler.workers() as f64 / self.chunks as f64,
            share: difference / frame,
        }
    }
}

/// Chunks of one item.
struct Chunks {
    count: usize,
}

impl Node<Work> for Chunks {
    fn width(&self, _work: &Work) -> usize {
        self.count
    }

    fn run(&self, work: &Work, range: Range<usize>, _worker: &Worker) -> Result<(), NodeError> {
        range.for_each(|job| work.job(job));
        Ok(())
    }
}
