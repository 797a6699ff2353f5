//! Counts of wrong results.

use serde::Serialize;

use super::oracle::Classification;

/// How often a test was wrong.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Tally {
    pub cases: u64,
    /// Culled, but inside according to the oracle.
    pub false_culls: u64,
    /// Outside according to the oracle.
    pub outside: u64,
    /// Outside, but not culled.
    pub false_visibles: u64,
}

impl Tally {
    pub fn count(&mut self, classification: Classification, is_visible: bool) {
        self.cases += 1;
        self.false_culls += u64::from(classification == Classification::Inside && !is_visible);
        self.outside += u64::from(classification == Classification::Outside);
        self.false_visibles += u64::from(classification == Classification::Outside && is_visible);
    }

    pub fn add(&mut self, other: &Self) {
        self.cases += other.cases;
        self.false_culls += other.false_culls;
        self.outside += other.outside;
        self.false_visibles += other.false_visibles;
    }

    /// The share of those outside that were not culled.
    pub fn false_share(&self) -> f64 {
        self.false_visibles as f64 / self.outside.max(1) as f64
    }
}

/// Tallies of volumes that touch a plane by construction, and of volumes anywhere.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Tallies {
    pub tangent: Tally,
    pub anywhere: Tally,
}

impl Tallies {
    pub fn of(&mut self, is_tangent: bool) -> &mut Tally {
        if is_tangent { &mut self.tangent } else { &mut self.anywhere }
    }

    pub fn add(&mut self, other: &Self) {
        self.tangent.add(&other.tangent);
        self.anywhere.add(&other.anywhere);
    }

    pub fn cases(&self) -> u64 {
        self.tangent.cases + self.anywhere.cases
    }

    pub fn false_culls(&self) -> u64 {
        self.tangent.false_culls + self.anywhere.false_culls
    }
}
