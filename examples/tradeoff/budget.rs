//! The most accurate settings that fit into a budget.

use std::time::Duration;

use drawloom::quality::Quality;
use drawloom::scene::{Camera, Scene};

use crate::Failure;
use crate::measure::time_along;
use crate::results::Results;
use crate::settings::{Knob, Setting};
use crate::stage::Stage;

/// From the most accurate settings on, turns down what saves most time for the error it makes, until a frame fits; and says what that
/// is. What knobs save together is measured, since it is not the sum of what each saves alone.
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
    let mut steps = steps(settings, results);
    let mut quality = Quality::exact();
    let mut turned: Vec<String> = Vec::new();
    loop {
        let frame = time_of(stage, scene, path, &quality)?;
        if milliseconds(frame) <= budget_ms {
            println!("The most accurate that fits into {budget_ms} ms takes {:.2} ms:\n", milliseconds(frame));
            match turned.is_empty() {
                true => println!("Quality::exact()"),
                false => println!("Quality::exact() with {}", turned.join(", ")),
            }
            println!("\n{quality:#?}");
            return Ok(());
        }
        let Some(step) = steps.pop() else {
            println!(
                "Nothing fits into {budget_ms} ms: with {} it is {:.2} ms.",
                turned.join(", "),
                milliseconds(frame)
            );
            return Ok(());
        };
        let changed = step.knob.changed(&quality, &step.quality);
        // Some do not go together with what was turned before.
        if quality != changed && changed.check().is_ok() && time_of(stage, scene, path, &changed)? < frame {
            turned.retain(|other| !other.starts_with(step.knob.name()));
            turned.push(format!("{}: {}", step.knob.name(), step.name));
            quality = changed;
        }
    }
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

fn time_of(stage: &mut dyn Stage, scene: &Scene, path: &[Camera], quality: &Quality) -> Result<Duration, Failure> {
    Ok(time_along(stage, scene, path, quality)?.frame)
}

fn milliseconds(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}
