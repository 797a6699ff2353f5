//! Whether a run is worth sharing between workers.
//!
//! To share costs wake-ups, and cache lines that travel with every process that one worker makes ready and another runs. A
//! frame of little work is done sooner by the thread that has it. So each schedule remembers how long it took by itself and
//! how long shared, and how much work it is, and goes the way that is shorter.

use std::time::Duration;

/// What has been seen of a schedule's runs.
#[derive(Debug, Default)]
pub(super) struct Sharing {
    /// Nanoseconds on one thread.
    alone: Option<f64>,
    /// Nanoseconds on all workers.
    shared: Option<f64>,
    /// How many measured runs there were, and how many others since.
    measured: u32,
    since_measured: u32,
    is_alone: bool,
    /// How often in succession a run was too long to be finished alone.
    given_up: u32,
}

/// How a run is to go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Way {
    /// On the calling thread, unless there is a limit and it takes longer than that.
    Alone { at_most: Option<Duration> },
    /// On all workers.
    Shared { is_measured: bool },
}

/// The first runs are measured, and later ones every now and then.
const FIRST_MEASURED: u32 = 4;
const MEASURED_EVERY: u32 = 32;

/// The part of the latest run in an average, and how many times the average it may be: once in a while the system takes the
/// processor away, which says nothing of the next frame.
const WEIGHT: f64 = 0.125;
const OUTLIER: f64 = 2.0;

/// How much longer the way that was gone may be before it is left.
const RELUCTANCE: f64 = 1.25;

impl Sharing {
    /// The way of the next run, where a worker is woken at that price.
    pub(super) fn choose(&mut self, wake_price: Duration) -> Way {
        let limit = self.shared.unwrap_or(0.0).max(wake_price.as_nanos() as f64);
        self.is_alone = match self.alone {
            None => false,
            Some(alone) if self.is_alone => alone <= limit * RELUCTANCE,
            Some(alone) => alone * RELUCTANCE <= limit,
        };
        if self.is_alone {
            return Way::Alone { at_most: Some(Duration::from_nanos((limit * 2.0 * RELUCTANCE) as u64)) };
        }
        self.share()
    }

    /// The way of the next run if it is to be shared in any case.
    pub(super) fn share(&self) -> Way {
        Way::Shared { is_measured: self.measured < FIRST_MEASURED || self.since_measured + 1 >= MEASURED_EVERY }
    }

    /// A run went alone and took that long.
    pub(super) fn went_alone(&mut self, took: Duration) {
        self.given_up = 0;
        average(&mut self.alone, took);
    }

    /// A run was begun alone, and shared when it was found too long.
    pub(super) fn gave_up(&mut self) {
        self.given_up += 1;
        // Once may be the system's fault. Twice it is another frame than before, of which nothing is known.
        if self.given_up > 1 {
            *self = Self::default();
        }
    }

    /// A run was shared and took that long; where it was measured, all workers' time on it is known.
    pub(super) fn was_shared(&mut self, took: Duration, work: Option<Duration>) {
        average(&mut self.shared, took);
        match work {
            None => self.since_measured += 1,
            Some(work) => {
                self.measured += 1;
                self.since_measured = 0;
                // What it took in all would be what it takes alone, were there no clocks to be read.
                self.alone = None;
                average(&mut self.alone, work);
            }
        }
    }
}

fn average(average: &mut Option<f64>, latest: Duration) {
    let latest = latest.as_nanos() as f64;
    *average = Some(match *average {
        None => latest,
        Some(average) => average + WEIGHT * (latest.min(average * OUTLIER) - average),
    });
}
