//! The running average of a measured cost.

/// The running average of a measured cost, in nanoseconds for whatever is measured: an item, a batch, a run.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Estimate {
    average: f32,
    /// The larger of the first two samples, until the third decides between them.
    larger: f32,
    samples: u32,
    /// How many of the latest samples in a row were outliers.
    outliers: u32,
}

/// How an estimate weighs its samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Filter {
    /// The time constant of the average in samples: the latest sample has one part in this many.
    time_constant: f32,
    /// A sample counts as at most this multiple of the average,
    max_rise: f32,
    /// and as at least the average divided by this.
    max_fall: f32,
}

impl Filter {
    /// A filter for samples of which there is one each frame or run.
    pub(crate) const fn frequent(time_constant: f32) -> Self {
        Self { time_constant, max_rise: Estimate::OUTLIER_LIMIT, max_fall: f32::INFINITY }
    }

    /// A filter for samples between which there are many frames or runs: none is taken for an outlier.
    pub(crate) const fn rare(time_constant: f32) -> Self {
        Self { time_constant, max_rise: f32::INFINITY, max_fall: f32::INFINITY }
    }

    /// As this one, but a sample counts as at least the average divided by `max_fall`.
    pub(crate) const fn with_max_fall(self, max_fall: f32) -> Self {
        Self { max_fall, ..self }
    }
}

impl Estimate {
    /// A sample counts as at most this multiple of the average: now and then the operating system preempts a worker, which says
    /// nothing about the next sample.
    pub(crate) const OUTLIER_LIMIT: f32 = 1.6;

    /// This many outliers in a row are no outliers but a step. Another program may take a processor for a few frames in a row;
    /// this is more.
    pub(crate) const STEP_SAMPLES: u32 = 8;

    /// The samples of which the average begins as the median: enough to tolerate one outlier.
    pub(crate) const FIRST_SAMPLES: u32 = 3;

    /// An estimate that begins as if it had this average for some time.
    pub(crate) const fn settled_at(average: f32) -> Self {
        Self { average, larger: average, samples: Self::FIRST_SAMPLES, outliers: 0 }
    }

    /// The estimated cost; `None` before the first sample.
    pub(crate) fn get(self) -> Option<f32> {
        (self.samples > 0).then_some(self.average)
    }

    /// Whether the estimate has enough samples to tolerate an outlier among them.
    pub(crate) fn is_settled(self) -> bool {
        self.samples >= Self::FIRST_SAMPLES
    }

    /// Adds a sample. Returns true if it shows a step: the cost has risen for good, and the estimate starts over.
    pub(crate) fn add(&mut self, sample: f32, filter: Filter) -> bool {
        match self.samples {
            0 => (self.average, self.larger) = (sample, sample),
            1 => (self.average, self.larger) = (self.average.min(sample), self.average.max(sample)),
            2 => self.average = sample.clamp(self.average, self.larger),
            _ => {
                let limit = self.average * filter.max_rise;
                self.outliers = if sample > limit { self.outliers + 1 } else { 0 };
                if self.outliers >= Self::STEP_SAMPLES {
                    *self = Self { average: sample, larger: sample, samples: 1, outliers: 0 };
                    return true;
                }
                let counted = sample.min(limit).max(self.average / filter.max_fall);
                self.average += (counted - self.average) / filter.time_constant;
            }
        }
        self.samples = self.samples.saturating_add(1);
        false
    }
}

#[cfg(all(test, not(drawloom_loom)))]
mod tests {
    use super::*;
    use crate::tuning::signal::Signal;

    const FILTER: Filter = Filter::frequent(8.0);

    /// The estimate after each sample.
    fn estimates(samples: impl IntoIterator<Item = f32>) -> Vec<f32> {
        let mut estimate = Estimate::default();
        let add = |sample| {
            estimate.add(sample, FILTER);
            estimate.get().unwrap()
        };
        samples.into_iter().map(add).collect()
    }

    #[test]
    fn the_first_estimates_are_the_smaller_sample_and_the_median() {
        assert_eq!(Estimate::default().get(), None);
        assert_eq!(estimates([50.0, 7.0, 9.0]), [50.0, 7.0, 9.0]);
        assert_eq!(estimates([7.0, 50.0, 90.0]), [7.0, 7.0, 50.0]);
        assert_eq!(estimates([7.0, 50.0, 3.0]), [7.0, 7.0, 7.0]);
    }

    #[test]
    fn noise_is_averaged_and_outliers_hardly_count() {
        let mut signal = Signal::new(1).with_noise(0.3).with_outliers(20, 50.0);
        for estimate in &estimates((0..2000).map(|_| signal.sample(100.0)))[100..] {
            assert!((90.0..160.0).contains(estimate), "{estimate}");
        }
    }

    #[test]
    fn a_step_up_is_followed_within_ten_samples_and_a_step_down_within_thirty() {
        let up = estimates((0..100).map(|index| if index < 50 { 10.0 } else { 1000.0 }));
        assert!(up[49] == 10.0 && up[54] < 60.0 && up[58] == 1000.0, "{up:?}");
        let down = estimates((0..100).map(|index| if index < 50 { 1000.0 } else { 10.0 }));
        assert!(down[80] < 30.0, "{down:?}");
    }

    #[test]
    fn a_step_is_reported_once() {
        let mut estimate = Estimate::default();
        let steps = (0..100).filter(|&index| estimate.add(if index < 50 { 10.0 } else { 1000.0 }, FILTER));
        assert_eq!(steps.collect::<Vec<_>>(), [57]);
    }

    #[test]
    fn a_rare_sample_counts_in_full_and_a_fall_can_be_limited() {
        let mut estimate = Estimate::settled_at(100.0);
        assert!(!estimate.add(900.0, Filter::rare(2.0)));
        assert_eq!(estimate.get(), Some(500.0));
        estimate.add(5.0, Filter::rare(1.0).with_max_fall(4.0));
        assert_eq!(estimate.get(), Some(125.0));
    }
}
