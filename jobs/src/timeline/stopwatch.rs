//! Measures how long work takes, by the clock that costs are measured with.

use std::time::Duration;

use super::clock::{Clock, EngineClock};
use crate::sync::Instant;

/// Measures from its start by the clock that costs are measured with: the system's, or the engine's if it supplies one.
///
/// Not the processor's counter, whose rate is measured for 10 ms before the first reading.
#[derive(Clone, Copy)]
pub struct Stopwatch<'clock> {
    start: Start<'clock>,
}

/// When it started, by each clock.
#[derive(Clone, Copy)]
enum Start<'clock> {
    System(Instant),
    Engine(&'clock EngineClock, u64),
}

impl<'clock> Stopwatch<'clock> {
    /// Starts now.
    #[inline]
    pub(super) fn of(clock: &'clock Clock) -> Self {
        let start = match clock {
            Clock::Machine(_) => Start::System(Instant::now()),
            Clock::Engine(clock) => Start::Engine(clock, clock.read()),
        };
        Self { start }
    }

    /// Another stopwatch by the same clock, which starts now.
    #[inline]
    pub fn restarted(self) -> Self {
        let start = match self.start {
            Start::System(_) => Start::System(Instant::now()),
            Start::Engine(clock, _) => Start::Engine(clock, clock.read()),
        };
        Self { start }
    }

    /// The time since it started.
    #[inline]
    pub fn elapsed(self) -> Duration {
        match self.start {
            Start::System(start) => start.elapsed(),
            Start::Engine(clock, start) => Duration::from_nanos(clock.read().saturating_sub(start)),
        }
    }
}
