//! What each view draws, and what that costs.

use drawloom::ViewStatistics;
use drawloom::backend::TargetMemory;
use egui::{Grid, Ui};

use crate::frame_history::FrameHistory;

const COLUMNS: [(&str, &str); 3] = [
    ("view", "The camera's name."),
    ("kind", "What the view is for."),
    ("thread time", "The time of all workers in its stages, and in those of other views of its name."),
];

type Count = fn(&ViewStatistics) -> usize;

/// The columns after these: name, explanation, and number.
const COUNTS: &[(&str, &str, Count)] = &[
    ("visible", "Objects that it sees.", |view| view.visible),
    ("occluded", "Objects in its frustum that others hide.", |view| view.occluded),
    ("lights", "Lights that reach it.", |view| view.lights),
    ("commands", "Draws of single objects, over all its processes.", |view| view.commands),
    ("batches", "Instanced draws that they are merged into.", |view| view.batches),
    ("bundles", "Bundles that the batches fill.", |view| view.bundles),
];

/// Shows the views of the shown frame.
pub fn show(ui: &mut Ui, history: &FrameHistory) {
    let shown = history.shown().and_then(|shown| Some((shown, shown.statistics.as_ref()?)));
    let Some((record, statistics)) = shown else {
        ui.weak("No statistics of this frame.");
        return;
    };
    Grid::new("views").striped(true).num_columns(COLUMNS.len() + COUNTS.len()).show(ui, |ui| {
        let counts = COUNTS.iter().map(|&(name, explanation, _)| (name, explanation));
        for (name, explanation) in COLUMNS.into_iter().chain(counts) {
            ui.weak(name).on_hover_text(explanation);
        }
        ui.end_row();
        for view in &statistics.views {
            ui.label(&view.name);
            ui.label(view.kind.name());
            ui.label(format!("{:.0} µs", record.view_time(&view.name).as_secs_f64() * 1e6));
            for (_, _, count) in COUNTS {
                ui.label(count(view).to_string());
            }
            ui.end_row();
        }
    });
    ui.add_space(8.0);
    ui.label(format!(
        "objects: {}, lights: {}, bytes uploaded: {}",
        statistics.objects, statistics.lights, statistics.uploaded
    ));
    if let Some(text) = text_of_targets(&statistics.targets) {
        ui.label(text).on_hover_text("See WgpuBackend::transient_targets.");
    }
    let stages = &statistics.stages;
    let times = [
        ("visibility", stages.visibility),
        ("fill", stages.fill),
        ("sort", stages.sort),
        ("instance", stages.instance),
        ("record", stages.record),
        ("nodes", stages.nodes),
    ];
    let texts = times.map(|(name, time)| format!("{name} {:.0} µs", time.as_secs_f64() * 1e6));
    ui.label(texts.join(", ")).on_hover_text("The thread time of each group of stages, over all views.");
}

/// What the targets of a frame take; `None` for a backend that does not tell.
fn text_of_targets(memory: &TargetMemory) -> Option<String> {
    let TargetMemory { textures, bytes, dedicated_bytes } = *memory;
    let [bytes, dedicated] = [bytes, dedicated_bytes].map(|bytes| bytes as f64 / f64::from(1 << 20));
    let text = || format!("targets: {textures} textures, {bytes:.1} MiB ({dedicated:.1} MiB without sharing)");
    (textures > 0).then(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn targets_are_told_with_and_without_sharing() {
        assert_eq!(text_of_targets(&TargetMemory::default()), None);
        let memory = TargetMemory { textures: 9, bytes: 48_024_000, dedicated_bytes: 79_167_000 };
        let text = text_of_targets(&memory);
        assert_eq!(text.as_deref(), Some("targets: 9 textures, 45.8 MiB (75.5 MiB without sharing)"));
    }
}
