//! What drawing a camera of a view costs: measured on the quality level on which it is drawn, and predicted for the
//! others.

use drawloom_jobs::internal::{Estimate, Filter};

use super::budgeted_view::QualityLevel;

/// What drawing a camera of a view costs, in nanoseconds, averaged over its cameras.
///
/// The costs of quality levels have fixed ratios, their *shares* of the cost of quality level 0, while the costs
/// themselves change with the scene. So what is measured on one quality level predicts all. A share is what the quality
/// level [expects](QualityLevel::expected_share) until the view has been on the quality level once; then it is what was
/// measured, compared with the quality level before.
#[derive(Debug)]
pub(super) struct ViewCost {
    /// On the quality level `measured_on`.
    estimate: Estimate,
    measured_on: usize,
    /// What the estimate is taken for until it is settled: `None` for a view that was never measured, or not for long.
    expected: Option<f32>,
    /// A quality level and its cost, which the estimate is compared with when it is settled.
    reference: Option<(usize, f32)>,
    /// By quality level: the first quality level on which drawing a camera costs the same.
    first_alike: Vec<usize>,
    /// By the first of the quality levels that cost the same.
    shares: Vec<f32>,
}

const FILTER: Filter = Filter::limiting_outliers(8.0);

/// The range of shares of quality levels on which the view is drawn: a measured cost of 0 says nothing about other
/// quality levels.
const SHARES: [f32; 2] = [1e-3, 4.0];

impl ViewCost {
    pub(super) fn new(levels: &[QualityLevel]) -> Self {
        let share = |level: &QualityLevel| match level {
            QualityLevel::LeftOut => 0.0,
            // Costs are divided by the share of the quality level on which they are measured.
            QualityLevel::Drawn(_) => level.expected_share().max(SHARES[0]),
        };
        let first_alike = |level: &QualityLevel| levels.iter().position(|other| other.draws_like(*level));
        let first_alike = levels.iter().enumerate().map(|(index, level)| first_alike(level).unwrap_or(index)).collect();
        let shares = levels.iter().map(share).collect();
        Self { estimate: Estimate::default(), measured_on: 0, expected: None, reference: None, first_alike, shares }
    }

    /// The cost on a quality level; `None` before it was measured on any.
    pub(super) fn on(&self, level: usize) -> Option<f32> {
        let settled = self.estimate.get().filter(|_| self.estimate.is_settled());
        let measured = settled.or(self.expected)?;
        Some(measured * self.share(level) / self.share(self.measured_on))
    }

    fn share(&self, level: usize) -> f32 {
        self.shares[self.first_alike[level]]
    }

    /// Adds a sample, on the current quality level.
    pub(super) fn add(&mut self, nanoseconds: f32) {
        if self.estimate.add(nanoseconds.max(f32::MIN_POSITIVE), FILTER) {
            // The cost has risen, and the estimate starts over with what it is now.
            self.expected = self.estimate.get();
        }
        if !self.estimate.is_settled() {
            return;
        }
        self.expected = None;
        if let (Some((level, cost)), Some(measured)) = (self.reference.take(), self.estimate.get())
            && cost > 0.0
        {
            let share = (self.share(level) * measured / cost).clamp(SHARES[0], SHARES[1]);
            self.shares[self.first_alike[self.measured_on]] = share;
        }
    }

    /// The view is drawn on another one of these quality levels from the next frame on.
    pub(super) fn move_to(&mut self, level: usize, levels: &[QualityLevel]) {
        if levels[level] == QualityLevel::LeftOut {
            // What was learned is kept until it is drawn again.
            return;
        }
        if self.first_alike[level] != self.first_alike[self.measured_on] {
            if self.reference.is_none() && self.estimate.is_settled() {
                self.reference = self.estimate.get().map(|cost| (self.measured_on, cost));
            }
            self.expected = self.on(level);
            self.estimate = Estimate::default();
        }
        self.measured_on = level;
    }

    /// The view is drawn on this quality level from the next frame on, to be measured: nothing is expected of it.
    pub(super) fn measure_on(&mut self, level: usize, was_left_out: bool) {
        // What it cost before it was left out is too old to be compared with.
        let is_comparable = !was_left_out && self.first_alike[level] != self.first_alike[self.measured_on];
        let settled = self.estimate.get().filter(|_| self.estimate.is_settled() && is_comparable);
        self.reference = settled.map(|cost| (self.measured_on, cost));
        (self.estimate, self.expected, self.measured_on) = (Estimate::default(), None, level);
    }
}
