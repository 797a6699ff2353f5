//! The recorder: workers and calling threads write to it, and a log takes out what they wrote.

use std::borrow::Cow;
use std::collections::{HashMap, HashSet};
use std::fmt;
use std::marker::PhantomData;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use crossbeam_utils::CachePadded;

use super::chunk_timer::ChunkTimer;
use super::clock::{Clock, ClockFn, ClockReader, EngineClock};
use super::event_store::{EventStore, Events, FrameSource, frames_of};
use super::frame_tuning::FrameTuning;
use super::log::{Chunk, Counter, Graph, Idle, IdleKind, Log, Run, WorkerLog};
use super::stopwatch::Stopwatch;
use super::track::{Entry, Track};
use crate::sync::{AtomicBool, AtomicU64, Mutex, Ordering};

/// Whether the build can record at all. It cannot under loom, which has enough state to explore without recording, and
/// in the build that the cost of a switched-off timeline is measured against.
const CAN_RECORD: bool = !cfg!(any(drawloom_loom, drawloom_without_timeline));

/// Records what the workers of a [`Scheduler`](crate::task::Scheduler) do.
///
/// It is off by default. [`start`](Self::start) and [`stop`](Self::stop) may be called at any time from any thread. A
/// run of a schedule is recorded either from beginning to end or not at all.
pub struct Timeline {
    is_on: AtomicBool,
    /// The timestamp of when it was last switched on.
    started: AtomicU64,
    clock: Clock,
    tracks: Box<[CachePadded<Track>]>,
    names: Box<[String]>,
    store: Mutex<EventStore>,
    /// Locked while a log is taken. Per worker, the time up to which logs have reported it.
    reported: Mutex<Box<[Duration]>>,
}

/// The settings of a timeline.
#[derive(Default)]
pub(crate) struct TimelineSettings {
    /// The capacity of each worker's track, in events.
    pub(crate) capacity: Option<usize>,
    /// The engine's clock, to be used instead of the machine's.
    pub(crate) clock: Option<ClockFn>,
}

impl TimelineSettings {
    /// Enough for the chunks of some hundred frames. It takes 3 MiB per worker.
    const DEFAULT_CAPACITY: usize = 1 << 16;

    /// It takes 768 MiB per worker.
    const MAX_CAPACITY: usize = 1 << 24;
}

impl Timeline {
    /// A timeline for workers with these names. It is off.
    pub(crate) fn new(names: Vec<String>, settings: TimelineSettings) -> Self {
        let capacity =
            settings.capacity.unwrap_or(TimelineSettings::DEFAULT_CAPACITY).clamp(1, TimelineSettings::MAX_CAPACITY);
        Self {
            is_on: AtomicBool::new(false),
            started: AtomicU64::new(0),
            clock: settings.clock.map_or_else(Clock::of_this_machine, |clock| Clock::Engine(EngineClock::new(clock))),
            tracks: names.iter().map(|_| CachePadded::new(Track::new(capacity))).collect(),
            reported: Mutex::new(names.iter().map(|_| Duration::ZERO).collect()),
            names: names.into(),
            store: Mutex::new(EventStore::default()),
        }
    }

    /// Switches the timeline on. The first call allocates the memory for all workers, and waits until the scheduler is
    /// 10 ms old, because it calibrates the processor's counter over that time.
    pub fn start(&self) {
        // Calibrates the counter on first use, which takes too long to be done during a run.
        let reader = self.clock.reader();
        if !self.is_on() {
            self.started.store(reader.read_ordered(), Ordering::Relaxed);
            self.store.lock().end_frame();
        }
        self.tracks.iter().for_each(|track| track.allocate());
        // Relaxed: a writer finds the memory through its `OnceLock`, and drops events until it is there.
        self.is_on.store(true, Ordering::Relaxed);
    }

    /// Switches the timeline off. What was recorded can still be [taken](Self::take).
    pub fn stop(&self) {
        self.is_on.store(false, Ordering::Relaxed);
    }

    /// Whether the timeline is on.
    #[inline]
    pub fn is_on(&self) -> bool {
        CAN_RECORD && self.is_on.load(Ordering::Relaxed)
    }

    /// The size of the workers' ring buffers in bytes: 0 before the first [`start`](Self::start), and constant after
    /// it.
    pub fn bytes(&self) -> usize {
        self.tracks.iter().map(|track| track.bytes()).sum()
    }

    /// The current time: since the scheduler was built, unless the engine supplies the clock. The first call waits as
    /// [`start`](Self::start) does.
    pub fn now(&self) -> Duration {
        self.clock.now()
    }

    /// Begins a frame. What is recorded until the next frame belongs to it.
    ///
    /// Calling this is optional. If an engine never calls it, every `Renderer::record` begins a frame; without a
    /// renderer, every run of a schedule does that begins while no other run is in progress. After the first call, even
    /// one while the timeline is off, only these calls begin frames, and a frame can contain any number of records and
    /// runs.
    pub fn mark_frame(&self) {
        let now = self.is_on().then(|| self.now());
        self.store.lock().mark_frame(FrameSource::Engine, now);
    }

    /// Begins a span of the calling thread, which ends when the guard is dropped. It belongs to the frame in which it
    /// ends.
    ///
    /// ```
    /// # let scheduler = drawloom_jobs::task::Scheduler::new(1)?;
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

    /// As [`span`](Self::span), but in the given frame, if any.
    #[doc(hidden)]
    pub fn span_of(&self, frame: Option<u64>, name: impl Into<Cow<'static, str>>) -> OpenSpan<'_> {
        let open = self.is_on().then(|| (name.into(), frame, self.now()));
        OpenSpan { timeline: self, open, stays_on_its_thread: PhantomData }
    }

    /// Records the value of a counter. Its name includes the unit, and is the same each time.
    pub fn count(&self, name: impl Into<Cow<'static, str>>, value: f64) {
        if self.is_on() {
            let at = self.now();
            // The conversion is the engine's code, so it is not called under the lock.
            let counter = Counter { name: name.into().into_owned(), at, value };
            self.store.lock().push(|events| &mut events.counters, counter);
        }
    }

    /// A stopwatch that starts now, for the cost of some work.
    #[inline]
    #[doc(hidden)]
    pub fn stopwatch(&self) -> Stopwatch<'_> {
        Stopwatch::of(&self.clock)
    }

    /// Records what was chosen by measurement in a frame: none if the timeline was off when the frame began.
    #[doc(hidden)]
    pub fn add_tuning(&self, frame: Option<u64>, tuning: &FrameTuning) {
        if let Some(frame) = frame.filter(|_| self.is_on()) {
            let tuning = tuning.clone();
            self.store.lock().add_tuning(frame, tuning);
        }
    }

    /// Takes out what was recorded since the last call.
    ///
    /// This may be called at any time, and blocks no worker. It is best called between two frames: chunks of a run in
    /// progress are lost and counted as dropped, and that run is not [complete](Run::complete).
    pub fn take(&self) -> Log {
        // The clock is the engine's code, so it is not called under a lock.
        let now = self.now();
        let mut reported = self.reported.lock();
        let Events { frames, runs, spans, counters, tuning, threads, dropped } = self.store.lock().take();
        let mut log = Log { spans, counters, tuning, threads, dropped, ..Log::default() };
        let mut indices = HashMap::with_capacity(runs.len());
        let mut open_runs = HashSet::new();
        for (number, run) in runs {
            indices.insert(number, log.runs.len());
            log.runs.push(run);
        }
        for worker in 0..self.tracks.len() {
            let drained = self.drain((worker, now), &mut reported[worker], &indices, &mut log.runs, &mut open_runs);
            log.workers.push(drained);
        }
        self.store.lock().mark_incomplete(&open_runs);
        log.clock_panic = self.clock.panic_message().map(str::to_owned);
        for run in &mut log.runs {
            run.chunks.sort_unstable_by_key(|chunk| (chunk.node, chunk.items.start));
            run.empty.sort_unstable_by_key(|chunk| chunk.node);
        }
        log.frames = frames_of(frames, &log);
        log
    }

    /// Takes out one worker's chunks, and its idle intervals from the last log until `now`. Chunks of a run without an
    /// index are lost, and the run's number is added to `open_runs`.
    fn drain(
        &self,
        (worker, now): (usize, Duration),
        reported: &mut Duration,
        indices: &HashMap<u32, usize>,
        runs: &mut [Run],
        open_runs: &mut HashSet<u32>,
    ) -> WorkerLog {
        let track = &*self.tracks[worker];
        let mut log = WorkerLog { name: self.names[worker].clone(), ..WorkerLog::default() };
        let (mut until, mut lost) = (Duration::ZERO, 0);
        let mut add = |run: u32, chunk: Chunk, list: fn(&mut Run) -> &mut Vec<Chunk>| match indices.get(&run) {
            Some(&index) => list(&mut runs[index]).push(chunk),
            None => {
                lost += 1;
                open_runs.insert(run);
            }
        };
        // An idle interval that began while the timeline was off has no start time.
        let started = self.clock.time(self.started.load(Ordering::Relaxed));
        let with_start = |idle: Idle, until: Duration| {
            let began = if idle.began.is_zero() { until.max(started) } else { idle.began };
            Idle { began: began.max(*reported).min(idle.ended), ..idle }
        };
        // Read before the ring is drained, so that the open interval overlaps nothing in the ring.
        let open = track.idle_until(now, &self.clock);
        let dropped = track.drain(worker, &self.clock, |entry| match entry {
            Entry::Idle(idle) => {
                // The last log has reported the whole interval if it ended while that log was taken.
                log.idle.extend((idle.ended >= *reported).then(|| with_start(idle, until)));
                until = idle.ended;
            }
            Entry::Chunk { run, chunk } => {
                until = chunk.ended;
                add(run, chunk, |run| &mut run.chunks);
            }
            Entry::Empty { run, chunk } => {
                until = chunk.ended;
                add(run, chunk, |run| &mut run.empty);
            }
        });
        let open = open.map(|idle| with_start(idle, until));
        let open = open.filter(|idle| log.idle.last().is_none_or(|last| last.ended <= idle.began));
        // Another log may have been taken since `now`.
        *reported = until.max(open.map_or(*reported, |idle| idle.ended)).max(*reported);
        log.idle.extend(open);
        log.dropped = dropped + lost;
        log
    }

    /// Begins a frame, unless the engine marks frames, and returns the current frame's number. `None` if the timeline
    /// is off.
    #[doc(hidden)]
    pub fn begin_frame(&self) -> Option<u64> {
        self.is_on().then(|| {
            let now = self.now();
            let mut store = self.store.lock();
            store.mark_frame(FrameSource::Renderer, Some(now));
            store.current_frame()
        })
    }

    /// Begins a run of the schedule that `graph` describes. `None` if the timeline is off.
    pub(crate) fn open_run(&self, in_background: bool, graph: impl FnOnce() -> Arc<Graph>) -> Option<OpenRun<'_>> {
        self.is_on().then(|| {
            let graph = graph();
            let began = self.now();
            let (number, frame) = self.store.lock().open_run(began, in_background);
            OpenRun {
                timeline: self,
                reader: self.clock.reader(),
                number,
                frame,
                graph,
                began,
                in_background,
                parallel_from: OnceLock::new(),
                dropped: AtomicU64::new(0),
                end: RunEnd { failed: true, ..RunEnd::default() },
            }
        })
    }

    /// The worker becomes idle.
    ///
    /// That it falls asleep is noted even while the timeline is off, because it may still be asleep when the timeline
    /// is on.
    pub(crate) fn start_idle(&self, worker: usize, kind: IdleKind) {
        let now = self.timestamp_if_on();
        if now.is_some() || (CAN_RECORD && kind == IdleKind::Asleep) {
            self.tracks[worker].start_idle(kind, now);
        }
    }

    /// The worker becomes busy.
    pub(crate) fn end_idle(&self, worker: usize) {
        if CAN_RECORD && self.tracks[worker].is_idle() {
            self.tracks[worker].end_idle(self.timestamp_if_on());
        }
    }

    fn timestamp_if_on(&self) -> Option<u64> {
        self.is_on().then(|| self.clock.reader().read_ordered())
    }
}

impl fmt::Debug for Timeline {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Timeline").field("is_on", &self.is_on()).finish_non_exhaustive()
    }
}

/// An open span: see [`Timeline::span`]. It cannot leave the thread that began it:
///
/// ```compile_fail
/// let scheduler = drawloom_jobs::task::Scheduler::new(1).unwrap();
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
            self.timeline.store.lock().add_span(name.into_owned(), frame, began..ended);
        }
    }
}

/// A run that is being recorded.
pub(crate) struct OpenRun<'timeline> {
    timeline: &'timeline Timeline,
    reader: ClockReader<'timeline>,
    number: u32,
    frame: u64,
    graph: Arc<Graph>,
    began: Duration,
    in_background: bool,
    parallel_from: OnceLock<Duration>,
    /// How many of its chunks were dropped.
    dropped: AtomicU64,
    end: RunEnd,
}

/// What is known of a run when it ends.
#[derive(Default)]
pub(crate) struct RunEnd {
    pub(crate) always_parallel: bool,
    pub(crate) failed: bool,
}

impl OpenRun<'_> {
    /// A worker opens a node of the run, and begins to run its chunks.
    #[inline]
    pub(crate) fn open(&self, worker: usize, node: u32, stolen: bool) -> ChunkTimer<'_> {
        self.timer(worker, node, stolen, None)
    }

    /// A worker joins the workers that run the chunks of a node. `opened` is the timestamp of when the node was opened.
    #[inline]
    pub(crate) fn join(&self, worker: usize, node: u32, stolen: bool, opened: u64) -> ChunkTimer<'_> {
        self.timer(worker, node, stolen, Some(opened))
    }

    /// The run is parallel from now on.
    pub(crate) fn start_parallel(&self) {
        if self.parallel_from.get().is_none() {
            // The clock is the engine's code, so it is not called while others wait for this cell.
            let _ = self.parallel_from.set(self.timeline.now());
        }
    }

    #[inline]
    fn timer(&self, worker: usize, node: u32, stolen: bool, opened: Option<u64>) -> ChunkTimer<'_> {
        ChunkTimer::new(&self.timeline.tracks[worker], self.reader, [self.number, node], stolen, opened, &self.dropped)
    }

    /// Ends the run. A run that is dropped without this call, because a panic unwinds through it, counts as failed.
    pub(crate) fn end(mut self, end: RunEnd) {
        self.end = end;
    }
}

impl Drop for OpenRun<'_> {
    fn drop(&mut self) {
        let RunEnd { always_parallel, failed } = self.end;
        let run = Run {
            frame: self.frame,
            graph: Arc::clone(&self.graph),
            workers: self.timeline.tracks.len(),
            began: self.began,
            ended: self.timeline.now(),
            parallel_from: self.parallel_from.take(),
            always_parallel,
            in_background: self.in_background,
            failed,
            // Relaxed: all workers that count are done.
            complete: self.dropped.load(Ordering::Relaxed) == 0,
            chunks: Vec::new(),
            empty: Vec::new(),
        };
        self.timeline.store.lock().end_run(self.number, run);
    }
}
