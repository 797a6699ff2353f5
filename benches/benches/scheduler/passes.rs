//! Rows `frame`, `frame_cold` and `fine`: passes of busy jobs, each pass after the one before.

use std::ops::Range;
use std::time::Duration;

use drawloom::graph::{FrameGraph, Node, NodeError, Schedule};
use drawloom::task::{Scheduler, Worker};
use drawloom_benches::work::{Record, Work};
use rayon::prelude::*;

use crate::crew::Crew;
use crate::turns::{Contender, Order, Row};
use crate::watch::Pace;
use crate::{Extent, Failure, WORKERS, pools};

const PASSES: usize = 24;

pub fn frame(extent: &Extent) -> Row {
    row("frame", Shape { passes: PASSES, jobs: 24 }, Duration::from_nanos(2_900), extent.hot())
}

/// The same, but a frame every 5 ms: workers and caches are cold.
pub fn frame_cold(extent: &Extent) -> Row {
    let pace = Pace::Cold { every: Duration::from_millis(5), frames: extent.cold_frames };
    row("frame_cold", Shape { passes: PASSES, jobs: 24 }, Duration::from_nanos(2_900), pace)
}

pub fn fine(extent: &Extent) -> Row {
    row("fine", Shape { passes: PASSES, jobs: 192 }, Duration::from_nanos(300), extent.hot())
}

fn row(name: &'static str, shape: Shape, job: Duration, pace: Pace<'static>) -> Row {
    let mut contenders = vec![Contender::plain_loop(shape.all()), Contender::ideal(shape.all())];
    contenders.extend(shape.contenders());
    Row {
        name,
        unit: "µs a frame",
        scale: 1e6,
        pace,
        work: Work::busy(job),
        jobs: shape.all(),
        order: shape.order(),
        contenders,
    }
}

/// So many passes of so many jobs, each job a chunk of its own.
#[derive(Clone, Copy)]
pub struct Shape {
    pub passes: usize,
    pub jobs: usize,
}

impl Shape {
    pub fn all(self) -> usize {
        self.passes * self.jobs
    }

    /// The jobs of each pass.
    fn ranges(self) -> impl Iterator<Item = Range<usize>> + Clone {
        (0..self.passes).map(move |pass| pass * self.jobs..(pass + 1) * self.jobs)
    }

    /// A pass begins when the one before it has ended.
    pub fn order(self) -> Order {
        Box::new(move |record: &Record| {
            for (before, after) in self.ranges().zip(self.ranges().skip(1)) {
                let ended = before.map(|job| record.ended(job)).max();
                let began = after.clone().map(|job| record.began(job)).min();
                if ended >= began {
                    return Err(format!("the pass of jobs {after:?} began before the one before it had ended"));
                }
            }
            Ok(())
        })
    }

    /// All that can run passes, but for the plain loop.
    pub fn contenders(self) -> Vec<Contender> {
        vec![
            self.drawloom(),
            self.drawloom_parallel_for(),
            self.rayon(),
            self.rayon_single(),
            self.bevy_tasks(),
            self.chili(),
            self.std_threads(),
        ]
    }

    /// A chain of nodes. Its schedule knows nothing at the start of a turn, as what it has learnt is of that turn's pool.
    pub fn drawloom(self) -> Contender {
        Contender::new("drawloom", move |work, watch| {
            let mut schedule = self.schedule()?;
            let scheduler = Scheduler::new(WORKERS)?;
            watch.frames(|| Ok(schedule.run(&scheduler, work)?))
        })
    }

    fn schedule(self) -> Result<Schedule<Chunks>, Failure> {
        let mut graph = FrameGraph::new();
        let nodes: Vec<_> = self.ranges().map(|jobs| graph.add(format!("{jobs:?}"), Chunks { jobs })).collect();
        for pair in nodes.windows(2) {
            graph.order(pair[0], pair[1]);
        }
        nodes.iter().for_each(|&node| graph.keep(node));
        Ok(graph.compile()?)
    }

    pub fn drawloom_parallel_for(self) -> Contender {
        Contender::new("drawloom parallel_for", move |work, watch| {
            let scheduler = Scheduler::new(WORKERS)?;
            watch.frames(|| {
                for jobs in self.ranges() {
                    scheduler.parallel_for(jobs.len(), 1, |range, _worker| {
                        range.for_each(|job| work.job(jobs.start + job));
                    })?;
                }
                Ok(())
            })
        })
    }

    /// As rayon itself splits a pass.
    pub fn rayon(self) -> Contender {
        Contender::new("rayon", move |work, watch| {
            pools::rayon()?.install(|| {
                watch.frames(|| {
                    self.ranges().for_each(|jobs| jobs.into_par_iter().for_each(|job| work.job(job)));
                    Ok(())
                })
            })
        })
    }

    /// Split down to single jobs.
    pub fn rayon_single(self) -> Contender {
        Contender::new("rayon max_len 1", move |work, watch| {
            pools::rayon()?.install(|| {
                watch.frames(|| {
                    self.ranges().for_each(|jobs| jobs.into_par_iter().with_max_len(1).for_each(|job| work.job(job)));
                    Ok(())
                })
            })
        })
    }

    /// A scope a pass, a task a job.
    pub fn bevy_tasks(self) -> Contender {
        Contender::new("bevy_tasks", move |work, watch| {
            let pool = pools::bevy_tasks();
            watch.frames(|| {
                for jobs in self.ranges() {
                    pool.scope(|scope| jobs.for_each(|job| scope.spawn(async move { work.job(job) })));
                }
                Ok(())
            })
        })
    }

    /// With a scope for all frames, which keeps heartbeats going between them.
    ///
    /// Looks at every join whether somebody wants a half: it costs little beside such jobs.
    pub fn chili(self) -> Contender {
        Contender::new("chili", move |work, watch| {
            let pool = pools::chili();
            let mut scope = pool.scope();
            watch.frames(|| {
                self.ranges().for_each(|jobs| pools::halve::<1>(&mut scope, jobs, work));
                Ok(())
            })
        })
    }

    /// With a scope for each frame: between frames nothing goes on.
    pub fn chili_scope_a_frame(self) -> Contender {
        Contender::new("chili", move |work, watch| {
            let pool = pools::chili();
            watch.frames(|| {
                let mut scope = pool.scope();
                self.ranges().for_each(|jobs| pools::halve::<1>(&mut scope, jobs, work));
                Ok(())
            })
        })
    }

    pub fn std_threads(self) -> Contender {
        let crew = Crew::new(self.ranges().map(|jobs| jobs.end).collect(), 1);
        Contender::new("std threads", move |work, watch| crew.frames(work, watch))
    }
}

/// A pass.
struct Chunks {
    jobs: Range<usize>,
}

impl Node<Work> for Chunks {
    fn width(&self, _work: &Work) -> usize {
        self.jobs.len()
    }

    fn run(&self, work: &Work, range: Range<usize>, _worker: &Worker) -> Result<(), NodeError> {
        range.for_each(|job| work.job(self.jobs.start + job));
        Ok(())
    }
}
