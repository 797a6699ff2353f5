//! What was chosen by measurement, and why.

use drawloom::timeline::{Labels, TuningAlternative};
use egui::{Grid, RichText, Ui};

use crate::frame_history::FrameRecord;

/// Shows the choices of a frame.
pub fn show(ui: &mut Ui, record: Option<&FrameRecord>) {
    let Some(statistics) = record.and_then(|record| record.statistics.as_ref()) else {
        ui.weak("No statistics of this frame.");
        return;
    };
    let tuning = &statistics.tuning;
    ui.strong("Chosen among alternatives, by their measured cost");
    Grid::new("choices").striped(true).num_columns(4).show(ui, |ui| {
        heading(ui, ["choice", "for", "chosen", "instead of"]);
        for choice in &tuning.choices {
            let unit = choice.subject.unit();
            ui.label(choice.subject.name());
            ui.label(owner(&choice.labels));
            let chosen = choice.alternatives.get(choice.chosen).map_or_else(String::new, |chosen| cost(chosen, unit));
            let text = RichText::new(chosen).strong();
            ui.label(if choice.is_trial { text.italics() } else { text }).on_hover_text(if choice.is_trial {
                "A trial: this frame has it only to measure it."
            } else {
                "Chosen by measured cost; a little less is no reason for a change."
            });
            let others = choice.alternatives.iter().enumerate().filter(|&(index, _)| index != choice.chosen);
            let others: Vec<_> = others.map(|(_, other)| cost(other, unit)).collect();
            ui.label(others.join("\n"));
            ui.end_row();
        }
    });
    if tuning.choices.is_empty() {
        ui.weak("No choice is open: nothing to choose between, or the engine fixed all of them.");
    }
    ui.add_space(8.0);
    ui.strong("Sizes of jobs, by the measured cost of their items");
    Grid::new("job sizes").striped(true).num_columns(5).show(ui, |ui| {
        heading(ui, ["stage", "for", "items", "an item", "jobs"]);
        for size in tuning.job_sizes.iter().filter(|size| size.items > 0) {
            ui.label(size.labels.stage.as_deref().unwrap_or("node"));
            ui.label(owner(&size.labels));
            ui.label(size.items.to_string());
            ui.label(size.nanoseconds_per_item.map_or_else(|| "not measured".into(), nanoseconds));
            ui.label(format!("{} of {}", size.jobs(), size.items_per_job));
            ui.end_row();
        }
    });
}

fn heading<const COLUMNS: usize>(ui: &mut Ui, names: [&str; COLUMNS]) {
    names.into_iter().for_each(|name| _ = ui.weak(name));
    ui.end_row();
}

/// What a choice is for: a process in a view, or the whole frame.
fn owner(labels: &Labels) -> String {
    match (&labels.process, &labels.view) {
        (Some(process), Some(view)) => format!("{process} in {view}"),
        (Some(name), None) | (None, Some(name)) => name.to_string(),
        (None, None) => "the frame".into(),
    }
}

fn cost(alternative: &TuningAlternative, unit: &str) -> String {
    let measured = alternative.nanoseconds.map(|time| format!("{} {}/{unit}", alternative.name, nanoseconds(time)));
    measured.unwrap_or_else(|| format!("{} (not measured)", alternative.name))
}

fn nanoseconds(time: f32) -> String {
    match time {
        ..1e3 => format!("{time:.1} ns"),
        ..1e6 => format!("{:.1} µs", time / 1e3),
        _ => format!("{:.1} ms", time / 1e6),
    }
}
