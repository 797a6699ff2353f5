//! A dropped scheduler leaves no thread. This is the only test of its binary, so that it can count the threads of the
//! process.

use std::sync::{
    Arc,
    atomic::{AtomicIsize, AtomicUsize, Ordering},
};

use drawloom_jobs::task::Scheduler;

/// The number of threads of this process.
#[cfg(target_os = "linux")]
fn threads() -> usize {
    std::fs::read_dir("/proc/self/task").unwrap().count()
}

#[test]
fn a_thousand_dropped_schedulers_leave_no_thread() {
    #[cfg(target_os = "linux")]
    let before = threads();
    let (live, started) = (Arc::new(AtomicIsize::new(0)), Arc::new(AtomicUsize::new(0)));
    for round in 0..1_000 {
        let [begun, ended] = [(); 2].map(|()| Arc::clone(&live));
        let counted = Arc::clone(&started);
        let scheduler = Scheduler::builder()
            .workers(4)
            .on_start(move |_worker| {
                counted.fetch_add(1, Ordering::Relaxed);
                begun.fetch_add(1, Ordering::Relaxed);
            })
            .on_stop(move |_worker| {
                ended.fetch_sub(1, Ordering::Relaxed);
            })
            .build()
            .unwrap();
        assert_eq!(live.load(Ordering::Relaxed), 3);
        if round % 2 == 0 {
            let ran = AtomicUsize::new(0);
            let body = |_, _: &_| {
                ran.fetch_add(1, Ordering::Relaxed);
            };
            scheduler.parallel_for(100, 1, body).unwrap();
            assert_eq!(ran.into_inner(), 100);
        }
        drop(scheduler);
        assert_eq!(live.load(Ordering::Relaxed), 0, "round {round}");
    }
    assert_eq!(started.load(Ordering::Relaxed), 3_000);
    // A joined thread may be listed for a moment longer; a leaked one would be listed for ever.
    #[cfg(target_os = "linux")]
    assert!((0..10_000).any(|_attempt| {
        threads() <= before || {
            std::thread::sleep(std::time::Duration::from_millis(1));
            false
        }
    }));
}
