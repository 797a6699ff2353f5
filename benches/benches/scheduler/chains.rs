//! Rows `frame`, `frame_cold` and `fine`: a chain of nodes with busy jobs.

use std::ops::Range;
use std::time::Duration;

use drawloom::graph::{FrameGraph, Node, NodeError, Schedule};
use drawloom::task::{Scheduler, Worker};
use drawloom_benches::work::{Record, Work};
use rayon::prelude::*;

use crate::row::{Contender, Order, Row};
use crate::thread_team::ThreadTeam;
use crate::timer::Pace;
use crate::{Extent, Failure, pools};

const NODES: usize = 24;

/// Threads that never sleep.
const SPINNING: &str = "spinning threads";

pub fn frame(extent: &Extent, workers: &[usize]) -> Row {
    row("frame", Chain { nodes: NODES, jobs: 24 }, Duration::from_nanos(2_900), extent.back_to_back(), workers)
}

/// The same with one frame every 5 ms, so that workers sleep and caches are cold.
pub fn frame_cold(extent: &Extent, workers: &[usize]) -> Row {
    let pace = Pace::Paced { interval: Duration::from_millis(5), frames: extent.cold_frames };
    let mut row = row("frame_cold", Chain { nodes: NODES, jobs: 24 }, Duration::from_nanos(2_900), pace, workers);
    // They keep a core busy between frames, and have none to wake.
    row.contenders.iter_mut().filter(|contender| contender.name == SPINNING).for_each(|one| one.is_easier = true);
    row
}

pub fn fine(extent: &Extent, workers: &[usize]) -> Row {
    row("fine", Chain { nodes: NODES, jobs: 192 }, Duration::from_nanos(300), extent.back_to_back(), workers)
}

fn row(name: &'static str, shape: Chain, job: Duration, pace: Pace<'static>, workers: &[usize]) -> Row {
    let mut contenders = vec![Contender::plain_loop(shape.all())];
    for &workers in workers {
        contenders.push(Contender::ideal(shape.all(), workers));
        contenders.extend(shape.contenders(workers));
    }
    Row {
        name,
        unit: "µs per frame",
        scale: 1e6,
        pace,
        work: Work::busy(job),
        jobs: shape.all(),
        order: shape.order(),
        contenders,
    }
}

/// A chain of nodes of as many jobs each. Each job is a chunk of its own.
#[derive(Clone, Copy)]
pub struct Chain {
    pub nodes: usize,
    pub jobs: usize,
}

impl Chain {
    pub fn all(self) -> usize {
        self.nodes * self.jobs
    }

    /// The jobs of each node.
    fn ranges(self) -> impl Iterator<Item = Range<usize>> + Clone {
        (0..self.nodes).map(move |node| node * self.jobs..(node + 1) * self.jobs)
    }

    /// Checks that each node begins after the one before it has ended.
    pub fn order(self) -> Order {
        Box::new(move |record: &Record| {
            for (before, after) in self.ranges().zip(self.ranges().skip(1)) {
                let ended = before.map(|job| record.ended(job)).max();
                let began = after.clone().map(|job| record.began(job)).min();
                if ended >= began {
                    return Err(format!("the node of jobs {after:?} began before the node before it had ended"));
                }
            }
            Ok(())
        })
    }

    /// All contenders but the plain loop.
    pub fn contenders(self, workers: usize) -> Vec<Contender> {
        vec![
            self.drawloom(workers),
            self.drawloom_parallel_for(workers),
            self.rayon(workers),
            self.rayon_single(workers),
            self.bevy_tasks(workers),
            self.chili(workers),
            self.std_threads(workers),
            self.spinning_threads(workers),
        ]
    }

    /// The schedule is compiled for each sample, so that it has no measurements of an earlier pool.
    pub fn drawloom(self, workers: usize) -> Contender {
        Contender::new("drawloom", workers, move |work, timer| {
            let mut schedule = self.schedule()?;
            let scheduler = Scheduler::new(workers)?;
            timer.frames(|| Ok(schedule.run(&scheduler, work)?))
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

    pub fn drawloom_parallel_for(self, workers: usize) -> Contender {
        Contender::new("drawloom parallel_for", workers, move |work, timer| {
            let scheduler = Scheduler::new(workers)?;
            timer.frames(|| {
                for jobs in self.ranges() {
                    scheduler.parallel_for(jobs.len(), 1, |range, _worker| {
                        range.for_each(|job| work.job(jobs.start + job));
                    })?;
                }
                Ok(())
            })
        })
    }

    /// rayon itself decides how to split a node's jobs.
    pub fn rayon(self, workers: usize) -> Contender {
        Contender::new("rayon", workers, move |work, timer| {
            pools::rayon(workers)?.install(|| {
                timer.frames(|| {
                    self.ranges().for_each(|jobs| jobs.into_par_iter().for_each(|job| work.job(job)));
                    Ok(())
                })
            })
        })
    }

    /// Split down to single jobs.
    pub fn rayon_single(self, workers: usize) -> Contender {
        Contender::new("rayon max_len 1", workers, move |work, timer| {
            pools::rayon(workers)?.install(|| {
                timer.frames(|| {
                    self.ranges().for_each(|jobs| jobs.into_par_iter().with_max_len(1).for_each(|job| work.job(job)));
                    Ok(())
                })
            })
        })
    }

    /// One scope per node, one task per job.
    pub fn bevy_tasks(self, workers: usize) -> Contender {
        Contender::new("bevy_tasks", workers, move |work, timer| {
            let pool = pools::bevy_tasks(workers);
            timer.frames(|| {
                for jobs in self.ranges() {
                    pool.scope(|scope| jobs.for_each(|job| scope.spawn(async move { work.job(job) })));
                }
                Ok(())
            })
        })
    }

    /// With one scope for all frames, which keeps the heartbeat going between them.
    ///
    /// It checks for idle threads at every join, which costs little beside such jobs.
    pub fn chili(self, workers: usize) -> Contender {
        Contender::new("chili", workers, move |work, timer| {
            let pool = pools::chili(workers);
            let mut scope = pool.scope();
            timer.frames(|| {
                self.ranges().for_each(|jobs| pools::join_halves::<1>(&mut scope, jobs, work));
                Ok(())
            })
        })
    }

    /// With one scope per frame: no heartbeat between frames.
    pub fn chili_scope_per_frame(self, workers: usize) -> Contender {
        Contender::new("chili", workers, move |work, timer| {
            let pool = pools::chili(workers);
            timer.frames(|| {
                let mut scope = pool.scope();
                self.ranges().for_each(|jobs| pools::join_halves::<1>(&mut scope, jobs, work));
                Ok(())
            })
        })
    }

    pub fn std_threads(self, workers: usize) -> Contender {
        let team = ThreadTeam::sleeping(workers, self.ranges().map(|jobs| jobs.end).collect(), 1);
        Contender::new("std threads", workers, move |work, timer| team.frames(work, timer))
    }

    pub fn spinning_threads(self, workers: usize) -> Contender {
        let team = ThreadTeam::spinning(workers, self.ranges().map(|jobs| jobs.end).collect(), 1);
        Contender::new(SPINNING, workers, move |work, timer| team.frames(work, timer))
    }
}

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
