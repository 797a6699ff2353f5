//! The views of a budget, the forms in which they may be drawn, and what each costs.

use std::borrow::Cow;

use drawloom_jobs::internal::{Estimate, Filter};

use crate::frame::BudgetError;
use crate::scene::{Camera, Redraw};

/// A view whose cost a [`ViewBudget`](crate::frame::ViewBudget) may reduce.
#[derive(Clone, Debug, PartialEq)]
pub struct BudgetedView {
    /// Identifies the view from frame to frame, and names it in reports.
    pub name: String,
    /// Views of lower priority are degraded first. Of equal ones, the last is.
    pub priority: i32,
    /// The view at its best: one camera, or several that are degraded together, such as the sides of a cube map, a
    /// mirror and the mirrors in it, or the samples of antialiasing. Their names are unique among all views of the
    /// budget.
    pub cameras: Vec<Camera>,
    /// Forms that cost less, each less than the one before: quality level 1, quality level 2, and so on. QualityLevel 0
    /// is the view at its best. Only the last one may be [`QualityLevel::LeftOut`]. A view whose quality levels differs
    /// from that of the frame before is a new view: it is at its best, and not measured.
    pub levels: Vec<QualityLevel>,
}

/// A form in which a view is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum QualityLevel {
    /// It is drawn in a cheaper form.
    Drawn(ViewVariant),
    /// The frame leaves the view out. Processes that sample it read zeros.
    LeftOut,
}

/// A cheaper form of a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViewVariant {
    /// The interval of frames in which the view is drawn, at least 1: see [`Redraw::Interval`]. At 1, its cameras say
    /// how often. A camera with [`Redraw::OnCameraChange`] keeps that.
    pub interval: u32,
    /// The width and height of the picture, as a share of those of the cameras: above 0 and up to 1.
    pub size: f32,
    /// The factor by which [`Camera::level_of_detail_scale`] is larger, at least 1: the error of coarser meshes, in
    /// pixels.
    pub level_of_detail_scale: f32,
    /// Cameras beyond this number are left out, at least 1.
    pub max_cameras: usize,
}

impl ViewVariant {
    /// The view at its best.
    pub const BEST: Self = Self { interval: 1, size: 1.0, level_of_detail_scale: 1.0, max_cameras: usize::MAX };

    /// The cameras of the view in this form.
    fn cameras(self, cameras: &[Camera]) -> impl Iterator<Item = Camera> {
        cameras.iter().take(self.max_cameras).map(move |camera| Camera {
            // An empty picture stays empty, so that its error names it.
            size: camera.size.map(|pixels| ((pixels as f32 * self.size).round() as u32).max(pixels.min(1))),
            redraw: self.redraw(camera),
            level_of_detail_scale: camera.level_of_detail_scale * self.level_of_detail_scale,
            ..camera.clone()
        })
    }

    /// How often a camera of the view is drawn in this form.
    fn redraw(self, camera: &Camera) -> Redraw {
        match camera.redraw {
            Redraw::EveryFrame if self.interval > 1 => Redraw::Interval(self.interval),
            // An interval of 0 frames is kept, so that its error names it.
            Redraw::Interval(interval) if interval > 0 => Redraw::Interval(interval.max(self.interval)),
            redraw => redraw,
        }
    }

    fn problem(self) -> Option<&'static str> {
        if self.interval == 0 {
            Some("an interval of 0 frames")
        } else if !(self.size > 0.0 && self.size <= 1.0) {
            Some("a size that is not above 0 and up to 1")
        } else if !(self.level_of_detail_scale >= 1.0 && self.level_of_detail_scale.is_finite()) {
            Some("a level of detail that is not coarser by a factor of 1 or more")
        } else if self.max_cameras == 0 {
            Some("no camera")
        } else {
            None
        }
    }
}

impl QualityLevel {
    /// The view at its best.
    pub(in crate::frame) const BEST: Self = Self::Drawn(ViewVariant::BEST);

    /// The cameras of the view on this quality level, of those that it has at its best: for an engine that chooses
    /// forms itself.
    pub fn cameras(self, cameras: &[Camera]) -> impl Iterator<Item = Camera> {
        let form = match self {
            Self::Drawn(form) => Some(form),
            Self::LeftOut => None,
        };
        form.into_iter().flat_map(move |form| form.cameras(cameras))
    }

    /// The share of a view's cameras that a frame draws, on average, in cameras.
    pub(in crate::frame) fn draws_per_frame(self, cameras: &[Camera]) -> f32 {
        let Self::Drawn(form) = self else { return 0.0 };
        let draws = |camera: &Camera| match form.redraw(camera) {
            Redraw::Interval(interval) => 1.0 / interval.max(1) as f32,
            Redraw::EveryFrame | Redraw::OnCameraChange => 1.0,
        };
        // `sum` of nothing is −0.
        cameras.iter().take(form.max_cameras).map(draws).fold(0.0, |sum, draws| sum + draws)
    }

    /// What drawing a camera costs before it was measured, as a share of what it costs at its best: proportional to the
    /// pixels.
    pub(in crate::frame) fn expected_share(self) -> f32 {
        match self {
            Self::Drawn(form) => form.size * form.size,
            Self::LeftOut => 0.0,
        }
    }

    /// Whether drawing a camera costs the same on both quality levels.
    pub(in crate::frame) fn draws_like(self, other: Self) -> bool {
        let (Self::Drawn(one), Self::Drawn(other)) = (self, other) else { return false };
        (one.size, one.level_of_detail_scale) == (other.size, other.level_of_detail_scale)
    }

    /// Its name in reports.
    pub(in crate::frame) fn name(self) -> Cow<'static, str> {
        let Self::Drawn(form) = self else { return "left out".into() };
        let mut parts = Vec::new();
        if form.interval > 1 {
            parts.push(format!("every {} frames", form.interval));
        }
        if form.size < 1.0 {
            parts.push(format!("{}% of the size", (form.size * 100.0).round()));
        }
        if form.level_of_detail_scale > 1.0 {
            parts.push(format!("meshes coarser by {}", form.level_of_detail_scale));
        }
        if form.max_cameras < usize::MAX {
            parts.push(format!("{} cameras", form.max_cameras));
        }
        if parts.is_empty() { "at its best".into() } else { parts.join(", ").into() }
    }
}

impl BudgetedView {
    /// All quality levels, quality level 0 first.
    pub(in crate::frame) fn levels(&self) -> impl Iterator<Item = QualityLevel> {
        std::iter::once(QualityLevel::BEST).chain(self.levels.iter().copied())
    }

    /// # Errors
    /// If a quality level is invalid, or comes after the one that leaves the view out.
    pub(in crate::frame) fn check(&self) -> Result<(), BudgetError> {
        if let Some(left_out) =
            self.levels().position(|level| level == QualityLevel::LeftOut).filter(|level| *level < self.levels.len())
        {
            return Err(BudgetError::QualityLevelAfterLeftOut { view: self.name.clone(), level: left_out + 1 });
        }
        for (level, form) in self.levels().enumerate() {
            if let QualityLevel::Drawn(form) = form
                && let Some(problem) = form.problem()
            {
                return Err(BudgetError::InvalidQualityLevel { view: self.name.clone(), level, problem });
            }
        }
        Ok(())
    }
}

/// What drawing a camera of a view costs, in nanoseconds, averaged over its cameras.
///
/// The costs of quality levels have fixed ratios, their *shares* of the cost of quality level 0, while the costs
/// themselves change with the scene. So what is measured on one quality level predicts all. A share is what the quality
/// level [expects](QualityLevel::expected_share) until the view has been on the quality level once; then it is what was
/// measured, compared with the quality level before.
#[derive(Debug)]
pub(in crate::frame) struct ViewCost {
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
    pub(in crate::frame) fn new(levels: &[QualityLevel]) -> Self {
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
    pub(in crate::frame) fn on(&self, level: usize) -> Option<f32> {
        let settled = self.estimate.get().filter(|_| self.estimate.is_settled());
        let measured = settled.or(self.expected)?;
        Some(measured * self.share(level) / self.share(self.measured_on))
    }

    fn share(&self, level: usize) -> f32 {
        self.shares[self.first_alike[level]]
    }

    /// Adds a sample, on the current quality level.
    pub(in crate::frame) fn add(&mut self, nanoseconds: f32) {
        if self.estimate.add(nanoseconds.max(f32::MIN_POSITIVE), FILTER) {
            // The cost has risen, and the estimate starts over with what it is now.
            self.expected = self.estimate.get();
        }
        if !self.estimate.is_settled() {
            return;
        }
        self.expected = None;
        // No cost is 0, as no sample is.
        if let (Some((level, cost)), Some(measured)) = (self.reference.take(), self.estimate.get()) {
            let share = (self.share(level) * measured / cost).clamp(SHARES[0], SHARES[1]);
            self.shares[self.first_alike[self.measured_on]] = share;
        }
    }

    /// The view is drawn on another one of these quality levels from the next frame on.
    pub(in crate::frame) fn move_to(&mut self, level: usize, levels: &[QualityLevel]) {
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
    pub(in crate::frame) fn measure_on(&mut self, level: usize, was_left_out: bool) {
        // What it cost before it was left out is too old to be compared with.
        let is_comparable = !was_left_out && self.first_alike[level] != self.first_alike[self.measured_on];
        let settled = self.estimate.get().filter(|_| self.estimate.is_settled() && is_comparable);
        self.reference = settled.map(|cost| (self.measured_on, cost));
        (self.estimate, self.expected, self.measured_on) = (Estimate::default(), None, level);
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    const WORSE: ViewVariant = ViewVariant { interval: 2, size: 0.5, level_of_detail_scale: 3.0, max_cameras: 4 };

    #[test]
    fn a_quality_level_is_named_after_what_makes_it_worse() {
        let names = [QualityLevel::BEST, QualityLevel::Drawn(WORSE), QualityLevel::LeftOut].map(QualityLevel::name);
        let worse = "every 2 frames, 50% of the size, meshes coarser by 3, 4 cameras";
        assert_eq!(names, ["at its best", worse, "left out"]);
    }

    #[test]
    fn what_a_camera_costs_depends_on_its_size_and_its_meshes() {
        let [best, worse] = [QualityLevel::BEST, QualityLevel::Drawn(WORSE)];
        assert_eq!([best, worse, QualityLevel::LeftOut].map(QualityLevel::expected_share), [1.0, 0.25, 0.0]);
        let like = |variant| worse.draws_like(QualityLevel::Drawn(variant));
        assert!(like(ViewVariant { interval: 7, max_cameras: 1, ..WORSE }));
        assert!(
            !like(ViewVariant { size: 0.75, ..WORSE }) && !like(ViewVariant { level_of_detail_scale: 2.0, ..WORSE })
        );
        assert!(!worse.draws_like(QualityLevel::LeftOut));
    }

    #[test]
    fn an_interval_of_0_frames_stays_an_error() {
        let redrawn = |redraw| {
            let camera = Camera { redraw, ..Camera::looking_at("main", DVec3::Z, DVec3::ZERO) };
            QualityLevel::Drawn(WORSE).cameras(&[camera]).next().unwrap().redraw
        };
        assert_eq!(redrawn(Redraw::Interval(0)), Redraw::Interval(0));
        assert_eq!([1, 5].map(|interval| redrawn(Redraw::Interval(interval))), [2, 5].map(Redraw::Interval));
        assert_eq!(redrawn(Redraw::EveryFrame), Redraw::Interval(2));
    }

    const LEVELS: [QualityLevel; 3] = [QualityLevel::BEST, QualityLevel::Drawn(SMALL), QualityLevel::LeftOut];
    const SMALL: ViewVariant = ViewVariant { size: 0.5, ..ViewVariant::BEST };

    fn add(cost: &mut ViewCost, milliseconds: f32, samples: u32) {
        (0..samples).for_each(|_| cost.add(milliseconds * 1e6));
    }

    /// What a camera costs on each of the quality levels.
    fn milliseconds(cost: &ViewCost) -> [Option<f64>; 3] {
        std::array::from_fn(|level| cost.on(level).map(|nanoseconds| f64::from(nanoseconds.round()) / 1e6))
    }

    #[test]
    fn a_share_is_what_was_measured_compared_with_the_quality_level_before() {
        let mut cost = ViewCost::new(&LEVELS);
        assert_eq!(milliseconds(&cost), [None; 3]);
        add(&mut cost, 8.0, 3);
        assert_eq!(milliseconds(&cost), [Some(8.0), Some(2.0), Some(0.0)], "a quarter of the pixels");
        cost.move_to(1, &LEVELS);
        add(&mut cost, 6.0, 2);
        assert_eq!(milliseconds(&cost), [Some(8.0), Some(2.0), Some(0.0)], "not settled");
        add(&mut cost, 6.0, 1);
        assert_eq!(milliseconds(&cost), [Some(8.0), Some(6.0), Some(0.0)]);
        // Back up, compared with a quality level whose share is not 1.
        cost.move_to(0, &LEVELS);
        add(&mut cost, 12.0, 3);
        assert_eq!(milliseconds(&cost), [Some(12.0), Some(6.0), Some(0.0)]);
    }

    #[test]
    fn nothing_is_compared_with_a_cost_that_is_not_settled() {
        let mut cost = ViewCost::new(&LEVELS);
        add(&mut cost, 8.0, 1);
        cost.move_to(1, &LEVELS);
        add(&mut cost, 6.0, 3);
        assert_eq!(milliseconds(&cost), [Some(24.0), Some(6.0), Some(0.0)], "as the pixels are");
    }

    #[test]
    fn a_trial_is_compared_with_the_quality_level_before_unless_the_view_was_left_out() {
        let settled_on = |level| {
            let mut cost = ViewCost::new(&LEVELS);
            cost.move_to(level, &LEVELS);
            add(&mut cost, 8.0, 3);
            cost
        };
        let measured = |mut cost: ViewCost, level, was_left_out| {
            cost.measure_on(level, was_left_out);
            assert_eq!(milliseconds(&cost), [None; 3], "nothing is expected of it");
            add(&mut cost, 6.0, 3);
            milliseconds(&cost)
        };
        assert_eq!(measured(settled_on(0), 1, false), [Some(8.0), Some(6.0), Some(0.0)]);
        assert_eq!(measured(settled_on(0), 1, true), [Some(24.0), Some(6.0), Some(0.0)]);
        // The same quality level has cost 8 ms, which says nothing about others.
        assert_eq!(measured(settled_on(1), 1, false), [Some(24.0), Some(6.0), Some(0.0)]);
        let mut unsettled = ViewCost::new(&LEVELS);
        add(&mut unsettled, 8.0, 1);
        assert_eq!(measured(unsettled, 1, false), [Some(24.0), Some(6.0), Some(0.0)]);
    }
}
