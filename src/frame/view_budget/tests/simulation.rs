//! Frames of a controller, whose costs are known.

use std::time::Duration;

use fastrand::Rng;
use glam::DVec3;

use crate::frame::view_budget::ViewBudget;
use crate::frame::{BudgetedView, FrameStatistics, Rung, StageTimes, ViewForm, ViewStatistics};
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
    /// What drawing a camera takes on a rung with a smaller picture, as a share of that.
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
    /// How often the rung of a view changed.
    pub(super) changes: usize,
    /// The cameras of the latest frame that are drawn when they change, with their size.
    pub(super) cached: Vec<(String, [u32; 2])>,
}

pub(super) fn every(interval: u32) -> Rung {
    Rung::Drawn(ViewForm { interval, ..ViewForm::BEST })
}

pub(super) fn small() -> Rung {
    Rung::Drawn(ViewForm { size: SMALL, ..ViewForm::BEST })
}

pub(super) fn view(name: &str, priority: i32, cost: f64, ladder: &[Rung]) -> Simulated {
    with_cameras(name, priority, cost, 1, ladder)
}

pub(super) fn with_cameras(name: &str, priority: i32, cost: f64, cameras: usize, ladder: &[Rung]) -> Simulated {
    let camera = |index| Camera::looking_at(format!("{name} {index}"), DVec3::Z, DVec3::ZERO);
    let (name, cameras, ladder) = (name.to_owned(), (0..cameras).map(camera).collect(), ladder.to_vec());
    let view = BudgetedView { name, priority, cameras, ladder };
    Simulated { view, cost, share_of_small: f64::from(SMALL * SMALL) }
}

impl Simulation {
    pub(super) fn new(milliseconds: f64, rest: f64, views: &[Simulated]) -> Self {
        let budget = ViewBudget::new(milliseconds).unwrap();
        let (views, random) = (views.to_vec(), Rng::with_seed(3));
        Self { budget, views, rest, noise: 0.0, random, frame: 0, changes: 0, cached: Vec::new() }
    }

    pub(super) fn rungs(&self) -> Vec<usize> {
        self.views.iter().map(|simulated| self.budget.rung(&simulated.view.name).unwrap()).collect()
    }

    pub(super) fn is_at_best(&self) -> bool {
        self.rungs().iter().all(|rung| *rung == 0)
    }

    pub(super) fn is_at_last(&self) -> bool {
        self.rungs().iter().zip(&self.views).all(|(rung, simulated)| *rung == simulated.view.ladder.len())
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
                pieces: 0,
                objects_of_pieces: 0,
                occluded: 0,
                lights: 0,
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
            let before = self.rungs();
            self.budget.update(&statistics);
            self.changes += before.iter().zip(self.rungs()).filter(|(before, after)| **before != *after).count();
        }
    }

    /// What a frame costs on average on the current rungs, in milliseconds: a sum over what each rung says.
    pub(super) fn true_cost(&self) -> f64 {
        let cost = |(rung, simulated): (usize, &Simulated)| {
            let count = simulated.view.cameras.len();
            match rung.checked_sub(1).map(|index| simulated.view.ladder[index]) {
                None => simulated.cost * count as f64,
                Some(Rung::LeftOut) => 0.0,
                Some(Rung::Drawn(form)) => {
                    let share = if form.size < 1.0 { simulated.share_of_small } else { 1.0 };
                    simulated.cost * count.min(form.max_cameras) as f64 * share / f64::from(form.interval)
                }
            }
        };
        self.rest + self.rungs().into_iter().zip(&self.views).map(cost).sum::<f64>()
    }

    pub(super) fn scale_costs(&mut self, factor: f64) {
        self.rest *= factor;
        self.views.iter_mut().for_each(|simulated| simulated.cost *= factor);
    }
}
