//! What was chosen by measurement in a frame, as plain data.

use std::borrow::Cow;
use std::fmt::{self, Display, Formatter};
use std::sync::Arc;

use super::labels::Labels;

/// What was chosen by measurement in a frame, and the costs by which it was chosen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameTuning {
    /// The choices among alternatives. Choices that the engine fixed are left out, and so are views and passes without
    /// a choice.
    pub choices: Vec<TuningChoice>,
    /// The job sizes of the nodes of the frame's stage graph whose items are divided by cost: which these are depends
    /// on the granularity.
    pub job_sizes: Vec<JobSize>,
}

/// A choice among alternatives by measured cost.
#[derive(Clone, Debug, PartialEq)]
pub struct TuningChoice {
    /// What was chosen.
    pub subject: TuningSubject,
    /// The view or pass that it was chosen for; none for the whole frame.
    pub labels: Arc<Labels>,
    /// The alternatives.
    pub alternatives: Vec<TuningAlternative>,
    /// The index of the one that the frame has.
    pub chosen: usize,
    /// Whether the frame has it only to measure it.
    pub is_trial: bool,
}

/// What is chosen among alternatives by measured cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum TuningSubject {
    /// Whether the frame's stage graph runs on the calling thread alone or on all workers: see
    /// [`Schedule::run_mode`](crate::graph::Schedule::run_mode).
    RunMode,
    /// Whether a view tests for occlusion: see `Quality::occlusion`.
    OcclusionTest,
    /// How a pass is recorded and encoded.
    Recording,
    /// The form in which a view is drawn to keep a `ViewBudget`.
    QualityLevel,
}

impl TuningSubject {
    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::RunMode => "run mode",
            Self::OcclusionTest => "occlusion test",
            Self::Recording => "recording",
            Self::QualityLevel => "quality level",
        }
    }

    /// What the cost of an alternative is for.
    pub fn unit(self) -> &'static str {
        match self {
            Self::RunMode => "run",
            Self::OcclusionTest => "object",
            Self::Recording => "batch",
            Self::QualityLevel => "frame",
        }
    }
}

/// One alternative of a [`TuningChoice`].
#[derive(Clone, Debug, PartialEq)]
pub struct TuningAlternative {
    /// Its name: `serial`, `cached bundles`, `every 2 frames`.
    pub name: Cow<'static, str>,
    /// Its estimated cost in nanoseconds per [unit](TuningSubject::unit) when the frame was recorded. `None` if it was
    /// not measured yet, or not since the work has changed; a trial begins without an estimate too.
    pub nanoseconds: Option<f32>,
}

/// The job size of one node.
#[derive(Clone, Debug, PartialEq)]
pub struct JobSize {
    /// The stage whose jobs these are, and its view and process.
    pub labels: Arc<Labels>,
    /// The number of items of the node.
    pub items: usize,
    /// How many of them make a job.
    pub items_per_job: usize,
    /// The estimated thread time of an item in nanoseconds, before the frame; `None` if it was not measured yet.
    pub nanoseconds_per_item: Option<f32>,
}

impl JobSize {
    /// The number of jobs.
    pub fn jobs(&self) -> usize {
        self.items.div_ceil(self.items_per_job.max(1))
    }

    /// The estimated thread time of all items in nanoseconds; 0 if it was not measured yet.
    pub fn work(&self) -> f32 {
        self.nanoseconds_per_item.unwrap_or(0.0) * self.items as f32
    }
}

/// One line: what was chosen and why. Alternatives that were not measured are left out.
///
/// ```text
/// recording of geometry buffer in main: cached bundles for 21.0 ns a batch; direct 95.2 ns, bundles 101 ns
/// ```
impl Display for TuningChoice {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", self.subject.name())?;
        write_labels(formatter, &self.labels)?;
        let Some(chosen) = self.alternatives.get(self.chosen) else { return Ok(()) };
        write!(formatter, ": {}", chosen.name)?;
        if let Some(nanoseconds) = chosen.nanoseconds {
            let unit = self.subject.unit();
            let article = if unit.starts_with('o') { "an" } else { "a" };
            write!(formatter, " for {} {article} {unit}", Nanoseconds(nanoseconds))?;
        }
        if self.is_trial {
            write!(formatter, ", as a trial")?;
        }
        let others = self.alternatives.iter().enumerate().filter(|&(index, _)| index != self.chosen);
        let measured = others.filter_map(|(_, other)| Some((&other.name, other.nanoseconds?)));
        for (position, (name, nanoseconds)) in measured.enumerate() {
            write!(formatter, "{} {name} {}", if position == 0 { ";" } else { "," }, Nanoseconds(nanoseconds))?;
        }
        Ok(())
    }
}

/// One line: the job size and the reason for it.
///
/// ```text
/// fill of geometry buffer in main: 10000 items of 6.10 ns in 4 jobs of 2560
/// ```
impl Display for JobSize {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", self.labels.stage.as_deref().unwrap_or("node"))?;
        write_labels(formatter, &self.labels)?;
        write!(formatter, ": {} {}", self.items, if self.items == 1 { "item" } else { "items" })?;
        if let Some(nanoseconds) = self.nanoseconds_per_item {
            write!(formatter, " of {}", Nanoseconds(nanoseconds))?;
        }
        match self.jobs() {
            1 => write!(formatter, " in one job"),
            jobs => write!(formatter, " in {jobs} jobs of {}", self.items_per_job),
        }
    }
}

fn write_labels(formatter: &mut Formatter<'_>, labels: &Labels) -> fmt::Result {
    if let Some(process) = &labels.process {
        write!(formatter, " of {process}")?;
    }
    match &labels.view {
        Some(view) => write!(formatter, " in {view}"),
        None => Ok(()),
    }
}

/// A time with three significant digits, in the unit that suits it.
struct Nanoseconds(f32);

impl Display for Nanoseconds {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        let (mut value, mut unit) = (self.0, "ns");
        for larger in ["µs", "ms", "s"] {
            // What would be rounded to 1000 is 1 of the next unit.
            if value >= 999.5 {
                (value, unit) = (value / 1e3, larger);
            }
        }
        let decimals = match value {
            value if value < 9.995 => 2,
            value if value < 99.95 => 1,
            _ => 0,
        };
        write!(formatter, "{value:.decimals$} {unit}")
    }
}

#[cfg(all(test, not(drawloom_model_check)))]
mod tests {
    use super::*;

    fn labels() -> Arc<Labels> {
        let [process, view, stage] = ["geometry buffer", "main", "fill"].map(|label| Some(label.into()));
        Arc::new(Labels { process, stage, view })
    }

    #[test]
    fn a_choice_is_a_line() {
        let alternative = |name: &'static str, nanoseconds| TuningAlternative { name: name.into(), nanoseconds };
        let choice = TuningChoice {
            subject: TuningSubject::Recording,
            labels: labels(),
            alternatives: vec![
                alternative("direct", Some(95.2)),
                alternative("bundles", Some(1500.0)),
                alternative("split", None),
            ],
            chosen: 1,
            is_trial: true,
        };
        let text = "recording of geometry buffer in main: bundles for 1.50 µs a batch, as a trial; direct 95.2 ns";
        assert_eq!(choice.to_string(), text);
    }

    #[test]
    fn a_job_size_is_a_line() {
        let size = |items, items_per_job| {
            JobSize { labels: labels(), items, items_per_job, nanoseconds_per_item: Some(6.13) }.to_string()
        };
        assert_eq!(size(10_000, 2560), "fill of geometry buffer in main: 10000 items of 6.13 ns in 4 jobs of 2560");
        assert_eq!(size(1, 1), "fill of geometry buffer in main: 1 item of 6.13 ns in one job");
    }

    #[test]
    fn times_have_three_digits() {
        let texts = [0.0, 5.0, 9.994, 9.996, 99.96, 999.4, 999.7, 12_345.0, 1.5e6, 2e9]
            .map(|time| Nanoseconds(time).to_string());
        let expected =
            ["0.00 ns", "5.00 ns", "9.99 ns", "10.0 ns", "100 ns", "999 ns", "1.00 µs", "12.3 µs", "1.50 ms", "2.00 s"];
        assert_eq!(texts, expected);
    }
}
