//! Threads that run node after node together, with a barrier between them: parallelism without a job system.

use std::sync::Barrier;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

use crossbeam_utils::CachePadded;
use drawloom_benches::work::Work;

use crate::Failure;
use crate::timer::Timer;

/// The calling thread, and others that live for one sample. A thread claims the next jobs of a node by a ticket.
pub struct ThreadTeam {
    /// The end of each node's jobs.
    ends: Vec<usize>,
    jobs_per_ticket: usize,
    threads: usize,
    tickets: Vec<CachePadded<AtomicUsize>>,
    barrier: Barrier,
    is_over: AtomicBool,
}

impl ThreadTeam {
    /// `ends` has the end of each node's jobs. They begin at the end of those of the node before.
    pub fn new(ends: Vec<usize>, jobs_per_ticket: usize, threads: usize) -> Self {
        let tickets = ends.iter().map(|_| CachePadded::default()).collect();
        let (barrier, is_over) = (Barrier::new(threads), AtomicBool::new(false));
        Self { ends, jobs_per_ticket, threads, tickets, barrier, is_over }
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
            if self.barrier.wait().is_leader() {
                ticket.store(0, Ordering::Relaxed);
            }
            begin = end;
        }
    }
}
