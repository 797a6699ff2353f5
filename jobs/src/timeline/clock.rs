//! The timeline's clock: the processor's time-stamp counter, the system's clock, or the engine's.
//!
//! Workers record raw *timestamps*. They are converted to nanoseconds, all at the same rate, when a log is taken.

use std::sync::OnceLock;
use std::thread;
use std::time::Duration;

use super::ticks;
use crate::sync::{AtomicU64, Instant, Ordering};
use crate::unwind::{Contained, JobPanic, catch, emit};

/// The source of timestamps.
pub(super) enum Clock {
    Machine(MachineClock),
    Engine(EngineClock),
}

/// The processor's counter and the system's clock.
pub(super) struct MachineClock {
    /// When the scheduler was built.
    built: Reading,
    /// The nanoseconds in a tick of the processor's counter, times 2³²; 0 if the counter cannot be used. Measured on
    /// first use.
    tick: OnceLock<u64>,
}

/// A simultaneous reading of the system's clock and the counter.
#[derive(Clone, Copy)]
struct Reading {
    time: Instant,
    ticks: u64,
}

impl Clock {
    /// The machine's clock, starting now.
    pub(super) fn of_this_machine() -> Self {
        Self::Machine(MachineClock { built: Reading::now(), tick: OnceLock::new() })
    }

    #[inline]
    pub(super) fn reader(&self) -> ClockReader<'_> {
        match self {
            Self::Machine(machine) if machine.tick() > 0 => ClockReader::Counter { built: machine.built.ticks },
            Self::Machine(machine) => ClockReader::System { built: machine.built.time },
            Self::Engine(clock) => ClockReader::Engine(clock),
        }
    }

    /// The message of the engine's clock's panic, if it panicked.
    pub(super) fn panic_message(&self) -> Option<&str> {
        match self {
            Self::Machine(_) => None,
            Self::Engine(clock) => clock.panic.get().map(|panic| panic.message.as_str()),
        }
    }

    /// Converts a timestamp.
    pub(super) fn time(&self, timestamp: u64) -> Duration {
        let nanoseconds = match self {
            Self::Machine(machine) if machine.tick() > 0 => {
                ((u128::from(timestamp) * u128::from(machine.tick())) >> 32).try_into().unwrap_or(u64::MAX)
            }
            _ => timestamp,
        };
        Duration::from_nanos(nanoseconds)
    }

    /// The time.
    pub(super) fn now(&self) -> Duration {
        self.time(self.reader().read_ordered())
    }
}

impl MachineClock {
    /// The counter is compared with the system's clock over at least this time. The error is then a few parts per
    /// million.
    const MIN_COMPARISON: Duration = Duration::from_millis(10);

    #[inline]
    fn tick(&self) -> u64 {
        *self.tick.get_or_init(|| self.measure_tick())
    }

    #[cold]
    fn measure_tick(&self) -> u64 {
        if !ticks::is_reliable() {
            return 0;
        }
        thread::sleep(Self::MIN_COMPARISON.saturating_sub(self.built.time.elapsed()));
        let now = Reading::now();
        let time = now.time.duration_since(self.built.time).as_nanos() << 32;
        let ticks = u128::from(now.ticks.saturating_sub(self.built.ticks));
        time.checked_div(ticks).and_then(|tick| tick.try_into().ok()).unwrap_or(0)
    }
}

/// The function that the engine supplies as a clock.
pub(crate) type ClockFn = Contained<Box<dyn Fn() -> Duration + Send + Sync>>;

/// A clock that the engine supplies. Workers read it between two jobs, where a panic must not unwind.
///
/// If it panics, it is not called again, and time stops at its latest reading.
pub(super) struct EngineClock {
    call: ClockFn,
    /// The latest reading of any thread. Relaxed: it hands nothing over.
    latest: AtomicU64,
    panic: OnceLock<JobPanic>,
}

impl EngineClock {
    pub(super) fn new(call: ClockFn) -> Self {
        Self { call, latest: AtomicU64::new(0), panic: OnceLock::new() }
    }

    pub(super) fn read(&self) -> u64 {
        if self.panic.get().is_none() {
            match catch(|| (self.call)()) {
                Ok(time) => {
                    let timestamp = nanoseconds(time);
                    self.latest.fetch_max(timestamp, Ordering::Relaxed);
                    return timestamp;
                }
                Err(panic) => self.stop(panic),
            }
        }
        self.latest.load(Ordering::Relaxed)
    }

    #[cold]
    fn stop(&self, panic: JobPanic) {
        let message = panic.message.clone();
        // If several threads' readings panic at once, the first is reported.
        if self.panic.set(panic).is_ok() {
            emit(
                || tracing::error!(target: "drawloom", message = %message, "the timeline's clock panicked, so its time stands still"),
            );
        }
    }
}

impl Reading {
    /// Enough tries that the thread is not preempted between the two readings in at least one of them.
    const TRIES: usize = 8;

    fn now() -> Self {
        let one = || {
            let before = ticks::read_ordered();
            let time = Instant::now();
            let after = ticks::read_ordered();
            (after.saturating_sub(before), Self { time, ticks: before + after.saturating_sub(before) / 2 })
        };
        let first = one();
        (1..Self::TRIES).map(|_| one()).fold(first, |best, next| if next.0 < best.0 { next } else { best }).1
    }
}

/// Reads a clock, whose kind is determined once and not at every reading.
#[derive(Clone, Copy)]
pub(super) enum ClockReader<'clock> {
    Counter { built: u64 },
    System { built: Instant },
    Engine(&'clock EngineClock),
}

impl ClockReader<'_> {
    /// The current time, or the time a few nanoseconds ago: the processor may read the counter early.
    #[inline]
    pub(super) fn read(self) -> u64 {
        match self {
            Self::Counter { built } => ticks::read().saturating_sub(built),
            other => other.read_ordered(),
        }
    }

    /// The current time. It is not earlier than what another thread read before this thread saw that thread's work.
    #[inline]
    pub(super) fn read_ordered(self) -> u64 {
        match self {
            Self::Counter { built } => ticks::read_ordered().saturating_sub(built),
            Self::System { built } => nanoseconds(built.elapsed()),
            Self::Engine(clock) => clock.read(),
        }
    }
}

/// Saturates after 73 years, because an event uses three bits of a timestamp for its tag.
#[inline]
fn nanoseconds(time: Duration) -> u64 {
    // Faster than `as_nanos`, which computes with 128 bits.
    let nanoseconds = time.as_secs().saturating_mul(1_000_000_000).saturating_add(u64::from(time.subsec_nanos()));
    nanoseconds.min(u64::MAX >> 3)
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU64, Ordering};
    use std::thread;
    use std::time::{Duration, Instant};

    use super::{Clock, EngineClock};
    use crate::unwind::Contained;

    #[test]
    fn the_counter_agrees_with_the_systems_clock() {
        let clock = Clock::of_this_machine();
        for _round in 0..5 {
            let (start, began) = (Instant::now(), clock.now());
            thread::sleep(Duration::from_millis(20));
            let (ended, took) = (clock.now(), start.elapsed());
            let (min, max) = (Duration::from_millis(20).mul_f64(0.999), took.mul_f64(1.001));
            assert!((min..max).contains(&(ended - began)), "{:?} of {took:?}", ended - began);
        }
    }

    #[test]
    fn timestamps_of_one_thread_ascend() {
        let clock = Clock::of_this_machine();
        let reader = clock.reader();
        let count = if cfg!(miri) { 100 } else { 10_000 };
        let timestamps: Vec<_> = (0..count).map(|_| (reader.read_ordered(), reader.read_ordered())).collect();
        assert!(timestamps.iter().all(|(before, after)| before <= after));
        assert!(timestamps.is_sorted());
        assert!(clock.time(timestamps[0].0) < clock.time(timestamps[count - 1].1));
    }

    #[test]
    fn an_engines_clock_is_used_unchanged() {
        let clock = Clock::Engine(EngineClock::new(Contained::new(Box::new(|| Duration::new(3, 7)))));
        assert_eq!(clock.now(), Duration::new(3, 7));
        assert_eq!(clock.reader().read(), 3_000_000_007);
        assert_eq!(clock.panic_message(), None);
    }

    #[test]
    fn a_clock_that_panics_stands_still_and_is_not_called_again() {
        let calls = Arc::new(AtomicU64::new(0));
        let clock = Clock::Engine(EngineClock::new(Contained::new(Box::new({
            let calls = Arc::clone(&calls);
            move || match calls.fetch_add(1, Ordering::Relaxed) {
                0 => Duration::from_secs(5),
                _ => panic!("as planned"),
            }
        }))));
        assert_eq!([(); 4].map(|()| clock.now()), [Duration::from_secs(5); 4]);
        assert_eq!(clock.panic_message(), Some("as planned"));
        assert_eq!(calls.load(Ordering::Relaxed), 2);
    }
}
