//! Searches for the most accurate settings within a frame time budget.

use drawloom::scene::Camera;
use drawloom_output::print_line;

use crate::Failure;
use crate::backend::BackendUnderTest;
use crate::configuration::Configuration;
use crate::measure::time_along;
use crate::results::Results;
use crate::settings::{Knob, Setting};
use crate::subject::Subject;

/// Starts at the most accurate settings, and turns down the knob that saves most time per error until a frame fits.
/// Then turns knobs back up, greatest error first, as long as the frame still fits. Prints the result. Combinations are
/// measured, as their savings do not add up.
///
/// # Errors
/// Returns an error if a frame fails.
pub fn search(
    budget_ms: f64,
    backend: &mut dyn BackendUnderTest,
    subject: &mut Subject,
    path: &[Camera],
    settings: &[Setting],
    results: &Results,
) -> Result<(), Failure> {
    let exact = Configuration::exact();
    let mut time_of = |configuration: &Configuration| {
        Ok::<_, Failure>(time_along(backend, subject, path, configuration)?.frame.as_secs_f64() * 1e3)
    };
    let mut configuration = exact;
    let mut time = time_of(&configuration)?;
    let mut reduced: Vec<&Setting> = Vec::new();
    let mut steps = steps(settings, results);
    while time > budget_ms {
        let Some(step) = steps.pop() else {
            print_line!("No setting fits into {budget_ms} ms: with {} a frame takes {time:.2} ms.", names(&reduced));
            return Ok(());
        };
        let changed = step.knob.changed(&configuration, &step.configuration);
        // Some settings exclude each other.
        if configuration == changed || changed.quality.check().is_err() {
            continue;
        }
        let faster = time_of(&changed)?;
        if faster < time {
            reduced.retain(|other| other.knob != step.knob);
            reduced.push(step);
            (configuration, time) = (changed, faster);
        }
    }
    let error_of = |step: &Setting| {
        let entry = settings
            .iter()
            .zip(&results.entries)
            .find(|(setting, _)| setting.name == step.name && setting.knob == step.knob);
        entry.map_or(0.0, |(_, entry)| entry.rmse)
    };
    let mut by_error = reduced.clone();
    by_error.sort_by(|one, other| error_of(other).total_cmp(&error_of(one)));
    for step in by_error {
        let changed = step.knob.changed(&configuration, &exact);
        if changed.quality.check().is_err() {
            continue;
        }
        let slower = time_of(&changed)?;
        if slower <= budget_ms {
            reduced.retain(|other| other.knob != step.knob);
            (configuration, time) = (changed, slower);
        }
    }
    print_line!("The most accurate settings found that fit into {budget_ms} ms take {time:.2} ms:\n");
    if reduced.is_empty() {
        print_line!("exact");
    } else {
        print_line!("exact with {}", names(&reduced));
    }
    print_line!("\n{configuration:#?}");
    Ok(())
}

fn names(reduced: &[&Setting]) -> String {
    let names: Vec<_> = reduced.iter().map(|setting| format!("{}: {}", setting.knob.name(), setting.name)).collect();
    names.join(", ")
}

/// The settings to turn down, the best last, by saved time per error.
fn steps<'a>(settings: &'a [Setting], results: &Results) -> Vec<&'a Setting> {
    let Some(exact) = results.entries.first() else { return Vec::new() };
    let alone = settings.iter().zip(&results.entries).filter(|(setting, _)| setting.knob != Knob::Preset);
    let mut steps: Vec<_> = alone
        .filter(|(_, entry)| entry.frame_ns < exact.frame_ns)
        .map(|(setting, entry)| {
            let saved = (exact.frame_ns - entry.frame_ns) as f64;
            (saved / entry.rmse.max(MIN_ERROR), setting)
        })
        .collect();
    steps.sort_by(|(one, _), (other, _)| one.total_cmp(other));
    steps.into_iter().map(|(_, setting)| setting).collect()
}

/// The minimum error of a setting: smaller differences between pictures of bytes are noise.
const MIN_ERROR: f64 = 1e-6;
