//! Scenes with extreme numbers, on every backend. Each is drawn correctly, refused with a specific error, or drawn
//! without the parts that cannot be drawn, which are counted. No case panics, hangs, draws NaN, or leaves something out
//! silently.
//!
//! Without an adapter the cases on wgpu are ignored; with `DRAWLOOM_REQUIRE_ADAPTER=1` a missing adapter fails them.
//! Slow ones are ignored without `DRAWLOOM_SLOW_CASES=1`.
//!
//! There are no cases for shear, which a transform cannot express: it is one scale along the object's own axes and one
//! rotation, and objects have no parents.

mod counts;
mod cameras;
mod cascades;
mod columns;
mod degenerate;
mod derived;
mod error_table;
mod levels_and_static_groups;
mod lit_mirrors;
mod moved_scenes;
mod placement;
mod shown_mirror;
mod surroundings;
mod timeout;
mod vertices;
mod lights;
mod capture;
mod numbers;
mod oracle;
mod positions;
mod qualities;
mod markers;
mod special;
mod harness;

use drawloom_testing::{adapter, slow_cases};
use libtest_mimic::{Arguments, Failed, Trial};

use harness::{BackendName, Harness};

/// The name of a case, and a function that checks it on a backend.
type Case = (&'static str, fn(&mut Harness) -> Result<(), Failed>);

/// Cases that take three seconds and more.
const SLOW_CASES: [&str; 4] = [
    "a_scene_looks_the_same_anywhere_up_to_four_million_kilometres",
    "every_setting_at_its_limits_draws_every_scene",
    "lights_in_a_surface_and_very_close_to_it",
    "presets_draw_every_scene",
];

fn main() {
    let arguments = Arguments::from_args();
    let required = std::env::var_os("DRAWLOOM_REQUIRE_ADAPTER").is_some_and(|value| value == "1");
    let no_adapter = adapter::shared_device().is_err();
    let mut trials = Vec::new();
    for backend in BackendName::ALL {
        let lacks_adapter = backend == BackendName::Wgpu && no_adapter;
        let earlier =
            [cameras::CASES, positions::CASES, numbers::CASES, lights::CASES, counts::CASES, qualities::CASES];
        let views = [
            derived::CASES,
            surroundings::CASES,
            degenerate::CASES,
            cascades::CASES,
            lit_mirrors::CASES,
            shown_mirror::CASES,
        ];
        let geometry = [columns::CASES, levels_and_static_groups::CASES, vertices::CASES];
        let cases = earlier.into_iter().chain(views).chain(geometry).flatten();
        for &(name, case) in cases {
            let case = move || {
                if lacks_adapter {
                    return Err("there is no graphics adapter".into());
                }
                timeout::with_timeout(move || case(&mut Harness::new(backend)?))
            };
            let trial = Trial::test(format!("{}::{name}", backend.name()), case);
            let is_too_slow = slow_cases::leave_out(&SLOW_CASES, name);
            trials.push(trial.with_ignored_flag((lacks_adapter && !required) || is_too_slow));
        }
    }
    let conclusion = libtest_mimic::run(&arguments, trials);
    error_table::print();
    conclusion.exit();
}
