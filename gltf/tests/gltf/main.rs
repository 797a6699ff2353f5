//! Loading and drawing of small glTF files, which the tests generate.
//!
//! Without an adapter, the cases that draw are reported as ignored. With `DRAWLOOM_REQUIRE_ADAPTER=1` a missing adapter
//! fails them. The files and the pictures stay in `target/tmp/gltf`, to look at.

mod appearance;
mod escaping;
mod faults;
mod fixture;
mod generate;
mod invariants;
mod limits;
mod malformed;
mod malformed_elements;
mod moving;
mod oracle;
mod property;
mod sharp;
mod sources;
mod valid;
mod versions;

use libtest_mimic::{Arguments, Failed, Trial};

type Case = (&'static str, fn() -> Result<(), Failed>);

fn main() {
    let no_adapter = fixture::device().is_none();
    let required = std::env::var_os("DRAWLOOM_REQUIRE_ADAPTER").is_some_and(|value| value == "1");
    let mut trials = Vec::new();
    let of_adapter = [moving::CASES, appearance::CASES, sharp::CASES, sources::CASES];
    for &(name, case) in of_adapter.into_iter().flatten() {
        trials.push(Trial::test(name, case).with_ignored_flag(no_adapter && !required));
    }
    let others = [malformed::CASES, malformed_elements::CASES, faults::CASES, valid::CASES, versions::CASES];
    let others = others.into_iter().chain([limits::CASES, escaping::CASES, property::CASES]);
    trials.extend(others.flatten().map(|&(name, case)| Trial::test(name, case)));
    libtest_mimic::run(&Arguments::from_args(), trials).exit();
}
