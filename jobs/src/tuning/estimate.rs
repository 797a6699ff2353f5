//! The running average of a measured cost.

/// The running average of a measured cost, in nanoseconds for whatever is measured: an item, a batch, a run.
#[derive(Clone, Copy, Debug, Default)]
pub struct Estimate {
    average: f32,
    /// The average before the current run of outliers. During the first three samples, the larger of the first two.
    reference: f32,
    samples: u32,
    /// How many of the latest samples in a row were outliers.
    outliers: u32,
}

/// How an estimate weighs its samples.
#[derive(Clone, Copy, Debug)]
pub struct Filter {
    /// The time constant of the average in samples: the latest sample has one part in this many.
    time_constant: f32,
    limits_outliers: bool,
}

impl Filter {
    /// A filter for samples of which there is one each frame or run. It limits outliers.
    pub const fn limiting_outliers(time_constant: f32) -> Self {
        Self { time_constant, limits_outliers: true }
    }

    /// A filter that counts each sample unchanged: for samples that are too rare to tell an outlier from a change, or
    /// that have a limit of their own.
    pub const fn unlimited(time_constant: f32) -> Self {
        Self { time_constant, limits_outliers: false }
    }
}

impl Estimate {
    /// A sample counts as at most this multiple of the average: now and then the operating system preempts a worker,
    /// which says nothing about the next sample.
    pub const OUTLIER_LIMIT: f32 = 1.6;

    /// This many outliers in a row are no outliers but a step. Another program may take a processor for a few frames in
    /// a row; this is more.
    pub const STEP_SAMPLES: u32 = 8;

    /// The samples of which the average begins as the median: enough to tolerate one outlier.
    pub const FIRST_SAMPLES: u32 = 3;

    /// The estimated cost; `None` before the first sample.
    pub fn get(self) -> Option<f32> {
        (self.samples > 0).then_some(self.average)
    }

    /// Whether the estimate has enough samples to tolerate an outlier among them.
    pub fn is_settled(self) -> bool {
        self.samples >= Self::FIRST_SAMPLES
    }

    /// Adds a sample. Returns true if it shows a step: the cost has risen for good, and the estimate starts over.
    pub fn add(&mut self, sample: f32, filter: Filter) -> bool {
        let is_step = match self.samples {
            0 => {
                (self.average, self.reference) = (sample, sample);
                false
            }
            _ if !filter.limits_outliers => {
                self.average += (sample - self.average) / filter.time_constant;
                // Samples of another filter that follow are no first samples.
                (self.samples, self.outliers) = (self.samples.max(Self::FIRST_SAMPLES), 0);
                false
            }
            1 => {
                (self.average, self.reference) = (self.average.min(sample), self.average.max(sample));
                false
            }
            2 => {
                // The median of three: the third sample, or that of the first two which is closer to it.
                self.average = sample.max(self.average).min(self.reference.max(self.average));
                false
            }
            _ => self.add_limited(sample, filter),
        };
        self.samples = self.samples.saturating_add(1);
        is_step
    }

    fn add_limited(&mut self, sample: f32, filter: Filter) -> bool {
        if self.outliers == 0 {
            // Outliers raise the average, but not what later ones are compared with.
            self.reference = self.average;
        }
        self.outliers = if sample > self.reference * Self::OUTLIER_LIMIT { self.outliers + 1 } else { 0 };
        if self.outliers >= Self::STEP_SAMPLES {
            *self = Self { average: sample, reference: sample, samples: 0, outliers: 0 };
            return true;
        }
        let counted = sample.min(self.average * Self::OUTLIER_LIMIT);
        self.average += (counted - self.average) / filter.time_constant;
        false
    }
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use drawloom_signal::Signal;

    use super::*;

    const FILTER: Filter = Filter::limiting_outliers(8.0);

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
        for factor in [1.7, 2.0, 3.0, 20.0] {
            let up = estimates((0..100).map(|index| if index < 50 { 10.0 } else { 10.0 * factor }));
            assert!(up[49] == 10.0 && up[54] < 60.0 && up[58] == 10.0 * factor, "{up:?}");
            let down = estimates((0..100).map(|index| if index < 50 { 10.0 * factor } else { 10.0 }));
            assert!(down[80] < 14.0, "{down:?}");
        }
    }

    #[test]
    fn a_step_is_reported_once_and_less_than_a_step_is_not() {
        for (factor, expected) in [(1.5, vec![]), (1.7, vec![57]), (100.0, vec![57])] {
            let mut estimate = Estimate::default();
            let steps = (0..200).filter(|&index| estimate.add(if index < 50 { 10.0 } else { 10.0 * factor }, FILTER));
            assert_eq!(steps.collect::<Vec<_>>(), expected, "{factor}");
        }
    }

    #[test]
    fn a_cost_of_zero_is_followed_like_any_other() {
        let mut estimate = Estimate::default();
        let costs: Vec<_> = (0..40)
            .map(|index| {
                estimate.add(if index < 20 { 0.0 } else { 5.0 }, FILTER);
                estimate.get().unwrap()
            })
            .collect();
        assert_eq!((costs[19], costs[39]), (0.0, 5.0));
        let mut estimate = Estimate::default();
        for sample in [0.0, 0.0, 0.0, 0.0, 8.0] {
            estimate.add(sample, Filter::unlimited(2.0));
        }
        assert_eq!(estimate.get(), Some(4.0));
    }

    #[test]
    fn samples_of_two_filters_are_averaged() {
        let mut estimate = Estimate::default();
        estimate.add(100.0, Filter::unlimited(2.0));
        estimate.add(200.0, Filter::unlimited(2.0));
        estimate.add(70.0, FILTER);
        assert_eq!(estimate.get(), Some(140.0));
    }

    #[test]
    fn a_sample_counts_as_it_is_if_outliers_are_not_limited() {
        let mut estimate = Estimate::default();
        let averages = [100.0, 900.0, 100.0].map(|sample| {
            assert!(!estimate.add(sample, Filter::unlimited(2.0)));
            estimate.get().unwrap()
        });
        assert_eq!(averages, [100.0, 500.0, 300.0]);
    }
}
