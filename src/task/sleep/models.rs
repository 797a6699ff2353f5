//! The protocol of sleep, walked through by loom.

use std::mem;

use loom::{model, model::Builder, thread};

use super::{Sleep, WakeFor};
use crate::{
    sync::{Arc, AtomicBool, AtomicUsize, Ordering},
    task::{latch::Latch, priority::Priority},
};

/// Jobs are only counted here, and relaxed, so that nothing but the protocol's fences orders them.
struct Room {
    sleep: Sleep,
    jobs: AtomicUsize,
    background: AtomicUsize,
    latch: Latch,
    /// Whether the owner of the region has run a job.
    ran: AtomicBool,
    shut_down: AtomicBool,
}

impl Room {
    fn new(outstanding: usize) -> Arc<Self> {
        Arc::new(Self {
            sleep: Sleep::new(3),
            jobs: AtomicUsize::new(0),
            background: AtomicUsize::new(0),
            latch: Latch::new(outstanding),
            ran: AtomicBool::new(false),
            shut_down: AtomicBool::new(false),
        })
    }

    fn produce(&self) {
        self.jobs.fetch_add(1, Ordering::Relaxed);
        self.sleep.wake_any();
    }

    fn has_jobs(&self) -> bool {
        self.jobs.load(Ordering::Relaxed) > 0
    }

    /// What a worker sees that ends its search: `jobs` are a frame's.
    fn sees(&self, bands: &[Priority]) -> bool {
        let background = || self.background.load(Ordering::Relaxed) > 0;
        (bands.contains(&Priority::Normal) && self.has_jobs())
            || (bands.contains(&Priority::Background) && background())
    }

    fn try_consume(&self) -> bool {
        self.jobs.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |jobs| jobs.checked_sub(1)).is_ok()
    }

    /// What `Worker::work` and `Idle` do: looks for a job, and sleeps as long as there is none.
    fn consume(&self, worker: usize) {
        self.search(worker, false);
    }

    /// The same, by a worker that counts as a searcher before it sleeps.
    fn search_and_consume(&self, worker: usize) {
        if !self.try_consume() {
            self.sleep.start_search();
            self.search(worker, true);
        }
    }

    fn search(&self, worker: usize, mut is_searcher: bool) {
        while !self.try_consume() {
            is_searcher = self.sleep.sleep(worker, WakeFor::Any, is_searcher, || self.has_jobs());
        }
        if is_searcher {
            self.sleep.end_search(|bands| self.sees(bands));
        }
    }

    /// What the owner of a region does that runs no jobs.
    fn wait(&self, worker: usize) {
        while !self.latch.is_released() {
            self.sleep.sleep(worker, WakeFor::Region { level: 0 }, false, || self.latch.is_released());
        }
    }

    /// What a worker does that takes one job: of a frame if there is one, and otherwise of the background.
    fn consume_either(&self, worker: usize) {
        let take = |jobs: &AtomicUsize| {
            jobs.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |jobs| jobs.checked_sub(1)).is_ok()
        };
        let mut is_searcher = false;
        while !(take(&self.jobs) || take(&self.background)) {
            is_searcher = self.sleep.sleep(worker, WakeFor::Any, is_searcher, || self.sees(&Priority::ALL));
        }
        if is_searcher {
            self.sleep.end_search(|bands| self.sees(bands));
        }
    }

    /// What the owner of a region does in the midst of a job: it takes what lies in its mailbox for that region, and nothing
    /// else.
    fn consume_own(&self, worker: usize, level: usize) {
        while !self.try_consume() {
            self.sleep.sleep(worker, WakeFor::Region { level }, false, || self.has_jobs());
        }
    }

    /// Puts a job into the mailbox of worker 0, for the region of that level.
    fn produce_for_owner(&self, level: usize) {
        self.jobs.fetch_add(1, Ordering::Relaxed);
        self.sleep.wake_owner_or_other(0, level, Priority::Normal);
    }

    /// What the owner of a region does that helps others: it looks for jobs, and for the end of its region only where there
    /// is none.
    fn wait_and_help(&self, worker: usize) {
        let mut is_searcher = false;
        loop {
            if self.try_consume() {
                if mem::take(&mut is_searcher) {
                    self.sleep.end_search(|bands| self.sees(bands));
                }
                self.ran.store(true, Ordering::Relaxed);
                self.sleep.wake_worker(1);
            } else if self.latch.is_released() {
                break;
            } else {
                let sees_work = || self.latch.is_released() || self.has_jobs();
                is_searcher = self.sleep.sleep(worker, WakeFor::Any, is_searcher, sees_work);
            }
        }
        if is_searcher {
            self.sleep.end_search(|bands| self.sees(bands));
        }
    }

    fn finish(&self) {
        if self.latch.finish(1) {
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
fn a_job_is_seen_by_a_searcher_that_goes_to_sleep() {
    bounded(4, || {
        let room = Room::new(1);
        let worker = start(&room, |room| room.search_and_consume(0));
        room.produce();
        worker.join().unwrap();
        assert_eq!(room.sleep.counts.load(Ordering::Relaxed), 0, "nobody sleeps or searches");
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
        assert_eq!(room.sleep.counts.load(Ordering::Relaxed), 0, "a call was left over, and cut the next sleep short");
    });
}

#[test]
fn two_jobs_reach_two_workers_though_one_is_woken() {
    bounded(3, || {
        let room = Room::new(1);
        let workers = [0, 1].map(|worker| start(&room, move |room| room.consume(worker)));
        room.produce();
        room.produce();
        join(workers);
        assert_eq!(room.sleep.counts.load(Ordering::Relaxed), 0);
    });
}

#[test]
fn a_searcher_that_finds_one_job_wakes_a_sleeper_for_the_next() {
    bounded(3, || {
        let room = Room::new(1);
        let workers = [start(&room, |room| room.search_and_consume(0)), start(&room, |room| room.consume(1))];
        room.produce();
        room.produce();
        join(workers);
        assert_eq!(room.sleep.counts.load(Ordering::Relaxed), 0);
    });
}

#[test]
fn two_producers_wake_two_workers() {
    bounded(2, || {
        let room = Room::new(1);
        let workers = [0, 1].map(|worker| start(&room, move |room| room.search_and_consume(worker)));
        let producer = start(&room, Room::produce);
        room.produce();
        producer.join().unwrap();
        join(workers);
    });
}

#[test]
fn the_last_job_of_a_region_wakes_its_owner() {
    for waits in [Room::wait, Room::wait_and_help] {
        bounded(4, move || {
            let room = Room::new(2);
            let workers = [(); 2].map(|()| start(&room, Room::finish));
            waits(&room, 0);
            join(workers);
            assert_eq!(room.sleep.counts.load(Ordering::Relaxed), 0);
        });
    }
}

#[test]
fn an_owner_called_for_a_job_as_its_region_ends_passes_the_call_on() {
    for waits in [Room::wait, Room::wait_and_help] {
        bounded(3, move || {
            let room = Room::new(1);
            // Whoever takes the job ends the thief.
            let thief = start(&room, |room| {
                let mut is_searcher = false;
                while !room.ran.load(Ordering::Relaxed) && !room.try_consume() {
                    let sees_work = || room.ran.load(Ordering::Relaxed) || room.has_jobs();
                    is_searcher = room.sleep.sleep(1, WakeFor::Any, is_searcher, sees_work);
                }
            });
            let producer = start(&room, |room| {
                room.produce();
                room.finish();
            });
            waits(&room, 0);
            join([thief, producer]);
        });
    }
}

#[test]
fn a_background_job_wakes_a_worker_though_worker_0_searches() {
    bounded(3, || {
        let room = Room::new(1);
        let worker = start(&room, |room| room.consume(1));
        room.sleep.start_search();
        room.jobs.fetch_add(1, Ordering::Relaxed);
        room.sleep.wake_beside(Priority::Background);
        // Worker 0 has no eyes for it.
        room.sleep.end_search(|_| false);
        worker.join().unwrap();
    });
}

#[test]
fn a_job_in_a_mailbox_reaches_its_owner_though_a_searcher_is_late() {
    bounded(4, || {
        let room = Room::new(1);
        // It is going to look one day, and has something else to do until then.
        room.sleep.start_search();
        let owner = start(&room, |room| room.consume_own(0, 1));
        room.produce_for_owner(1);
        owner.join().unwrap();
    });
}

#[test]
fn jobs_in_a_mailbox_reach_the_owner_and_a_helper() {
    bounded(3, || {
        let room = Room::new(1);
        let threads = [start(&room, |room| room.consume_own(0, 1)), start(&room, |room| room.consume(1))];
        room.produce_for_owner(1);
        room.produce_for_owner(1);
        join(threads);
        assert_eq!(room.sleep.counts.load(Ordering::Relaxed), 0, "nobody sleeps or searches");
    });
}

#[test]
fn a_job_of_an_outer_region_wakes_a_helper_while_the_owner_sleeps_for_an_inner_one() {
    bounded(3, || {
        let room = Room::new(1);
        let owner = start(&room, |room| {
            while !room.latch.is_released() {
                room.sleep.sleep(0, WakeFor::Region { level: 2 }, false, || room.latch.is_released());
            }
        });
        let helper = start(&room, |room| {
            room.consume(1);
            room.finish();
        });
        room.produce_for_owner(1);
        join([owner, helper]);
    });
}

#[test]
fn a_worker_called_for_a_background_job_that_finds_a_frames_passes_the_call_on() {
    bounded(3, || {
        let room = Room::new(1);
        let workers = [1, 2].map(|worker| start(&room, move |room| room.consume_either(worker)));
        room.background.fetch_add(1, Ordering::Relaxed);
        room.sleep.wake_beside(Priority::Background);
        room.jobs.fetch_add(1, Ordering::Relaxed);
        room.sleep.wake_any();
        join(workers);
        assert_eq!(room.sleep.counts.load(Ordering::Relaxed), 0, "nobody sleeps or searches");
    });
}

#[test]
fn the_end_of_the_scheduler_wakes_everyone() {
    bounded(4, || {
        let room = Room::new(1);
        let workers = [1, 2].map(|worker| {
            start(&room, move |room| {
                let mut is_searcher = false;
                while !room.shut_down.load(Ordering::Relaxed) {
                    let is_over = || room.shut_down.load(Ordering::Relaxed);
                    is_searcher = room.sleep.sleep(worker, WakeFor::Any, is_searcher, is_over);
                }
            })
        });
        room.shut_down.store(true, Ordering::Relaxed);
        room.sleep.wake_all();
        join(workers);
    });
}
