//! What drawing a camera of a view costs: measured on the rung on which it is drawn, and predicted for the others.

use drawloom_jobs::internal::{Estimate, Filter};

use super::budgeted_view::Rung;

/// What drawing a camera of a view costs, in nanoseconds, averaged over its cameras.
///
/// The costs of rungs have fixed ratios, their *shares* of the cost of rung 0, while the costs themselves change with
/// the scene. So what is measured on one rung predicts all. A share is what the rung [expects](Rung::expected_share)
/// until the view has been on the rung once; then it is what was measured, compared with the rung before.
#[derive(Debug)]
pub(super) struct ViewCost {
    /// On the rung `measured_on`.
    estimate: Estimate,
    measured_on: usize,
    /// What the estimate is taken for until it is settled: `None` for a view that was never measured, or not for long.
    expected: Option<f32>,
    /// A rung and its cost, which the estimate is compared with when it is settled.
    reference: Option<(usize, f32)>,
    /// By rung: the first rung on which drawing a camera costs the same.
    first_alike: Vec<usize>,
    /// By the first of the rungs that cost the same.
    shares: Vec<f32>,
}

const FILTER: Filter = Filter::limiting_outliers(8.0);

/// The range of shares of rungs on which the view is drawn: a measured cost of 0 says nothing about other rungs.
const SHARES: [f32; 2] = [1e-3, 4.0];

impl ViewCost {
    pub(super) fn new(rungs: &[Rung]) -> Self {
        let share = |rung: &Rung| match rung {
            Rung::LeftOut => 0.0,
            // Costs are divided by the share of the rung on which they are measured.
            Rung::Drawn(_) => rung.expected_share().max(SHARES[0]),
        };
        let first_alike = |rung: &Rung| rungs.iter().position(|other| other.draws_like(*rung));
        let first_alike = rungs.iter().enumerate().map(|(index, rung)| first_alike(rung).unwrap_or(index)).collect();
        let shares = rungs.iter().map(share).collect();
        Self { estimate: Estimate::default(), measured_on: 0, expected: None, reference: None, first_alike, shares }
    }

    /// The cost on a rung; `None` before it was measured on any.
    pub(super) fn on(&self, rung: usize) -> Option<f32> {
        let settled = self.estimate.get().filter(|_| self.estimate.is_settled());
        let measured = settled.or(self.expected)?;
        Some(measured * self.share(rung) / self.share(self.measured_on))
    }

    fn share(&self, rung: usize) -> f32 {
        self.shares[self.first_alike[rung]]
    }

    /// Adds a sample, on the current rung.
    pub(super) fn add(&mut self, nanoseconds: f32) {
        if self.estimate.add(nanoseconds.max(f32::MIN_POSITIVE), FILTER) {
            // The cost has risen, and the estimate starts over with what it is now.
            self.expected = self.estimate.get();
        }
        if !self.estimate.is_settled() {
            return;
        }
        self.expected = None;
        if let (Some((rung, cost)), Some(measured)) = (self.reference.take(), self.estimate.get())
            && cost > 0.0
        {
            let share = (self.share(rung) * measured / cost).clamp(SHARES[0], SHARES[1]);
            self.shares[self.first_alike[self.measured_on]] = share;
        }
    }

    /// The view is drawn on another one of these rungs from the next frame on.
    pub(super) fn move_to(&mut self, rung: usize, rungs: &[Rung]) {
        if rungs[rung] == Rung::LeftOut {
            // What was learned is kept until it is drawn again.
            return;
        }
        if self.first_alike[rung] != self.first_alike[self.measured_on] {
            if self.reference.is_none() && self.estimate.is_settled() {
                self.reference = self.estimate.get().map(|cost| (self.measured_on, cost));
            }
            self.expected = self.on(rung);
            self.estimate = Estimate::default();
        }
        self.measured_on = rung;
    }

    /// The view is drawn on this rung from the next frame on, to be measured: nothing is expected of it.
    pub(super) fn measure_on(&mut self, rung: usize, was_left_out: bool) {
        // What it cost before it was left out is too old to be compared with.
        let is_comparable = !was_left_out && self.first_alike[rung] != self.first_alike[self.measured_on];
        let settled = self.estimate.get().filter(|_| self.estimate.is_settled() && is_comparable);
        self.reference = settled.map(|cost| (self.measured_on, cost));
        (self.estimate, self.expected, self.measured_on) = (Estimate::default(), None, rung);
    }
}
