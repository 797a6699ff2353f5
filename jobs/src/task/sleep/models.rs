//! Loom's models of the sleep protocol.

use std::mem;

use loom::model::Builder;
use loom::{model as check, thread};

use super::{Sleep, WakeFor};
use crate::sync::{Arc, AtomicBool, AtomicUsize, Ordering};
use crate::task::latch::Latch;
use crate::task::priority::Priority;

/// What the threads of a model share. Jobs are relaxed counts, so that only the fences of the protocol order them.
struct Model {
    sleep: Sleep,
    jobs: AtomicUsize,
    background: AtomicUsize,
    latch: Latch,
    /// Whether the owner of the region has run a job.
    ran: AtomicBool,
    shut_down: AtomicBool,
}

impl Model {
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

    /// Whether there are jobs of these priorities, for a worker that ends its search: `jobs` are those of a frame.
    fn sees(&self, bands: &[Priority]) -> bool {
        let background = || self.background.load(Ordering::Relaxed) > 0;
        (bands.contains(&Priority::Normal) && self.has_jobs())
            || (bands.contains(&Priority::Background) && background())
    }

    fn try_consume(&self) -> bool {
        self.jobs.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |jobs| jobs.checked_sub(1)).is_ok()
    }

    /// As `Worker::work` and `Idle` do: looks for a job, and sleeps while there is none.
    fn consume(&self, worker: usize) {
        self.search(worker, false);
    }

    /// The same by a worker that counts as a searcher before it sleeps.
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

    /// As the owner of a region that runs no jobs.
    fn wait(&self, worker: usize) {
        while !self.latch.is_released() {
            self.sleep.sleep(worker, WakeFor::Region { level: 0 }, false, || self.latch.is_released());
        }
    }

    /// Takes one job: a frame's if there is one, and a background job otherwise.
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

    /// As the owner of a region inside a job: it takes only jobs of that region, from its mailbox.
    fn consume_own(&self, worker: usize, level: usize) {
        while !self.try_consume() {
            self.sleep.sleep(worker, WakeFor::Region { level }, false, || self.has_jobs());
        }
    }

    /// Puts a job into the mailbox of worker 0, for its region at this level.
    fn produce_for_owner(&self, level: usize) {
        self.jobs.fetch_add(1, Ordering::Relaxed);
        self.sleep.wake_owner_or_other(0, level, Priority::Normal);
    }

    /// As the owner of a region that helps others: it looks for jobs, and checks for the end of its region only if
    /// there is none.
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

/// Runs the closure on a thread of the model.
fn start(model: &Arc<Model>, run: impl FnOnce(&Model) + 'static) -> thread::JoinHandle<()> {
    let model = Arc::clone(model);
    thread::spawn(move || run(&model))
}

fn join(threads: [thread::JoinHandle<()>; 2]) {
    threads.into_iter().for_each(|thread| thread.join().unwrap());
}

/// Explores all executions with at most this many preemptions, for models that are too large to explore completely.
fn bounded(preemptions: usize, run: impl Fn() + Sync + Send + 'static) {
    let mut builder = Builder::new();
    builder.preemption_bound = Some(preemptions);
    builder.check(run);
}

#[test]
fn a_job_wakes_the_worker_that_waits_for_one() {
    check(|| {
        let model = Model::new(1);
        let worker = start(&model, |model| model.consume(0));
        model.produce();
        worker.join().unwrap();
        assert_eq!(model.sleep.sleepers(), 0);
    });
}

#[test]
fn a_job_is_seen_by_a_searcher_that_goes_to_sleep() {
    bounded(4, || {
        let model = Model::new(1);
        let worker = start(&model, |model| model.search_and_consume(0));
        model.produce();
        worker.join().unwrap();
        assert_eq!(model.sleep.counts.load(Ordering::Relaxed), 0, "nobody sleeps or searches");
    });
}

#[test]
fn a_worker_can_park_again() {
    bounded(3, || {
        let model = Model::new(1);
        let worker = start(&model, |model| {
            model.consume(0);
            model.consume(0);
        });
        model.produce();
        model.produce();
        worker.join().unwrap();
        assert_eq!(model.sleep.counts.load(Ordering::Relaxed), 0, "a notification is left over");
    });
}

#[test]
fn two_jobs_reach_two_workers_although_one_is_woken_at_a_time() {
    bounded(3, || {
        let model = Model::new(1);
        let workers = [0, 1].map(|worker| start(&model, move |model| model.consume(worker)));
        model.produce();
        model.produce();
        join(workers);
        assert_eq!(model.sleep.counts.load(Ordering::Relaxed), 0);
    });
}

#[test]
fn a_searcher_that_finds_one_job_wakes_a_sleeper_for_the_next() {
    bounded(3, || {
        let model = Model::new(1);
        let workers = [start(&model, |model| model.search_and_consume(0)), start(&model, |model| model.consume(1))];
        model.produce();
        model.produce();
        join(workers);
        assert_eq!(model.sleep.counts.load(Ordering::Relaxed), 0);
    });
}

#[test]
fn two_producers_wake_two_workers() {
    bounded(2, || {
        let model = Model::new(1);
        let workers = [0, 1].map(|worker| start(&model, move |model| model.search_and_consume(worker)));
        let producer = start(&model, Model::produce);
        model.produce();
        producer.join().unwrap();
        join(workers);
    });
}

#[test]
fn the_last_job_of_a_region_wakes_its_owner() {
    for waits in [Model::wait, Model::wait_and_help] {
        bounded(4, move || {
            let model = Model::new(2);
            let workers = [(); 2].map(|()| start(&model, Model::finish));
            waits(&model, 0);
            join(workers);
            assert_eq!(model.sleep.counts.load(Ordering::Relaxed), 0);
        });
    }
}

#[test]
fn an_owner_woken_for_a_job_as_its_region_ends_wakes_another_worker() {
    for waits in [Model::wait, Model::wait_and_help] {
        bounded(3, move || {
            let model = Model::new(1);
            // The thief ends when one of the threads has taken the job.
            let thief = start(&model, |model| {
                let mut is_searcher = false;
                while !model.ran.load(Ordering::Relaxed) && !model.try_consume() {
                    let sees_work = || model.ran.load(Ordering::Relaxed) || model.has_jobs();
                    is_searcher = model.sleep.sleep(1, WakeFor::Any, is_searcher, sees_work);
                }
            });
            let producer = start(&model, |model| {
                model.produce();
                model.finish();
            });
            waits(&model, 0);
            join([thief, producer]);
        });
    }
}

#[test]
fn a_background_job_wakes_a_worker_although_worker_0_searches() {
    bounded(3, || {
        let model = Model::new(1);
        let worker = start(&model, |model| model.consume(1));
        model.sleep.start_search();
        model.jobs.fetch_add(1, Ordering::Relaxed);
        model.sleep.wake_despite_searchers(Priority::Background);
        // Worker 0 does not look for background jobs.
        model.sleep.end_search(|_| false);
        worker.join().unwrap();
    });
}

#[test]
fn a_job_in_a_mailbox_reaches_its_owner_although_a_searcher_is_late() {
    bounded(4, || {
        let model = Model::new(1);
        // The searcher does something else before it looks.
        model.sleep.start_search();
        let owner = start(&model, |model| model.consume_own(0, 1));
        model.produce_for_owner(1);
        owner.join().unwrap();
    });
}

#[test]
fn jobs_in_a_mailbox_reach_the_owner_and_a_helper() {
    bounded(3, || {
        let model = Model::new(1);
        let threads = [start(&model, |model| model.consume_own(0, 1)), start(&model, |model| model.consume(1))];
        model.produce_for_owner(1);
        model.produce_for_owner(1);
        join(threads);
        assert_eq!(model.sleep.counts.load(Ordering::Relaxed), 0, "nobody sleeps or searches");
    });
}

#[test]
fn a_job_of_an_outer_region_wakes_a_helper_while_the_owner_sleeps_for_an_inner_one() {
    bounded(3, || {
        let model = Model::new(1);
        let owner = start(&model, |model| {
            while !model.latch.is_released() {
                model.sleep.sleep(0, WakeFor::Region { level: 2 }, false, || model.latch.is_released());
            }
        });
        let helper = start(&model, |model| {
            model.consume(1);
            model.finish();
        });
        model.produce_for_owner(1);
        join([owner, helper]);
    });
}

#[test]
fn a_worker_woken_for_a_background_job_that_finds_a_frames_job_wakes_another_worker() {
    bounded(3, || {
        let model = Model::new(1);
        let workers = [1, 2].map(|worker| start(&model, move |model| model.consume_either(worker)));
        model.background.fetch_add(1, Ordering::Relaxed);
        model.sleep.wake_despite_searchers(Priority::Background);
        model.jobs.fetch_add(1, Ordering::Relaxed);
        model.sleep.wake_any();
        join(workers);
        assert_eq!(model.sleep.counts.load(Ordering::Relaxed), 0, "nobody sleeps or searches");
    });
}

#[test]
fn the_end_of_the_scheduler_wakes_everyone() {
    bounded(4, || {
        let model = Model::new(1);
        let workers = [1, 2].map(|worker| {
            start(&model, move |model| {
                let mut is_searcher = false;
                while !model.shut_down.load(Ordering::Relaxed) {
                    let is_over = || model.shut_down.load(Ordering::Relaxed);
                    is_searcher = model.sleep.sleep(worker, WakeFor::Any, is_searcher, is_over);
                }
            })
        });
        model.shut_down.store(true, Ordering::Relaxed);
        model.sleep.wake_all();
        join(workers);
    });
}
