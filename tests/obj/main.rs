//! OBJ files: the shared scenes, files written for one purpose each, and files broken at random.
//!
//! Cases that need the shared scenes are ignored, and never pass, where those are missing.

mod broken;
mod folder;
mod geometry;
mod materials;
mod shared;

use std::process::ExitCode;

use libtest_mimic::{Arguments, Failed, Trial, run};

fn main() -> ExitCode {
    let arguments = Arguments::from_args();
    let trials = [shared::trials(), geometry::trials(), materials::trials(), broken::trials()];
    run(&arguments, trials.into_iter().flatten().collect()).exit_code()
}

/// A trial that fails by panicking, as a usual test does.
fn trial(name: impl Into<String>, test: impl FnOnce() + Send + 'static) -> Trial {
    Trial::test(name, move || {
        test();
        Ok::<(), Failed>(())
    })
}
