//! Threads that go from pass to pass together, as they do without a job system.

use std::sync::Barrier;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

use crossbeam_utils::CachePadded;
use drawloom_benches::work::Work;

use crate::watch::Watch;
use crate::{Failure, WORKERS};

/// The caller's thread, and others that stay for a turn. A ticket says which jobs of a pass a thread takes next.
pub struct Crew {
    /// Where each pass ends.
    ends: Vec<usize>,
    jobs_a_ticket: usize,
    tickets: Vec<CachePadded<AtomicUsize>>,
    barrier: Barrier,
    is_over: AtomicBool,
}

impl Crew {
    /// `ends` is where each pass ends, which begins where the one before it ends.
    pub fn new(ends: Vec<usize>, jobs_a_ticket: usize) -> Self {
        let tickets = ends.iter().map(|_| CachePadded::default()).collect();
        let (barrier, is_over) = (Barrier::new(WORKERS), AtomicBool::new(false));
        Self { ends, jobs_a_ticket, tickets, barrier, is_over }
    }

    /// # Errors
    /// If a frame fails.
    pub fn frames(&self, work: &Work, watch: &mut Watch) -> Result<(), Failure> {
        thread::scope(|scope| {
            self.is_over.store(false, Ordering::Relaxed);
            for _ in 1..WORKERS {
                scope.spawn(|| {
                    loop {
                        self.barrier.wait();
                        if self.is_over.load(Ordering::Relaxed) {
                            break;
                        }
                        self.take_part(work);
                    }
                });
            }
            let outcome = watch.frames(|| {
                self.barrier.wait();
                self.take_part(work);
                Ok(())
            });
            self.is_over.store(true, Ordering::Relaxed);
            self.barrier.wait();
            outcome
        })
    }

    fn take_part(&self, work: &Work) {
        let mut begin = 0;
        for (&end, ticket) in self.ends.iter().zip(&self.tickets) {
            loop {
                let first = begin + ticket.fetch_add(self.jobs_a_ticket, Ordering::Relaxed);
                if first >= end {
                    break;
                }
                (first..end.min(first + self.jobs_a_ticket)).for_each(|job| work.job(job));
            }
            // The pass comes again after at least one more barrier.
            if self.barrier.wait().is_leader() {
                ticket.store(0, Ordering::Relaxed);
            }
            begin = end;
        }
    }
}
