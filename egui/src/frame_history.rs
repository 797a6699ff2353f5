//! The latest frames.

use std::collections::VecDeque;
use std::time::Duration;

use drawloom::FrameStatistics;
use drawloom::timeline::{Frame, Log, Run};

/// The latest frames, and which of them is shown.
#[derive(Debug, Default)]
pub struct FrameHistory {
    frames: VecDeque<FrameRecord>,
    latest_statistics: Option<FrameStatistics>,
    /// The number of the frame that is shown; `None` follows the latest one.
    selected: Option<u64>,
}

/// A frame.
#[derive(Debug, Default)]
pub struct FrameRecord {
    /// As the timeline counts.
    pub number: u64,
    /// What was recorded of this frame, and of no other.
    pub log: Log,
    /// `None` if none was added for this number.
    pub statistics: Option<FrameStatistics>,
}

impl FrameHistory {
    /// The number of frames that are kept.
    pub const LENGTH: usize = 240;

    /// Adds what was recorded since the log before.
    pub fn add_log(&mut self, log: Log) {
        let mut numbers: Vec<_> = log.frames.iter().map(|frame| frame.number).collect();
        // What ended after its frame was reported, as the submission of the frame before.
        numbers.extend(log.spans.iter().map(|span| span.frame).chain(log.runs.iter().map(|run| run.frame)));
        numbers.sort_unstable();
        numbers.dedup();
        for number in numbers {
            if let Some(record) = self.record(number) {
                record.append(&log);
            }
        }
    }

    /// Adds the statistics of a frame, by the timeline's number of it.
    pub fn add_statistics(&mut self, number: Option<u64>, statistics: &FrameStatistics) {
        self.latest_statistics = Some(statistics.clone());
        if let Some(record) = number.and_then(|number| self.record(number)) {
            record.statistics = Some(statistics.clone());
        }
    }

    /// The statistics of the frame that was added last.
    pub fn latest_statistics(&self) -> Option<&FrameStatistics> {
        self.latest_statistics.as_ref()
    }

    /// The frames, the oldest first.
    pub fn frames(&self) -> impl DoubleEndedIterator<Item = &FrameRecord> + ExactSizeIterator {
        self.frames.iter()
    }

    /// The number of the frame that is shown whatever follows; `None` if the latest one is.
    pub fn selected(&self) -> Option<u64> {
        self.selected.filter(|_| self.shown().is_some_and(|shown| Some(shown.number) == self.selected))
    }

    /// Shows this frame from now on, as long as it is kept, or always the latest one.
    pub fn select(&mut self, number: Option<u64>) {
        self.selected = number;
    }

    /// The frame that is shown. The latest one is the last but one that was added, whose submission has ended.
    pub fn shown(&self) -> Option<&FrameRecord> {
        let selected = self.frames.iter().find(|record| Some(record.number) == self.selected);
        selected.or_else(|| self.frames.iter().rev().filter(|record| record.has_ended()).nth(1)).or(self.frames.back())
    }

    /// The record of a frame, new if it is later than all others; `None` if it is no longer kept.
    fn record(&mut self, number: u64) -> Option<&mut FrameRecord> {
        if self.frames.back().is_none_or(|latest| latest.number < number) {
            // The frame that is looked at stays.
            let is_selected = |record: &FrameRecord| Some(record.number) == self.selected;
            if self.frames.len() >= Self::LENGTH {
                let oldest = usize::from(self.frames.front().is_some_and(is_selected));
                self.frames.remove(oldest);
            }
            self.frames.push_back(FrameRecord { number, ..FrameRecord::default() });
        }
        let index = self.frames.binary_search_by_key(&number, |record| record.number).ok()?;
        self.frames.get_mut(index)
    }
}

impl FrameRecord {
    /// From its first event to its last one.
    pub fn duration(&self) -> Duration {
        self.log.frames.first().map_or(Duration::ZERO, |frame| frame.ended.saturating_sub(frame.began))
    }

    /// When it began.
    pub fn began(&self) -> Duration {
        self.log.frames.first().map_or(Duration::ZERO, |frame| frame.began)
    }

    /// Its run with the most nodes: that of the frame's stage graph.
    pub fn main_run(&self) -> Option<&Run> {
        self.log.runs.iter().filter(|run| !run.in_background).max_by_key(|run| run.graph.nodes.len())
    }

    /// The thread time that one view took.
    pub fn view_time(&self, view: &str) -> Duration {
        let runs = self.log.runs.iter();
        let chunks = runs.flat_map(|run| run.chunks.iter().map(|chunk| (&run.graph.nodes[chunk.node], chunk)));
        chunks.filter(|(node, _)| node.labels.view.as_deref() == Some(view)).map(|(_, chunk)| chunk.duration()).sum()
    }

    fn has_ended(&self) -> bool {
        !self.log.runs.is_empty()
    }

    /// Adds what a log says of this frame.
    fn append(&mut self, log: &Log) {
        self.log.runs.extend(log.runs_of(self.number).cloned());
        for span in log.spans_of(self.number) {
            let name = &log.threads[span.thread];
            let thread = self.log.threads.iter().position(|thread| thread == name).unwrap_or_else(|| {
                self.log.threads.push(name.clone());
                self.log.threads.len() - 1
            });
            self.log.spans.push(drawloom::timeline::Span { thread, ..span.clone() });
        }
        self.log.tuning.extend(log.tuning.iter().filter(|(frame, _)| *frame == self.number).cloned());
        self.log.dropped += log.all_dropped();
        let ends = self.log.runs.iter().map(|run| run.ended).chain(self.log.spans.iter().map(|span| span.ended));
        let ended = ends.max().unwrap_or_default();
        let reported = log.frames.iter().find(|frame| frame.number == self.number);
        if let Some(frame) = self.log.frames.first_mut() {
            frame.ended = frame.ended.max(ended);
        } else if let Some(frame) = reported {
            self.log.frames.push(Frame { ended: frame.ended.max(ended), ..*frame });
        }
        let Some(&Frame { began, ended, .. }) = self.log.frames.first() else { return };
        self.log.workers.resize_with(log.workers.len(), Default::default);
        for (own, worker) in self.log.workers.iter_mut().zip(&log.workers) {
            own.name.clone_from(&worker.name);
            own.idle.extend(worker.idle.iter().filter(|idle| idle.began < ended && idle.ended > began));
        }
    }
}
