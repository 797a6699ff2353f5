//! Every call of a frame fails once, in turn. The frame is refused with an error that says what failed and where, and
//! the next one is right.

use std::iter::repeat_n;
use std::time::Duration;

#[cfg(feature = "wgpu")]
use drawloom::backend::WgpuBackend;
use drawloom::backend::{BackendError, NullBackend, SoftwareBackend};
use drawloom::scene::Changes;
use drawloom::{FrameError, Granularity, SubmitError};
use drawloom_testing::fault_injection::{CallKind, FailedCall, Fault};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::{Fixture, Refusal, Setting, two_scenes};
use crate::subjects::Subject;
use crate::worlds::Worlds;

pub const CASES: &[Case] = &[
    ("every_call_of_a_frame_of_the_null_backend_fails_once", null),
    ("every_call_of_a_frame_of_the_software_backend_fails_once", software),
    ("every_call_of_a_simple_frame_of_the_software_backend_fails_once", simple_software),
    (
        "every_call_of_a_frame_with_nodes_and_static_groups_of_the_software_backend_fails_once",
        with_nodes_and_static_groups::<SoftwareBackend>,
    ),
    ("slow_calls_change_no_picture", slow_calls),
    ("pipelines_whose_preparation_failed_are_made_by_the_next_frame", preparation),
];

#[cfg(feature = "wgpu")]
pub const CASES_OF_ADAPTERS: &[Case] = &[
    ("every_call_of_a_frame_of_wgpu_fails_once", wgpu),
    ("every_call_of_a_frame_of_wgpu_with_passes_finished_together_fails_once", wgpu_together),
    (
        "every_call_of_a_frame_with_nodes_and_static_groups_of_wgpu_fails_once",
        with_nodes_and_static_groups::<WgpuBackend>,
    ),
];

fn null() -> Result<(), Failed> {
    for workers in [1, 2, 4] {
        for joins_passes in [false, true] {
            for granularity in [Granularity::PerCamera, Granularity::Chunk(2), Granularity::Adaptive] {
                every_call_fails_once::<NullBackend>(Setting { workers, granularity, joins_passes, ..Setting::FULL })?;
            }
        }
    }
    Ok(())
}

fn software() -> Result<(), Failed> {
    every_call_fails_once::<SoftwareBackend>(Setting::FULL)?;
    every_call_fails_once::<SoftwareBackend>(Setting { workers: 1, joins_passes: true, ..Setting::FULL })
}

fn simple_software() -> Result<(), Failed> {
    let granularity = Granularity::Chunk(1);
    every_call_fails_once::<SoftwareBackend>(Setting { granularity, is_full: false, ..Setting::FULL })
}

#[cfg(feature = "wgpu")]
fn wgpu() -> Result<(), Failed> {
    every_call_fails_once::<WgpuBackend>(Setting::FULL)
}

#[cfg(feature = "wgpu")]
fn wgpu_together() -> Result<(), Failed> {
    every_call_fails_once::<WgpuBackend>(Setting { workers: 1, joins_passes: true, ..Setting::FULL })
}

fn with_nodes_and_static_groups<S: Subject>() -> Result<(), Failed> {
    for joins_passes in [false, true] {
        // Views that test for occlusion execute no static groups.
        let setting = Setting { joins_passes, tests_occlusion: false, ..Setting::FULL };
        every_call_of_worlds_fails_once::<S>(setting, &Worlds::with_nodes_and_static_groups()?)?;
    }
    Ok(())
}

fn every_call_fails_once<S: Subject>(setting: Setting) -> Result<(), Failed> {
    every_call_of_worlds_fails_once::<S>(setting, &Worlds::plain()?)
}

fn every_call_of_worlds_fails_once<S: Subject>(setting: Setting, worlds: &Worlds) -> Result<(), Failed> {
    let expected = [
        worlds.picture(&mut Fixture::<S>::new(setting)?, 0, Changes::Unknown)?,
        worlds.picture(&mut Fixture::<S>::new(setting)?, 1, Changes::Unknown)?,
    ];
    expect(expected[0] != expected[1], || String::from("the worlds look alike"))?;
    let mut fixture = Fixture::<S>::new(setting)?;
    worlds.picture(&mut fixture, 1, Changes::Unknown)?;
    let mut turn = 0;
    for kind in CallKind::ALL {
        // Where many passes fail in one call, each fault is tried on each call; elsewhere the faults take turns.
        let tries = if kind == CallKind::FinishTogether { FAULTS.len() } else { 1 };
        let mut calls = 0;
        for reported in Reported::of(worlds) {
            for index in (0..).flat_map(|index| repeat_n(index, tries)) {
                let (world, expected) = (turn % 2, &expected[turn % 2]);
                let fault = FAULTS[turn % FAULTS.len()].clone();
                turn += 1;
                let name = format!("{setting:?}, {reported:?}, {kind:?} {index}");
                let changes = match reported {
                    Reported::Everything => Changes::Unknown,
                    Reported::MovedObjects => Changes::Objects(&worlds.moved),
                    Reported::Nothing => {
                        worlds.picture(&mut fixture, world, Changes::Objects(&worlds.moved))?;
                        Changes::NONE
                    }
                };
                fixture.renderer.backend().inject(kind, index, fault.clone());
                let drawn = worlds.draw(&mut fixture, world, changes)?;
                let Some(call) = fixture.renderer.backend().failed_call() else {
                    let picture = drawn.map_err(|refusal| format!("{name} did not come, but {refusal:?}"))?;
                    expect(picture == *expected, || format!("{name} did not come, and the picture is another one"))?;
                    let executes_static_groups = reported == Reported::Nothing;
                    expect(!executes_static_groups || fixture.executed_static_groups > 0, || {
                        format!("{name}: no static group is executed")
                    })?;
                    break;
                };
                let refusal = drawn.err().ok_or_else(|| format!("{name}: the frame is drawn nevertheless"))?;
                check_refusal(&refusal, &call, &fault).map_err(|problem| format!("{name}: {problem}: {refusal:?}"))?;
                // What the failed frame was told has changed is not told again.
                let picture = worlds.picture(&mut fixture, world, Changes::NONE);
                let picture = picture.map_err(|error| format!("{name}: then {error:?}"))?;
                expect(picture == *expected, || format!("{name}: the next picture is another one"))?;
            }
            calls += fixture.renderer.backend().calls(kind);
            // The fault that did not come would come in a frame that is drawn before the next fault.
            fixture.renderer.backend().clear();
        }
        let has_calls = match kind {
            // The software backend records no parts.
            CallKind::Record => false,
            CallKind::PreparePipelines => false,
            CallKind::Finish => !setting.joins_passes,
            CallKind::FinishTogether => setting.joins_passes,
            _ => true,
        };
        expect(!has_calls || calls > 0, || format!("{setting:?} has no {kind:?}"))?;
    }
    Ok(())
}

/// The changes that a frame reports. They decide which calls it makes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Reported {
    /// Everything is uploaded, with all objects.
    Everything,
    /// The objects that moved are uploaded apart from the others.
    MovedObjects,
    /// Objects that moved in the frame before are recorded as static groups.
    Nothing,
}

impl Reported {
    /// Those of frames that differ in their calls: without static groups, a frame in which nothing moved makes no call
    /// that others do not make.
    fn of(worlds: &Worlds) -> impl Iterator<Item = Self> {
        let of_static_groups = worlds.has_static_groups().then_some(Self::Nothing);
        [Self::Everything, Self::MovedObjects].into_iter().chain(of_static_groups)
    }
}

const FAULTS: [Fault; 5] = [Fault::DeviceLost, Fault::OutOfMemory, Fault::Panic, Fault::Validation, Fault::Limit];

/// Whether an error says what failed, and where.
fn check_refusal(refusal: &Refusal, call: &FailedCall, fault: &Fault) -> Result<(), &'static str> {
    let require = |holds: bool, problem| if holds { Ok(()) } else { Err(problem) };
    let (stage, error, message) = match refusal {
        Refusal::Frame(error) => match error {
            FrameError::Panicked { stage, message } => (stage.as_str(), None, Some(message)),
            FrameError::Failed { stage, .. } => (stage.as_str(), error.backend_error(), None),
            FrameError::Backend(source) => ("begin", Some(source), None),
            _ => return Err("it is another error"),
        },
        Refusal::Submission(SubmitError::Panicked { message }) => ("submit", None, Some(message)),
        Refusal::Submission(error) => ("submit", error.backend_error(), None),
    };
    let is_told = match fault {
        Fault::DeviceLost => matches!(error, Some(BackendError::DeviceLost { .. })),
        Fault::OutOfMemory => matches!(error, Some(BackendError::OutOfMemory { .. })),
        Fault::Validation => matches!(error, Some(BackendError::Validation { .. })),
        Fault::Limit => matches!(error, Some(BackendError::Limit { .. })),
        Fault::Panic => message.is_some_and(|message| message.contains("injected")),
        Fault::Delay(_) | Fault::After(_) => false,
    };
    require(is_told, "it says something else")?;
    if call.process.is_empty() {
        let of_frame: &[&str] = match call.kind {
            CallKind::UploadObjects => &["objects", "upload"],
            CallKind::Submit => &["submit"],
            _ => &["the backend's begin", "begin"],
        };
        return require(of_frame.contains(&stage), "it names another stage");
    }
    let names_process = stage.starts_with(&format!("{}, view ", call.process));
    require(names_process, "it names another process")?;
    require(stage.contains(&format!(" {:?}, ", call.view)), "it names another view")
}

/// Jobs meet each other in another order, and nothing else changes.
fn slow_calls() -> Result<(), Failed> {
    let (scenes, _) = two_scenes()?;
    let expected = Fixture::<SoftwareBackend>::new(Setting::FULL)?.picture(&scenes[0], Changes::Unknown)?;
    let mut fixture = Fixture::<SoftwareBackend>::new(Setting::FULL)?;
    for kind in CallKind::ALL {
        fixture.renderer.backend().inject(kind, 0, Fault::Delay(Duration::from_millis(5)));
        let picture = fixture.picture(&scenes[0], Changes::Unknown)?;
        expect(picture == expected, || format!("a slow {kind:?} changes the picture"))?;
        // The software backend records no parts, and this frame finishes each pass alone.
        let is_called = !matches!(kind, CallKind::Record | CallKind::FinishTogether | CallKind::PreparePipelines);
        let came = fixture.renderer.backend().failed_call().is_some();
        expect(came == is_called, || format!("a slow {kind:?} came: {came}"))?;
    }
    Ok(())
}

fn preparation() -> Result<(), Failed> {
    let (scenes, _) = two_scenes()?;
    let mut fixture = Fixture::<NullBackend>::new(Setting::FULL)?;
    for turn in 0..5 {
        let fault = FAULTS[turn % FAULTS.len()].clone();
        fixture.renderer.backend().inject(CallKind::PreparePipelines, turn % 2, fault.clone());
        let prepared = match turn % 2 {
            0 => fixture.renderer.prepare_pipelines(scenes[0].as_scene_ref()),
            _ => fixture.renderer.prepare_pipelines_in_background(scenes[0].as_scene_ref())?.wait()?,
        };
        let is_told = match (&prepared, &fault) {
            (Err(FrameError::Panicked { stage, .. }), Fault::Panic) => stage == "the backend's prepare_pipelines",
            (Err(error), _) => error.backend_error().is_some(),
            (Ok(()), _) => false,
        };
        expect(is_told, || format!("{prepared:?}"))?;
        fixture.picture(&scenes[0], Changes::Unknown)?;
        fixture.renderer.prepare_pipelines(scenes[0].as_scene_ref())?;
    }
    Ok(())
}

pub fn expect(holds: bool, problem: impl FnOnce() -> String) -> Result<(), Failed> {
    if holds { Ok(()) } else { Err(problem().into()) }
}
