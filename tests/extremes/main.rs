//! Scenes at the ends of what numbers can say, on every backend: each is drawn right, refused by a named error, or drawn with
//! what cannot be left out and counted. Nothing panics, nothing hangs, no pixel is not a number, and nothing is lost in silence.
//!
//! Without an adapter the cases on wgpu show as ignored; with `DRAWLOOM_REQUIRE_ADAPTER=1` a missing one fails them. Those that the
//! processor draws take half an hour where nothing is optimised, and show as ignored there: with
//! `--config profile.dev.package.drawloom.opt-level=1` and `DRAWLOOM_DRAW_ON_PROCESSOR=1` they run, in two minutes.
//!
//! Shear is not among the cases: an object's transform is one scale along its own axes and one turn, and objects have no
//! parents, so it cannot be said.

mod amounts;
mod cameras;
mod deadline;
mod lights;
mod look;
mod numbers;
mod oracle;
mod places;
mod qualities;
mod signs;
mod special;
mod stage;

use libtest_mimic::{Arguments, Failed, Trial};

use stage::{StageName, Studio};

/// What is to hold on a backend.
type Case = (&'static str, fn(&mut Studio) -> Result<(), Failed>);

fn main() {
    let arguments = Arguments::from_args();
    let is_set = |name| std::env::var_os(name).is_some_and(|value| value == "1");
    let required = is_set("DRAWLOOM_REQUIRE_ADAPTER");
    let is_optimised = !cfg!(debug_assertions) || is_set("DRAWLOOM_DRAW_ON_PROCESSOR");
    let no_adapter = stage::device().is_none();
    let mut trials = Vec::new();
    for stage in StageName::ALL {
        let lacks_adapter = stage == StageName::Wgpu && no_adapter;
        let cases = [cameras::CASES, places::CASES, numbers::CASES, lights::CASES, amounts::CASES, qualities::CASES];
        for &(name, case) in cases.into_iter().flatten() {
            let case = move || {
                if lacks_adapter {
                    return Err("there is no graphics adapter".into());
                }
                deadline::within_the_deadline(move || case(&mut Studio::new(stage)?))
            };
            let trial = Trial::test(format!("{}::{name}", stage.name()), case);
            let by_processor = matches!(stage, StageName::Software | StageName::Reference);
            trials.push(trial.with_ignored_flag((lacks_adapter && !required) || (by_processor && !is_optimised)));
        }
    }
    libtest_mimic::run(&arguments, trials).exit();
}
