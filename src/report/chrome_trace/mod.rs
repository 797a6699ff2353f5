//! A log as a trace that Perfetto and `chrome://tracing` open.

mod events;
mod nested_lanes;
mod passages;

use std::{
    cmp::Reverse,
    io::{self, BufWriter},
    time::Duration,
};

use crate::{
    report::consistency::check_log,
    timeline::{Chunk, DeviceLog, IdleKind, Log, NodeInfo, Run},
};

use self::{
    events::{Events, Lane, microseconds},
    nested_lanes::nested_lanes,
    passages::{Passage, Passages, slices},
};

/// The numbers of the processes of a trace: what ran on workers and threads, and what ran on the device.
const CPU: usize = 1;
const DEVICE: usize = 2;

/// Writes a log in the Trace Event Format (Duca and Sinclair, "Trace Event Format"), for `ui.perfetto.dev` and
/// `chrome://tracing`.
///
/// Times are microseconds with three decimals, on the log's own axis. There is a lane for each worker, one for each thread
/// that has spans, and below them the device's; spans and passes that overlap without one lying inside the other get lanes
/// of their own.
///
/// | what | events | category |
/// | --- | --- | --- |
/// | chunks, as many as ran | `X`, by the name of their node | `job` |
/// | nodes without items | `X` | `empty` |
/// | idle times | `X`: `searching`, `asleep` | `idle` |
/// | spans | `X` | `span` |
/// | the device's passes | `X` | `device` |
/// | dependencies, from the end of the last chunk to the beginning of the first | `s` and `f` | `dependency` |
/// | frames | `i` | `frame` |
/// | counters, and `ready nodes`: how many could have been opened, and were later | `C` | `counter` |
///
/// The arguments of a chunk say what it is a part of, its items, the frame, the place of its run among [`Log::runs`], when
/// its node was opened (`opened_us`), how long after the last of what that waits for it began (`queued_us`), and
/// whether it was stolen. `otherData` says how much was dropped, and how many dependencies have no arrow since there is no
/// chunk at one of their ends, as in a run that failed or is not complete.
///
/// It is written as it is read, so a trace is never in memory as a whole.
///
/// ```
/// use drawloom::{
///     graph::{Closure, FrameGraph},
///     report::write_chrome_trace,
///     task::Scheduler,
/// };
///
/// let mut graph = FrameGraph::new();
/// let cull = graph.add("cull", Closure::new(|_: &(), _range, _worker| Ok(())).with_width(|_| 100));
/// graph.keep(cull);
/// let mut schedule = graph.compile()?;
///
/// let scheduler = Scheduler::new(2)?;
/// scheduler.timeline().start();
/// schedule.run(&scheduler, &())?;
/// let mut trace = Vec::new();
/// write_chrome_trace(&scheduler.timeline().take(), &mut trace)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
///
/// What `writer` returns; and [`InvalidInput`](io::ErrorKind::InvalidInput) if the log names a node, a worker or a thread
/// that it does not list, or has a node wait for a later one.
pub fn write_chrome_trace(log: &Log, writer: impl io::Write) -> io::Result<()> {
    check_log(log).map_err(|problem| io::Error::new(io::ErrorKind::InvalidInput, problem))?;
    let events = Events::begin(BufWriter::new(writer))?;
    let mut trace = Trace { log, events, threads: log.workers.len(), arrows: 0, left_out: 0 };
    trace.name_process(CPU, "drawloom")?;
    trace.write_workers()?;
    trace.write_frames()?;
    trace.write_runs()?;
    trace.write_spans()?;
    trace.write_counters()?;
    if let Some(device) = &log.device {
        trace.write_device(device)?;
    }
    trace.finish()
}

struct Trace<'log, W> {
    log: &'log Log,
    events: Events<W>,
    /// How many threads there are. They are numbered across both processes, as those of a system are.
    threads: usize,
    /// How many dependencies have an arrow, and how many have none.
    arrows: u64,
    left_out: u64,
}

impl<W: io::Write> Trace<'_, W> {
    fn write_workers(&mut self) -> io::Result<()> {
        for (worker, log) in self.log.workers.iter().enumerate() {
            let lane = lane_of(worker);
            self.name_lane(lane, &log.name)?;
            for idle in &log.idle {
                let name = match idle.kind {
                    IdleKind::Searching => "searching",
                    IdleKind::Asleep => "asleep",
                };
                self.events.slice("idle", name, lane, idle.began, idle.ended)?.end()?;
            }
        }
        Ok(())
    }

    fn write_frames(&mut self) -> io::Result<()> {
        self.log.frames.iter().try_for_each(|frame| {
            let event = self.events.event("i", "frame", &format!("frame {}", frame.number), lane_of(0))?;
            event.value("s", "g")?.time("ts", frame.began)?.end()
        })
    }

    fn write_runs(&mut self) -> io::Result<()> {
        let log = self.log;
        // One that was started in another one's chunk comes after that, even if both began at once.
        let mut order: Vec<_> = log.runs.iter().enumerate().collect();
        order.sort_by_key(|(_, run)| (run.began, Reverse(run.ended)));
        let mut waits = Waits::default();
        for (place, run) in order {
            waits.write_until(run.began, &mut self.events)?;
            let passages = Passages::new(run, self.arrows + 1);
            self.arrows += passages.arrows;
            self.left_out += passages.left_out;
            waits.add(passages.waits());
            for (slice_place, (is_empty, chunk)) in slices(run).enumerate() {
                if let Some(passage) = &passages.nodes[chunk.node] {
                    let category = if is_empty { "empty" } else { "job" };
                    self.write_chunk(category, chunk, (place, run), passage)?;
                    self.write_arrows(slice_place, chunk, passage)?;
                }
            }
        }
        waits.write_until(Duration::MAX, &mut self.events)
    }

    fn write_chunk(
        &mut self,
        category: &str,
        chunk: &Chunk,
        (place, run): (usize, &Run),
        passage: &Passage,
    ) -> io::Result<()> {
        let NodeInfo { name, labels, .. } = &run.graph.nodes[chunk.node];
        let slice = self.events.slice(category, name, lane_of(chunk.worker), chunk.started, chunk.ended)?;
        let slice = slice.object("args", |mut arguments| {
            for (key, label) in [("process", &labels.process), ("stage", &labels.stage), ("view", &labels.view)] {
                if let Some(label) = label {
                    arguments = arguments.value(key, label)?;
                }
            }
            arguments = arguments.value("items", format!("{:?}", chunk.items))?;
            if let Some(ready) = passage.ready {
                arguments = arguments.time("queued_us", chunk.started.saturating_sub(ready))?;
            }
            let arguments = arguments.time("opened_us", chunk.opened)?.value("stolen", chunk.stolen)?;
            arguments.value("frame", run.frame)?.value("run", place)
        })?;
        slice.end()
    }

    /// The ends of arrows at a slice. They stand next to it: where several slices begin at one moment, Perfetto binds an arrow
    /// to the one it read last. And they lie a nanosecond inside, if there is an inside: where one slice ends as the next one
    /// begins, `chrome://tracing` binds an arrow to the one that ends.
    fn write_arrows(&mut self, place: usize, chunk: &Chunk, passage: &Passage) -> io::Result<()> {
        let lane = lane_of(chunk.worker);
        let nanosecond = Duration::from_nanos(1);
        let before_end = chunk.ended.saturating_sub(nanosecond).max(chunk.started);
        if place == passage.first.place {
            let after_start = chunk.started.saturating_add(nanosecond).min(before_end);
            for &arrow in &passage.arrows_in {
                let event = self.events.event("f", "dependency", "dependency", lane)?;
                event.value("bp", "e")?.value("id", arrow)?.time("ts", after_start)?.end()?;
            }
        }
        if place == passage.last.place {
            for &arrow in &passage.arrows_out {
                let event = self.events.event("s", "dependency", "dependency", lane)?;
                event.value("id", arrow)?.time("ts", before_end)?.end()?;
            }
        }
        Ok(())
    }

    fn write_spans(&mut self) -> io::Result<()> {
        let log = self.log;
        for (thread, name) in log.threads.iter().enumerate() {
            let spans = log.spans.iter().filter(|span| span.thread == thread);
            let spans = spans.map(|span| (span.began, span.ended, span)).collect();
            self.write_nested(CPU, name, spans, |events, lane, span| {
                let slice = events.slice("span", &span.name, lane, span.began, span.ended)?;
                slice.object("args", |arguments| arguments.value("frame", span.frame))?.end()
            })?;
        }
        Ok(())
    }

    fn write_counters(&mut self) -> io::Result<()> {
        // JSON has no number for the others.
        let mut counters = self.log.counters.iter().filter(|counter| counter.value.is_finite());
        counters.try_for_each(|counter| self.events.reading(&counter.name, lane_of(0), counter.at, counter.value))
    }

    fn write_device(&mut self, device: &DeviceLog) -> io::Result<()> {
        self.name_process(DEVICE, &device.name)?;
        let lane = Lane { process: DEVICE, thread: self.threads + 1 };
        let error = format!("±{} µs", microseconds(device.error));
        self.events.metadata("process_labels", lane, "labels", error)?;
        let passes = device.passes.iter().map(|pass| (pass.began, pass.ended, pass)).collect();
        self.write_nested(DEVICE, "passes", passes, |events, lane, pass| {
            let slice = events.slice("device", &pass.process, lane, pass.began, pass.ended)?;
            let slice = slice.object("args", |arguments| {
                let arguments = arguments.value("process", &pass.process)?.value("view", &pass.view)?;
                arguments.value("frame", pass.frame)
            })?;
            slice.end()
        })
    }

    /// Slices with when they began and ended, on as many lanes of that name as it takes for them to nest.
    fn write_nested<T>(
        &mut self,
        process: usize,
        name: &str,
        mut slices: Vec<(Duration, Duration, T)>,
        write: impl Fn(&mut Events<W>, Lane, T) -> io::Result<()>,
    ) -> io::Result<()> {
        slices.sort_by_key(|&(began, ended, _)| (began, Reverse(ended)));
        let lanes = nested_lanes(slices.iter().map(|&(began, ended, _)| (began, ended)));
        let first = self.threads + 1;
        // Even if there is nothing on it, so that it is seen that there was nothing.
        self.threads += lanes.iter().max().map_or(1, |last| last + 1);
        for thread in first..=self.threads {
            let name = if thread == first { name.to_owned() } else { format!("{name} ({})", thread - first + 1) };
            self.name_lane(Lane { process, thread }, &name)?;
        }
        for ((_, _, slice), lane) in slices.into_iter().zip(lanes) {
            write(&mut self.events, Lane { process, thread: first + lane }, slice)?;
        }
        Ok(())
    }

    fn name_process(&mut self, process: usize, name: &str) -> io::Result<()> {
        let lane = Lane { process, thread: if process == CPU { 1 } else { self.threads + 1 } };
        self.events.metadata("process_name", lane, "name", name)?;
        self.events.metadata("process_sort_index", lane, "sort_index", process)
    }

    /// Lanes stand in the order of their numbers.
    fn name_lane(&mut self, lane: Lane, name: &str) -> io::Result<()> {
        self.events.metadata("thread_name", lane, "name", name)?;
        self.events.metadata("thread_sort_index", lane, "sort_index", lane.thread)
    }

    fn finish(self) -> io::Result<()> {
        let Self { log, events, left_out, .. } = self;
        let incomplete = log.runs.iter().filter(|run| !run.complete).count();
        events.finish(|data| {
            let data = data.value("dropped", log.all_dropped())?.value("incomplete_runs", incomplete)?;
            let data = data.value("dependencies_left_out", left_out)?;
            match &log.device {
                Some(device) => data.time("device_error_us", device.error),
                None => Ok(data),
            }
        })
    }
}

/// A worker's.
fn lane_of(worker: usize) -> Lane {
    Lane { process: CPU, thread: worker + 1 }
}

/// How many nodes could be opened and are not yet, in runs that may overlap.
#[derive(Default)]
struct Waits {
    changes: Vec<(Duration, i64)>,
    /// When the last of them is.
    last: Duration,
}

impl Waits {
    fn add(&mut self, changes: impl Iterator<Item = (Duration, i64)>) {
        self.changes.extend(changes.inspect(|&(at, _)| self.last = self.last.max(at)));
    }

    /// Writes what was added, unless it goes on beyond that.
    fn write_until<W: io::Write>(&mut self, end: Duration, events: &mut Events<W>) -> io::Result<()> {
        if self.last > end {
            return Ok(());
        }
        self.changes.sort_unstable_by_key(|&(at, _)| at);
        let mut ready = 0;
        for together in self.changes.chunk_by(|one, next| one.0 == next.0) {
            let change: i64 = together.iter().map(|(_, change)| change).sum();
            ready += change;
            if change != 0 {
                events.reading("ready nodes", lane_of(0), together[0].0, ready)?;
            }
        }
        self.changes.clear();
        Ok(())
    }
}
