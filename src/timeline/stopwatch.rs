//! Measures how long work takes, by the clock that costs are measured with.

use std::time::Duration;

use super::clock::{Clock, EngineClock};
use crate::sync::Instant;

/// A moment, and the clock that told it: the system's, or the engine's if it supplies one.
///
/// Not the processor's counter, whose rate is measured for 10 ms before the first reading.
#[derive(Clone, Copy)]
pub(crate) struct Stopwatch<'clock> {
    start: Moment<'clock>,
}

#[derive(Clone, Copy)]
enum Moment<'clock> {
    System(Instant),
    Engine(&'clock EngineClock, u64),
}

impl<'clock> Stopwatch<'clock> {
    /// Starts now.
    #[inline]
    pub(super) fn of(clock: &'clock Clock) -> Self {
        let start = match clock {
            Clock::Machine(_) => Moment::System(Instant::now()),
            Clock::Engine(clock) => Moment::Engine(clock, clock.read()),
        };
        Self { start }
    }

    /// Another stopwatch by the same clock, which starts now.
    #[inline]
    pub(crate) fn restarted(self) -> Self {
        let start = match self.start {
            Moment::System(_) => Moment::System(Instant::now()),
            Moment::Engine(clock, _) => Moment::Engine(clock, clock.read()),
        };
        Self { start }
    }

    /// The time since it started.
    #[inline]
    pub(crate) fn elapsed(self) -> Duration {
        match self.start {
            Moment::System(start) => start.elapsed(),
            Moment::Engine(clock, start) => Duration::from_nanos(clock.read().saturating_sub(start)),
        }
    }
}
