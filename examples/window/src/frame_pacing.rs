//! How evenly frames follow each other.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// The times between the latest frames.
#[derive(Debug, Default)]
pub struct FramePacing {
    last: Option<Instant>,
    intervals: VecDeque<Duration>,
}

impl FramePacing {
    const CAPACITY: usize = 120;

    /// A frame was presented.
    pub fn add_frame(&mut self, now: Instant) {
        if let Some(last) = self.last.replace(now) {
            if self.intervals.len() == Self::CAPACITY {
                self.intervals.pop_front();
            }
            self.intervals.push_back(now - last);
        }
    }

    /// No frame follows for a while, so the time until the next one does not count.
    pub fn pause(&mut self) {
        self.last = None;
    }

    /// The median and the longest time between two of the latest frames; `None` before there are two.
    pub fn median_and_longest(&self) -> Option<[Duration; 2]> {
        let mut sorted: Vec<_> = self.intervals.iter().copied().collect();
        sorted.sort();
        Some([*sorted.get(sorted.len() / 2)?, *sorted.last()?])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pauses_do_not_count_and_old_frames_are_forgotten() {
        let (mut pacing, mut now) = (FramePacing::default(), Instant::now());
        let mut add = |pacing: &mut FramePacing, milliseconds| {
            now += Duration::from_millis(milliseconds);
            pacing.add_frame(now);
        };
        add(&mut pacing, 0);
        assert_eq!(pacing.median_and_longest(), None);
        [10, 50, 20].into_iter().for_each(|milliseconds| add(&mut pacing, milliseconds));
        let [median, longest] = [20, 50].map(Duration::from_millis);
        assert_eq!(pacing.median_and_longest(), Some([median, longest]));
        pacing.pause();
        add(&mut pacing, 9_000);
        assert_eq!(pacing.median_and_longest(), Some([median, longest]));
        (0..FramePacing::CAPACITY).for_each(|_| add(&mut pacing, 16));
        assert_eq!(pacing.median_and_longest(), Some([Duration::from_millis(16); 2]));
    }
}
