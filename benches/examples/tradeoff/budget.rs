//! The most accurate settings that fit into a budget.

use drawloom::quality::Quality;
use drawloom::scene::{Camera, Scene};

use crate::Failure;
use crate::measure::time_along;
use crate::results::Results;
use crate::settings::{Knob, Setting};
use crate::stage::Stage;

/// From the most accurate settings on, turns down what saves most time for the error it makes, until a frame fits; then turns back up
/// what it fits without, the greatest error first; and says what that is. What knobs save together is measured, since it is not the sum
/// of what each saves alone.
///
/// # Errors
/// If a frame fails.
pub fn answer(
    budget_ms: f64,
    stage: &mut dyn Stage,
    scene: &Scene,
    path: &[Camera],
    settings: &[Setting],
    results: &Results,
) -> Result<(), Failure> {
    let exact = Quality::exact();
    let mut time_of =
        |quality: &Quality| Ok::<_, Failure>(time_along(stage, scene, path, quality)?.frame.as_secs_f64() * 1e3);
    let mut quality = exact;
    let mut time = time_of(&quality)?;
    let mut turned: Vec<&Setting> = Vec::new();
    let mut steps = steps(settings, results);
    while time > budget_ms {
        let Some(step) = steps.pop() else {
            println!("Nothing fits into {budget_ms} ms: with {} it is {time:.2} ms.", names(&turned));
            return Ok(());
        };
        let changed = step.knob.changed(&quality, &step.quality);
        // Some do not go together with what was turned before.
        if quality == changed || changed.check().is_err() {
            continue;
        }
        let faster = time_of(&changed)?;
        if faster < time {
            turned.retain(|other| other.knob != step.knob);
            turned.push(step);
            (quality, time) = (changed, faster);
        }
    }
    let error_of = |step: &Setting| {
        let entry = settings
            .iter()
            .zip(&results.entries)
            .find(|(setting, _)| setting.name == step.name && setting.knob == step.knob);
        entry.map_or(0.0, |(_, entry)| entry.rmse)
    };
    let mut by_error = turned.clone();
    by_error.sort_by(|one, other| error_of(other).total_cmp(&error_of(one)));
    for step in by_error {
        let changed = step.knob.changed(&quality, &exact);
        if changed.check().is_err() {
            continue;
        }
        let slower = time_of(&changed)?;
        if slower <= budget_ms {
            turned.retain(|other| other.knob != step.knob);
            (quality, time) = (changed, slower);
        }
    }
    println!("The most accurate found that fits into {budget_ms} ms takes {time:.2} ms:\n");
    if turned.is_empty() {
        println!("Quality::exact()");
    } else {
        println!("Quality::exact() with {}", names(&turned));
    }
    println!("\n{quality:#?}");
    Ok(())
}

fn names(turned: &[&Setting]) -> String {
    let names: Vec<_> = turned.iter().map(|setting| format!("{}: {}", setting.knob.name(), setting.name)).collect();
    names.join(", ")
}

/// What to turn down, the best last: by the time it saves for the error that it makes.
fn steps<'a>(settings: &'a [Setting], results: &Results) -> Vec<&'a Setting> {
    let Some(exact) = results.entries.first() else { return Vec::new() };
    let alone = settings.iter().zip(&results.entries).filter(|(setting, _)| setting.knob != Knob::Preset);
    let mut steps: Vec<_> = alone
        .filter(|(_, entry)| entry.frame_ns < exact.frame_ns)
        .map(|(setting, entry)| {
            let saved = (exact.frame_ns - entry.frame_ns) as f64;
            (saved / entry.rmse.max(SMALLEST_ERROR), setting)
        })
        .collect();
    steps.sort_by(|(one, _), (other, _)| one.total_cmp(other));
    steps.into_iter().map(|(_, setting)| setting).collect()
}

/// Of a picture of bytes, a difference below this is none.
const SMALLEST_ERROR: f64 = 1e-6;
