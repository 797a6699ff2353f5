//! The period of the device's ticks.

/// How long a tick of the device's clock is.
#[derive(Clone, Copy)]
pub(crate) struct TickPeriod {
    /// In 2⁻³² ns: fixed point, because some devices count from 1970, and a float of that has an error of hundreds of
    /// nanoseconds.
    period: u128,
}

impl TickPeriod {
    pub(crate) fn new(nanoseconds: f32) -> Self {
        Self { period: (f64::from(nanoseconds) * 2_f64.powi(32)) as u128 }
    }

    /// This many ticks in nanoseconds; `None` after 584 years.
    pub(crate) fn nanoseconds(self, ticks: u64) -> Option<u64> {
        let product = u128::from(ticks).checked_mul(self.period)?;
        u64::try_from(product >> 32).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_tick_counts_convert_without_losing_a_nanosecond() {
        let epoch = 1_700_000_000_000_000_001;
        assert_eq!(TickPeriod::new(1.0).nanoseconds(epoch), Some(epoch));
        assert_eq!(TickPeriod::new(2.0).nanoseconds(epoch), Some(epoch * 2));
        assert_eq!(TickPeriod::new(0.25).nanoseconds(41), Some(10));
        assert_eq!(TickPeriod::new(1000.0).nanoseconds(epoch), None);
        let coarse = TickPeriod::new(83.333_336);
        assert!((0..1000).map(|tick| coarse.nanoseconds(tick * 1_000_003)).is_sorted());
        assert_eq!(coarse.nanoseconds(12_000_000).map(|time| time / 1000), Some(1_000_000));
    }
}
