//! Devices that fail: every call of a frame fails once, devices are lost, and others take their place.
//!
//! Cases that need an adapter are reported as ignored without one. With `DRAWLOOM_REQUIRE_ADAPTER=1` they fail then.
//! Slow cases are ignored without `DRAWLOOM_SLOW_CASES=1`.

mod calls;
#[cfg(feature = "wgpu")]
mod destroyed;
mod fixture;
mod histories;
#[cfg(feature = "wgpu")]
mod lost_devices;
mod lost_frames;
mod replaced;
mod subjects;
mod worlds;

use std::panic;

use drawloom_testing::slow_cases;
use libtest_mimic::{Arguments, Failed, Trial};

type Case = (&'static str, fn() -> Result<(), Failed>);

/// Cases that take two seconds and more. Less of the same is in faster ones.
const SLOW_CASES: [&str; 7] = [
    "a_device_of_noop_that_is_lost_in_any_call_is_told",
    "cached_views_of_a_wgpu_backend_are_drawn_anew_by_the_next",
    "every_call_of_a_frame_of_the_software_backend_fails_once",
    "every_call_of_a_frame_of_wgpu_with_passes_finished_together_fails_once",
    "every_call_of_a_frame_with_nodes_and_static_groups_of_the_software_backend_fails_once",
    "every_call_of_a_frame_with_nodes_and_static_groups_of_wgpu_fails_once",
    "frames_in_flight_are_lost_with_their_device_and_no_others",
];

fn main() {
    let arguments = Arguments::from_args();
    hide_injected_panics();
    #[cfg(feature = "wgpu")]
    let (more, of_adapters) = (
        lost_devices::CASES,
        [
            calls::CASES_OF_ADAPTERS,
            destroyed::CASES_OF_ADAPTERS,
            histories::CASES_OF_ADAPTERS,
            lost_frames::CASES_OF_ADAPTERS,
            replaced::CASES_OF_ADAPTERS,
            lost_devices::CASES_OF_ADAPTERS,
        ]
        .concat(),
    );
    #[cfg(not(feature = "wgpu"))]
    let (more, of_adapters): (&[Case], Vec<Case>) = Default::default();
    let cases = [calls::CASES, histories::CASES, lost_frames::CASES, replaced::CASES, more].concat().into_iter();
    let required = std::env::var_os("DRAWLOOM_REQUIRE_ADAPTER").is_some_and(|value| value == "1");
    let lacks_adapter = !has_adapter() && !required;
    let trial = |lacks_adapter: bool, (name, case): Case| {
        let is_ignored = lacks_adapter || slow_cases::leave_out(&SLOW_CASES, name);
        Trial::test(name, case).with_ignored_flag(is_ignored)
    };
    let on_adapter = of_adapters.into_iter().map(|case| trial(lacks_adapter, case));
    let trials = cases.map(|case| trial(false, case)).chain(on_adapter);
    libtest_mimic::run(&arguments, trials.collect()).exit();
}

/// Hundreds of panics are wanted here, and wgpu tells of lost and foreign devices by some.
fn hide_injected_panics() {
    let hook = panic::take_hook();
    panic::set_hook(Box::new(move |info| {
        let message = info.payload_as_str().unwrap_or_default();
        if message != "an injected fault" && !message.contains("RenderBundleEncoder::finish") {
            hook(info);
        }
    }));
}

#[cfg(feature = "wgpu")]
fn has_adapter() -> bool {
    drawloom_testing::adapter::shared_device().is_ok()
}

#[cfg(not(feature = "wgpu"))]
fn has_adapter() -> bool {
    false
}
