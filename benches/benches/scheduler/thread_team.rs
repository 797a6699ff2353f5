//! Threads that run node after node together, with a barrier between them: parallelism without a job system.

use std::sync::Barrier;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

use crossbeam_utils::CachePadded;
use drawloom_benches::spinning::SpinBarrier;
use drawloom_benches::work::Work;

use crate::Failure;
use crate::timer::Timer;

/// The calling thread, and others that live for one sample. A thread claims the next jobs of a node by a ticket.
pub struct ThreadTeam<B> {
    threads: usize,
    /// The end of each node's jobs.
    ends: Vec<usize>,
    jobs_per_ticket: usize,
    tickets: Vec<CachePadded<AtomicUsize>>,
    barrier: B,
    is_over: AtomicBool,
}

/// How threads wait for each other.
pub trait Wait: Sync {
    /// Waits until all threads have called it. Returns true on one of them.
    fn wait(&self) -> bool;
}

impl Wait for Barrier {
    fn wait(&self) -> bool {
        Self::wait(self).is_leader()
    }
}

impl Wait for SpinBarrier {
    fn wait(&self) -> bool {
        Self::wait(self)
    }
}

impl ThreadTeam<Barrier> {
    /// Threads that sleep at a barrier. `ends` has the end of each node's jobs. They begin at the end of those of the
    /// node before.
    pub fn sleeping(threads: usize, ends: Vec<usize>, jobs_per_ticket: usize) -> Self {
        Self::new(threads, ends, jobs_per_ticket, Barrier::new(threads))
    }
}

impl ThreadTeam<SpinBarrier> {
    /// The same with threads that never sleep, neither at a barrier nor between frames.
    pub fn spinning(threads: usize, ends: Vec<usize>, jobs_per_ticket: usize) -> Self {
        Self::new(threads, ends, jobs_per_ticket, SpinBarrier::new(threads))
    }
}

impl<B: Wait> ThreadTeam<B> {
    fn new(threads: usize, ends: Vec<usize>, jobs_per_ticket: usize, barrier: B) -> Self {
        let tickets = ends.iter().map(|_| CachePadded::default()).collect();
        Self { threads, ends, jobs_per_ticket, tickets, barrier, is_over: AtomicBool::new(false) }
    }

    /// # Errors
    /// Returns an error if a frame fails.
    pub fn frames(&self, work: &Work, timer: &mut Timer) -> Result<(), Failure> {
        thread::scope(|scope| {
            self.is_over.store(false, Ordering::Relaxed);
            for _ in 1..self.threads {
                scope.spawn(|| {
                    loop {
                        self.barrier.wait();
                        if self.is_over.load(Ordering::Relaxed) {
                            break;
                        }
                        self.run_jobs(work);
                    }
                });
            }
            let outcome = timer.frames(|| {
                self.barrier.wait();
                self.run_jobs(work);
                Ok(())
            });
            self.is_over.store(true, Ordering::Relaxed);
            self.barrier.wait();
            outcome
        })
    }

    fn run_jobs(&self, work: &Work) {
        let mut begin = 0;
        for (&end, ticket) in self.ends.iter().zip(&self.tickets) {
            loop {
                let first = begin + ticket.fetch_add(self.jobs_per_ticket, Ordering::Relaxed);
                if first >= end {
                    break;
                }
                (first..end.min(first + self.jobs_per_ticket)).for_each(|job| work.job(job));
            }
            // No thread uses this ticket again before one more barrier.
            if self.barrier.wait() {
                ticket.store(0, Ordering::Relaxed);
            }
            begin = end;
        }
    }
}
