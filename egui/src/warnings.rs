//! What frames left out, or could not draw as requested.

use drawloom::FrameStatistics;
use drawloom::text::Escaped;
use drawloom::view::SceneIssue;
use egui::{Grid, Ui};

/// The warnings of all frames since the list was cleared, one for each reason.
#[derive(Debug, Default)]
pub struct WarningList {
    entries: Vec<Entry>,
    frames: u64,
}

#[derive(Debug)]
struct Entry {
    issue: SceneIssue,
    /// The number of the latest frame with it, counted by the list.
    frame: u64,
}

impl WarningList {
    /// Adds the warnings of a frame.
    pub fn add_frame(&mut self, statistics: &FrameStatistics) {
        self.frames += 1;
        for issue in &statistics.scene_issues {
            let entry = Entry { issue: issue.clone(), frame: self.frames };
            match self.entries.iter_mut().find(|entry| entry.issue.reason == issue.reason) {
                Some(known) => *known = entry,
                None => self.entries.push(entry),
            }
        }
    }

    /// The number of reasons.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    /// Shows the list.
    pub fn show(&mut self, ui: &mut Ui) {
        if self.entries.is_empty() {
            ui.label("Everything was drawn as requested.");
            return;
        }
        Grid::new("warnings").striped(true).num_columns(5).show(ui, |ui| {
            ["not drawn as requested", "how many", "the first", "its name", "last seen"]
                .into_iter()
                .for_each(|name| _ = ui.weak(name));
            ui.end_row();
            for Entry { issue, frame } in &self.entries {
                ui.label(issue.reason.name());
                ui.label(issue.count.to_string());
                ui.label(format!("index {}", issue.first));
                ui.label(issue.name.as_deref().map(|name| Escaped::new(name).to_string()).unwrap_or_default());
                ui.label(match self.frames - frame {
                    0 => "in the latest frame".to_owned(),
                    ago => format!("{ago} frames ago"),
                });
                ui.end_row();
            }
        });
        if ui.button("Clear").clicked() {
            self.entries.clear();
        }
    }
}

#[cfg(test)]
mod tests {
    use drawloom::view::IssueReason;
    use egui_kittest::Harness;
    use egui_kittest::kittest::Queryable;

    use super::*;

    #[test]
    fn names_are_shown_as_they_are_but_on_one_line_and_in_one_direction() {
        let reason = IssueReason::StaleMesh;
        let issue = SceneIssue { reason, count: 1, first: 0, name: Some("'oak' \"é\"\n\u{202e}elm".into()) };
        let mut list = WarningList::default();
        list.add_frame(&FrameStatistics { scene_issues: vec![issue], ..FrameStatistics::default() });
        let harness = Harness::new_ui(|ui| list.show(ui));
        harness.get_by_label("'oak' \"é\"\\u{a}\\u{202e}elm");
    }
}
