//! The settings of the quality, and what each costs in the engine's scene.

mod price;

use drawloom::backend::Backend;
use drawloom::quality::{Knob, Quality};
use drawloom::{FrameStatistics, Renderer};
use egui::{Button, ComboBox, Grid, ProgressBar, RichText, Ui};

use crate::colors::ACCENT;
use price::{KnobValue, Measurement, PriceList};

/// Shows and changes the quality, and measures what its settings cost.
#[derive(Debug, Default)]
pub struct QualityPanel {
    prices: PriceList,
    /// The quality that the prices were measured against.
    prices_of: Option<Quality>,
    measurement: Option<Measurement>,
    /// Why the latest change was refused.
    error: Option<String>,
}

impl QualityPanel {
    /// Adds a frame that was just recorded.
    pub fn add_frame(&mut self, statistics: &FrameStatistics) {
        if let Some(measurement) = &mut self.measurement {
            measurement.add_frame(statistics);
        }
    }

    /// Whether a measurement runs.
    pub fn is_measuring(&self) -> bool {
        self.measurement.is_some()
    }

    /// Sets the quality that a running measurement needs for the next frame.
    pub fn update<B: Backend>(&mut self, renderer: &mut Renderer<B>) {
        let Some(measurement) = &mut self.measurement else { return };
        if let Some(quality) = measurement.next_quality(&mut self.prices)
            && let Err(error) = renderer.set_quality(quality)
        {
            measurement.refuse(&mut self.prices, error.to_string());
        }
        if measurement.has_ended() {
            self.cancel_measurement(renderer);
        }
    }

    /// Ends a measurement, and sets the quality from before it.
    pub fn cancel_measurement<B: Backend>(&mut self, renderer: &mut Renderer<B>) {
        if let Some(measurement) = self.measurement.take() {
            self.set(renderer, measurement.baseline());
        }
    }

    /// Shows the panel.
    pub fn show<B: Backend>(&mut self, ui: &mut Ui, renderer: &mut Renderer<B>) {
        let current = self.measurement.as_ref().map_or(*renderer.quality(), Measurement::baseline);
        if self.prices_of != Some(current) {
            self.prices.clear();
            self.prices_of = Some(current);
        }
        let (mut chosen, mut is_preset) = (current, false);
        ui.horizontal(|ui| {
            ui.add_enabled_ui(self.measurement.is_none(), |ui| {
                for (name, preset) in
                    [("fast", Quality::fast()), ("balanced", Quality::balanced()), ("exact", Quality::exact())]
                {
                    is_preset |= ui.selectable_value(&mut chosen, preset, name).clicked();
                }
            });
            if renderer.pipeline_has_quality() {
                self.show_measurement(ui, renderer, current);
            }
        });
        if !renderer.pipeline_has_quality() {
            ui.label(
                RichText::new("The pipeline has settings of its own, so nothing can be measured. Choose a quality here, which replaces \
                     all of them, or give one to RendererBuilder::quality.")
                    .color(ACCENT),
            );
        }
        ui.weak(
            "A price is what a frame takes longer, or shorter, than with the chosen value. With vertical synchronisation, the \
             time between frames does not tell.",
        );
        if let Some(error) = &self.error {
            ui.label(RichText::new(error).color(ACCENT));
        }
        Grid::new("quality").striped(true).num_columns(4).show(ui, |ui| {
            ["setting", "value", "", "prices: CPU time, time between frames"]
                .into_iter()
                .for_each(|name| _ = ui.weak(name));
            ui.end_row();
            for (index, knob) in Knob::ALL.iter().enumerate() {
                let can_measure = self.measurement.is_none() && renderer.pipeline_has_quality();
                self.show_knob(ui, index, knob, can_measure, &mut chosen);
                ui.end_row();
            }
        });
        if (chosen != current || is_preset) && self.measurement.is_none() {
            self.set(renderer, chosen);
        }
    }

    fn show_measurement<B: Backend>(&mut self, ui: &mut Ui, renderer: &mut Renderer<B>, current: Quality) {
        if let Some(measurement) = &self.measurement {
            ui.add(ProgressBar::new(measurement.progress()).desired_width(320.0).text(measurement.progress_text()));
            if ui.button("Stop").clicked() {
                self.cancel_measurement(renderer);
            }
        } else if ui.button("Measure all prices").clicked() {
            self.measurement =
                Some(Measurement::new(current, (0..Knob::ALL.len()).flat_map(|knob| alternatives(knob, current))));
        }
    }

    fn show_knob(&mut self, ui: &mut Ui, index: usize, knob: &Knob, can_measure: bool, chosen: &mut Quality) {
        let current = *chosen;
        ui.label(knob.name).on_hover_text(knob.explanation);
        let selected = knob.chosen(&current).map_or("another value", |value| knob.values[value].0);
        ui.add_enabled_ui(self.measurement.is_none(), |ui| {
            ComboBox::from_id_salt(knob.name).selected_text(selected).show_ui(ui, |ui| {
                for (name, apply) in knob.values {
                    let mut changed = *chosen;
                    apply(&mut changed);
                    let check = changed.check();
                    let is_chosen = changed == *chosen;
                    let response = ui.add_enabled(check.is_ok(), Button::selectable(is_chosen, *name));
                    if response.clicked() {
                        *chosen = changed;
                    }
                    if let Err(error) = check {
                        response.on_disabled_hover_text(error.to_string());
                    }
                }
            });
        });
        if ui.add_enabled(can_measure, Button::new("Measure").small()).clicked() {
            self.measurement = Some(Measurement::new(current, alternatives(index, current)));
        }
        let prices = alternatives(index, current)
            .filter_map(|value| Some(format!("{} {}", knob.values[value.value].0, self.prices.get(value)?)));
        ui.label(prices.collect::<Vec<_>>().join("; "));
    }

    fn set<B: Backend>(&mut self, renderer: &mut Renderer<B>, quality: Quality) {
        self.error = renderer.set_quality(quality).err().map(|error| error.to_string());
    }
}

/// The values of a knob that are not chosen.
fn alternatives(knob: usize, current: Quality) -> impl Iterator<Item = KnobValue> {
    let chosen = Knob::ALL[knob].chosen(&current);
    (0..Knob::ALL[knob].values.len())
        .filter(move |value| Some(*value) != chosen)
        .map(move |value| KnobValue { knob, value })
}
