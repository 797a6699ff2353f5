//! The controller that keeps the cost of a frame's views within a budget.
//!
//! **What it predicts.** A frame costs what its views cost and a rest, which no view's form changes. A view costs what
//! drawing one of its cameras costs on its quality level, times the cameras that a frame draws on average. Both are
//! measured, and [`ViewCost`] predicts the quality levels on which the view is not. So the cost of any assignment of
//! quality levels is a sum, known without trying it.
//!
//! **How it chooses.** If the predicted cost exceeds the budget for [`OVER_FRAMES`] frames, it sheds: from the lowest
//! priority on, each view descends its quality levels until the prediction fits, all in one frame, as each frame over
//! the budget is late. A view that would save next to nothing is passed over. If not even the last quality levels fit,
//! all views take these, and the budget is [exhausted](ViewBudget::is_exhausted). If there is room, it restores in the
//! opposite order, one quality level of one view at a time, and waits [`SETTLE_FRAMES`] for what that costs. While that
//! view waits, no other view is restored, because it would take the room that the first one waits for. It also waits
//! for views that it moved to another quality level and has not measured there yet, as their costs count as 0, but not
//! for ever: one that is cached never is.
//!
//! **Why it does not flap.** A quality level is restored only if the prediction leaves room for a rise by
//! [`HYSTERESIS`]. A restoration that is undone soon had a wrong prediction, so the view's pause before the next one
//! doubles, up to [`MAX_PAUSE`].
//!
//! **How it finds out that it is wrong.** What a view that is left out costs is remembered, but cannot be measured, and
//! the ratio of two quality levels is wrong if the scene changed while it was measured. So a quality level that is
//! predicted not to fit is tried after [`TRIAL_PAUSES`] pauses, if there is room at all. The same doubling makes such
//! trials rare where they fail.

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use drawloom_jobs::internal::{Estimate, Filter, Hysteresis};

use super::budgeted_view::{BudgetedView, QualityLevel, ViewCost};
#[cfg(feature = "wgpu")]
use crate::backend::DevicePassTimes;
use crate::frame::{BudgetError, FrameStatistics};
use crate::scene::Camera;
use crate::timeline::{Labels, TuningAlternative, TuningChoice, TuningSubject};
use crate::unwind::emit;

/// Keeps what frames cost within a budget: draws views in cheaper forms, or not at all, and draws them at their best
/// again when there is room (M 10.4: reflections are left out on slow hardware).
///
/// The cost of a frame is thread time, summed over workers, or the device's time. Whether the camera of a view with
/// [`Redraw::OnCameraChange`](crate::scene::Redraw::OnCameraChange) will change is not known, so it counts as drawn in
/// every frame.
///
/// ```
/// # use std::sync::Arc;
/// # use drawloom::backend::NullBackend;
/// # use drawloom::glam::DVec3;
/// # use drawloom::process::Deferred;
/// # use drawloom::task::Scheduler;
/// use drawloom::scene::{Camera, Scene, SceneRef};
/// use drawloom::{BudgetedView, Renderer, QualityLevel, ViewBudget, ViewVariant};
///
/// # let scheduler = Arc::new(Scheduler::new(2)?);
/// # let (mut renderer, submitter) = Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).build(scheduler)?;
/// # let scene = Scene::new();
/// let mut budget = ViewBudget::new(4.0)?;
/// for _frame in 0..3 {
///     let main = Camera::looking_at("main", DVec3::Z, DVec3::ZERO);
///     let map = Camera::looking_at("map", DVec3::Y * 50.0, DVec3::ZERO);
///     let views = [
///         BudgetedView { name: "main".into(), priority: 1, cameras: vec![main], levels: vec![] },
///         BudgetedView {
///             name: "map".into(),
///             priority: 0,
///             cameras: vec![map],
///             levels: vec![
///                 QualityLevel::Drawn(ViewVariant { interval: 2, ..ViewVariant::BEST }),
///                 QualityLevel::Drawn(ViewVariant { interval: 4, size: 0.5, ..ViewVariant::BEST }),
///                 QualityLevel::LeftOut,
///             ],
///         },
///     ];
///     let cameras = budget.cameras(&views)?;
///     renderer.add_choices(budget.choices());
///     let recorded = renderer.record(SceneRef { cameras: &cameras, ..scene.as_scene_ref() })?;
///     budget.update(&submitter.submit(recorded)?.statistics);
/// }
/// assert_eq!(budget.level("map"), Some(0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct ViewBudget {
    /// In nanoseconds a frame.
    budget: f32,
    /// What a frame costs beside the views of the budget, in nanoseconds.
    rest: Estimate,
    views: Vec<ViewState>,
    /// The number of calls of [`Self::cameras`].
    frame: u64,
    /// The frame of the latest change of a quality level.
    changed: u64,
    /// How many frames in a row were predicted to exceed the budget.
    over: u32,
    /// How many frames in a row reported no quality level of a view that has a quality levels.
    without_levels: u32,
    /// How many frames in a row lacked the device's times of passes.
    #[cfg(feature = "wgpu")]
    incomplete: u32,
}

/// A view, and the quality level it is on.
#[derive(Debug)]
struct ViewState {
    priority: i32,
    levels: Vec<QualityLevel>,
    /// The names of the quality levels, for reports.
    names: Vec<Cow<'static, str>>,
    labels: Arc<Labels>,
    /// By quality level: the cameras that a frame draws on average.
    draws: Vec<f32>,
    /// The names of all cameras.
    cameras: Vec<String>,
    level: usize,
    is_trial: bool,
    cost: ViewCost,
    /// The frames in which it was last degraded, restored and requested.
    degraded: u64,
    restored: Option<u64>,
    requested: u64,
    /// The frames between being degraded and being restored.
    pause: u64,
}

/// A quality level is restored if the prediction is below the budget by this factor.
const HYSTERESIS: Hysteresis = Hysteresis::new(1.15);

/// The frames in a row over the budget before views are degraded: a frame that is disturbed raises an average for
/// fewer.
const OVER_FRAMES: u32 = 4;

/// The frames between two restorations: enough samples of what the first one costs.
const SETTLE_FRAMES: u64 = 8;

/// For how long a restoration waits for the costs of views that changed their quality level.
const MAX_MEASURING_FRAMES: u64 = 128;

/// A restoration that is undone within this number of frames was wrong.
const RETRY_FRAMES: u64 = 64;

/// After this many frames in a row that report no quality level, or lack times, the budget warns: a frame in flight may
/// have had other views.
const WARNING_FRAMES: u32 = 8;

const MIN_PAUSE: u64 = 16;
const MAX_PAUSE: u64 = 1024;

/// How many pauses pass before a quality level is tried although it is predicted not to fit.
const TRIAL_PAUSES: u64 = 8;

/// What a view must save to be degraded, as a share of the budget, unless the budget is exhausted.
const MIN_SAVING: f32 = 0.005;

/// What is known of a view is forgotten when it was not requested for this number of frames.
const MEMORY_FRAMES: u64 = 256;

const FILTER: Filter = Filter::limiting_outliers(8.0);

impl ViewBudget {
    /// A budget of `milliseconds` a frame.
    ///
    /// # Errors
    /// If that is not from [`BudgetError::MIN_MILLISECONDS`] to [`BudgetError::MAX_MILLISECONDS`].
    pub fn new(milliseconds: f64) -> Result<Self, BudgetError> {
        let (rest, views) = (Estimate::default(), Vec::new());
        let mut budget = Self {
            budget: 0.0,
            rest,
            views,
            frame: 0,
            changed: 0,
            over: 0,
            without_levels: 0,
            #[cfg(feature = "wgpu")]
            incomplete: 0,
        };
        budget.set_milliseconds(milliseconds)?;
        Ok(budget)
    }

    /// Sets the budget from the next frame on.
    ///
    /// # Errors
    /// If it is not from [`BudgetError::MIN_MILLISECONDS`] to [`BudgetError::MAX_MILLISECONDS`]; the budget does not
    /// change then.
    pub fn set_milliseconds(&mut self, milliseconds: f64) -> Result<(), BudgetError> {
        if !(BudgetError::MIN_MILLISECONDS..=BudgetError::MAX_MILLISECONDS).contains(&milliseconds) {
            return Err(BudgetError::InvalidBudget { milliseconds });
        }
        self.budget = (milliseconds * 1e6) as f32;
        Ok(())
    }

    /// The cameras of the next frame, in the order of the views, each view in the form of its quality level. The
    /// cameras of views that the budget may not reduce may be among them, as views without a quality levels, or be
    /// added by the engine.
    ///
    /// Give [`Self::choices`] to [`Renderer::add_choices`](crate::frame::Renderer::add_choices) before the frame of
    /// these cameras is recorded, as the [example](ViewBudget) does. The frame reports its quality levels only then,
    /// and without them the budget learns no view's cost. It warns of frames that report none.
    ///
    /// # Errors
    /// If a quality level is invalid or comes after [`QualityLevel::LeftOut`], or if two views or two of their cameras
    /// have the same name.
    pub fn cameras(&mut self, views: &[BudgetedView]) -> Result<Vec<Camera>, BudgetError> {
        views.iter().try_for_each(BudgetedView::check)?;
        let mut names: Vec<_> = views.iter().map(|view| view.name.as_str()).collect();
        names.sort_unstable();
        if let Some(pair) = names.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(BudgetError::DuplicateView { view: pair[0].to_owned() });
        }
        check_camera_names(views)?;
        self.frame += 1;
        let frame = self.frame;
        let mut before: HashMap<_, _> = self.views.drain(..).map(|state| (state.name().to_owned(), state)).collect();
        let mut cameras = Vec::new();
        for view in views {
            let known = before.remove(&view.name).filter(|state| state.levels.iter().copied().eq(view.levels()));
            let mut state = known.unwrap_or_else(|| ViewState::new(view));
            state.request(view, frame);
            cameras.extend(state.levels[state.level].cameras(&view.cameras));
            self.views.push(state);
        }
        let mut absent: Vec<_> = before.into_values().filter(|state| frame - state.requested < MEMORY_FRAMES).collect();
        // Not in the order of a hash map: that of equal priorities is the order here.
        absent.sort_by(|one, other| one.name().cmp(other.name()));
        self.views.append(&mut absent);
        Ok(cameras)
    }

    /// The quality levels of the next frame, and what each costs a frame: for
    /// [`Renderer::add_choices`](crate::frame::Renderer::add_choices). Then they are in the
    /// [statistics](FrameStatistics::tuning), the timeline and the report of the frame, and [`Self::update`] finds them
    /// there.
    pub fn choices(&self) -> impl Iterator<Item = TuningChoice> + '_ {
        self.requested().filter(|view| view.levels.len() > 1).map(|view| {
            let alternative = |(level, name): (usize, &Cow<'static, str>)| TuningAlternative {
                name: name.clone(),
                nanoseconds: view.cost.on(level).map(|cost| cost * view.draws[level]),
            };
            TuningChoice {
                subject: TuningSubject::QualityLevel,
                labels: Arc::clone(&view.labels),
                alternatives: view.names.iter().enumerate().map(alternative).collect(),
                chosen: view.level,
                is_trial: view.is_trial && !view.is_measured(),
            }
        })
    }

    /// Chooses quality levels by the thread time of a frame that was submitted.
    pub fn update(&mut self, statistics: &FrameStatistics) {
        let FrameStatistics { views, view_times, stages, .. } = statistics;
        let attributed = view_times.iter().sum::<Duration>().as_secs_f32();
        // Submission belongs to no view: it is divided as the stages are.
        let factor = if attributed > 0.0 { 1.0 + stages.submit.as_secs_f32() / attributed } else { 1.0 };
        let drawn = views.iter().zip(view_times).filter(|(view, _)| view.age == 0);
        let costs = drawn.map(|(view, time)| (view.name.as_str(), time.as_secs_f32() * 1e9 * factor)).collect();
        self.add_frame(statistics, stages.total().as_secs_f32() * 1e9, &costs);
    }

    /// Chooses quality levels by the device's time for a frame, with the statistics of that same frame: the sum of its
    /// passes' times, although a device may draw several at once. A frame that [lacks](DevicePassTimes::skipped) times
    /// of passes is ignored, and a run of such frames is warned of. A budget is kept by this or by [`Self::update`],
    /// not by both.
    #[cfg(feature = "wgpu")]
    pub fn update_from_device(&mut self, statistics: &FrameStatistics, times: &DevicePassTimes) {
        self.incomplete = continued(self.incomplete, times.skipped > 0);
        if self.incomplete == WARNING_FRAMES {
            let message = "the device's times lack passes, so that a view budget learns nothing of them";
            emit(|| tracing::warn!(target: "drawloom", "{message}"));
        }
        if self.incomplete > 0 {
            return;
        }
        let mut costs: HashMap<&str, f32> = HashMap::new();
        for pass in &times.passes {
            *costs.entry(pass.view.as_str()).or_default() += pass.ended.saturating_sub(pass.began).as_secs_f32() * 1e9;
        }
        self.add_frame(statistics, costs.values().sum(), &costs);
    }

    /// The quality level on which the next frame draws a view; `None` if [`Self::cameras`] was not given it.
    pub fn level(&self, view: &str) -> Option<usize> {
        self.requested().find(|state| state.name() == view).map(|state| state.level)
    }

    /// The predicted cost of the next frame, in milliseconds. It is 0 before the first frames were measured.
    pub fn predicted_milliseconds(&self) -> f64 {
        f64::from(self.predicted()) * 1e-6
    }

    /// Whether the budget is predicted to be exceeded although all views are on their last quality levels.
    pub fn is_exhausted(&self) -> bool {
        self.predicted() > self.budget && self.requested().all(|view| view.level + 1 == view.levels.len())
    }

    /// Adds what a frame cost, all of it and each camera that it drew, in nanoseconds, and chooses.
    fn add_frame(&mut self, statistics: &FrameStatistics, total: f32, costs: &HashMap<&str, f32>) {
        let levels: HashMap<_, _> = statistics.levels().collect();
        self.warn_without_levels(&levels);
        let mut of_views = 0.0;
        for view in self.views.iter_mut().filter(|view| view.requested == self.frame) {
            let drawn = || view.cameras.iter().filter_map(|camera| costs.get(camera.as_str()));
            let (cost, count) = (drawn().sum::<f32>(), drawn().count());
            of_views += cost;
            // A frame that was recorded before a quality level changed says nothing about the quality level.
            let is_current = view.levels.len() == 1 || levels.get(view.name()) == Some(&view.level);
            if count > 0 && is_current {
                view.cost.add(cost / count as f32);
            }
        }
        self.rest.add((total - of_views).max(f32::MIN_POSITIVE), FILTER);
        self.choose();
    }

    /// Warns of a run of frames that do not report the quality levels of these views, once a run.
    fn warn_without_levels(&mut self, levels: &HashMap<&str, usize>) {
        let with_levels = || self.requested().filter(|view| view.levels.len() > 1);
        let is_missing = with_levels().count() > 0 && !with_levels().any(|view| levels.contains_key(view.name()));
        self.without_levels = continued(self.without_levels, is_missing);
        if self.without_levels == WARNING_FRAMES {
            let message = "frames report no quality level of a view budget: give ViewBudget::choices to Renderer::add_choices before each";
            emit(|| tracing::warn!(target: "drawloom", "{message}"));
        }
    }

    fn choose(&mut self) {
        if !self.rest.is_settled() {
            return;
        }
        self.over = continued(self.over, self.predicted() > self.budget);
        if self.over >= OVER_FRAMES {
            self.over = 0;
            self.degrade();
        } else if self.over == 0 {
            self.restore();
        }
    }

    /// Takes views down their quality levels until the prediction fits.
    fn degrade(&mut self) {
        let order = self.shedding_order();
        for includes_small_savings in [false, true] {
            for &index in &order {
                let mut level = self.views[index].level;
                let others = self.predicted() - self.views[index].cost_on(level);
                let view = &self.views[index];
                let min_cost =
                    (level..view.levels.len()).map(|level| view.cost_on(level)).fold(f32::INFINITY, f32::min);
                let saves = view.cost_on(level) - min_cost >= MIN_SAVING * self.budget;
                let is_last = |level| level + 1 == view.levels.len();
                while (saves || includes_small_savings) && !is_last(level) && others + view.cost_on(level) > self.budget
                {
                    level += 1;
                }
                if level != view.level {
                    self.views[index].degrade_to(level, self.frame);
                    self.changed = self.frame;
                }
            }
        }
    }

    /// Restores one quality level of the degraded view with the highest priority, if that fits or if its turn has come
    /// to be measured.
    fn restore(&mut self) {
        // A view that is drawn seldom may not have been measured since it was restored.
        let is_awaited = |view: &ViewState| {
            !view.is_measured() && view.moved().is_some_and(|moved| self.frame - moved < MAX_MEASURING_FRAMES)
        };
        if self.frame - self.changed < SETTLE_FRAMES || self.requested().any(is_awaited) {
            return;
        }
        let order = self.shedding_order();
        let is_restorable = |view: &ViewState| view.level > 0 && view.is_measured();
        let Some(&index) = order.iter().rev().find(|index| is_restorable(&self.views[**index])) else { return };
        let (view, now) = (&self.views[index], self.predicted());
        let waited = self.frame - view.degraded;
        if waited < view.pause {
            return;
        }
        let has_room = |predicted: f32| predicted * HYSTERESIS.factor() <= self.budget;
        let restored = now - view.cost_on(view.level) + view.cost_on(view.level - 1);
        let is_trial = !has_room(restored);
        if !is_trial || has_room(now) && waited >= TRIAL_PAUSES * view.pause {
            self.views[index].restore(is_trial, self.frame);
            self.changed = self.frame;
        }
    }

    /// The indices of the requested views, the first to be degraded first.
    fn shedding_order(&self) -> Vec<usize> {
        let mut order: Vec<_> =
            (0..self.views.len()).rev().filter(|index| self.views[*index].requested == self.frame).collect();
        order.sort_by_key(|index| self.views[*index].priority);
        order
    }

    fn requested(&self) -> impl Iterator<Item = &ViewState> {
        self.views.iter().filter(|view| view.requested == self.frame)
    }

    /// In nanoseconds.
    fn predicted(&self) -> f32 {
        self.rest.get().unwrap_or(0.0) + self.requested().map(|view| view.cost_on(view.level)).sum::<f32>()
    }
}

impl ViewState {
    fn new(view: &BudgetedView) -> Self {
        let levels: Vec<_> = view.levels().collect();
        Self {
            priority: view.priority,
            names: levels.iter().map(|level| level.name()).collect(),
            labels: Arc::new(Labels { view: Some(view.name.as_str().into()), ..Labels::default() }),
            draws: Vec::new(),
            cameras: Vec::new(),
            level: 0,
            is_trial: false,
            cost: ViewCost::new(&levels),
            levels,
            degraded: 0,
            restored: None,
            requested: 0,
            pause: MIN_PAUSE,
        }
    }

    fn name(&self) -> &str {
        self.labels.view.as_deref().unwrap_or_default()
    }

    fn request(&mut self, view: &BudgetedView, frame: u64) {
        (self.priority, self.requested) = (view.priority, frame);
        self.draws = self.levels.iter().map(|level| level.draws_per_frame(&view.cameras)).collect();
        self.cameras = view.cameras.iter().map(|camera| camera.name.clone()).collect();
    }

    /// The predicted cost on a quality level, in nanoseconds a frame; 0 before it was measured.
    fn cost_on(&self, level: usize) -> f32 {
        self.cost.on(level).unwrap_or(0.0) * self.draws[level]
    }

    /// Whether the cost on the current quality level is known.
    fn is_measured(&self) -> bool {
        self.draws[self.level] == 0.0 || self.cost.on(self.level).is_some()
    }

    /// The frame in which the budget moved it to its quality level; `None` if it never did.
    fn moved(&self) -> Option<u64> {
        self.restored.or((self.degraded > 0).then_some(self.degraded))
    }

    fn degrade_to(&mut self, level: usize, frame: u64) {
        let was_restored = self.restored.take().is_some_and(|restored| frame - restored < RETRY_FRAMES);
        self.pause = if was_restored { (2 * self.pause).min(MAX_PAUSE) } else { MIN_PAUSE };
        (self.level, self.degraded, self.is_trial) = (level, frame, false);
        self.cost.move_to(level, &self.levels);
    }

    fn restore(&mut self, is_trial: bool, frame: u64) {
        let was_left_out = self.levels[self.level] == QualityLevel::LeftOut;
        (self.level, self.restored, self.is_trial) = (self.level - 1, Some(frame), is_trial);
        if is_trial {
            self.cost.measure_on(self.level, was_left_out);
        } else {
            self.cost.move_to(self.level, &self.levels);
        }
    }
}

/// The length of a run of frames after one more, which belongs to it or ends it.
fn continued(run: u32, belongs: bool) -> u32 {
    if belongs { run.saturating_add(1) } else { 0 }
}

/// # Errors
/// If two cameras have the same name: what drawing them costs is told apart by it.
fn check_camera_names(views: &[BudgetedView]) -> Result<(), BudgetError> {
    let mut view_of: HashMap<&str, &str> = HashMap::new();
    for view in views {
        for camera in &view.cameras {
            if let Some(other) = view_of.insert(&camera.name, &view.name) {
                let views = [other, &view.name].map(str::to_owned);
                return Err(BudgetError::DuplicateCamera { camera: camera.name.clone(), views });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
