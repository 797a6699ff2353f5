//! What may be uploaded from one frame to the next.

use std::time::{Duration, Instant};

/// How many bytes may be uploaded until the next frame, and how long that may take.
pub(super) struct UploadBudget {
    bytes: u64,
    began: Instant,
    time: Duration,
    has_begun: bool,
}

impl UploadBudget {
    /// The bytes of a portion: so small that a job looks at the time often.
    const PORTION: u64 = 1 << 18;

    /// An upload budget of bytes within a time that begins now.
    pub(super) fn new(bytes: u64, time: Duration) -> Self {
        Self { bytes, began: Instant::now(), time, has_begun: false }
    }

    /// Takes at most `bytes`, a multiple of `unit`, which `bytes` is, too. 0 if nothing is allowed any more. The first
    /// portion is allowed at any time, and is a unit at least, so that something is uploaded even if the time is over
    /// before it begins, or the bytes are too few.
    pub(super) fn take(&mut self, bytes: u64, unit: u64) -> u64 {
        let least = if self.has_begun || self.bytes == 0 { 0 } else { unit };
        let taken = (bytes.min(Self::PORTION.max(unit)).min(self.bytes) / unit * unit).max(least.min(bytes));
        if taken == 0 || self.is_late() {
            return 0;
        }
        self.bytes = self.bytes.saturating_sub(taken);
        self.has_begun = true;
        taken
    }

    /// Whether the time is over, or there are too few bytes for any portion.
    pub(super) fn is_over(&self) -> bool {
        self.bytes < 4 || self.is_late()
    }

    pub(super) fn bytes(&self) -> u64 {
        self.bytes
    }

    fn is_late(&self) -> bool {
        // The end of the time may be none that an `Instant` can be.
        self.has_begun && self.began.elapsed() >= self.time
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn portions_are_whole_units_and_add_up_to_the_bytes() {
        let mut upload_budget = UploadBudget::new(1_000_003, Duration::MAX);
        let mut sum = 0;
        while !upload_budget.is_over() {
            let taken = upload_budget.take(1 << 40, 12);
            if taken == 0 {
                break;
            }
            assert!(taken.is_multiple_of(12) && taken <= UploadBudget::PORTION);
            sum += taken;
        }
        assert_eq!(sum, 1_000_003 / 12 * 12);
        assert_eq!(sum + upload_budget.bytes(), 1_000_003);
    }

    #[test]
    fn one_portion_is_allowed_when_the_time_is_over() {
        let mut upload_budget = UploadBudget::new(100, Duration::ZERO);
        assert_eq!((upload_budget.take(8, 4), upload_budget.take(8, 4), upload_budget.is_over()), (8, 0, true));
    }

    #[test]
    fn the_first_portion_is_a_unit_even_if_that_takes_more_bytes() {
        let mut upload_budget = UploadBudget::new(100, Duration::MAX);
        assert_eq!(
            (upload_budget.take(900, 300), upload_budget.take(600, 300), upload_budget.is_over()),
            (300, 0, true)
        );
    }
}
