//! The latest frames.

use std::collections::VecDeque;
use std::time::Duration;

use drawloom::FrameStatistics;
use drawloom::timeline::{Frame, Idle, Log, Run, Span, WorkerLog};

/// The latest frames of one scheduler, and which of them is shown.
#[derive(Debug, Default)]
pub struct FrameHistory {
    frames: VecDeque<FrameRecord>,
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

    /// Adds what was recorded since the log before. What a log reports of an earlier frame, as its submission, is added
    /// to that.
    pub fn add_log(&mut self, log: Log) {
        let skipped = log.frames.len().saturating_sub(Self::LENGTH);
        let frames = &log.frames[skipped..];
        for (index, frame) in frames.iter().enumerate() {
            let is_newest = index + 1 == frames.len();
            self.begin(frame.number);
            if let Some(record) = self.record(frame.number) {
                record.extend_to(frame);
                // A worker may fall asleep before the newest frame goes on.
                record
                    .add_idle(&log.workers, |idle| idle.ended > frame.began && (is_newest || idle.began < frame.ended));
                if is_newest {
                    record.log.dropped += log.all_dropped();
                }
            }
        }
        for run in log.runs {
            if let Some(record) = self.record(run.frame) {
                record.log.runs.push(run);
            }
        }
        for span in log.spans {
            if let Some(record) = self.record(span.frame) {
                record.add_span(span, &log.threads);
            }
        }
        for (number, tuning) in log.tuning {
            if let Some(record) = self.record(number) {
                record.log.tuning.push((number, tuning));
            }
        }
    }

    /// Adds the statistics of a frame, by the timeline's number of it.
    pub fn add_statistics(&mut self, number: u64, statistics: &FrameStatistics) {
        self.begin(number);
        if let Some(record) = self.record(number) {
            record.statistics = Some(statistics.clone());
        }
    }

    /// The frames that have ended, the latest first: all but the one that was added last, which is not submitted yet.
    pub fn ended(&self) -> impl Iterator<Item = &FrameRecord> {
        self.frames.iter().rev().skip(1)
    }

    /// The number of the frame that was selected; `None` if the latest one is shown.
    pub fn selected(&self) -> Option<u64> {
        self.selected.filter(|&number| self.frames.iter().any(|record| record.number == number))
    }

    /// Shows this frame from now on, or always the latest one that has ended.
    pub fn select(&mut self, number: Option<u64>) {
        self.selected = number;
    }

    /// The frame that is shown.
    pub fn shown(&self) -> Option<&FrameRecord> {
        let selected = self.frames.iter().find(|record| Some(record.number) == self.selected);
        selected.or_else(|| self.ended().next()).or(self.frames.back())
    }

    /// Makes a record of a frame that is later than all others. Beyond the length the oldest one goes, unless it is
    /// selected.
    fn begin(&mut self, number: u64) {
        let latest = self.frames.back().map(|latest| latest.number);
        // A scheduler that is new counts from 0 again.
        if latest.is_some_and(|latest| number + Self::LENGTH as u64 <= latest) {
            self.frames.clear();
            self.selected = None;
        } else if latest.is_some_and(|latest| number <= latest) {
            return;
        }
        if self.frames.len() >= Self::LENGTH {
            let keeps_oldest = self.frames.front().is_some_and(|oldest| Some(oldest.number) == self.selected);
            self.frames.remove(usize::from(keeps_oldest));
        }
        self.frames.push_back(FrameRecord { number, ..FrameRecord::default() });
    }

    fn record(&mut self, number: u64) -> Option<&mut FrameRecord> {
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

    /// The run of the frame's stage graph: the largest one with stages.
    pub fn stage_run(&self) -> Option<&Run> {
        let has_stages = |run: &&Run| run.graph.nodes.iter().any(|node| node.labels.stage.is_some());
        self.log.runs.iter().filter(has_stages).max_by_key(|run| run.graph.nodes.len())
    }

    /// The thread time that the views of a name took.
    pub fn view_time(&self, view: &str) -> Duration {
        let runs = self.log.runs.iter();
        let chunks = runs.flat_map(|run| run.chunks.iter().map(|chunk| (&run.graph.nodes[chunk.node], chunk)));
        chunks.filter(|(node, _)| node.labels.view.as_deref() == Some(view)).map(|(_, chunk)| chunk.duration()).sum()
    }

    fn extend_to(&mut self, reported: &Frame) {
        match self.log.frames.first_mut() {
            Some(frame) => {
                frame.began = frame.began.min(reported.began);
                frame.ended = frame.ended.max(reported.ended);
            }
            None => self.log.frames.push(*reported),
        }
    }

    fn add_idle(&mut self, workers: &[WorkerLog], is_of_frame: impl Fn(&Idle) -> bool) {
        self.log.workers.resize_with(workers.len(), WorkerLog::default);
        for (own, worker) in self.log.workers.iter_mut().zip(workers) {
            own.name.clone_from(&worker.name);
            own.idle.extend(worker.idle.iter().filter(|idle| is_of_frame(idle)));
        }
    }

    /// Adds a span, whose thread is among `threads`.
    fn add_span(&mut self, span: Span, threads: &[String]) {
        let Some(name) = threads.get(span.thread) else { return };
        let known = self.log.threads.iter().position(|thread| thread == name);
        let thread = known.unwrap_or_else(|| {
            self.log.threads.push(name.clone());
            self.log.threads.len() - 1
        });
        self.log.spans.push(Span { thread, ..span });
    }
}

#[cfg(test)]
mod tests {
    use drawloom::timeline::IdleKind;

    use super::*;

    fn micros(time: u64) -> Duration {
        Duration::from_micros(time)
    }

    fn frame(number: u64, began: u64, ended: u64) -> Frame {
        Frame { number, began: micros(began), ended: micros(ended) }
    }

    fn span(name: &str, thread: usize, frame: u64, began: u64, ended: u64) -> Span {
        Span { name: name.into(), thread, frame, began: micros(began), ended: micros(ended) }
    }

    fn asleep(began: u64, ended: u64) -> Idle {
        Idle { kind: IdleKind::Asleep, began: micros(began), ended: micros(ended) }
    }

    fn worker(idle: &[Idle]) -> WorkerLog {
        WorkerLog { name: "worker".into(), idle: idle.to_vec(), dropped: 0 }
    }

    #[test]
    fn a_frame_whose_log_comes_in_two_parts_is_whole() {
        let mut history = FrameHistory::default();
        history.add_log(Log {
            frames: vec![frame(0, 100, 200)],
            threads: vec!["main".into()],
            spans: vec![span("record", 0, 0, 100, 200)],
            // It falls asleep when the frame was recorded.
            workers: vec![worker(&[asleep(50, 120), asleep(201, 210)])],
            dropped: 3,
            ..Log::default()
        });
        history.add_log(Log {
            frames: vec![frame(0, 220, 240), frame(1, 300, 320)],
            threads: vec!["other".into(), "main".into()],
            spans: vec![span("submit", 1, 0, 220, 240), span("record", 1, 1, 300, 320)],
            workers: vec![worker(&[asleep(210, 230), asleep(250, 310)])],
            dropped: 2,
            ..Log::default()
        });
        let first = history.ended().next().unwrap();
        assert_eq!((first.number, first.began(), first.duration()), (0, micros(100), micros(140)));
        assert_eq!(first.log.threads, ["main"]);
        assert_eq!(first.log.spans, [span("record", 0, 0, 100, 200), span("submit", 0, 0, 220, 240)]);
        assert_eq!(first.log.workers[0].idle, [asleep(50, 120), asleep(201, 210), asleep(210, 230)]);
        let [first, second] = [0, 1].map(|index| &history.frames[index]);
        assert_eq!((first.log.dropped, second.log.dropped), (3, 2));
        assert_eq!(second.log.workers[0].idle, [asleep(250, 310)]);
    }

    #[test]
    fn a_background_run_does_not_make_its_frame_longer() {
        let mut history = FrameHistory::default();
        history.add_log(Log { frames: vec![frame(0, 100, 200), frame(1, 300, 400)], ..Log::default() });
        let run = Run { frame: 0, ended: micros(9_000), in_background: true, ..Run::default() };
        history.add_log(Log { runs: vec![run], ..Log::default() });
        let first = history.ended().next().unwrap();
        assert_eq!((first.duration(), first.log.runs.len()), (micros(100), 1));
    }

    #[test]
    fn old_frames_go_and_the_selected_one_stays() {
        let mut history = FrameHistory::default();
        let numbers = |numbers: std::ops::Range<u64>| Log {
            frames: numbers.map(|number| frame(number, number * 10, number * 10 + 5)).collect(),
            ..Log::default()
        };
        history.add_log(numbers(0..10));
        history.select(Some(4));
        history.add_log(numbers(10..1_000));
        assert_eq!(history.frames.len(), FrameHistory::LENGTH);
        assert_eq!(history.shown().unwrap().number, 4);
        history.select(None);
        assert_eq!(history.shown().unwrap().number, 998);
        // Another scheduler.
        history.add_log(numbers(0..3));
        assert_eq!(history.frames.iter().map(|record| record.number).collect::<Vec<_>>(), [0, 1, 2]);
    }
}
