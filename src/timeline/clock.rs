//! The clock that a timeline reads.

use std::{fmt, time::Duration};

use crate::sync::Instant;

/// What tells the time, since some moment.
pub(super) enum Clock {
    System(Instant),
    Other(Box<dyn Fn() -> Duration + Send + Sync>),
}

impl Clock {
    /// Nanoseconds. More than 584 years are not told from that many.
    #[inline]
    pub(super) fn now(&self) -> u64 {
        match self {
            Self::System(start) => nanoseconds(start.elapsed()),
            Self::Other(clock) => nanoseconds(clock()),
        }
    }
}

#[inline]
fn nanoseconds(time: Duration) -> u64 {
    // Without the detour over 128 bits, which costs more than the rest.
    time.as_secs().saturating_mul(1_000_000_000).saturating_add(u64::from(time.subsec_nanos()))
}

impl fmt::Debug for Clock {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::System(_) => "System",
            Self::Other(_) => "Other",
        })
    }
}
