//! Writes a log as a trace.

use std::cmp::Reverse;
use std::io::{self, BufWriter};
use std::time::Duration;

use super::events::{EventWriter, Track, microseconds};
use super::nested_tracks::nested_tracks;
use super::node_spans::{NodeSpan, NodeSpans, slices};
use super::ready_nodes::ReadyNodes;
use crate::report::consistency::check_log;
use crate::timeline::{Chunk, DeviceLog, IdleKind, Log, NodeInfo, Run};

/// The processes of a trace, in the terms of the format: one for workers and threads, and one for the device.
const CPU: usize = 1;
const DEVICE: usize = 2;

/// Writes a log in the Trace Event Format (Duca and Sinclair, "Trace Event Format"), for `ui.perfetto.dev` and
/// `chrome://tracing`.
///
/// Times are microseconds with three decimals, on the log's own axis. There is a track for each worker, one for each
/// thread that has spans, and below them the device's. Spans and passes that overlap without one lying inside the other
/// get tracks of their own.
///
/// | what | events | category |
/// | --- | --- | --- |
/// | chunks | `X`, with the name of their node | `job` |
/// | nodes without items | `X` | `empty` |
/// | idle intervals | `X`: `searching`, `asleep` | `idle` |
/// | spans | `X` | `span` |
/// | passes of the device | `X` | `device` |
/// | dependencies, from the end of the last chunk to the beginning of the first | `s` and `f` | `dependency` |
/// | frames | `i` | `frame` |
/// | counters, and `ready nodes`: how many nodes were ready but not opened | `C` | `counter` |
///
/// The arguments of a chunk are its labels, its items, the frame, the index of its run among [`Log::runs`], when its
/// node was opened (`opened_us`), how long after the last of the node's dependencies it began (`queued_us`), and
/// whether it was stolen. `otherData` says how much was dropped, and how many dependencies have no arrow because there
/// is no chunk at one of their ends, as in a run that failed or is not complete.
///
/// Events are written one by one, so the trace is never in memory as a whole.
///
/// ```
/// use drawloom_jobs::graph::{Closure, FrameGraph};
/// use drawloom_jobs::report::write_chrome_trace;
/// use drawloom_jobs::task::Scheduler;
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
/// Returns the error of `writer`, or [`InvalidInput`](io::ErrorKind::InvalidInput) if the log refers to a node, a
/// worker or a thread that it does not list, or if a node waits for a later one.
pub fn write_chrome_trace(log: &Log, writer: impl io::Write) -> io::Result<()> {
    check_log(log).map_err(|problem| io::Error::new(io::ErrorKind::InvalidInput, problem))?;
    let events = EventWriter::new(BufWriter::new(writer))?;
    let mut trace = TraceWriter { log, events, threads: log.workers.len(), arrows: 0, left_out: 0 };
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

struct TraceWriter<'log, W> {
    log: &'log Log,
    events: EventWriter<W>,
    /// The number of threads. Threads are numbered across both processes, as an operating system does.
    threads: usize,
    /// How many dependencies have an arrow, and how many have none.
    arrows: u64,
    left_out: u64,
}

impl<W: io::Write> TraceWriter<'_, W> {
    fn write_workers(&mut self) -> io::Result<()> {
        for (worker, log) in self.log.workers.iter().enumerate() {
            let track = track_of(worker);
            self.name_track(track, &log.name)?;
            for idle in &log.idle {
                let name = match idle.kind {
                    IdleKind::Searching => "searching",
                    IdleKind::Asleep => "asleep",
                };
                self.events.slice("idle", name, track, idle.began, idle.ended)?.end()?;
            }
        }
        Ok(())
    }

    fn write_frames(&mut self) -> io::Result<()> {
        self.log.frames.iter().try_for_each(|frame| {
            let event = self.events.event("i", "frame", &format!("frame {}", frame.number), track_of(0))?;
            event.value("s", "g")?.time("ts", frame.began)?.end()
        })
    }

    fn write_runs(&mut self) -> io::Result<()> {
        let log = self.log;
        // A run that was started inside another run's chunk comes after that run, even if both began at once.
        let mut order: Vec<_> = log.runs.iter().enumerate().collect();
        order.sort_by_key(|(_, run)| (run.began, Reverse(run.ended)));
        let mut ready_nodes = ReadyNodes::default();
        for (index, run) in order {
            ready_nodes.write_until(run.began, &mut self.events, track_of(0))?;
            let spans = NodeSpans::new(run, self.arrows + 1);
            self.arrows += spans.arrows;
            self.left_out += spans.left_out;
            ready_nodes.add(spans.ready_changes());
            for (slice, (is_empty, chunk)) in slices(run).enumerate() {
                if let Some(span) = &spans.nodes[chunk.node] {
                    let category = if is_empty { "empty" } else { "job" };
                    self.write_chunk(category, chunk, (index, run), span)?;
                    self.write_arrows(slice, chunk, span)?;
                }
            }
        }
        ready_nodes.write_until(Duration::MAX, &mut self.events, track_of(0))
    }

    fn write_chunk(
        &mut self,
        category: &str,
        chunk: &Chunk,
        (run_index, run): (usize, &Run),
        span: &NodeSpan,
    ) -> io::Result<()> {
        let NodeInfo { name, labels, .. } = &run.graph.nodes[chunk.node];
        let slice = self.events.slice(category, name, track_of(chunk.worker), chunk.started, chunk.ended)?;
        let slice = slice.object("args", |mut arguments| {
            for (key, label) in [("process", &labels.process), ("stage", &labels.stage), ("view", &labels.view)] {
                if let Some(label) = label {
                    arguments = arguments.value(key, &**label)?;
                }
            }
            arguments = arguments.value("items", format!("{:?}", chunk.items))?;
            if let Some(ready) = span.ready {
                arguments = arguments.time("queued_us", chunk.started.saturating_sub(ready))?;
            }
            let arguments = arguments.time("opened_us", chunk.opened)?.value("stolen", chunk.stolen)?;
            arguments.value("frame", run.frame)?.value("run", run_index)
        })?;
        slice.end()
    }

    /// Writes the ends of the arrows at a slice. They directly follow the slice, because Perfetto binds an arrow to the
    /// last slice it has read of those that begin at the same time. They lie a nanosecond inside the slice if it is
    /// long enough, because `chrome://tracing` binds an arrow at the border of two slices to the one that ends.
    fn write_arrows(&mut self, slice: usize, chunk: &Chunk, span: &NodeSpan) -> io::Result<()> {
        let track = track_of(chunk.worker);
        let nanosecond = Duration::from_nanos(1);
        let before_end = chunk.ended.saturating_sub(nanosecond).max(chunk.started);
        if slice == span.first.index {
            let after_start = chunk.started.saturating_add(nanosecond).min(before_end);
            for &arrow in &span.arrows_in {
                let event = self.events.event("f", "dependency", "dependency", track)?;
                event.value("bp", "e")?.value("id", arrow)?.time("ts", after_start)?.end()?;
            }
        }
        if slice == span.last.index {
            for &arrow in &span.arrows_out {
                let event = self.events.event("s", "dependency", "dependency", track)?;
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
            self.write_nested(CPU, name, spans, |events, track, span| {
                let slice = events.slice("span", &span.name, track, span.began, span.ended)?;
                slice.object("args", |arguments| arguments.value("frame", span.frame))?.end()
            })?;
        }
        Ok(())
    }

    fn write_counters(&mut self) -> io::Result<()> {
        // JSON has no representation of other numbers.
        let mut counters = self.log.counters.iter().filter(|counter| counter.value.is_finite());
        counters.try_for_each(|counter| self.events.counter(&counter.name, track_of(0), counter.at, counter.value))
    }

    fn write_device(&mut self, device: &DeviceLog) -> io::Result<()> {
        self.name_process(DEVICE, &device.name)?;
        let track = Track { process: DEVICE, thread: self.threads + 1 };
        let error = format!("±{} µs", microseconds(device.error));
        self.events.metadata("process_labels", track, "labels", error)?;
        let passes = device.passes.iter().map(|pass| (pass.began, pass.ended, pass)).collect();
        self.write_nested(DEVICE, "passes", passes, |events, track, pass| {
            let slice = events.slice("device", &pass.process, track, pass.began, pass.ended)?;
            let slice = slice.object("args", |arguments| {
                let arguments = arguments.value("process", &pass.process)?.value("view", &pass.view)?;
                arguments.value("frame", pass.frame)
            })?;
            slice.end()
        })
    }

    /// Writes slices, given with when they began and ended, on as many tracks of that name as they need to nest.
    fn write_nested<T>(
        &mut self,
        process: usize,
        name: &str,
        mut slices: Vec<(Duration, Duration, T)>,
        write: impl Fn(&mut EventWriter<W>, Track, T) -> io::Result<()>,
    ) -> io::Result<()> {
        slices.sort_by_key(|&(began, ended, _)| (began, Reverse(ended)));
        let tracks = nested_tracks(slices.iter().map(|&(began, ended, _)| (began, ended)));
        let first = self.threads + 1;
        // Even without slices there is a track, to show that there were none.
        self.threads += tracks.iter().max().map_or(1, |last| last + 1);
        for thread in first..=self.threads {
            let name = if thread == first { name.to_owned() } else { format!("{name} ({})", thread - first + 1) };
            self.name_track(Track { process, thread }, &name)?;
        }
        for ((_, _, slice), track) in slices.into_iter().zip(tracks) {
            write(&mut self.events, Track { process, thread: first + track }, slice)?;
        }
        Ok(())
    }

    fn name_process(&mut self, process: usize, name: &str) -> io::Result<()> {
        let track = Track { process, thread: if process == CPU { 1 } else { self.threads + 1 } };
        self.events.metadata("process_name", track, "name", name)?;
        self.events.metadata("process_sort_index", track, "sort_index", process)
    }

    /// Names a track, and sorts tracks by their numbers.
    fn name_track(&mut self, track: Track, name: &str) -> io::Result<()> {
        self.events.metadata("thread_name", track, "name", name)?;
        self.events.metadata("thread_sort_index", track, "sort_index", track.thread)
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

/// The track of a worker.
fn track_of(worker: usize) -> Track {
    Track { process: CPU, thread: worker + 1 }
}
