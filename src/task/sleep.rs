//! Where workers sleep that find nothing to do, so that an idle scheduler costs no time, and how they are woken, so
//! that no work waits for a worker that sleeps through it. Nobody pays a system call while nobody sleeps.
//!
//! # Protocol
//!
//! *Work* is whatever a worker may wait for: a job in somebody's deque, a pinned job, a released latch, the shutdown
//! flag.
//!
//! ```text
//!  sleeper                                        waker
//!  S1  lock: add itself to the list, set count    W1  publish the work
//!  S2  fence                                      W2  fence
//!  S3  look for work once more                    W3  read count; none: done
//!  S4  work seen: lock, take itself off;          W4  lock: take one sleeper off, set count
//!      it was still there: go on, awake           W5  call it
//!  S5  otherwise wait until called
//! ```
//!
//! # Proof
//!
//! **No wake-up is lost.** Both fences are sequentially consistent, so one of them comes first. Is it W2, then S3 comes
//! after W1 and sees the work. Is it S2, then W3 comes after S1 and reads a count that has the sleeper in it, unless
//! the sleeper has been taken off since. If it was taken off by itself, it is awake. If another waker took it off, it
//! has been called or will be, and is going to look for work, with a fence of its own, before it can wait again. In
//! either case it passes S2 again *after* W2, and S3 sees the work. If it is still on the list, W4 finds it, or, where
//! any sleeper will do, another one that looks for work as well. Two kinds of sleepers do
//! not look, or not at once: the owner of a scope that ended while it was called for something else, and one that finds
//! another job first, a pinned one, and is away with it. Both pass the call on (`Worker::pass_on`).
//!
//! **A call is neither lost nor left over.** Under the lock exactly one thread takes a sleeper off the list. Is that a
//! waker, it calls once, and the sleeper waits for this one call even if it has seen work meanwhile. Is it the sleeper,
//! nobody calls. So between two sleeps no call is pending.
//!
//! **Nothing deadlocks.** The lock of the list and that of a bed are never held together, and no code of a user runs
//! under either.
//!
//! # Memory ordering
//!
//! The fences carry the argument, so the count is written and read relaxed, and W1 and S3 may be relaxed too. Reading
//! a stale count above zero costs a lock; a stale zero is excluded by the fences. What the work itself makes visible is
//! for the deque, the mailbox's lock and the latch to order: to be woken is only a reason to look.

use crossbeam_utils::CachePadded;

use crate::sync::{AtomicUsize, Condvar, Mutex, Ordering, fence};

/// The beds of all workers, and the list of those that sleep.
pub(super) struct Sleep {
    /// The length of `sleepers`, to be read without its lock.
    count: CachePadded<AtomicUsize>,
    /// Who sleeps or is about to. The last to lie down is called first, as its caches are the warmest.
    sleepers: Mutex<Vec<usize>>,
    beds: Box<[Bed]>,
}

impl Sleep {
    /// A bed for each worker.
    pub(super) fn new(workers: usize) -> Self {
        Self {
            count: CachePadded::new(AtomicUsize::new(0)),
            sleepers: Mutex::new(Vec::with_capacity(workers)),
            beds: (0..workers).map(|_| Bed::new()).collect(),
        }
    }

    /// Sleeps until called, unless `sees_work`, which is asked when wakers can see the worker on the list.
    pub(super) fn sleep(&self, worker: usize, sees_work: impl FnOnce() -> bool) {
        self.lie_down(worker);
        fence(Ordering::SeqCst);
        if sees_work() && self.take_off(|sleepers| position(sleepers, worker)).is_some() {
            return;
        }
        self.beds[worker].wait();
    }

    /// Wakes a worker, if one sleeps. The work it is woken for has been published.
    pub(super) fn wake_any(&self) {
        self.wake(last);
    }

    /// Wakes this worker, if it sleeps. What it is woken for has been published.
    pub(super) fn wake_worker(&self, worker: usize) {
        self.wake(|sleepers| position(sleepers, worker));
    }

    /// Wakes every worker that sleeps. What they are woken for has been published.
    pub(super) fn wake_all(&self) {
        // No fence: the lock is taken in any case, and whoever lies down after that sees what has been published
        // before.
        while let Some(sleeper) = self.take_off(last) {
            self.beds[sleeper].call();
        }
    }

    /// How many workers sleep or are about to.
    #[cfg(test)]
    pub(super) fn sleepers(&self) -> usize {
        self.count.load(Ordering::Relaxed)
    }

    fn wake(&self, choose: impl FnOnce(&[usize]) -> Option<usize>) {
        fence(Ordering::SeqCst);
        if self.count.load(Ordering::Relaxed) == 0 {
            return;
        }
        if let Some(sleeper) = self.take_off(choose) {
            self.beds[sleeper].call();
        }
    }

    fn lie_down(&self, worker: usize) {
        let mut sleepers = self.sleepers.lock();
        sleepers.push(worker);
        self.count.store(sleepers.len(), Ordering::Relaxed);
    }

    /// Takes the chosen sleeper off the list, and says which worker it is.
    fn take_off(&self, choose: impl FnOnce(&[usize]) -> Option<usize>) -> Option<usize> {
        let mut sleepers = self.sleepers.lock();
        let chosen = choose(&sleepers)?;
        let worker = sleepers.remove(chosen);
        self.count.store(sleepers.len(), Ordering::Relaxed);
        Some(worker)
    }
}

fn last(sleepers: &[usize]) -> Option<usize> {
    sleepers.len().checked_sub(1)
}

fn position(sleepers: &[usize], worker: usize) -> Option<usize> {
    sleepers.iter().position(|&sleeper| sleeper == worker)
}

/// Where one worker waits to be called.
struct Bed {
    called: Mutex<bool>,
    bell: Condvar,
}

impl Bed {
    fn new() -> Self {
        Self { called: Mutex::new(false), bell: Condvar::new() }
    }

    /// Waits for a call, and uses it up.
    fn wait(&self) {
        let mut called = self.called.lock();
        while !*called {
            called = self.bell.wait(called);
        }
        *called = false;
    }

    fn call(&self) {
        *self.called.lock() = true;
        self.bell.notify_one();
    }
}

#[cfg(all(test, drawloom_loom))]
mod loom_tests {
    use loom::{model, model::Builder, thread};

    use super::Sleep;
    use crate::{
        sync::{Arc, AtomicBool, AtomicUsize, Ordering},
        task::latch::Latch,
    };

    /// Jobs are only counted here, and relaxed, so that nothing but the protocol's fences orders them.
    struct Room {
        sleep: Sleep,
        jobs: AtomicUsize,
        ran: AtomicBool,
        latch: Latch,
        shut_down: AtomicBool,
    }

    impl Room {
        fn new(outstanding: usize) -> Arc<Self> {
            Arc::new(Self {
                sleep: Sleep::new(2),
                jobs: AtomicUsize::new(0),
                ran: AtomicBool::new(false),
                latch: Latch::new(outstanding),
                shut_down: AtomicBool::new(false),
            })
        }

        fn produce(&self) {
            self.jobs.fetch_add(1, Ordering::Relaxed);
            self.sleep.wake_any();
        }

        /// Sleeps until there is a job, and takes it.
        fn consume(&self, worker: usize) {
            while !self.try_consume() {
                self.sleep.sleep(worker, || self.jobs.load(Ordering::Relaxed) > 0);
            }
        }

        fn try_consume(&self) -> bool {
            self.jobs.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |jobs| jobs.checked_sub(1)).is_ok()
        }

        fn finish(&self) {
            if self.latch.finish() {
                self.sleep.wake_worker(0);
            }
        }
    }

    /// Runs the closure on a thread of the model that shares the room.
    fn start(room: &Arc<Room>, run: impl FnOnce(&Room) + 'static) -> thread::JoinHandle<()> {
        let room = Arc::clone(room);
        thread::spawn(move || run(&room))
    }

    fn join(threads: [thread::JoinHandle<()>; 2]) {
        threads.into_iter().for_each(|thread| thread.join().unwrap());
    }

    /// Explores all executions with at most that many preemptions, for models too large to explore whole.
    fn bounded(preemptions: usize, run: impl Fn() + Sync + Send + 'static) {
        let mut builder = Builder::new();
        builder.preemption_bound = Some(preemptions);
        builder.check(run);
    }

    #[test]
    fn a_job_wakes_the_worker_that_waits_for_one() {
        model(|| {
            let room = Room::new(1);
            let worker = start(&room, |room| room.consume(0));
            room.produce();
            worker.join().unwrap();
            assert_eq!(room.sleep.sleepers(), 0);
        });
    }

    #[test]
    fn a_bed_can_be_slept_in_again() {
        bounded(3, || {
            let room = Room::new(1);
            let worker = start(&room, |room| {
                room.consume(0);
                room.consume(0);
            });
            room.produce();
            room.produce();
            worker.join().unwrap();
            assert_eq!(room.sleep.sleepers(), 0, "a call was left over, and cut the next sleep short");
        });
    }

    #[test]
    fn two_jobs_wake_two_workers() {
        bounded(3, || {
            let room = Room::new(1);
            let workers = [0, 1].map(|worker| start(&room, move |room| room.consume(worker)));
            room.produce();
            room.produce();
            join(workers);
        });
    }

    #[test]
    fn two_producers_wake_two_workers() {
        bounded(2, || {
            let room = Room::new(1);
            let workers = [0, 1].map(|worker| start(&room, move |room| room.consume(worker)));
            let producer = start(&room, Room::produce);
            room.produce();
            producer.join().unwrap();
            join(workers);
        });
    }

    #[test]
    fn the_last_job_of_a_scope_wakes_its_owner() {
        bounded(4, || {
            let room = Room::new(2);
            let workers = [(); 2].map(|()| start(&room, Room::finish));
            while !room.latch.is_released() {
                room.sleep.sleep(0, || room.latch.is_released());
            }
            join(workers);
        });
    }

    #[test]
    fn an_owner_called_for_a_job_as_its_scope_ends_passes_the_call_on() {
        bounded(3, || {
            let room = Room::new(1);
            let thief = start(&room, |room| {
                while !room.ran.load(Ordering::Relaxed) && !room.try_consume() {
                    room.sleep.sleep(1, || room.ran.load(Ordering::Relaxed) || room.jobs.load(Ordering::Relaxed) > 0);
                }
            });
            let producer = start(&room, |room| {
                room.produce();
                room.finish();
            });
            // What `Worker::work` does in worker 0. Whichever of the two takes the job ends the thief.
            let mut called = false;
            while !room.latch.is_released() {
                called = false;
                if room.try_consume() {
                    room.ran.store(true, Ordering::Relaxed);
                    room.sleep.wake_worker(1);
                } else {
                    room.sleep.sleep(0, || room.latch.is_released() || room.jobs.load(Ordering::Relaxed) > 0);
                    called = true;
                }
            }
            if called && room.jobs.load(Ordering::Relaxed) > 0 {
                room.sleep.wake_any();
            }
            join([thief, producer]);
        });
    }

    #[test]
    fn the_end_of_the_scheduler_wakes_everyone() {
        bounded(4, || {
            let room = Room::new(1);
            let workers = [0, 1].map(|worker| {
                start(&room, move |room| {
                    while !room.shut_down.load(Ordering::Relaxed) {
                        room.sleep.sleep(worker, || room.shut_down.load(Ordering::Relaxed));
                    }
                })
            });
            room.shut_down.store(true, Ordering::Relaxed);
            room.sleep.wake_all();
            join(workers);
        });
    }
}
