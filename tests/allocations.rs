//! A steady frame takes no memory: not from the graph, not from a loop, on no thread. And what is done leaves none behind.
//!
//! The allocator of this binary counts for all threads, so everything is in one test: a second one, or the harness that
//! starts it, would be counted as well.
//!
//! Queues keep the memory that they once took, and take more only when more jobs lie in them than ever before. Where a
//! worker is late that may happen in any frame. So before anything is counted each queue is made to hold more than the frames
//! could put there.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    hint::black_box,
    ops::Range,
    sync::{
        Barrier, Mutex,
        atomic::{AtomicUsize, Ordering},
    },
    thread,
    time::Duration,
};

use drawloom::{
    graph::{Closure, FrameGraph, NodeId, Schedule},
    task::{Scheduler, Worker, catch},
};

/// The system's allocator, and how often any thread has asked it for memory.
struct Counting;

static REQUESTS: AtomicUsize = AtomicUsize::new(0);

/// How many bytes have been asked for and not given back.
static BYTES: AtomicUsize = AtomicUsize::new(0);

#[global_allocator]
static ALLOCATOR: Counting = Counting;

// SAFETY: Everything is left to the system's allocator, which is one.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        REQUESTS.fetch_add(1, Ordering::Relaxed);
        BYTES.fetch_add(layout.size(), Ordering::Relaxed);
        // SAFETY: Whoever calls this has promised the same.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        REQUESTS.fetch_add(1, Ordering::Relaxed);
        BYTES.fetch_add(layout.size(), Ordering::Relaxed);
        // SAFETY: Whoever calls this has promised the same.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        REQUESTS.fetch_add(1, Ordering::Relaxed);
        BYTES.fetch_add(size.wrapping_sub(layout.size()), Ordering::Relaxed);
        // SAFETY: Whoever calls this has promised the same, and the memory is the system's.
        unsafe { System.realloc(memory, layout, size) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        BYTES.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: Whoever calls this has promised the same, and the memory is the system's.
        unsafe { System.dealloc(memory, layout) }
    }
}

/// More than any frame here has jobs at once.
const MOST_JOBS: usize = 600;
const WARMING: usize = 50;
const COUNTED: usize = 100;
const SPELLS: usize = 3;

/// Runs frames, and says how often the counted ones asked for memory: those of the best of three spells, as whatever a
/// thread does for the first time, such as to steal or to wait for a lock, may take memory that once, in any frame.
fn requests_of(mut frame: impl FnMut(usize)) -> usize {
    (0..WARMING).for_each(&mut frame);
    let spells = (0..SPELLS).map(|_| {
        let before = REQUESTS.load(Ordering::Relaxed);
        (0..COUNTED).for_each(&mut frame);
        REQUESTS.load(Ordering::Relaxed) - before
    });
    spells.min().expect("there are some")
}

/// What a frame is lent: how much work an item is.
#[derive(Default)]
struct World {
    work: AtomicUsize,
    items: AtomicUsize,
}

type Process = Closure<'static, World>;

fn process() -> Process {
    Closure::new(|world: &World, range: Range<usize>, _: &Worker| {
        world.items.fetch_add(range.len(), Ordering::Relaxed);
        (0..world.work.load(Ordering::Relaxed)).for_each(|step| {
            black_box(step);
        });
        Ok(())
    })
}

/// A layered graph: narrow, wide and pinned processes, of which each waits for some of the layer before.
fn layered(seed: u64, layers: &[usize]) -> Schedule<Process> {
    let mut state = seed;
    let mut below = |count: usize| {
        state = state.wrapping_mul(0x5851_F42D_4C95_7F2D).wrapping_add(0x1405_7B7E_F767_814F);
        (state >> 33) as usize % count
    };
    let mut graph = FrameGraph::new();
    let mut before: Vec<NodeId> = Vec::new();
    for (layer, &width) in layers.iter().enumerate() {
        let processes: Vec<NodeId> = (0..width)
            .map(|place| {
                let (items, chunk) = (2 + below(100), 1 + below(4));
                let payload = match below(8) {
                    0 => process().on_calling_thread(),
                    1 | 2 => process().with_width(move |_| items).with_chunk(chunk),
                    _ => process(),
                };
                let added = graph.add(format!("{layer} {place}"), payload);
                graph.keep(added);
                for _ in 0..before.len().min(1 + below(3)) {
                    graph.order(before[below(before.len())], added);
                }
                added
            })
            .collect();
        before = processes;
    }
    graph.compile().expect("nothing is wrong")
}

/// A root, which takes as long as it is told, and then a spine of processes, each of which makes its successor ready and a
/// tooth that nothing waits for: whoever runs the spine queues all teeth.
fn comb() -> Schedule<Closure<'static, Duration>> {
    let nothing = || Closure::new(|_: &Duration, _, _| Ok(()));
    let mut graph = FrameGraph::new();
    let root = Closure::new(|long: &Duration, _, _| {
        thread::sleep(*long);
        Ok(())
    });
    // Of processes that cost the same the first added comes first, so the spine does.
    let mut last = graph.add("root", root);
    graph.keep(last);
    let bones: Vec<NodeId> = (0..MOST_JOBS).map(|place| graph.add(format!("bone {place}"), nothing())).collect();
    for (place, bone) in bones.into_iter().enumerate() {
        graph.order(last, bone);
        last = bone;
        let tooth = graph.add(format!("tooth {place}"), nothing());
        graph.order(bone, tooth);
        graph.keep(bone);
        graph.keep(tooth);
    }
    let mut schedule = graph.compile().expect("nothing is wrong");
    schedule.always_parallel(true);
    schedule
}

/// A root that makes everything ready which is for the calling thread.
fn mail() -> Schedule<Process> {
    let mut graph = FrameGraph::new();
    let root = graph.add("root", process());
    graph.keep(root);
    for place in 0..MOST_JOBS {
        let pinned = graph.add(format!("pinned {place}"), process().on_calling_thread());
        graph.order(root, pinned);
        graph.keep(pinned);
    }
    let mut schedule = graph.compile().expect("nothing is wrong");
    schedule.always_parallel(true);
    schedule
}

/// Has every worker sleep once, and every queue and mailbox take the memory that it will ever need.
fn stretch(scheduler: &Scheduler) {
    let together = Barrier::new(scheduler.workers());
    for runner in 0..scheduler.workers() {
        // The others have nothing to do meanwhile. A lock takes memory for a thread that waits for the first time.
        let outcome = scheduler.parallel_for(scheduler.workers(), 1, |_range, worker| {
            together.wait();
            if worker.index() == runner {
                thread::sleep(Duration::from_millis(20));
            }
        });
        assert_eq!(outcome, Ok(()));
        with_others_kept(scheduler, runner, || {
            mail().run(scheduler, &World::default()).unwrap();
            // Nothing is known of the costs, so nothing is urgent.
            let mut schedule = comb();
            // The first run is not measured, and the second is.
            (0..2).for_each(|_| schedule.run(scheduler, &Duration::from_millis(200)).unwrap());
            // Beside such a root all else costs nothing, so all ways are the longest, and everything is urgent.
            schedule.run(scheduler, &Duration::ZERO).unwrap();
        });
    }
}

/// Calls that on one worker, while the others can take nothing off it.
fn with_others_kept(scheduler: &Scheduler, chosen: usize, call: impl FnMut() + Send) {
    let [begin, end] = [(); 2].map(|()| Barrier::new(scheduler.workers()));
    let call = Mutex::new(call);
    let outcome = scheduler.parallel_for(scheduler.workers(), 1, |_range, worker| {
        begin.wait();
        let outcome = if worker.index() == chosen { catch(|| call.lock().unwrap()()) } else { Ok(()) };
        end.wait();
        outcome.unwrap();
    });
    assert_eq!(outcome, Ok(()));
}

/// The requests of frames of a graph, whose work changes: heavy frames are too long to be run alone.
fn requests_of_graph(scheduler: &Scheduler, mut schedule: Schedule<Process>, always_parallel: bool) -> usize {
    schedule.always_parallel(always_parallel);
    let world = World::default();
    let requests = requests_of(|frame| {
        world.work.store(if frame % 5 == 4 { 200 } else { 0 }, Ordering::Relaxed);
        schedule.run(scheduler, &world).unwrap();
    });
    assert!(world.items.into_inner() >= schedule.len() * (WARMING + SPELLS * COUNTED), "all has been run");
    requests
}

/// Background jobs that were waited for before anybody had begun them are gone, wherever nobody takes them out of a queue.
fn check_that_waiting_leaves_nothing(workers: usize) {
    const JOBS: usize = 1_000;
    const RESULT: usize = 16_384;
    let scheduler = Scheduler::new(workers).unwrap();
    let wait_for_all = || {
        for job in 0..JOBS {
            assert_eq!(scheduler.background(move || [job as u8; RESULT]).wait(), Ok([job as u8; RESULT]));
        }
    };
    wait_for_all();
    let before = BYTES.load(Ordering::Relaxed);
    wait_for_all();
    let left = BYTES.load(Ordering::Relaxed).saturating_sub(before);
    assert!(left < 2 * RESULT, "{workers} workers: {JOBS} jobs that were waited for have left {left} bytes");
}

#[test]
fn a_steady_frame_takes_no_memory() {
    [1, 2].into_iter().for_each(check_that_waiting_leaves_nothing);

    // What counts must count, on every thread.
    let before = REQUESTS.load(Ordering::Relaxed);
    thread::spawn(|| drop(black_box(Box::new(7)))).join().unwrap();
    assert!(REQUESTS.load(Ordering::Relaxed) > before);

    let scheduler = Scheduler::builder().workers(2).build().unwrap();
    stretch(&scheduler);

    let mut found = Vec::new();
    let mut note = |case: String, requests: usize| found.extend((requests > 0).then(|| format!("{case}: {requests}")));
    for (seed, layers) in [&[1, 12, 3, 30, 7, 1][..], &[5, 100, 2, 150, 40], &[200, 1, 200]].into_iter().enumerate() {
        for always_parallel in [true, false] {
            let requests = requests_of_graph(&scheduler, layered(seed as u64, layers), always_parallel);
            note(format!("layers of {layers:?}, always shared: {always_parallel}"), requests);
        }
    }
    let mut schedule = comb();
    let mut requests = 0;
    with_others_kept(&scheduler, 0, || {
        requests = requests_of(|_frame| schedule.run(&scheduler, &Duration::ZERO).unwrap());
    });
    note("jobs that the deque has no room for".to_owned(), requests);
    let requests = requests_of(|_frame| schedule.run(&scheduler, &Duration::ZERO).unwrap());
    note("the same with thieves".to_owned(), requests);
    for (length, chunk) in [(1_000, 1), (1_000, 7), (2, 1), (1, 1)] {
        let sum = AtomicUsize::new(0);
        let requests = requests_of(|_frame| {
            let body = |range: Range<usize>, _: &Worker| {
                sum.fetch_add(range.len(), Ordering::Relaxed);
            };
            scheduler.parallel_for(length, chunk, body).unwrap();
        });
        note(format!("a loop over {length} by {chunk}"), requests);
        assert_eq!(sum.into_inner(), length * (WARMING + SPELLS * COUNTED));
    }
    note(
        "loops in a loop".to_owned(),
        requests_of(|_frame| {
            let inner = |_: Range<usize>, _: &Worker| scheduler.parallel_for(20, 1, |_range, _worker| {}).unwrap();
            scheduler.parallel_for(20, 1, inner).unwrap();
        }),
    );
    assert_eq!(found, [""; 0], "requests for memory in {COUNTED} frames each");
}
