//! Budgets of views, and how frames are divided into jobs.

use drawloom::backend::NullBackend;
use drawloom::glam::DVec3;
use drawloom::graph::NodeError;
use drawloom::process::Deferred;
use drawloom::scene::{Camera, Redraw};
use drawloom::task::{Scheduler, Worker};
use drawloom::{
    BudgetedView, CpuNode, FrameInputs, Granularity, NodeAccesses, NodeContext, QualityLevel, Renderer, ViewBudget,
    ViewVariant,
};
use libtest_mimic::Failed;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::NumberCase;
use crate::fixture::{COUNTS, FLOATS, Fixture, SIZES, ensure, refused, same, scene};

pub const CASES: &[NumberCase] = &[
    NumberCase {
        name: "view_budgets_of_any_time",
        numbers: &["ViewBudget::new", "ViewBudget::set_milliseconds"],
        check: times,
    },
    NumberCase {
        name: "forms_of_views_of_any_numbers",
        numbers: &[
            "BudgetedView::priority",
            "ViewVariant::interval",
            "ViewVariant::level_of_detail_scale",
            "ViewVariant::max_cameras",
            "ViewVariant::size",
            "scene::Redraw::Interval",
            "scene::Camera::level_of_detail_scale",
        ],
        check: forms,
    },
    NumberCase { name: "jobs_of_any_size", numbers: &["Granularity::Chunk"], check: granularity },
    NumberCase {
        name: "cpu_nodes_of_any_width",
        numbers: &["CpuNode::width", "CpuNode::items_per_job"],
        check: node_widths,
    },
];

fn times() -> Result<(), Failed> {
    let mut budget = ViewBudget::new(1.0)?;
    for milliseconds in [0.0, -1.0, f64::NAN, f64::INFINITY, f64::MAX, f64::MIN, 5e-324] {
        refused(ViewBudget::new(milliseconds), "budget")?;
        refused(budget.set_milliseconds(milliseconds), "budget")?;
    }
    Ok(())
}

fn forms() -> Result<(), Failed> {
    let camera = |name: &str| Camera { size: [16, 16], ..Camera::looking_at(name, DVec3::Z * 3.0, DVec3::ZERO) };
    let draw = |form: ViewVariant, priority: i32| -> Result<(), Failed> {
        // Next to nothing, so that the last quality level is taken.
        let mut budget = ViewBudget::new(1e-6)?;
        let view = BudgetedView {
            name: "view".to_owned(),
            priority,
            cameras: vec![camera("main"), camera("other")],
            levels: vec![QualityLevel::Drawn(form)],
        };
        let mut fixture = Fixture::null(1);
        for _ in 0..30 {
            let mut scene = scene();
            scene.cameras = budget.cameras(std::slice::from_ref(&view))?;
            fixture.renderer.add_choices(budget.choices().collect::<Vec<_>>());
            let submitted = fixture.draw(&scene)?;
            budget.update(&submitted.statistics);
        }
        Ok(())
    };
    let best = ViewVariant::BEST;
    for priority in [i32::MIN, 0, i32::MAX] {
        draw(best, priority)?;
    }
    for interval in COUNTS {
        let drawn = draw(ViewVariant { interval, ..best }, 0);
        ensure(drawn.is_ok() == (interval > 0), format_args!("an interval of {interval}: {drawn:?}"))?;
    }
    for max_cameras in SIZES {
        let drawn = draw(ViewVariant { max_cameras, ..best }, 0);
        ensure(drawn.is_ok() == (max_cameras > 0), format_args!("{max_cameras} cameras: {drawn:?}"))?;
    }
    for number in FLOATS {
        let drawn = draw(ViewVariant { size: number, ..best }, 0);
        ensure(drawn.is_ok() == (number > 0.0 && number <= 1.0), format_args!("a size of {number}: {drawn:?}"))?;
        let drawn = draw(ViewVariant { level_of_detail_scale: number, ..best }, 0);
        let is_valid = number >= 1.0 && number.is_finite();
        ensure(drawn.is_ok() == is_valid, format_args!("levels coarser by {number}: {drawn:?}"))?;
        let mut scene = scene();
        scene.cameras[0].level_of_detail_scale = number;
        let drawn = Fixture::null(1).draw(&scene);
        let is_valid = number >= 0.0 && number.is_finite();
        ensure(drawn.is_ok() == is_valid, format_args!("a camera's levels coarser by {number}"))?;
    }
    for interval in COUNTS {
        let mut scene = scene();
        scene.cameras[0].redraw = Redraw::Interval(interval);
        let mut fixture = Fixture::null(1);
        for _ in 0..3 {
            let drawn = fixture.draw(&scene);
            ensure(drawn.is_ok() == (interval > 0), format_args!("redrawn every {interval} frames"))?;
        }
    }
    Ok(())
}

fn granularity() -> Result<(), Failed> {
    for workers in [1, 2] {
        for chunk in SIZES {
            let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture());
            let built = builder.granularity(Granularity::Chunk(chunk)).build(Arc::new(Scheduler::new(workers)?));
            match built {
                Err(error) if chunk == 0 => refused(Err::<(), _>(error), "Granularity::Chunk")?,
                built => {
                    let (renderer, submitter) = built?;
                    Fixture { renderer, submitter }.expect_usual(chunk)?;
                }
            }
        }
    }
    Ok(())
}

struct Counts {
    width: usize,
    items_per_job: Option<usize>,
    done: AtomicUsize,
}

impl CpuNode for Counts {
    fn name(&self) -> &str {
        "counts"
    }

    fn declare(&self, _: &mut NodeAccesses) {}

    fn width(&self, _: &NodeContext<'_>) -> usize {
        self.width
    }

    fn items_per_job(&self) -> Option<usize> {
        self.items_per_job
    }

    fn run(&self, _: &NodeContext<'_>, items: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        self.done.fetch_add(items.len(), Ordering::Relaxed);
        Ok(())
    }
}

fn node_widths() -> Result<(), Failed> {
    for workers in [1, 2] {
        let mut fixture = Fixture::null(workers);
        for (width, items_per_job) in [
            (0, None),
            (0, Some(0)),
            (100, Some(0)),
            (100, Some(usize::MAX)),
            (usize::MAX, Some(usize::MAX)),
            (1 << 63, Some(1 << 61)),
        ] {
            let node = Counts { width, items_per_job, done: AtomicUsize::new(0) };
            let recorded = fixture
                .renderer
                .record_with(FrameInputs { nodes: &[&node], ..FrameInputs::new(scene().as_scene_ref()) })?;
            fixture.submitter.submit(recorded)?;
            same(node.done.into_inner(), width, format_args!("items, {items_per_job:?} per job"))?;
        }
    }
    Ok(())
}
