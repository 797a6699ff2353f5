//! Row `wake`: the time from the submission of a job until a sleeping worker begins it, while the submitter is busy.
//!
//! Another thread is not always another core: a system may run the woken thread on the submitter's core, where it
//! begins sooner than on a core that has to be woken too.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use drawloom::task::Scheduler;
use drawloom_benches::work::Work;

use crate::row::{Contender, Row};
use crate::timer::{Pace, WakeLatency};
use crate::{Extent, pools};

/// chili is left out: it hands over a job only at a join, so a thread cannot submit a job and go on.
pub fn row(extent: &Extent, workers: &[usize]) -> Row {
    // One worker is the submitter.
    let workers = workers.iter().filter(|&&workers| workers > 1);
    let mut contenders: Vec<_> = workers.flat_map(|&workers| pool_contenders(workers)).collect();
    if !contenders.is_empty() {
        contenders.push(std_threads());
    }
    Row {
        name: "wake",
        unit: "µs",
        scale: 1e6,
        pace: Pace::Wakes { idle: Duration::from_millis(3), jobs: extent.wakes },
        work: Work::empty(),
        jobs: 0,
        order: Box::new(|_record| Ok(())),
        contenders,
    }
}

fn pool_contenders(workers: usize) -> [Contender; 4] {
    let drawloom = Contender::new("drawloom", workers, move |_work, timer| {
        let scheduler = Scheduler::new(workers)?;
        timer.wakes(|latency| {
            Ok(scheduler.scope(|scope| {
                latency.mark_submitted();
                scope.spawn(|_scope, _worker| latency.mark_begun());
                latency.wait();
            })?)
        })
    });
    let rayon = Contender::new("rayon", workers, move |_work, timer| {
        pools::rayon(workers)?.install(|| {
            timer.wakes(|latency| {
                rayon::scope(|scope| {
                    latency.mark_submitted();
                    scope.spawn(|_scope| latency.mark_begun());
                    latency.wait();
                });
                Ok(())
            })
        })
    });
    let rayon_in_place = Contender::new("rayon in_place_scope", workers, move |_work, timer| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(workers - 1).build()?;
        timer.wakes(|latency| {
            pool.in_place_scope(|scope| {
                latency.mark_submitted();
                scope.spawn(|_scope| latency.mark_begun());
                latency.wait();
            });
            Ok(())
        })
    });
    let bevy_tasks = Contender::new("bevy_tasks", workers, move |_work, timer| {
        let pool = pools::bevy_tasks(workers);
        timer.wakes(|latency| {
            pool.scope(|scope| {
                latency.mark_submitted();
                scope.spawn(async { latency.mark_begun() });
                latency.wait();
            });
            Ok(())
        })
    });
    [drawloom, rayon, rayon_in_place, bevy_tasks]
}

/// A thread that parks until it has a job.
fn std_threads() -> Contender {
    Contender::new("std threads", 2, |_work, timer| {
        let submitted: Mutex<Option<Arc<WakeLatency>>> = Mutex::new(None);
        let is_over = AtomicBool::new(false);
        let take = || submitted.lock().unwrap_or_else(PoisonError::into_inner).take();
        thread::scope(|scope| {
            let worker = scope.spawn(|| {
                while !is_over.load(Ordering::Acquire) {
                    match take() {
                        Some(latency) => latency.mark_begun(),
                        None => thread::park(),
                    }
                }
            });
            let outcome = timer.wakes(|latency| {
                latency.mark_submitted();
                *submitted.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::clone(latency));
                worker.thread().unpark();
                latency.wait();
                Ok(())
            });
            is_over.store(true, Ordering::Release);
            worker.thread().unpark();
            outcome
        })
    })
}
