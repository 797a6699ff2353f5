//! The recorder: what workers and calling threads write into, and what takes it out.

use std::{
    borrow::Cow,
    collections::{HashMap, HashSet},
    fmt,
    marker::PhantomData,
    sync::{Arc, OnceLock},
    time::Duration,
};

use crossbeam_utils::CachePadded;

use crate::sync::{AtomicBool, AtomicU64, Mutex, Ordering};

use super::{
    book::{Book, Kept, Marks, frames_of},
    clock::{Clock, EngineClock, Reader},
    lane::{Entry, Lane, Lap},
    log::{Chunk, Counter, Graph, Idle, IdleKind, Log, Run, WorkerLog},
};

/// Whether anything is recorded at all. A model checker has enough to do without; and what recording costs while it is off
/// is measured against a build without it.
const RECORDS: bool = !cfg!(any(drawloom_loom, drawloom_without_timeline));

/// Records what the workers of a [`Scheduler`](crate::task::Scheduler) do.
///
/// It is off at first. [`start`](Self::start) and [`stop`](Self::stop) may be called at any time, from any thread: a run of a
/// schedule is recorded from its beginning to its end, or not at all.
pub struct Timeline {
    is_on: AtomicBool,
    /// The mark of when it was last switched on.
    started: AtomicU64,
    clock: Clock,
    lanes: Box<[CachePadded<Lane>]>,
    names: Box<[String]>,
    book: Mutex<Book>,
    /// Held by whoever takes a log: until when the last one told of each worker.
    taker: Mutex<Box<[Duration]>>,
}

/// How a timeline is to be.
#[derive(Default)]
pub(crate) struct Setup {
    /// How many events each worker has room for.
    pub(crate) capacity: Option<usize>,
    /// What tells the time instead of the system.
    pub(crate) clock: Option<Box<dyn Fn() -> Duration + Send + Sync>>,
}

impl Setup {
    /// Room for the chunks of some hundred frames, in 3 MiB a worker.
    const CAPACITY: usize = 1 << 16;

    /// 768 MiB a worker.
    const MOST_CAPACITY: usize = 1 << 24;
}

impl Timeline {
    /// Off, for workers of these names.
    pub(crate) fn new(names: Vec<String>, setup: Setup) -> Self {
        let capacity = setup.capacity.unwrap_or(Setup::CAPACITY).clamp(1, Setup::MOST_CAPACITY);
        Self {
            is_on: AtomicBool::new(false),
            started: AtomicU64::new(0),
            clock: setup.clock.map_or_else(Clock::of_this_machine, |clock| Clock::Engine(EngineClock::new(clock))),
            lanes: names.iter().map(|_| CachePadded::new(Lane::new(capacity))).collect(),
            taker: Mutex::new(names.iter().map(|_| Duration::ZERO).collect()),
            names: names.into(),
            book: Mutex::new(Book::default()),
        }
    }

    /// Records from now on. The first time, memory for all workers is asked for; and for the processor's counter to be known well
    /// enough, the scheduler has to be 10 ms old: so long it waits at most.
    pub fn start(&self) {
        // What a tick is takes its time to find out, so nobody is to do that amid a run.
        let reader = self.clock.reader();
        if !self.is_on() {
            self.started.store(reader.in_order(), Ordering::Relaxed);
            self.book.lock().forget_frame();
        }
        self.lanes.iter().for_each(|lane| lane.make_room());
        // Relaxed: whoever writes finds the memory by itself, and drops what it writes if that is not there yet.
        self.is_on.store(true, Ordering::Relaxed);
    }

    /// Records no further. What was recorded can still be [taken](Self::take).
    pub fn stop(&self) {
        self.is_on.store(false, Ordering::Relaxed);
    }

    /// Whether it records.
    #[inline]
    pub fn is_on(&self) -> bool {
        RECORDS && self.is_on.load(Ordering::Relaxed)
    }

    /// How many bytes of memory its rings take: none before it was started for the first time, and never more from then on.
    pub fn bytes(&self) -> usize {
        self.lanes.iter().map(|lane| lane.bytes()).sum()
    }

    /// The time on its axis: since the scheduler was built, unless an engine's clock says it. The first time, it waits as
    /// [`start`](Self::start) does.
    pub fn now(&self) -> Duration {
        self.clock.now()
    }

    /// A frame begins. All that is recorded until the next one belongs to it.
    ///
    /// An engine that never calls this need not: then every [`Renderer::record`](crate::Renderer::record) begins one, and where
    /// there is no renderer every run of a schedule that begins while no other goes on. One that does, also while nothing is
    /// recorded, has frames of its own, with any number of both in each.
    pub fn mark_frame(&self) {
        let now = self.is_on().then(|| self.now());
        self.book.lock().mark(Marks::Engine, now);
    }

    /// Names what the calling thread does until the guard is dropped: a span of its own among those of the frame in which it
    /// ends.
    ///
    /// ```
    /// # let scheduler = drawloom::task::Scheduler::new(1)?;
    /// scheduler.timeline().start();
    /// let simulated = scheduler.timeline().span("simulate");
    /// // ... what the engine does ...
    /// drop(simulated);
    /// assert_eq!(scheduler.timeline().take().spans[0].name, "simulate");
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use = "a span ends when this is dropped"]
    pub fn span(&self, name: impl Into<Cow<'static, str>>) -> OpenSpan<'_> {
        self.span_of(None, name)
    }

    /// As [`span`](Self::span), of that frame if it is given.
    pub(crate) fn span_of(&self, frame: Option<u64>, name: impl Into<Cow<'static, str>>) -> OpenSpan<'_> {
        let open = self.is_on().then(|| (name.into(), frame, self.now()));
        OpenSpan { timeline: self, open, stays_on_its_thread: PhantomData }
    }

    /// Notes what a counter stands at. Its name is the same each time, and says the unit.
    pub fn count(&self, name: impl Into<Cow<'static, str>>, value: f64) {
        if self.is_on() {
            let at = self.now();
            self.book.lock().keep(|kept| &mut kept.counters, Counter { name: name.into().into_owned(), at, value });
        }
    }

    /// Takes out all that was recorded since the last time.
    ///
    /// It may be called at any time, and keeps nobody waiting. But chunks of a run that goes on meanwhile are lost, and counted,
    /// and that run is not [complete](Run::complete). So the best moment is between two frames.
    pub fn take(&self) -> Log {
        let mut told = self.taker.lock();
        let Kept { frames, runs, spans, counters, threads, dropped } = self.book.lock().take();
        let mut log = Log { spans, counters, threads, dropped, ..Log::default() };
        let mut places = HashMap::with_capacity(runs.len());
        let mut too_early = HashSet::new();
        for (number, run) in runs {
            places.insert(number, log.runs.len());
            log.runs.push(run);
        }
        for (worker, lane) in self.lanes.iter().enumerate() {
            let drained = self.drain(worker, lane, &mut told[worker], &places, &mut log.runs, &mut too_early);
            log.workers.push(drained);
        }
        self.book.lock().lose_chunks_of(&too_early);
        log.clock_panic = self.clock.panic_message().map(str::to_owned);
        for run in &mut log.runs {
            run.chunks.sort_unstable_by_key(|chunk| (chunk.process, chunk.items.start));
            run.empty.sort_unstable_by_key(|chunk| chunk.process);
        }
        log.frames = frames_of(frames, &log);
        log
    }

    /// Takes out what one worker has written, and its idle times from where the last log ended. Chunks of a run that has no
    /// place are lost, and its number goes to those that were taken out too early.
    fn drain(
        &self,
        worker: usize,
        lane: &Lane,
        told: &mut Duration,
        places: &HashMap<u32, usize>,
        runs: &mut [Run],
        too_early: &mut HashSet<u32>,
    ) -> WorkerLog {
        let mut log = WorkerLog { name: self.names[worker].clone(), ..WorkerLog::default() };
        let (mut until, mut lost) = (Duration::ZERO, 0);
        let mut put = |run: u32, chunk: Chunk, list: fn(&mut Run) -> &mut Vec<Chunk>| match places.get(&run) {
            Some(&place) => list(&mut runs[place]).push(chunk),
            None => {
                lost += 1;
                too_early.insert(run);
            }
        };
        // Who fell asleep while nothing was recorded has not said when.
        let started = self.clock.time(self.started.load(Ordering::Relaxed));
        let since_when = |idle: Idle, until: Duration| {
            let began = if idle.began.is_zero() { until.max(started) } else { idle.began };
            Idle { began: began.max(*told).min(idle.ended), ..idle }
        };
        // Before the rest, so that it overlaps nothing that is taken out.
        let now = lane.idle_until(self.now(), &self.clock);
        let dropped = lane.drain(worker, &self.clock, |entry| match entry {
            Entry::Idle(idle) => {
                // The last log may have told of all of it, where it ended as that was taken.
                log.idle.extend((idle.ended >= *told).then(|| since_when(idle, until)));
                until = idle.ended;
            }
            Entry::Chunk { run, chunk } => {
                until = chunk.ended;
                put(run, chunk, |run| &mut run.chunks);
            }
            Entry::Empty { run, chunk } => {
                until = chunk.ended;
                put(run, chunk, |run| &mut run.empty);
            }
        });
        let now = now.map(|now| since_when(now, until));
        let now = now.filter(|now| log.idle.last().is_none_or(|last| last.ended <= now.began));
        *told = until.max(now.map_or(*told, |now| now.ended));
        log.idle.extend(now);
        log.dropped = dropped + lost;
        log
    }

    /// A frame begins, unless the engine marks its own. Says which it is; `None` if nothing is recorded.
    pub(crate) fn begin_frame(&self) -> Option<u64> {
        self.is_on().then(|| {
            let now = self.now();
            let mut book = self.book.lock();
            book.mark(Marks::Renderer, Some(now));
            book.current_frame()
        })
    }

    /// A run of a schedule begins, of which `graph` tells what it is of.
    pub(crate) fn open_run(&self, in_background: bool, graph: impl FnOnce() -> Arc<Graph>) -> Option<OpenRun<'_>> {
        self.is_on().then(|| {
            let graph = graph();
            let began = self.now();
            let (number, frame) = self.book.lock().open_run(began, in_background);
            OpenRun {
                timeline: self,
                reader: self.clock.reader(),
                number,
                frame,
                graph,
                began,
                in_background,
                shared_from: OnceLock::new(),
                dropped: AtomicU64::new(0),
                how: Ended { failed: true, ..Ended::default() },
            }
        })
    }

    /// The worker has nothing to do from now on.
    ///
    /// That it fell asleep is noted even while nothing is recorded: it may still sleep when something is.
    pub(crate) fn start_idle(&self, worker: usize, kind: IdleKind) {
        let now = self.mark_if_on();
        if now.is_some() || (RECORDS && kind == IdleKind::Asleep) {
            self.lanes[worker].start_idle(kind, now);
        }
    }

    /// The worker has something to do.
    pub(crate) fn end_idle(&self, worker: usize) {
        if RECORDS && self.lanes[worker].is_idle() {
            self.lanes[worker].end_idle(self.mark_if_on());
        }
    }

    fn mark_if_on(&self) -> Option<u64> {
        self.is_on().then(|| self.clock.reader().in_order())
    }
}

impl fmt::Debug for Timeline {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Timeline").field("is_on", &self.is_on()).finish_non_exhaustive()
    }
}

/// A span that has not ended: see [`Timeline::span`]. It is of the thread that began it, and stays there:
///
/// ```compile_fail
/// let scheduler = drawloom::task::Scheduler::new(1).unwrap();
/// let span = scheduler.timeline().span("simulate");
/// std::thread::scope(|scope| _ = scope.spawn(move || drop(span)));
/// ```
pub struct OpenSpan<'timeline> {
    timeline: &'timeline Timeline,
    open: Option<(Cow<'static, str>, Option<u64>, Duration)>,
    stays_on_its_thread: PhantomData<*const ()>,
}

impl Drop for OpenSpan<'_> {
    fn drop(&mut self) {
        if let Some((name, frame, began)) = self.open.take() {
            let ended = self.timeline.now();
            self.timeline.book.lock().add_span(name.into_owned(), frame, began..ended);
        }
    }
}

/// A run that is being recorded.
pub(crate) struct OpenRun<'timeline> {
    timeline: &'timeline Timeline,
    reader: Reader<'timeline>,
    number: u32,
    frame: u64,
    graph: Arc<Graph>,
    began: Duration,
    in_background: bool,
    shared_from: OnceLock<Duration>,
    /// How many of its chunks there was no room for.
    dropped: AtomicU64,
    how: Ended,
}

/// How a run has ended.
#[derive(Default)]
pub(crate) struct Ended {
    pub(crate) always_parallel: bool,
    pub(crate) failed: bool,
}

impl OpenRun<'_> {
    /// A worker opens a process of the run, and begins with its chunks.
    #[inline]
    pub(crate) fn open(&self, worker: usize, process: u32, stolen: bool) -> Lap<'_> {
        self.lap(worker, process, stolen, None)
    }

    /// A worker joins those at a process of the run that was opened at that moment.
    #[inline]
    pub(crate) fn join(&self, worker: usize, process: u32, stolen: bool, opened: u64) -> Lap<'_> {
        self.lap(worker, process, stolen, Some(opened))
    }

    /// Other workers than the calling thread can take part from now on.
    pub(crate) fn let_others_in(&self) {
        self.shared_from.get_or_init(|| self.timeline.now());
    }

    #[inline]
    fn lap(&self, worker: usize, process: u32, stolen: bool, opened: Option<u64>) -> Lap<'_> {
        Lap::new(&self.timeline.lanes[worker], self.reader, [self.number, process], stolen, opened, &self.dropped)
    }

    /// The run has ended. One that is dropped without this, as a panic passes through it, has failed.
    pub(crate) fn end(mut self, how: Ended) {
        self.how = how;
    }
}

impl Drop for OpenRun<'_> {
    fn drop(&mut self) {
        let Ended { always_parallel, failed } = self.how;
        let run = Run {
            frame: self.frame,
            graph: Arc::clone(&self.graph),
            workers: self.timeline.lanes.len(),
            began: self.began,
            ended: self.timeline.now(),
            shared_from: self.shared_from.take(),
            always_parallel,
            in_background: self.in_background,
            failed,
            // Relaxed: all who count are done.
            complete: self.dropped.load(Ordering::Relaxed) == 0,
            chunks: Vec::new(),
            empty: Vec::new(),
        };
        self.timeline.book.lock().end_run(self.number, run);
    }
}
