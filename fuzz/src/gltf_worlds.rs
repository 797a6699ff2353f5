//! Loads glTF files, and checks what the tests of the loader check.

use std::path::Path;

use drawloom::task::Scheduler;
use drawloom_gltf::{LoadOptions, load_bytes};

#[path = "../../gltf/tests/gltf/invariants.rs"]
pub(crate) mod invariants;

use invariants::{SMALL_LIMITS, check_error, check_world};

/// The file, which errors have to name. There is no folder of that name, so that no URI leads to a file.
const NAME: &str = "no such folder/a.gltf";

thread_local! {
    static SCHEDULER: Scheduler = Scheduler::new(1).expect("one worker");
}

/// Loads a file, and checks the world, or the error.
///
/// # Panics
/// If one is wrong.
pub fn check(file: &[u8], time: Option<f64>) {
    let options = LoadOptions { time, limits: SMALL_LIMITS, ..LoadOptions::default() };
    let load = |scheduler: &Scheduler| load_bytes(Path::new(NAME), file.to_vec(), &options, scheduler, &mut |_| ());
    let checked = match SCHEDULER.with(load) {
        Ok(world) => check_world(&world, &SMALL_LIMITS),
        Err(error) => check_error(&error, NAME),
    };
    checked.unwrap_or_else(|failed| panic!("{failed}"));
}
