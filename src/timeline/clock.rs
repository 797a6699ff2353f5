//! The clock that a timeline reads: the processor's counter, the system's clock, or an engine's.
//!
//! What is written down are *marks*, as the clock gives them, and only what is taken out is put into nanoseconds, all of it
//! by the same measure.

use std::{sync::OnceLock, thread, time::Duration};

use crate::{
    sync::{AtomicU64, Instant, Ordering},
    unwind::{JobPanic, catch, emit},
};

use super::ticks;

/// What tells the time.
pub(super) enum Clock {
    Machine(Machine),
    Engine(EngineClock),
}

/// The machine's clocks.
pub(super) struct Machine {
    /// When the scheduler was built.
    built: Moment,
    /// How many nanoseconds a tick of the processor's counter is, times 2³²; 0 where the counter is of no use. It is found out
    /// when it is first needed.
    tick: OnceLock<u64>,
}

/// A moment on both of the machine's clocks.
#[derive(Clone, Copy)]
struct Moment {
    time: Instant,
    ticks: u64,
}

impl Clock {
    /// The machine's, from now on.
    pub(super) fn of_this_machine() -> Self {
        Self::Machine(Machine { built: Moment::now(), tick: OnceLock::new() })
    }

    /// What reads it.
    #[inline]
    pub(super) fn reader(&self) -> Reader<'_> {
        match self {
            Self::Machine(machine) if machine.tick() > 0 => Reader::Counter { built: machine.built.ticks },
            Self::Machine(machine) => Reader::System { built: machine.built.time },
            Self::Engine(clock) => Reader::Engine(clock),
        }
    }

    /// What the engine's clock said when it panicked, if it did.
    pub(super) fn panic_message(&self) -> Option<&str> {
        match self {
            Self::Machine(_) => None,
            Self::Engine(clock) => clock.panic.get().map(|panic| panic.message.as_str()),
        }
    }

    /// What a mark is.
    pub(super) fn time(&self, mark: u64) -> Duration {
        let nanoseconds = match self {
            Self::Machine(machine) if machine.tick() > 0 => {
                ((u128::from(mark) * u128::from(machine.tick())) >> 32).try_into().unwrap_or(u64::MAX)
            }
            _ => mark,
        };
        Duration::from_nanos(nanoseconds)
    }

    /// The time.
    pub(super) fn now(&self) -> Duration {
        self.time(self.reader().in_order())
    }
}

impl Machine {
    /// The counter is compared with the system's clock over that time at least: it is right by some millionths then.
    const COMPARED_FOR: Duration = Duration::from_millis(10);

    #[inline]
    fn tick(&self) -> u64 {
        *self.tick.get_or_init(|| self.measured_tick())
    }

    #[cold]
    fn measured_tick(&self) -> u64 {
        if !ticks::is_steady() {
            return 0;
        }
        thread::sleep(Self::COMPARED_FOR.saturating_sub(self.built.time.elapsed()));
        let now = Moment::now();
        let time = now.time.duration_since(self.built.time).as_nanos() << 32;
        let ticks = u128::from(now.ticks.saturating_sub(self.built.ticks));
        time.checked_div(ticks).and_then(|tick| tick.try_into().ok()).unwrap_or(0)
    }
}

/// A clock that the engine supplies. Workers read it between two jobs, where no panic may pass.
///
/// If it panics, it is not called again, and time stands still at its latest reading.
pub(super) struct EngineClock {
    call: Box<dyn Fn() -> Duration + Send + Sync>,
    /// The mark of the latest reading of any thread. Relaxed: it hands nothing over.
    latest: AtomicU64,
    panic: OnceLock<JobPanic>,
}

impl EngineClock {
    pub(super) fn new(call: Box<dyn Fn() -> Duration + Send + Sync>) -> Self {
        Self { call, latest: AtomicU64::new(0), panic: OnceLock::new() }
    }

    fn read(&self) -> u64 {
        if self.panic.get().is_none() {
            match catch(&self.call) {
                Ok(time) => {
                    let mark = nanoseconds(time);
                    self.latest.fetch_max(mark, Ordering::Relaxed);
                    return mark;
                }
                Err(panic) => self.stop(panic),
            }
        }
        self.latest.load(Ordering::Relaxed)
    }

    #[cold]
    fn stop(&self, panic: JobPanic) {
        let message = panic.message.clone();
        // Of several threads whose readings panic at once, the first is reported.
        if self.panic.set(panic).is_ok() {
            emit(|| tracing::error!(message = %message, "the timeline's clock panicked, and time stands still"));
        }
    }
}

impl Moment {
    /// In some tries, nobody comes between the two readings at least once.
    const TRIES: usize = 8;

    fn now() -> Self {
        let one = || {
            let before = ticks::read_in_order();
            let time = Instant::now();
            let after = ticks::read_in_order();
            (after.saturating_sub(before), Self { time, ticks: before + after.saturating_sub(before) / 2 })
        };
        let first = one();
        (1..Self::TRIES).map(|_| one()).fold(first, |best, next| if next.0 < best.0 { next } else { best }).1
    }
}

/// Reads a clock.
#[derive(Clone, Copy)]
pub(super) enum Reader<'clock> {
    Counter { built: u64 },
    System { built: Instant },
    Engine(&'clock EngineClock),
}

impl Reader<'_> {
    /// The mark of this moment, or of one some nanoseconds before.
    #[inline]
    pub(super) fn read(self) -> u64 {
        match self {
            Self::Counter { built } => ticks::read().saturating_sub(built),
            other => other.in_order(),
        }
    }

    /// The mark of this moment. Whatever another thread marked before this one saw what it did is not later.
    #[inline]
    pub(super) fn in_order(self) -> u64 {
        match self {
            Self::Counter { built } => ticks::read_in_order().saturating_sub(built),
            Self::System { built } => nanoseconds(built.elapsed()),
            Self::Engine(clock) => clock.read(),
        }
    }
}

/// More than 73 years are not told from that many: three bits of a mark are for something else.
#[inline]
fn nanoseconds(time: Duration) -> u64 {
    // Without the detour over 128 bits, which costs more than the rest.
    let nanoseconds = time.as_secs().saturating_mul(1_000_000_000).saturating_add(u64::from(time.subsec_nanos()));
    nanoseconds.min(u64::MAX >> 3)
}

#[cfg(all(test, not(any(drawloom_loom, drawloom_shuttle))))]
mod tests {
    use std::{
        sync::{
            Arc,
            atomic::{AtomicU64, Ordering},
        },
        thread,
        time::{Duration, Instant},
    };

    use super::{Clock, EngineClock};

    #[test]
    fn the_machines_clock_keeps_the_systems_time() {
        let clock = Clock::of_this_machine();
        for _round in 0..5 {
            let (start, began) = (Instant::now(), clock.now());
            thread::sleep(Duration::from_millis(20));
            let (ended, took) = (clock.now(), start.elapsed());
            let (least, most) = (Duration::from_millis(20).mul_f64(0.999), took.mul_f64(1.001));
            assert!((least..most).contains(&(ended - began)), "{:?} of {took:?}", ended - began);
        }
    }

    #[test]
    fn marks_of_one_thread_ascend() {
        let clock = Clock::of_this_machine();
        let reader = clock.reader();
        let marks: Vec<_> = (0..10_000).map(|_| (reader.in_order(), reader.in_order())).collect();
        assert!(marks.iter().all(|(before, after)| before <= after));
        assert!(marks.is_sorted());
        assert!(clock.time(marks[0].0) < clock.time(marks[9_999].1));
    }

    #[test]
    fn an_engines_clock_is_taken_as_it_is() {
        let clock = Clock::Engine(EngineClock::new(Box::new(|| Duration::new(3, 7))));
        assert_eq!(clock.now(), Duration::new(3, 7));
        assert_eq!(clock.reader().read(), 3_000_000_007);
        assert_eq!(clock.panic_message(), None);
    }

    #[test]
    fn a_clock_that_panics_stands_still_and_is_not_called_again() {
        let calls = Arc::new(AtomicU64::new(0));
        let clock = Clock::Engine(EngineClock::new(Box::new({
            let calls = Arc::clone(&calls);
            move || match calls.fetch_add(1, Ordering::Relaxed) {
                0 => Duration::from_secs(5),
                _ => panic!("as planned"),
            }
        })));
        assert_eq!([(); 4].map(|()| clock.now()), [Duration::from_secs(5); 4]);
        assert_eq!(clock.panic_message(), Some("as planned"));
        assert_eq!(calls.load(Ordering::Relaxed), 2);
    }
}
