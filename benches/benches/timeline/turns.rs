//! Frames with the recorder off and on, in turns.

use std::error::Error;
use std::ops::Range;
use std::time::{Duration, Instant};

use drawloom::graph::{FrameGraph, Node, NodeError, Schedule};
use drawloom::task::{Scheduler, Worker};
use drawloom_benches::stopwatch::middle;
use drawloom_benches::work::Work;

use crate::report::TimedFigures;

type Failure = Box<dyn Error + Send + Sync>;

/// How long frames are run in a turn.
const TURN: Duration = Duration::from_millis(15);

/// Something that is run with the recorder off and on.
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
    /// The scheduler benchmark's row `frame`, and chunks that do nothing, on one worker and shared by two.
    ///
    /// # Errors
    /// If a scheduler cannot be started.
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
        // What is to be compared is one way of running, not two.
        schedule.always_parallel(workers > 1);
        let scheduler = Scheduler::new(workers)?;
        let mut timed =
            Self { name, chunks: passes * chunks, schedule, scheduler, work, off: Vec::new(), on: Vec::new() };
        // Caches, job sizes, and the memory of the rings.
        timed.turn(false)?;
        timed.turn(true)?;
        (timed.off, timed.on) = (Vec::new(), Vec::new());
        Ok(timed)
    }

    /// A turn each, the first of which is another one each time.
    ///
    /// # Errors
    /// If a frame fails, or if something was dropped rather than recorded.
    pub fn round(&mut self) -> Result<(), Failure> {
        let on_first = self.off.len() % 2 == 1;
        self.turn(on_first)?;
        self.turn(!on_first)
    }

    fn turn(&mut self, is_on: bool) -> Result<(), Failure> {
        let timeline = self.scheduler.timeline();
        if is_on {
            timeline.start();
        }
        // What a worker has room for, with some to spare for its idle times.
        let most = ((1 << 16) * 3 / 4 / self.chunks).max(1);
        let (start, mut frames) = (Instant::now(), 0);
        while frames < most && start.elapsed() < TURN {
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
        if is_on { &mut self.on } else { &mut self.off }.push(frame);
        Ok(())
    }

    /// What the recorder has asked for, a worker.
    pub fn ring_bytes(&self) -> usize {
        self.scheduler.timeline().bytes() / self.scheduler.workers()
    }

    /// What was measured so far.
    pub fn figures(&self) -> TimedFigures {
        let differences = self.on.iter().zip(&self.off).map(|(on, off)| on - off);
        let (frame, difference) = (middle(self.off.iter().copied()), middle(differences));
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
