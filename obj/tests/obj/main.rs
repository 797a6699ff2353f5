//! The OBJ loader: generated and shared scenes, minimal files for one feature each, and mutants.
//!
//! Large files are ignored without `DRAWLOOM_SLOW_CASES=1`. Cases that need the shared scenes are ignored if those are
//! missing, or fail with `DRAWLOOM_REQUIRE_SCENES=1`. So are those that count instructions without valgrind, and
//! `DRAWLOOM_REQUIRE_VALGRIND=1`.

mod damaged;
mod files;
mod folder;
mod generated;
mod geometry;
mod large;
mod masks;
mod materials;
mod mutants;
mod shared;

use std::process::ExitCode;

use libtest_mimic::{Arguments, Failed, Trial, run};

fn main() -> ExitCode {
    if large::load_alone() {
        return ExitCode::SUCCESS;
    }
    let arguments = Arguments::from_args();
    let trials = [
        generated::trials(),
        shared::trials(),
        geometry::trials(),
        large::trials(),
        masks::trials(),
        materials::trials(),
        files::trials(),
        damaged::trials(),
        mutants::trials(),
    ];
    run(&arguments, trials.into_iter().flatten().collect()).exit_code()
}

/// A trial that fails if `test` panics.
fn trial(name: impl Into<String>, test: impl FnOnce() + Send + 'static) -> Trial {
    Trial::test(name, move || {
        test();
        Ok::<(), Failed>(())
    })
}
