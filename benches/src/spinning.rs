//! Threads that spin where others would sleep: the peers of a scheduler whose workers stay awake between frames.

use std::hint;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder, Yield};

/// Threads that wait for the next frame without sleeping. They are those of a rayon pool, which lends them what a frame
/// borrows.
pub struct SpinningTeam {
    pool: ThreadPool,
}

/// Where threads wait for each other without sleeping.
pub struct SpinBarrier {
    threads: usize,
    arrived: AtomicUsize,
    /// How often all threads have arrived.
    rounds: AtomicUsize,
}

impl SpinningTeam {
    /// # Errors
    /// Returns an error if a thread cannot be started.
    pub fn new(threads: usize) -> Result<Self, ThreadPoolBuildError> {
        Ok(Self { pool: ThreadPoolBuilder::new().num_threads(threads).build()? })
    }

    pub fn thread_count(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Runs `frames` on a thread of the team. Until it returns, the other threads spin; then they sleep.
    pub fn run<R: Send>(&self, frames: impl FnOnce() -> R + Send) -> R {
        let is_over = &AtomicBool::new(false);
        self.pool.install(|| {
            let caller = rayon::current_thread_index();
            rayon::scope(|scope| {
                scope.spawn_broadcast(move |_scope, context| {
                    if Some(context.index()) != caller {
                        look_for_jobs(is_over);
                    }
                });
                let _end = OnDrop(|| is_over.store(true, Ordering::Relaxed));
                frames()
            })
        })
    }

    /// Calls `work` on each thread, with the index of that thread, and spins until all calls have returned. Within
    /// [`run`](Self::run), all threads begin at once.
    pub fn on_each_thread(&self, work: impl Fn(usize) + Sync) {
        let (work, running) = (&work, &AtomicUsize::new(self.thread_count()));
        self.pool.in_place_scope(|scope| {
            scope.spawn_broadcast(move |_scope, context| {
                let _end = OnDrop(|| {
                    running.fetch_sub(1, Ordering::Release);
                });
                work(context.index());
            });
            // The scope itself would wait asleep after a while. A thread of the team runs its own call here.
            let mut spin = Spin::default();
            while running.load(Ordering::Acquire) > 0 {
                if rayon::yield_local() != Some(Yield::Executed) {
                    spin.pause();
                }
            }
        });
    }

    /// Calls `job` for each item. A thread claims one item after the other.
    pub fn claim_each<T: Send>(&self, items: &mut [T], job: impl Fn(&mut T) + Sync) {
        // No item is locked twice, so no thread waits for a lock.
        let items: Vec<_> = items.iter_mut().map(Mutex::new).collect();
        let next = AtomicUsize::new(0);
        self.on_each_thread(|_thread| {
            while let Some(item) = items.get(next.fetch_add(1, Ordering::Relaxed)) {
                job(&mut item.lock().unwrap_or_else(PoisonError::into_inner));
            }
        });
    }

    /// Calls `job` for each item. A thread has the same items in each call, if their number is the same.
    pub fn own_each<T: Send>(&self, items: &mut [T], job: impl Fn(&mut T) + Sync) {
        let share = items.len().div_ceil(self.thread_count()).max(1);
        let shares: Vec<_> = items.chunks_mut(share).map(Mutex::new).collect();
        self.on_each_thread(|thread| {
            if let Some(share) = shares.get(thread) {
                share.lock().unwrap_or_else(PoisonError::into_inner).iter_mut().for_each(&job);
            }
        });
    }
}

fn look_for_jobs(is_over: &AtomicBool) {
    let mut spin = Spin::default();
    while !is_over.load(Ordering::Relaxed) {
        if rayon::yield_now() == Some(Yield::Executed) {
            spin = Spin::default();
        } else {
            spin.pause();
        }
    }
}

impl SpinBarrier {
    pub fn new(threads: usize) -> Self {
        Self { threads, arrived: AtomicUsize::new(0), rounds: AtomicUsize::new(0) }
    }

    /// Waits until all threads have called it. Returns true on one of them.
    pub fn wait(&self) -> bool {
        let round = self.rounds.load(Ordering::Relaxed);
        if self.arrived.fetch_add(1, Ordering::AcqRel) + 1 == self.threads {
            self.arrived.store(0, Ordering::Relaxed);
            self.rounds.store(round.wrapping_add(1), Ordering::Release);
            return true;
        }
        let mut spin = Spin::default();
        while self.rounds.load(Ordering::Acquire) == round {
            spin.pause();
        }
        false
    }
}

/// The pauses between looks.
#[derive(Default)]
struct Spin {
    pauses: u32,
}

/// After this many pauses, a thread lets another one run: on a busy machine that may be the one that it waits for.
const PAUSES_TO_YIELD: u32 = 1 << 8;

impl Spin {
    fn pause(&mut self) {
        self.pauses += 1;
        if self.pauses.is_multiple_of(PAUSES_TO_YIELD) {
            thread::yield_now();
        } else {
            hint::spin_loop();
        }
    }
}

/// Calls a function at the end of a block, after a panic too: a thread that panics must not leave others spinning.
struct OnDrop<F: FnMut()>(F);

impl<F: FnMut()> Drop for OnDrop<F> {
    fn drop(&mut self) {
        (self.0)();
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashSet;
    use std::panic::{AssertUnwindSafe, catch_unwind};
    use std::thread::ThreadId;

    use super::*;

    #[test]
    fn each_item_is_visited_once_a_frame() -> Result<(), ThreadPoolBuildError> {
        for threads in [1, 2, 3] {
            let team = SpinningTeam::new(threads)?;
            let mut claimed = vec![0; 100];
            let mut owned = claimed.clone();
            let mut frames = || {
                for frame in 1..=20 {
                    team.claim_each(&mut claimed, |count| *count += 1);
                    team.own_each(&mut owned, |count| *count += 1);
                    assert!(
                        claimed.iter().chain(&owned).all(|&count| count == frame),
                        "{threads} threads, frame {frame}"
                    );
                }
            };
            team.run(&mut frames);
            team.claim_each::<u32>(&mut [], |_| panic!("there is no item"));
            team.own_each::<u32>(&mut [], |_| panic!("there is no item"));
        }
        Ok(())
    }

    #[test]
    fn all_threads_run_at_once_and_have_their_own_items() -> Result<(), ThreadPoolBuildError> {
        let team = SpinningTeam::new(3)?;
        let mut threads: Vec<HashSet<ThreadId>> = vec![HashSet::new(); 7];
        team.run(|| {
            for _ in 0..20 {
                // Returns only if all threads are there.
                let barrier = SpinBarrier::new(3);
                team.on_each_thread(|_| {
                    barrier.wait();
                });
                team.own_each(&mut threads, |threads| {
                    threads.insert(thread::current().id());
                });
            }
        });
        assert!(threads.iter().all(|threads| threads.len() == 1));
        assert_eq!(threads.iter().flatten().collect::<HashSet<_>>().len(), 3);
        Ok(())
    }

    #[test]
    fn a_panic_of_one_item_reaches_the_caller() -> Result<(), ThreadPoolBuildError> {
        let team = SpinningTeam::new(2)?;
        let panics = || team.run(|| team.claim_each(&mut [1, 2, 3], |item| assert_ne!(*item, 2)));
        assert!(catch_unwind(AssertUnwindSafe(panics)).is_err());
        // The team goes on.
        team.run(|| team.claim_each(&mut [1, 3], |item| assert_ne!(*item, 2)));
        Ok(())
    }

    #[test]
    fn no_thread_passes_a_barrier_before_all_are_there() {
        const THREADS: usize = 3;
        let (barrier, arrivals, leaders) = (SpinBarrier::new(THREADS), AtomicUsize::new(0), AtomicUsize::new(0));
        thread::scope(|scope| {
            for _ in 0..THREADS {
                scope.spawn(|| {
                    for round in 1..=200 {
                        arrivals.fetch_add(1, Ordering::Relaxed);
                        leaders.fetch_add(usize::from(barrier.wait()), Ordering::Relaxed);
                        assert!(arrivals.load(Ordering::Relaxed) >= round * THREADS);
                        barrier.wait();
                    }
                });
            }
        });
        assert_eq!(leaders.into_inner(), 200);
    }
}
