//! What a device has no room for is left out, counted and named, and everything else is drawn.
//!
//! The oracle is the scene without what is to be left out, on a backend without limits: the pictures are the same to
//! the byte.
//!
//! Without an adapter the cases on a device are reported as ignored. With `DRAWLOOM_REQUIRE_ADAPTER=1` a missing
//! adapter fails them.

mod fixture;
mod lights;
mod lists;
mod materials;
mod meshes;
mod objects;
mod textures;
mod wide_tints;

use drawloom_testing::adapter;
use libtest_mimic::{Arguments, Failed, Trial};

use crate::fixture::Device;

/// A case that runs on some devices.
type Case = (&'static str, &'static [Device], fn(Device) -> Result<(), Failed>);

fn main() {
    let arguments = Arguments::from_args();
    let has_adapter = adapter::device().is_ok();
    let required = std::env::var_os("DRAWLOOM_REQUIRE_ADAPTER").is_some_and(|value| value == "1");
    let mut trials = Vec::new();
    for cases in [lights::CASES, lists::CASES, materials::CASES, meshes::CASES, objects::CASES, textures::CASES] {
        for &(name, devices, case) in cases {
            for &device in devices {
                let trial = Trial::test(format!("{name}_{}", device.name()), move || case(device));
                let is_ignored = device == Device::Adapter && !has_adapter && !required;
                trials.push(trial.with_ignored_flag(is_ignored));
            }
        }
    }
    libtest_mimic::run(&arguments, trials).exit();
}
