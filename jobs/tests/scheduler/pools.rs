//! How schedulers are built and dropped: their threads' names, affinities and hooks, and failures of these.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::thread::{self, ThreadId};

#[cfg(all(feature = "affinity", target_os = "linux"))]
use drawloom_jobs::task::AffinityMask;
use drawloom_jobs::task::{Scheduler, SchedulerBuilder, SchedulerError};

use crate::{assert_intact, eventually};

type Threads = Arc<Mutex<Vec<(usize, ThreadId)>>>;

/// A builder with hooks that log the worker and the thread of each start and stop.
fn logged(workers: usize) -> (SchedulerBuilder, [Threads; 2]) {
    let log: [Threads; 2] = Default::default();
    let [started, stopped] = log.clone();
    let push = |threads: Threads| move |worker| threads.lock().unwrap().push((worker, thread::current().id()));
    (Scheduler::builder().workers(workers).on_start(push(started)).on_stop(push(stopped)), log)
}

fn sorted(threads: &Threads) -> Vec<(usize, ThreadId)> {
    let mut threads = threads.lock().unwrap().clone();
    threads.sort_by_key(|&(worker, _)| worker);
    threads
}

/// The thread of each worker, and the result of `query` on it.
fn on_each<R: Send>(scheduler: &Scheduler, query: impl Fn() -> R + Sync) -> Vec<(usize, ThreadId, R)> {
    let together = std::sync::Barrier::new(scheduler.workers());
    let results = Mutex::new(Vec::new());
    let body = |_, worker: &drawloom_jobs::task::Worker| {
        together.wait();
        results.lock().unwrap().push((worker.index(), thread::current().id(), query()));
    };
    scheduler.parallel_for(scheduler.workers(), 1, body).unwrap();
    let mut results = results.into_inner().unwrap();
    results.sort_by_key(|(worker, ..)| *worker);
    results
}

#[test]
fn hooks_run_once_on_the_thread_of_each_worker() {
    let (builder, [started, stopped]) = logged(5);
    let scheduler = builder.build().unwrap();
    let workers: Vec<_> = on_each(&scheduler, || ()).into_iter().map(|(worker, thread, ())| (worker, thread)).collect();
    // The scheduler did not start the calling thread, so it runs no hooks there.
    assert_eq!(sorted(&started), workers[1..]);
    assert_eq!(sorted(&stopped), []);
    drop(scheduler);
    assert_eq!(sorted(&started), workers[1..]);
    assert_eq!(sorted(&stopped), workers[1..]);
}

#[test]
fn threads_have_their_configured_names() {
    let name = || thread::current().name().map(str::to_owned);
    let named = Scheduler::builder().workers(4).name(|worker| format!("frame {worker}")).build().unwrap();
    for (worker, _, name) in on_each(&named, name).split_off(1) {
        assert_eq!(name, Some(format!("frame {worker}")));
    }
    for (worker, _, name) in on_each(&Scheduler::new(4).unwrap(), name).split_off(1) {
        assert_eq!(name, Some(format!("drawloom-{worker}")));
    }
}

#[test]
fn a_name_with_a_null_character_is_an_error_and_no_thread_is_started() {
    let (builder, [started, stopped]) = logged(4);
    let name = |worker| if worker == 3 { "three\0".to_owned() } else { "fine".to_owned() };
    let error = builder.name(name).build().unwrap_err();
    let SchedulerError::Name { worker, name } = error else { panic!("{error}") };
    assert_eq!((worker, name.as_str()), (3, "three\0"));
    assert_eq!((sorted(&started), sorted(&stopped)), (vec![], vec![]));
}

#[test]
fn a_panic_in_a_start_hook_is_an_error_and_no_thread_is_left() {
    for _round in 0..50 {
        let (live, has_ended) = mpsc::channel();
        let live = Mutex::new(live);
        let hook = move |worker| {
            // The clone is dropped when the thread ends.
            thread_local!(static LIVE: std::cell::RefCell<Option<mpsc::Sender<()>>> = const { std::cell::RefCell::new(None) });
            let sender = live.lock().unwrap().clone();
            LIVE.set(Some(sender));
            assert_ne!(worker, 2, "as planned");
        };
        let error = Scheduler::builder().workers(4).on_start(hook).build().unwrap_err();
        let SchedulerError::StartHook { worker, panic } = error else { panic!("{error}") };
        assert_eq!(worker, 2);
        assert!(panic.message.contains("as planned"), "{panic}");
        assert_eq!(has_ended.try_recv(), Err(mpsc::TryRecvError::Disconnected), "a thread or its hook is left");
    }
}

#[test]
fn a_panic_in_a_stop_hook_does_not_affect_other_threads() {
    let scheduler = Scheduler::builder().workers(3).on_stop(|worker| panic!("stop hook of {worker}")).build().unwrap();
    assert_intact(&scheduler);
    drop(scheduler);
}

#[cfg(all(feature = "affinity", target_os = "linux"))]
#[test]
fn threads_have_their_configured_affinity() {
    /// The processors that the calling thread may run on.
    fn allowed() -> Vec<usize> {
        let status = std::fs::read_to_string("/proc/thread-self/status").unwrap();
        let list = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:")).unwrap();
        let bounds = |range: &str| {
            let (first, last) = range.split_once('-').unwrap_or((range, range));
            first.parse::<usize>().unwrap()..=last.parse().unwrap()
        };
        list.trim().split(',').flat_map(bounds).collect()
    }
    let here = allowed();
    let processors = here.clone();
    let mask_of = move |worker: usize| AffinityMask::new([processors[worker % processors.len()]]);
    let scheduler = Scheduler::builder().workers(4).affinity(mask_of.clone()).build().unwrap();
    for _frame in 0..3 {
        let results = on_each(&scheduler, allowed);
        assert_eq!(results[0].2, here, "the affinity of the caller does not change");
        for (worker, _, allowed) in &results[1..] {
            assert_eq!(allowed, mask_of(*worker).processors());
        }
    }
}

#[cfg(all(feature = "affinity", target_os = "linux"))]
#[test]
fn an_impossible_affinity_is_an_error_that_names_the_worker() {
    for impossible in [AffinityMask::new([]), AffinityMask::new([1023]), AffinityMask::new([usize::MAX])] {
        let (builder, [started, stopped]) = logged(4);
        let possible = AffinityMask::new(0..1024);
        let mask = move |worker| if worker == 2 { impossible.clone() } else { possible.clone() };
        let error = builder.affinity(mask).build().unwrap_err();
        assert!(matches!(error, SchedulerError::Affinity { worker: 2, .. }), "{error}");
        assert_eq!(sorted(&started), sorted(&stopped));
    }
}

#[test]
fn a_background_job_may_drop_the_last_reference_to_its_scheduler() {
    for _round in 0..50 {
        let (builder, [started, stopped]) = logged(3);
        let scheduler = Arc::new(builder.build().unwrap());
        let (go, may_go) = mpsc::channel::<()>();
        let owned = Arc::clone(&scheduler);
        let job = scheduler.background(move || {
            may_go.recv().unwrap();
            drop(owned);
            7
        });
        // Waiting for the job here would run it on this thread.
        assert_eq!(Arc::strong_count(&scheduler), 2);
        drop(scheduler);
        go.send(()).unwrap();
        assert!(eventually(|| job.is_finished()));
        assert_eq!(job.wait(), Ok(7));
        // The thread that ran the job ends after it, and nothing joins that thread.
        assert!(eventually(|| stopped.lock().unwrap().len() == 2));
        assert_eq!(sorted(&started), sorted(&stopped));
    }
}

/// Opens scopes inside each other's jobs, all on one thread.
fn nest(scheduler: &Scheduler, depth: usize) -> usize {
    let below = AtomicUsize::new(0);
    if depth > 0 {
        let outcome = scheduler.scope(|scope| {
            scope.spawn(|_scope, _worker| below.store(nest(scheduler, depth - 1) + 1, Ordering::Relaxed));
        });
        assert_eq!(outcome, Ok(()));
    }
    below.into_inner()
}

/// On a worker's thread: a background job runs there, and its scopes' jobs on top of it.
fn nest_on_a_thread(builder: SchedulerBuilder, depth: usize) -> usize {
    let scheduler = Arc::new(builder.workers(2).build().unwrap());
    let job = scheduler.background({
        let scheduler = Arc::clone(&scheduler);
        move || nest(&scheduler, depth)
    });
    assert!(eventually(|| job.is_finished()));
    job.wait().unwrap()
}

#[test]
fn scopes_nest_as_deep_as_the_stack_is_large() {
    assert_eq!(nest_on_a_thread(Scheduler::builder(), 2_000), 2_000);
    assert_eq!(nest_on_a_thread(Scheduler::builder().stack_size(80 << 20), 10_000), 10_000);
}

#[test]
fn stacks_of_any_size_are_large_enough_or_an_error() {
    for bytes in [0, 1, 4_095, 16 << 10, SchedulerBuilder::MIN_STACK_SIZE, SchedulerBuilder::MIN_STACK_SIZE + 1] {
        assert_eq!(nest_on_a_thread(Scheduler::builder().stack_size(bytes), 10), 10, "{bytes} bytes");
    }
    for bytes in [usize::MAX, usize::MAX - 4_095, usize::MAX / 2 + 1, usize::MAX / 2] {
        let error = Scheduler::builder().workers(2).stack_size(bytes).build().unwrap_err();
        assert!(matches!(error, SchedulerError::Spawn { worker: 1, .. }), "{bytes} bytes: {error}");
        assert!(Scheduler::builder().workers(1).stack_size(bytes).build().is_ok(), "it starts no thread");
    }
}
