//! A budget for the gallery: which views are drawn in cheaper forms, and which are left out.

use std::collections::HashMap;
use std::error::Error;

use drawloom::backend::Backend;
use drawloom::scene::{Camera, SceneRef};
use drawloom::{BudgetedView, QualityLevel, Renderer, Submitter, ViewBudget, ViewVariant};
use drawloom_output::print_line;

use crate::gallery::Gallery;
use crate::{contact_sheet, mirror_ball};

/// Enough for the first measurements, to degrade, and to try a quality level that is left.
const FRAMES: u32 = 90;

/// What the budget leaves of the gallery.
pub struct Chosen {
    /// The cameras of the last frame.
    pub cameras: Vec<Camera>,
    /// The quality level of each camera, by name.
    pub levels: HashMap<String, usize>,
}

/// How often a budget that gives nothing up is halved, to show what would be.
const MAX_HALVINGS: u32 = 8;

/// Draws frames within a budget, in milliseconds of thread time. Prints a line whenever the quality level of a view
/// changes. If the budget gives nothing up, goes on with half of it, and so on, to show what would be given up first;
/// what is left is still that of the budget.
///
/// # Errors
/// If the budget is no time, or a frame fails.
pub fn choose<B: Backend>(
    milliseconds: f64,
    gallery: &Gallery,
    renderer: &mut Renderer<B>,
    submitter: &Submitter<B>,
) -> Result<Chosen, Box<dyn Error>> {
    let chosen = keep(milliseconds, gallery, renderer, submitter)?;
    let mut is_at_best = chosen.levels.values().all(|level| *level == 0);
    let mut less = milliseconds;
    for _ in 0..MAX_HALVINGS {
        if !is_at_best {
            break;
        }
        less *= 0.5;
        print_line!("nothing is given up; with {less} ms:");
        is_at_best = keep(less, gallery, renderer, submitter)?.levels.values().all(|level| *level == 0);
    }
    Ok(chosen)
}

/// Draws frames within one budget.
///
/// # Errors
/// If the budget is no time, or a frame fails.
fn keep<B: Backend>(
    milliseconds: f64,
    gallery: &Gallery,
    renderer: &mut Renderer<B>,
    submitter: &Submitter<B>,
) -> Result<Chosen, Box<dyn Error>> {
    let (views, mut budget) = (views(gallery), ViewBudget::new(milliseconds)?);
    let levels_of = |budget: &ViewBudget| {
        let of = |view: &BudgetedView| {
            let level = budget.level(&view.name).unwrap_or(0);
            view.cameras.iter().map(|camera| (camera.name.clone(), level)).collect::<Vec<_>>()
        };
        views.iter().flat_map(of).collect::<HashMap<_, _>>()
    };
    let mut frame = 0;
    loop {
        let cameras = budget.cameras(&views)?;
        renderer.add_choices(budget.choices());
        let levels = levels_of(&budget);
        let scene = SceneRef { cameras: &cameras, ..gallery.scene.as_scene_ref() };
        let submitted = submitter.submit(renderer.record(scene)?)?;
        let took = submitted.statistics.stages.total().as_secs_f64() * 1e3;
        frame += 1;
        if frame == FRAMES {
            let left = if budget.is_exhausted() { ", and every view is on its last quality level" } else { "" };
            print_line!("frame {frame:>3}: {took:.2} ms of {milliseconds} ms{left}");
            return Ok(Chosen { cameras, levels });
        }
        budget.update(&submitted.statistics);
        let after = levels_of(&budget);
        for view in &views {
            let [before, level] =
                [&levels, &after].map(|levels| levels.get(&view.cameras[0].name).copied().unwrap_or(0));
            if before != level {
                print_line!(
                    "frame {frame:>3}: {took:.2} ms, {} goes from quality level {before} to {level}",
                    view.name
                );
            }
        }
    }
}

/// The gallery's cameras. The sheet and its main view are always drawn; the portal goes together with the one in it.
fn views(gallery: &Gallery) -> Vec<BudgetedView> {
    let every = |interval| QualityLevel::Drawn(ViewVariant { interval, ..ViewVariant::BEST });
    let mirror = vec![every(2), every(4), QualityLevel::LeftOut];
    let mut views: Vec<BudgetedView> = Vec::new();
    for camera in &gallery.scene.cameras {
        let (group, priority, levels) = match camera.name.as_str() {
            "main" | contact_sheet::TARGET => (camera.name.as_str(), 9, Vec::new()),
            "main/portal/portal" | "main/portal" => ("main/portal", 4, mirror.clone()),
            "main/pool" => ("main/pool", 3, mirror.clone()),
            "guest" | "detail" => (camera.name.as_str(), 2, vec![every(2), every(4)]),
            name if name.starts_with("tiles/") => ("tiles of detail", 0, vec![every(4), QualityLevel::LeftOut]),
            name if name.starts_with(mirror_ball::PROBE) => {
                (mirror_ball::PROBE, 1, vec![every(6), QualityLevel::LeftOut])
            }
            name => (name, 1, mirror.clone()),
        };
        match views.iter_mut().find(|view| view.name == group) {
            Some(view) => view.cameras.push(Camera::clone(camera)),
            None => {
                let (name, cameras) = (group.to_owned(), vec![camera.clone()]);
                views.push(BudgetedView { name, priority, cameras, levels });
            }
        }
    }
    views
}
