//! Frames that are recorded and submitted on one thread.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use drawloom::backend::{NullBackend, SoftwareBackend};
use drawloom::fence::Fence;
use drawloom::glam::{DVec3, Vec3};
use drawloom::process::Deferred;
use drawloom::scene::{
    Camera, Changes, Material, MaterialPredicate, Mesh, Redraw, RenderObject, Scene, SceneRef, ViewFilter, ViewKind,
};
use drawloom::task::Scheduler;
use drawloom::{CpuNode, FrameInputs, Renderer, Submitter};

use crate::engine::{CALLSITES, OwnBackend, OwnNode, OwnProcess, Subject};
use crate::fuse::{self, Kind, Owned, PLANNED};
use crate::within_time;

/// Two states of a world, which differ in where an object is.
pub fn worlds() -> [Scene; 2] {
    [DVec3::ZERO, DVec3::X * 100.0].map(|position| {
        let mut scene = Scene::new();
        let mesh = scene.add(Mesh::cuboid("box", Vec3::ONE).unwrap()).unwrap();
        let material = scene.add(Material { emission: Vec3::ONE, ..Material::default() }).unwrap();
        scene.add_object(RenderObject::new(mesh, material, position)).unwrap();
        scene.add_object(RenderObject::new(mesh, material, DVec3::new(0.6, 0.4, 0.0))).unwrap();
        let main = Camera::looking_at("main", DVec3::Z * 3.0, DVec3::ZERO);
        let seldom = Camera::looking_at("seldom", DVec3::Z * 5.0, DVec3::ZERO);
        let (kind, redraw) = (ViewKind::Main, Redraw::Interval(2));
        scene.cameras = vec![Camera { size: [16, 16], ..main }, Camera { size: [8, 8], kind, redraw, ..seldom }];
        scene
    })
}

pub struct Fixture<S: Subject> {
    renderer: Renderer<OwnBackend<S>>,
    submitter: Submitter<OwnBackend<S>>,
    worlds: [Scene; 2],
}

impl<S: Subject> Fixture<S> {
    pub fn new(workers: usize, joins_passes: bool) -> Self {
        Self::on(Arc::new(Scheduler::new(workers).unwrap()), joins_passes)
    }

    pub fn on(scheduler: Arc<Scheduler>, joins_passes: bool) -> Self {
        let backend = OwnBackend::new(S::open(&scheduler), joins_passes);
        let builder = Renderer::builder(backend).pipeline(Deferred::to_picture()).process(OwnProcess::new());
        let (renderer, submitter) = builder.build(scheduler).unwrap();
        Self { renderer, submitter, worlds: worlds() }
    }

    /// Draws a frame in which the engine does all that it can.
    pub fn draw(&mut self, world: usize, changes: Changes<'_>) -> Result<Vec<u8>, String> {
        let captured = Owned::new("captured by a predicate", ());
        let predicate = MaterialPredicate::new(move |material| {
            let _ = &captured;
            fuse::call(Kind::Predicate, "contains");
            material.emission == Vec3::ONE
        });
        self.worlds[world].cameras[0].filter = ViewFilter::ALL.of_materials(predicate);
        let scene = SceneRef { changes, ..self.worlds[world].as_scene_ref() };
        let nodes: [&dyn CpuNode; 1] = [&OwnNode];
        let recorded = self.renderer.record_with(FrameInputs { nodes: &nodes, ..FrameInputs::new(scene) });
        let mut recorded = recorded.map_err(|error| error.to_string())?;
        match recorded.read_back_whole(0, "picture") {
            Err(error) if error.to_string().contains("panicked") => return Err(error.to_string()),
            // Backends may be unable to.
            Err(_) => {}
            // Its destructor is the engine's to catch.
            Ok(read_back) => catch_unwind(AssertUnwindSafe(|| drop(read_back))).unwrap_or_else(std::mem::forget),
        }
        let drawn = recorded.fence_at(drawloom::FencePoint::End).map_err(|error| error.to_string())?;
        let captured = Owned::new("captured by a callback", ());
        drawn.on_set(move |_| {
            let _ = &captured;
            fuse::call(Kind::Hook, "on_set");
        });
        let submitted = self.submitter.submit(recorded).map_err(|error| error.to_string())?;
        let read = S::read(submitted.submission.get());
        // Its destructor is the engine's to catch.
        catch_unwind(AssertUnwindSafe(|| drop(submitted))).unwrap_or_else(std::mem::forget);
        Ok(read)
    }
}

/// Whether an error names the call that panicked.
fn names(error: &str, call: &str) -> bool {
    let in_stages: &[&str] = match call {
        "upload_objects" => &["objects panicked", "upload panicked"],
        "objects_epoch" => &["upload panicked"],
        "prepare" => &[", prepare panicked"],
        "part_count" => &[", prepare panicked", ", record panicked"],
        "record" => &[", record panicked"],
        "finish" => &[", finish panicked"],
        "submit" => &["the submission of the frame panicked"],
        "name" => &["the name of node 0 panicked", "the engine's node panicked"],
        "declare" | "width" | "items_per_job" | "run" => &["the engine's node panicked"],
        "contains" => &["filter"],
        "draws" | "cpu_shader" | "fragment" => &["\"the engine's process\""],
        _ => return error.contains(&format!("the backend's {call} panicked")),
    };
    in_stages.iter().any(|name| error.contains(name))
}

/// Each call of a kind panics once, until a frame makes none that has not panicked.
fn each_call_panics_once<S: Subject>(kind: Kind, workers: usize, joins_passes: bool) -> usize {
    let expected = [0, 1].map(|world| Fixture::<S>::new(workers, joins_passes).draw(world, Changes::Unknown).unwrap());
    assert!(expected[0] != expected[1], "the worlds look alike");
    let mut fixture = Fixture::<S>::new(workers, joins_passes);
    for world in [0, 1] {
        assert!(fixture.draw(world, Changes::Unknown).as_ref() == Ok(&expected[world]));
    }
    let alive_before = fuse::alive();
    // With several workers the number of calls differs from frame to frame.
    let (mut index, mut frames_without) = (0, 0);
    while frames_without < if workers == 1 { 1 } else { 4 } {
        let (world, has_text) = (index % 2, index % 4 < 2);
        fuse::arm(kind, index, has_text);
        let outcome = catch_unwind(AssertUnwindSafe(|| fixture.draw(world, Changes::Objects(&[0]))));
        let blown = fuse::disarm();
        let name = format!("{kind:?} {index} ({blown:?})");
        let outcome = outcome.unwrap_or_else(|_| panic!("{name} unwinds"));
        match (&outcome, blown) {
            (Ok(shown), _) => assert!(*shown == expected[world], "{name}: the frame is another one"),
            (Err(error), None) => panic!("{name}: {error}"),
            (Err(error), Some(call)) => {
                let may_fail = !matches!(kind, Kind::Destructor | Kind::Subscriber | Kind::Hook);
                assert!(may_fail && names(error, call), "{name}: {error}");
                assert_eq!(error.contains(PLANNED), has_text, "{name}: {error}");
            }
        }
        // A graph that may not be the frame's is made anew.
        let may_succeed = matches!(kind, Kind::Destructor | Kind::Subscriber | Kind::Hook) || blown == Some("name");
        // The worker that does it may be late, and its panic is another frame's.
        let may_be_late = blown == Some("work_in_background") && workers > 1;
        assert!(blown.is_none() || outcome.is_err() || may_succeed || may_be_late, "{name}: nothing tells of it");
        frames_without = if blown.is_none() { frames_without + 1 } else { 0 };
        if may_be_late {
            // Frames go on until it has been told.
            let told = (0..1_000).find_map(|_| {
                std::thread::sleep(Duration::from_millis(1));
                fixture.draw(world, Changes::NONE).err()
            });
            assert!(outcome.is_err() || told.is_some_and(|error| names(&error, "work_in_background")), "{name}");
        }
        // What the failed frame was told has changed is not told again.
        let next = fixture.draw(world, Changes::NONE).unwrap_or_else(|error| panic!("after {name}: {error}"));
        assert!(next == expected[world], "after {name}: the next frame is another one");
        assert_eq!(fuse::alive(), alive_before, "after {name}: values of the engine's that are kept");
        index += 1;
    }
    drop(fixture);
    index - frames_without
}

fn each_call_of_all_backends_panics_once(kind: Kind, least: usize) {
    within_time(move || {
        for (workers, joins_passes) in [(1, false), (1, true), (2, true)] {
            let calls = each_call_panics_once::<NullBackend>(kind, workers, joins_passes);
            let drawn = each_call_panics_once::<SoftwareBackend>(kind, workers, joins_passes);
            assert!(calls > 0 && drawn >= least, "only {calls} and {drawn} calls of {kind:?} panicked");
        }
    });
}

#[test]
fn a_panic_in_any_call_of_the_backend_is_an_error_that_names_it() {
    each_call_of_all_backends_panics_once(Kind::Backend, 30);
}

#[test]
fn a_panic_in_any_call_of_a_node_is_an_error_that_names_it() {
    each_call_of_all_backends_panics_once(Kind::Node, 4);
}

#[test]
fn a_panic_in_any_call_of_a_process_is_an_error_that_names_it() {
    each_call_of_all_backends_panics_once(Kind::Process, 3);
}

#[test]
fn a_panic_of_a_predicate_is_an_error_that_names_the_filter() {
    each_call_of_all_backends_panics_once(Kind::Predicate, 1);
}

#[test]
fn a_panic_in_a_callback_of_a_fence_changes_nothing() {
    each_call_of_all_backends_panics_once(Kind::Hook, 1);
}

#[test]
fn a_panic_in_any_destructor_changes_nothing() {
    each_call_of_all_backends_panics_once(Kind::Destructor, 2);
}

#[test]
fn a_panic_in_any_call_of_the_subscriber_changes_nothing() {
    each_call_of_all_backends_panics_once(Kind::Subscriber, 100);
    let callsites = CALLSITES.load(Ordering::Relaxed);
    assert!(callsites >= 5, "only {callsites} events and spans were told of for the first time");
}

/// Destructors of a renderer that is dropped: all of them panic, one after the other.
#[test]
fn a_renderer_whose_destructors_panic_is_dropped() {
    within_time(|| {
        for index in 0..4 {
            let mut fixture = Fixture::<SoftwareBackend>::new(1 + index % 2, false);
            fixture.draw(0, Changes::Unknown).unwrap();
            let recorded = fixture.renderer.record(fixture.worlds[0].as_scene_ref()).unwrap();
            let before = fuse::alive();
            fuse::arm(Kind::Destructor, index, index % 2 == 0);
            let dropped = catch_unwind(AssertUnwindSafe(|| {
                drop(fixture.renderer);
                drop(recorded);
                drop(fixture.submitter);
            }));
            assert!(fuse::disarm().is_some() && dropped.is_ok(), "destructor {index} unwinds");
            assert!(fuse::alive() < before);
        }
    });
}

/// A device that is to set the fence which a frame waits for panics.
#[test]
fn a_device_that_panics_fails_the_fence_that_it_would_set() {
    within_time(|| {
        for (index, has_text) in [(0, true), (0, false)] {
            let mut fixture = Fixture::<NullBackend>::new(1, false);
            let (setter, fence) = Fence::new("terrain");
            setter.advance_by(crate::engine::OwnDevice::new());
            let mut recorded = fixture.renderer.record(fixture.worlds[0].as_scene_ref()).unwrap();
            recorded.submit_after(&fence, Duration::from_secs(60));
            fuse::arm(Kind::Hook, index, has_text);
            let submitted = catch_unwind(AssertUnwindSafe(|| fixture.submitter.submit(recorded).map(drop)));
            assert_eq!(fuse::disarm(), Some("advance"));
            let error = submitted.expect("it unwinds").expect_err("its fence is not set").to_string();
            assert!(error.contains("terrain") && error.contains("panicked"), "{error}");
            fuse::arm(Kind::Hook, index, has_text);
            assert!(catch_unwind(AssertUnwindSafe(|| fence.is_set())).is_ok_and(|is_set| !is_set));
            fuse::disarm();
            assert!(fixture.draw(0, Changes::NONE).is_ok());
            // The other fence has no device, and this one's panics when it is dropped.
            fuse::arm(Kind::Destructor, 0, has_text);
            assert!(catch_unwind(AssertUnwindSafe(|| drop((setter, fence)))).is_ok());
            assert_eq!(fuse::disarm(), Some("device"));
        }
    });
}
