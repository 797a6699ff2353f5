//! The frames, runs, spans, counters and tuning of a timeline. They are few, so they are stored behind a lock.

use std::collections::HashSet;
use std::ops::Range;
use std::time::Duration;
use std::{mem, thread};

use super::frame_tuning::FrameTuning;
use super::log::{Counter, Frame, Log, Run, Span};

/// The capacity for frames, runs, spans and counter readings, each, between two logs.
const MAX_EVENTS: usize = 1 << 16;

/// The capacity for frames' tuning between two logs: each is some kilobytes.
const MAX_TUNED_FRAMES: usize = 1 << 10;

/// The frames, runs, spans, counters and tuning since the last log.
#[derive(Default)]
pub(super) struct EventStore {
    frame_source: FrameSource,
    /// The current frame, once something belongs to it.
    frame: Option<u64>,
    next_frame: u64,
    next_run: u32,
    /// The runs that have not ended, and how many of them a frame waits for.
    open_runs: Vec<u32>,
    awaited_runs: usize,
    /// The open runs that have lost chunks, because a log was taken during the run.
    incomplete_runs: Vec<u32>,
    events: Events,
    /// The threads that have spans in `events`.
    threads: Vec<(thread::ThreadId, String)>,
}

/// What marks the beginning of frames, by ascending priority.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum FrameSource {
    #[default]
    Runs,
    Renderer,
    Engine,
}

/// What a log takes out of the store.
#[derive(Default)]
pub(super) struct Events {
    /// The frames' numbers, and when they began.
    pub(super) frames: Vec<(u64, Duration)>,
    pub(super) runs: Vec<(u32, Run)>,
    pub(super) spans: Vec<Span>,
    pub(super) counters: Vec<Counter>,
    /// With the frames' numbers.
    pub(super) tuning: Vec<(u64, FrameTuning)>,
    pub(super) threads: Vec<String>,
    pub(super) dropped: u64,
}

impl EventStore {
    /// Begins a frame, unless a source of higher priority marks frames. `now` is the time if the timeline is on.
    pub(super) fn mark_frame(&mut self, source: FrameSource, now: Option<Duration>) {
        self.frame_source = self.frame_source.max(source);
        if let Some(now) = now.filter(|_| self.frame_source == source) {
            self.frame = None;
            let number = self.current_frame();
            self.push(|events| &mut events.frames, (number, now));
        }
    }

    /// The number of the current frame. Events between the timeline's start and the first mark have a frame of their
    /// own.
    pub(super) fn current_frame(&mut self) -> u64 {
        *self.frame.get_or_insert_with(|| {
            let number = self.next_frame;
            self.next_frame += 1;
            number
        })
    }

    /// Ends the current frame: later events do not belong to it.
    pub(super) fn end_frame(&mut self) {
        self.frame = None;
    }

    /// Begins a run. Returns its number, and its frame's.
    pub(super) fn open_run(&mut self, now: Duration, in_background: bool) -> (u32, u64) {
        let number = self.next_run;
        self.next_run = number.wrapping_add(1);
        if !in_background {
            if self.awaited_runs == 0 {
                self.mark_frame(FrameSource::Runs, Some(now));
            }
            self.awaited_runs += 1;
        }
        self.open_runs.push(number);
        (number, self.current_frame())
    }

    /// Stores a run that has ended. It is incomplete if it has lost chunks.
    pub(super) fn end_run(&mut self, number: u32, mut run: Run) {
        run.complete &= !self.incomplete_runs.contains(&number);
        self.awaited_runs -= usize::from(!run.in_background);
        for list in [&mut self.open_runs, &mut self.incomplete_runs] {
            list.retain(|&other| other != number);
        }
        self.push(|events| &mut events.runs, (number, run));
    }

    /// Stores a span of the calling thread, in the given frame or else the current one.
    pub(super) fn add_span(&mut self, name: String, frame: Option<u64>, time: Range<Duration>) {
        let frame = frame.unwrap_or_else(|| self.current_frame());
        // A span that will be dropped does not add its thread.
        let thread = if self.events.spans.len() < MAX_EVENTS { self.this_thread() } else { 0 };
        let span = Span { name, thread, frame, began: time.start, ended: time.end };
        self.push(|events| &mut events.spans, span);
    }

    /// Adds an event to one of the lists, or counts it as dropped if the list is full.
    pub(super) fn push<T>(&mut self, list: impl FnOnce(&mut Events) -> &mut Vec<T>, event: T) {
        let list = list(&mut self.events);
        if list.len() < MAX_EVENTS {
            list.push(event);
        } else {
            self.events.dropped += 1;
        }
    }

    /// Adds a frame's tuning, or counts it as dropped if there is no room.
    pub(super) fn add_tuning(&mut self, frame: u64, tuning: FrameTuning) {
        if self.events.tuning.len() < MAX_TUNED_FRAMES {
            self.events.tuning.push((frame, tuning));
        } else {
            self.events.dropped += 1;
        }
    }

    pub(super) fn take(&mut self) -> Events {
        self.events.threads = mem::take(&mut self.threads).into_iter().map(|(_, name)| name).collect();
        mem::take(&mut self.events)
    }

    /// Marks runs as incomplete: a log took some of their chunks before the runs had ended, so the chunks are lost.
    pub(super) fn mark_incomplete(&mut self, runs: &HashSet<u32>) {
        self.incomplete_runs.extend(self.open_runs.iter().filter(|&run| runs.contains(run)));
        let ended = self.events.runs.iter_mut().filter(|(number, _)| runs.contains(number));
        ended.for_each(|(_, run)| run.complete = false);
    }

    /// The index of the calling thread among those that have spans.
    fn this_thread(&mut self) -> usize {
        let this = thread::current();
        let index = self.threads.iter().position(|(id, _)| *id == this.id());
        index.unwrap_or_else(|| {
            let name = this.name().map_or_else(|| format!("thread {}", self.threads.len()), str::to_owned);
            self.threads.push((this.id(), name));
            self.threads.len() - 1
        })
    }
}

/// The marked frames and all frames that runs or spans belong to, with the time that these cover.
pub(super) fn frames_of(marked: Vec<(u64, Duration)>, log: &Log) -> Vec<Frame> {
    let mut frames: Vec<_> = marked.into_iter().map(|(number, began)| Frame { number, began, ended: began }).collect();
    let runs = log.runs.iter().filter(|run| !run.in_background).map(|run| (run.frame, run.began, run.ended));
    let spans = log.spans.iter().map(|span| (span.frame, span.began, span.ended));
    for (number, began, ended) in runs.chain(spans) {
        let index = frames.partition_point(|frame| frame.number < number);
        if frames.get(index).is_none_or(|frame| frame.number != number) {
            frames.insert(index, Frame { number, began, ended });
        }
        let frame = &mut frames[index];
        (frame.began, frame.ended) = (frame.began.min(began), frame.ended.max(ended));
    }
    frames
}
