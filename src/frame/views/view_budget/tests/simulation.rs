//! Frames of a controller, whose costs are known.

use std::time::Duration;

use fastrand::Rng;
use glam::DVec3;

use crate::frame::views::view_budget::ViewBudget;
use crate::frame::{BudgetedView, FrameStatistics, QualityLevel, StageTimes, ViewStatistics, ViewVariant};
use crate::raster::CulledTriangles;
use crate::scene::{Camera, Redraw, ViewKind};
use crate::timeline::FrameTuning;

pub(super) const SMALL: f32 = 0.5;

/// A view as the simulation knows it.
#[derive(Clone)]
pub(super) struct Simulated {
    pub(super) view: BudgetedView,
    /// What drawing each of its cameras at its best takes, in milliseconds.
    pub(super) cost: f64,
    /// What drawing a camera takes on a quality level with a smaller picture, as a share of that.
    pub(super) share_of_small: f64,
}

/// Frames of a controller, whose costs are known.
pub(super) struct Simulation {
    pub(super) budget: ViewBudget,
    pub(super) views: Vec<Simulated>,
    /// What a frame costs beside its views, in milliseconds.
    pub(super) rest: f64,
    /// The range of a cost's samples, as a share of it.
    pub(super) noise: f64,
    pub(super) random: Rng,
    pub(super) frame: u32,
    /// How often the quality level of a view changed.
    pub(super) changes: usize,
    /// The cameras of the latest frame that are drawn when they change, with their size.
    pub(super) cached: Vec<(String, [u32; 2])>,
}

pub(super) fn every(interval: u32) -> QualityLevel {
    QualityLevel::Drawn(ViewVariant { interval, ..ViewVariant::BEST })
}

pub(super) fn small() -> QualityLevel {
    QualityLevel::Drawn(ViewVariant { size: SMALL, ..ViewVariant::BEST })
}

pub(super) fn view(name: &str, priority: i32, cost: f64, levels: &[QualityLevel]) -> Simulated {
    with_cameras(name, priority, cost, 1, levels)
}

pub(super) fn with_cameras(name: &str, priority: i32, cost: f64, cameras: usize, levels: &[QualityLevel]) -> Simulated {
    let camera = |index| Camera::looking_at(format!("{name} {index}"), DVec3::Z, DVec3::ZERO);
    let (name, cameras, levels) = (name.to_owned(), (0..cameras).map(camera).collect(), levels.to_vec());
    let view = BudgetedView { name, priority, cameras, levels };
    Simulated { view, cost, share_of_small: f64::from(SMALL * SMALL) }
}

impl Simulation {
    pub(super) fn new(milliseconds: f64, rest: f64, views: &[Simulated]) -> Self {
        let budget = ViewBudget::new(milliseconds).unwrap();
        let (views, random) = (views.to_vec(), Rng::with_seed(3));
        Self { budget, views, rest, noise: 0.0, random, frame: 0, changes: 0, cached: Vec::new() }
    }

    pub(super) fn levels(&self) -> Vec<usize> {
        self.views.iter().map(|simulated| self.budget.level(&simulated.view.name).unwrap()).collect()
    }

    pub(super) fn is_at_best(&self) -> bool {
        self.levels().iter().all(|level| *level == 0)
    }

    pub(super) fn is_at_last(&self) -> bool {
        self.levels().iter().zip(&self.views).all(|(level, simulated)| *level == simulated.view.levels.len())
    }

    pub(super) fn sample(&mut self, milliseconds: f64) -> Duration {
        Duration::from_secs_f64(milliseconds * (1.0 + self.noise * (2.0 * self.random.f64() - 1.0)) * 1e-3)
    }

    /// Draws a frame, and returns its statistics, before the controller gets them.
    pub(super) fn draw(&mut self) -> FrameStatistics {
        let views: Vec<_> = self.views.iter().map(|simulated| simulated.view.clone()).collect();
        let cameras = self.budget.cameras(&views).unwrap();
        let mut statistics = FrameStatistics {
            tuning: FrameTuning { choices: self.budget.choices().collect(), ..FrameTuning::default() },
            ..FrameStatistics::default()
        };
        let mut total = self.sample(self.rest);
        let cached = std::mem::take(&mut self.cached);
        for (index, camera) in (0..).zip(cameras) {
            let is_drawn = match camera.redraw {
                Redraw::Interval(interval) => (self.frame + index).is_multiple_of(interval),
                Redraw::OnCameraChange => {
                    self.cached.push((camera.name.clone(), camera.size));
                    !cached.contains(&(camera.name.clone(), camera.size))
                }
                Redraw::EveryFrame => true,
            };
            let simulated = self.views.iter().find(|simulated| camera.name.starts_with(&simulated.view.name)).unwrap();
            let is_small = camera.size != simulated.view.cameras[0].size;
            let cost = simulated.cost * if is_small { simulated.share_of_small } else { 1.0 };
            let time = if is_drawn { self.sample(cost) } else { Duration::ZERO };
            total += time;
            statistics.view_times.push(time);
            statistics.views.push(ViewStatistics {
                name: camera.name,
                kind: ViewKind::Main,
                age: u32::from(!is_drawn),
                visible: 0,
                static_groups: 0,
                objects_of_static_groups: 0,
                occluded: 0,
                lights: 0,
                items: 0,
                commands: 0,
                batches: 0,
                bundles: 0,
                culled_triangles: CulledTriangles::default(),
                levels_of_detail: None,
            });
        }
        statistics.stages = StageTimes { record: total, ..StageTimes::default() };
        self.frame += 1;
        statistics
    }

    pub(super) fn run(&mut self, frames: usize) {
        for _ in 0..frames {
            let statistics = self.draw();
            let before = self.levels();
            self.budget.update(&statistics);
            self.changes += before.iter().zip(self.levels()).filter(|(before, after)| **before != *after).count();
        }
    }

    /// What a frame costs on average on the current quality levels, in milliseconds: a sum over what each quality level
    /// says.
    pub(super) fn true_cost(&self) -> f64 {
        let cost = |(level, simulated): (usize, &Simulated)| {
            let count = simulated.view.cameras.len();
            match level.checked_sub(1).map(|index| simulated.view.levels[index]) {
                None => simulated.cost * count as f64,
                Some(QualityLevel::LeftOut) => 0.0,
                Some(QualityLevel::Drawn(form)) => {
                    let share = if form.size < 1.0 { simulated.share_of_small } else { 1.0 };
                    simulated.cost * count.min(form.max_cameras) as f64 * share / f64::from(form.interval)
                }
            }
        };
        self.rest + self.levels().into_iter().zip(&self.views).map(cost).sum::<f64>()
    }

    pub(super) fn scale_costs(&mut self, factor: f64) {
        self.rest *= factor;
        self.views.iter_mut().for_each(|simulated| simulated.cost *= factor);
    }
}
