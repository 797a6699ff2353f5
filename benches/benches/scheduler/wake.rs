//! Row `wake`: how long a job waits for a worker that sleeps, while who submitted it goes on with something else.
//!
//! Another thread is not always another core: a system may let the woken thread take the submitter's own core, where it begins
//! sooner than on one that has to be woken as well.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Duration;

use drawloom::task::Scheduler;
use drawloom_benches::work::Work;

use crate::turns::{Contender, Row};
use crate::watch::{Arrival, Pace};
use crate::{Extent, WORKERS, pools};

/// chili is left out: it passes a job on only when its owner joins something else, so nobody can submit a job and go on.
pub fn row(extent: &Extent) -> Row {
    let drawloom = Contender::new("drawloom", |_work, watch| {
        let scheduler = Scheduler::new(WORKERS)?;
        watch.wakes(|arrival| {
            Ok(scheduler.scope(|scope| {
                arrival.submit();
                scope.spawn(|_scope, _worker| arrival.begin());
                arrival.wait();
            })?)
        })
    });
    let rayon = Contender::new("rayon", |_work, watch| {
        pools::rayon()?.install(|| {
            watch.wakes(|arrival| {
                rayon::scope(|scope| {
                    arrival.submit();
                    scope.spawn(|_scope| arrival.begin());
                    arrival.wait();
                });
                Ok(())
            })
        })
    });
    let rayon_in_place = Contender::new("rayon in_place_scope", |_work, watch| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(WORKERS - 1).build()?;
        watch.wakes(|arrival| {
            pool.in_place_scope(|scope| {
                arrival.submit();
                scope.spawn(|_scope| arrival.begin());
                arrival.wait();
            });
            Ok(())
        })
    });
    let bevy_tasks = Contender::new("bevy_tasks", |_work, watch| {
        let pool = pools::bevy_tasks();
        watch.wakes(|arrival| {
            pool.scope(|scope| {
                arrival.submit();
                scope.spawn(async { arrival.begin() });
                arrival.wait();
            });
            Ok(())
        })
    });
    Row {
        name: "wake",
        unit: "µs",
        scale: 1e6,
        pace: Pace::Wakes { still: Duration::from_millis(3), jobs: extent.wakes },
        work: Work::empty(),
        jobs: 0,
        order: Box::new(|_record| Ok(())),
        contenders: vec![drawloom, rayon, rayon_in_place, bevy_tasks, std_threads()],
    }
}

/// A thread that parks until there is a job for it.
fn std_threads() -> Contender {
    Contender::new("std threads", |_work, watch| {
        let submitted: Mutex<Option<Arc<Arrival>>> = Mutex::new(None);
        let is_over = AtomicBool::new(false);
        let take = || submitted.lock().unwrap_or_else(PoisonError::into_inner).take();
        thread::scope(|scope| {
            let worker = scope.spawn(|| {
                while !is_over.load(Ordering::Acquire) {
                    match take() {
                        Some(arrival) => arrival.begin(),
                        None => thread::park(),
                    }
                }
            });
            let outcome = watch.wakes(|arrival| {
                arrival.submit();
                *submitted.lock().unwrap_or_else(PoisonError::into_inner) = Some(Arc::clone(arrival));
                worker.thread().unpark();
                arrival.wait();
                Ok(())
            });
            is_over.store(true, Ordering::Release);
            worker.thread().unpark();
            outcome
        })
    })
}
