//! The targets of a benchmark, and those that it misses.

use drawloom_output::print_line;

use crate::table::Table;

/// Figures with bounds, in the order of the table.
#[derive(Debug, Default)]
pub struct Targets {
    targets: Vec<Target>,
}

#[derive(Debug)]
struct Target {
    figure: String,
    bound: Bound,
    reached: f64,
}

#[derive(Clone, Copy, Debug)]
enum Bound {
    AtMost(f64),
    AtLeast(f64),
}

impl Targets {
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a figure whose value, `reached`, must not exceed the bound. NaN, where nothing was measured, misses it.
    pub fn at_most(&mut self, figure: impl Into<String>, bound: f64, reached: f64) {
        self.targets.push(Target { figure: figure.into(), bound: Bound::AtMost(bound), reached });
    }

    /// Adds a figure whose value, `reached`, must not be below the bound. NaN, where nothing was measured, misses it.
    pub fn at_least(&mut self, figure: impl Into<String>, bound: f64, reached: f64) {
        self.targets.push(Target { figure: figure.into(), bound: Bound::AtLeast(bound), reached });
    }

    /// Prints all targets as a table under `heading`, or nothing if there are none.
    pub fn print(&self, heading: &str) {
        if self.targets.is_empty() {
            return;
        }
        print_line!("{heading}\n");
        let mut table = Table::new(&["figure", "target", "reached"]);
        for target in &self.targets {
            let note = if target.is_met() { "" } else { ", missed" };
            table.row([target.figure.clone(), target.wanted(), format!("{:.2}{note}", target.reached)]);
        }
        table.print();
    }

    /// Prints the last line of a benchmark, which names the targets that were missed. It comes after the names of
    /// written files.
    pub fn print_missed(&self) {
        print_line!("{}", self.missed());
    }

    fn missed(&self) -> String {
        let missed: Vec<_> = self.targets.iter().filter(|target| !target.is_met()).map(Target::outcome).collect();
        match (&self.targets[..], &missed[..]) {
            ([], _) => "No target applies to what was measured.".to_owned(),
            (all, []) => format!("All targets are met: {} of {0}.", all.len()),
            (all, missed) => format!("Missed {} of {} targets: {}.", missed.len(), all.len(), missed.join("; ")),
        }
    }
}

impl Target {
    fn is_met(&self) -> bool {
        match self.bound {
            Bound::AtMost(bound) => self.reached <= bound,
            Bound::AtLeast(bound) => self.reached >= bound,
        }
    }

    fn wanted(&self) -> String {
        match self.bound {
            Bound::AtMost(bound) => format!("≤ {bound}"),
            Bound::AtLeast(bound) => format!("≥ {bound}"),
        }
    }

    fn outcome(&self) -> String {
        format!("{} ({:.2}, target {})", self.figure, self.reached, self.wanted())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_met_by_themselves_and_missed_by_what_was_not_measured() {
        for (reached, is_at_most, is_at_least) in
            [(0.6, true, true), (0.5, true, false), (0.7, false, true), (f64::NAN, false, false)]
        {
            let target = |bound| Target { figure: String::new(), bound, reached };
            assert_eq!(target(Bound::AtMost(0.6)).is_met(), is_at_most, "{reached} at most 0.6");
            assert_eq!(target(Bound::AtLeast(0.6)).is_met(), is_at_least, "{reached} at least 0.6");
        }
    }

    #[test]
    fn the_last_line_names_missed_targets_alone() {
        let mut targets = Targets::new();
        assert_eq!(targets.missed(), "No target applies to what was measured.");
        targets.at_most("still ÷ moving", 0.5, 0.14);
        assert_eq!(targets.missed(), "All targets are met: 1 of 1.");
        targets.at_least("speed-up", 1.8, 1.57);
        targets.at_most("growth", 1.5, f64::NAN);
        assert_eq!(
            targets.missed(),
            "Missed 2 of 3 targets: speed-up (1.57, target ≥ 1.8); growth (NaN, target ≤ 1.5)."
        );
    }
}
