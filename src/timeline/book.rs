//! What is told of frames, runs, spans and counters, which are few, and so go through a lock.

use std::{collections::HashSet, mem, ops::Range, thread, time::Duration};

use super::log::{Counter, Frame, Log, Run, Span};

/// How many frames, runs, spans and readings of counters are kept at most, of each, until they are taken.
const MOST_KEPT: usize = 1 << 16;

/// Frames, runs, spans and counters, until a log is taken.
#[derive(Default)]
pub(super) struct Book {
    marks: Marks,
    /// The current frame, once something belongs to it.
    frame: Option<u64>,
    next_frame: u64,
    next_run: u32,
    /// The runs that are going on, and how many of them a frame waits for.
    open: Vec<u32>,
    awaited: usize,
    /// Those of them of which chunks were taken out too early, and are lost.
    incomplete: Vec<u32>,
    kept: Kept,
    /// Those that have spans which are kept.
    threads: Vec<(thread::ThreadId, String)>,
}

/// Who says when a frame begins, the more of a say the later they stand.
#[derive(Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Marks {
    #[default]
    Runs,
    Renderer,
    Engine,
}

/// What is kept until a log is taken.
#[derive(Default)]
pub(super) struct Kept {
    /// Their numbers, and when they began.
    pub(super) frames: Vec<(u64, Duration)>,
    pub(super) runs: Vec<(u32, Run)>,
    pub(super) spans: Vec<Span>,
    pub(super) counters: Vec<Counter>,
    pub(super) threads: Vec<String>,
    pub(super) dropped: u64,
}

impl Book {
    /// A frame begins, at that time if something is recorded, unless somebody else has more of a say.
    pub(super) fn mark(&mut self, by: Marks, now: Option<Duration>) {
        self.marks = self.marks.max(by);
        if let Some(now) = now.filter(|_| self.marks == by) {
            self.frame = None;
            let number = self.current_frame();
            self.keep(|kept| &mut kept.frames, (number, now));
        }
    }

    /// The number of the current frame. What comes before the first mark since the timeline was started has one of its own.
    pub(super) fn current_frame(&mut self) -> u64 {
        *self.frame.get_or_insert_with(|| {
            let number = self.next_frame;
            self.next_frame += 1;
            number
        })
    }

    /// What comes now is of no frame before it.
    pub(super) fn forget_frame(&mut self) {
        self.frame = None;
    }

    /// A run begins. Gives its number, and its frame's.
    pub(super) fn open_run(&mut self, now: Duration, in_background: bool) -> (u32, u64) {
        let number = self.next_run;
        self.next_run = number.wrapping_add(1);
        if !in_background {
            if self.awaited == 0 {
                self.mark(Marks::Runs, Some(now));
            }
            self.awaited += 1;
        }
        self.open.push(number);
        (number, self.current_frame())
    }

    /// A run has ended, which is complete unless some of its chunks were taken out before.
    pub(super) fn end_run(&mut self, number: u32, mut run: Run) {
        run.complete &= !self.incomplete.contains(&number);
        self.awaited -= usize::from(!run.in_background);
        for list in [&mut self.open, &mut self.incomplete] {
            list.retain(|&other| other != number);
        }
        self.keep(|kept| &mut kept.runs, (number, run));
    }

    /// The calling thread has ended a span, of that frame if it is given.
    pub(super) fn add_span(&mut self, name: String, frame: Option<u64>, time: Range<Duration>) {
        let frame = frame.unwrap_or_else(|| self.current_frame());
        // Without room for its span, a thread takes none either.
        let thread = if self.kept.spans.len() < MOST_KEPT { self.this_thread() } else { 0 };
        let span = Span { name, thread, frame, began: time.start, ended: time.end };
        self.keep(|kept| &mut kept.spans, span);
    }

    /// Keeps something in one of the lists, if there is room.
    pub(super) fn keep<T>(&mut self, list: impl FnOnce(&mut Kept) -> &mut Vec<T>, value: T) {
        let list = list(&mut self.kept);
        if list.len() < MOST_KEPT {
            list.push(value);
        } else {
            self.kept.dropped += 1;
        }
    }

    pub(super) fn take(&mut self) -> Kept {
        self.kept.threads = mem::take(&mut self.threads).into_iter().map(|(_, name)| name).collect();
        mem::take(&mut self.kept)
    }

    /// Chunks of these runs were taken out before the runs had ended, and are lost.
    pub(super) fn lose_chunks_of(&mut self, runs: &HashSet<u32>) {
        self.incomplete.extend(self.open.iter().filter(|&run| runs.contains(run)));
        let ended = self.kept.runs.iter_mut().filter(|(number, _)| runs.contains(number));
        ended.for_each(|(_, run)| run.complete = false);
    }

    /// The calling thread's place among those that have spans.
    fn this_thread(&mut self) -> usize {
        let this = thread::current();
        let place = self.threads.iter().position(|(id, _)| *id == this.id());
        place.unwrap_or_else(|| {
            let name = this.name().map_or_else(|| format!("thread {}", self.threads.len()), str::to_owned);
            self.threads.push((this.id(), name));
            self.threads.len() - 1
        })
    }
}

/// The frames that were marked, and those that anything else belongs to.
pub(super) fn frames_of(marked: Vec<(u64, Duration)>, log: &Log) -> Vec<Frame> {
    let mut frames: Vec<_> = marked.into_iter().map(|(number, began)| Frame { number, began, ended: began }).collect();
    let runs = log.runs.iter().filter(|run| !run.in_background).map(|run| (run.frame, run.began, run.ended));
    let spans = log.spans.iter().map(|span| (span.frame, span.began, span.ended));
    for (number, began, ended) in runs.chain(spans) {
        let place = frames.partition_point(|frame| frame.number < number);
        if frames.get(place).is_none_or(|frame| frame.number != number) {
            frames.insert(place, Frame { number, began, ended });
        }
        let frame = &mut frames[place];
        (frame.began, frame.ended) = (frame.began.min(began), frame.ended.max(ended));
    }
    frames
}
