//! What each view costs, and what leaving it out would save.

use std::collections::HashMap;
use std::error::Error;
use std::sync::Arc;
use std::time::{Duration, Instant};

use drawloom::backend::{Backend, TargetMemory};
use drawloom::scene::{Camera, SceneRef};
use drawloom::timeline::Log;
use drawloom::{FrameStatistics, Renderer, Submitter};
use drawloom_output::{OutputFile, print_line};
use serde::Serialize;

use crate::gallery::Gallery;

/// Frames that are drawn before others are measured: targets and pipelines are made in them, and the impostor is drawn,
/// which is cached afterwards.
const WARM_UP_FRAMES: u32 = 3;

/// A view, and what it costs.
#[derive(Serialize)]
pub struct ViewCost {
    name: String,
    kind: &'static str,
    /// The view that samples it; none for one that all views share.
    parent: Option<String>,
    objects: usize,
    commands: usize,
    /// The thread time of its stages a frame, in milliseconds.
    ms: f64,
    /// By how many milliseconds a frame without it, and without those that only it samples, is recorded and submitted
    /// sooner. Only of views that may be left out.
    saves_ms: Option<f64>,
    /// Its quality level at the end of the frames with a budget: 0 at its best, and without a budget.
    level: usize,
}

/// Frames drawn in a row with a view, and then without it, before the two alternate.
const BLOCK_FRAMES: u32 = 10;

/// How many frames [`measure`] draws.
pub fn frames_to_draw(gallery: &Gallery, frames: u32) -> u64 {
    let [frames, blocks, warm_up] = [frames, frames.div_ceil(BLOCK_FRAMES), WARM_UP_FRAMES].map(u64::from);
    frames + warm_up + 2 * (frames + blocks * warm_up) * gallery.optional_views().count() as u64
}

/// Draws the gallery, in turn whole and without each of its views. Calls `drawn` after each frame.
///
/// # Errors
/// If a frame fails.
pub fn measure<B: Backend>(
    gallery: &Gallery,
    renderer: &mut Renderer<B>,
    submitter: &Submitter<B>,
    frames: u32,
    mut drawn: impl FnMut(),
) -> Result<(Vec<ViewCost>, TargetMemory), Box<dyn Error>> {
    let mut draw = |renderer: &mut Renderer<B>, cameras: &[Camera]| -> Result<_, Box<dyn Error>> {
        let scene = SceneRef { cameras, ..gallery.scene.as_scene_ref() };
        let start = Instant::now();
        let submitted = submitter.submit(renderer.record(scene)?)?;
        let took = start.elapsed();
        drawn();
        Ok((took, submitted.statistics))
    };
    let whole = &gallery.scene.cameras;
    let mut saved: HashMap<String, f64> = HashMap::new();
    for view in gallery.optional_views() {
        let without = gallery.without(view);
        let mut times = [Vec::new(), Vec::new()];
        while times[1].len() < frames as usize {
            for (times, cameras) in times.iter_mut().zip([whole, &without]) {
                for _ in 0..WARM_UP_FRAMES {
                    draw(renderer, cameras)?;
                }
                for _ in 0..BLOCK_FRAMES.min(frames - times.len() as u32) {
                    times.push(draw(renderer, cameras)?.0);
                }
            }
        }
        let [whole, without] = times.map(|mut times| {
            times.sort_unstable();
            times[times.len() / 2].as_secs_f64() * 1e3
        });
        saved.insert(view.to_owned(), whole - without);
    }

    for _ in 0..WARM_UP_FRAMES {
        draw(renderer, whole)?;
    }
    let timeline = Arc::clone(renderer.scheduler().timeline());
    timeline.start();
    let (mut statistics, mut times) = (None, HashMap::new());
    for _ in 0..frames {
        statistics = Some(draw(renderer, whole)?.1);
        // After each frame, because the timeline has room for some only.
        add_times(&timeline.take(), &mut times)?;
    }
    timeline.stop();
    let FrameStatistics { views, targets, .. } = statistics.ok_or("no frame was drawn")?;
    let names: Vec<_> = views.iter().map(|view| view.name.clone()).collect();
    let cost_of = |view: drawloom::ViewStatistics| {
        let parent = view.name.rsplit_once('/').map(|(parent, _)| parent.to_owned());
        ViewCost {
            kind: view.kind.name(),
            parent: parent.filter(|parent| names.contains(parent)),
            objects: view.visible,
            commands: view.commands,
            ms: times.get(&view.name).copied().unwrap_or_default().as_secs_f64() * 1e3 / f64::from(frames),
            saves_ms: saved.get(&view.name).copied(),
            level: 0,
            name: view.name,
        }
    };
    Ok((views.into_iter().map(cost_of).collect(), targets))
}

/// Adds the thread time of each view's stages, by its name.
///
/// # Errors
/// If the timeline had no room for all events.
fn add_times(log: &Log, times: &mut HashMap<String, Duration>) -> Result<(), Box<dyn Error>> {
    if log.all_dropped() > 0 {
        return Err(format!("the timeline had no room for {} events of a frame", log.all_dropped()).into());
    }
    for run in &log.runs {
        for chunk in &run.chunks {
            if let Some(view) = &run.graph.nodes[chunk.node].labels.view {
                *times.entry(view.to_string()).or_default() += chunk.ended.saturating_sub(chunk.started);
            }
        }
    }
    Ok(())
}

/// Sets the quality levels of views, by name.
pub fn set_levels(views: &mut [ViewCost], levels: &HashMap<String, usize>) {
    for view in views {
        view.level = levels.get(&view.name).copied().unwrap_or(0);
    }
}

/// Prints a line for each view, and the memory of all.
pub fn print(views: &[ViewCost], targets: TargetMemory) {
    let line = format!("{:<28} {:<10} {:>8} {:>9}", "view", "kind", "objects", "commands");
    print_line!("{line} {:>8} {:>9} {:>4}", "ms", "saves ms", "quality level");
    for view in views {
        let saves = view.saves_ms.map_or_else(|| "-".to_owned(), |saves| format!("{saves:.3}"));
        let ViewCost { name, kind, objects, commands, ms, level, .. } = view;
        print_line!("{name:<28} {kind:<10} {objects:>8} {commands:>9} {ms:>8.3} {saves:>9} {level:>4}");
    }
    let mebibytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    let TargetMemory { textures, bytes, dedicated_bytes, .. } = targets;
    let (bytes, dedicated) = (mebibytes(bytes), mebibytes(dedicated_bytes));
    print_line!(
        "ms: thread time of a frame with all views. saves ms: wall time of a frame without the view; below 0 is noise."
    );
    print_line!("quality level: 0 is a view at its best, higher ones are cheaper.");
    print_line!("{textures} textures of targets, {bytes:.1} MiB; {dedicated:.1} MiB if each target had its own");
}

/// Writes the table of views as JSON.
///
/// # Errors
/// If the file cannot be written.
pub fn write(views: &[ViewCost], file: &OutputFile) -> Result<(), Box<dyn Error>> {
    Ok(file.write_all(serde_json::to_string_pretty(&serde_json::json!({ "views": views }))?)?)
}
