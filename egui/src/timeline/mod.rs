//! Where the time of a frame went.

mod frame_chart;
mod lanes;
mod tracks;

use drawloom::report::{FrameReport, SchedulerCosts};
use egui::containers::scroll_area::ScrollSource;
use egui::{RichText, ScrollArea, Ui};

use crate::frame_history::{FrameHistory, FrameRecord};
use lanes::Lanes;

/// The latest frames as bars, and one of them as lanes of workers and threads.
#[derive(Default)]
pub struct TimelinePanel {
    lanes: Lanes,
    /// Measured when a report is first asked for.
    costs: Option<SchedulerCosts>,
    /// The latest report, or why there is none, and the number of its frame.
    report: Option<(u64, String)>,
}

impl TimelinePanel {
    /// Shows the panel.
    pub fn show(&mut self, ui: &mut Ui, history: &mut FrameHistory) {
        frame_chart::show(ui, history);
        let Some(record) = history.shown() else {
            ui.weak("No frame yet.");
            return;
        };
        let (number, duration) = (record.number, record.duration());
        let (mut follows, mut explains) = (history.selected().is_none(), false);
        ui.horizontal(|ui| {
            ui.label(format!("Frame {number}: {:.2} ms", duration.as_secs_f64() * 1e3));
            ui.checkbox(&mut follows, "follow the latest").on_hover_text("A click on a bar stays at its frame.");
            explains = ui
                .button("Why so long?")
                .on_hover_text("Computes the frame's critical path, and replays it.")
                .clicked();
            if record.log.dropped > 0 {
                ui.label(RichText::new(format!("{} events dropped", record.log.dropped)).color(crate::colors::ACCENT));
            }
        });
        if explains {
            let text = self.explain(record);
            self.report = Some((number, text));
        }
        // The wheel zooms.
        ScrollArea::vertical().scroll_source(ScrollSource::SCROLL_BAR).auto_shrink(false).show(ui, |ui| {
            self.lanes.show(ui, record);
            if let Some((frame, text)) = &self.report {
                ui.separator();
                ui.weak(format!("Report on frame {frame}"));
                ui.monospace(text);
            }
        });
        // The frame that is reported on stays.
        history.select(if explains || !follows { Some(history.selected().unwrap_or(number)) } else { None });
    }

    fn explain(&mut self, record: &FrameRecord) -> String {
        let costs = match self.costs {
            Some(costs) => costs,
            None => match SchedulerCosts::measure() {
                Ok(costs) => *self.costs.insert(costs),
                Err(error) => return format!("the costs of the scheduler cannot be measured: {error}"),
            },
        };
        match FrameReport::new(&record.log, record.number, &costs) {
            Ok(report) => report.to_string(),
            Err(error) => format!("there is no report: {error}"),
        }
    }
}
