//! Assets that are loaded by background jobs, and drawn before they have arrived.

use std::sync::Arc;
use std::sync::mpsc;

use drawloom::backend::NullBackend;
use drawloom::glam::DVec3;
use drawloom::handle::Handle;
use drawloom::process::Deferred;
use drawloom::scene::{
    Arrivals, AssetLoader, Changes, Material, Mesh, RenderObject, Scene, SceneError, SceneRef, Texture,
};
use drawloom::task::Scheduler;
use drawloom::view::{IssueReason, SceneIssue};
use drawloom::{FrameStatistics, Renderer, Submitter};
use drawloom_testing::scenes::{cube, field};

struct Engine {
    scheduler: Arc<Scheduler>,
    renderer: Renderer<NullBackend>,
    submitter: Submitter<NullBackend>,
    scene: Scene,
    loader: AssetLoader,
}

impl Engine {
    fn new(workers: usize) -> Self {
        let scheduler = Arc::new(Scheduler::new(workers).unwrap());
        let builder = Renderer::builder(NullBackend).pipeline(Deferred::to_picture());
        let (renderer, submitter) = builder.build(Arc::clone(&scheduler)).unwrap();
        let scene = field(20);
        let loader = scene.assets().loader(&scheduler);
        Self { scheduler, renderer, submitter, scene, loader }
    }

    fn frame(&mut self) -> FrameStatistics {
        self.submitter.submit(self.renderer.record(self.scene.as_scene_ref()).unwrap()).unwrap().statistics
    }

    /// Receives until everything that was requested has arrived, or failed.
    fn receive(&mut self, expected: usize) -> Arrivals {
        let mut all = Arrivals::default();
        while all.count + all.errors.len() < expected {
            let arrivals = self.scene.receive(&self.loader);
            all.count += arrivals.count;
            all.meshes.extend(arrivals.meshes);
            all.errors.extend(arrivals.errors);
            std::thread::yield_now();
        }
        all
    }

    fn material(&self) -> Handle<Material> {
        self.scene.assets().iter::<Material>().next().unwrap().0
    }
}

fn cube_of(name: &str) -> impl FnOnce() -> Result<Mesh, SceneError> + Send + 'static + use<> {
    let name = name.to_owned();
    move || {
        let cube = cube();
        Mesh::new(name, cube.topology(), cube.vertices().to_vec(), cube.indices().to_vec())
    }
}

fn reasons(statistics: &FrameStatistics) -> Vec<(IssueReason, usize)> {
    statistics.scene_issues.iter().map(|SceneIssue { reason, count, .. }| (*reason, *count)).collect()
}

#[test]
fn an_object_is_drawn_from_the_frame_on_in_which_its_mesh_has_arrived() {
    for workers in [1, 2, 4] {
        let mut engine = Engine::new(workers);
        let before = engine.frame();
        let (begin, waits) = mpsc::channel::<()>();
        let material = engine.material();
        let mesh = engine.loader.load("cube", 0, move || {
            let _ = waits.recv();
            cube_of("cube")()
        });
        let object = engine.scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO)).unwrap();
        assert!(engine.scene.assets().is_pending(mesh) && engine.scene.assets().get(mesh).is_err());
        let waiting = engine.frame();
        assert_eq!(reasons(&waiting), [(IssueReason::NotResident, 1)]);
        assert_eq!(waiting.views[0].visible, before.views[0].visible);
        begin.send(()).unwrap();
        assert_eq!(engine.receive(1).meshes, [mesh]);
        let arrived = engine.frame();
        assert_eq!(reasons(&arrived), []);
        assert_eq!(arrived.views[0].visible, before.views[0].visible + 1);
        assert!(engine.scene.as_scene_ref().bounds[20].radius > 0.5);
        engine.scene.remove_object(object).unwrap();
        engine.scene.remove(mesh).unwrap();
        assert!(!engine.scene.assets().is_pending(mesh));
    }
}

#[test]
fn what_cannot_be_loaded_is_told_once_by_name_and_its_handle_is_stale() {
    let mut engine = Engine::new(2);
    let material = engine.material();
    let refused = engine.loader.load::<Mesh, _>("torn", 3, || Err("the file ends early"));
    let panics = engine.loader.load::<Texture, SceneError>("bad image", 1, || panic!("an image without pixels"));
    let invalid = engine.loader.load("glow", 2, || {
        Ok::<_, SceneError>(Material { opacity: 2.0, name: "too much".to_owned(), ..Material::default() })
    });
    let plain = engine.scene.add(Material { texture: Some(panics), ..Material::default() }).unwrap();
    engine.scene.add_object(RenderObject::new(refused, material, DVec3::ZERO)).unwrap();
    let mesh = engine.scene.assets().iter::<Mesh>().next().unwrap().0;
    engine.scene.add_object(RenderObject::new(mesh, plain, DVec3::ZERO)).unwrap();
    engine.scene.add_object(RenderObject::new(mesh, invalid, DVec3::ZERO)).unwrap();
    let mut messages: Vec<_> = engine.receive(3).errors.iter().map(ToString::to_string).collect();
    messages.sort();
    assert_eq!(messages.len(), 3);
    assert_eq!(messages[0], "`bad image` cannot be loaded: a job panicked: an image without pixels");
    assert!(messages[1].starts_with("`glow` cannot be loaded: material `too much` has"), "{}", messages[1]);
    assert_eq!(messages[2], "`torn` cannot be loaded: the file ends early");
    assert!(engine.scene.receive(&engine.loader).errors.is_empty());
    assert!(!engine.scene.assets().is_pending(refused));
    let found = reasons(&engine.frame());
    assert_eq!(found, [(IssueReason::StaleMesh, 1), (IssueReason::StaleMaterial, 1)]);
    // The next asset may have its slot, but not its handle.
    let next = engine.scene.add(cube()).unwrap();
    assert!(next != refused && engine.scene.assets().get(refused).is_err());
}

#[test]
fn what_is_unloaded_before_it_arrives_is_dropped() {
    let mut engine = Engine::new(2);
    let (begin, waits) = mpsc::channel::<()>();
    let mesh = engine.loader.load("late", 0, move || {
        let _ = waits.recv();
        cube_of("late")()
    });
    assert!(engine.scene.remove(mesh).is_err(), "there is nothing to return yet");
    assert_eq!(engine.scene.unload(mesh), Ok(None));
    assert!(engine.scene.unload(mesh).is_err() && !engine.scene.assets().is_pending(mesh));
    let next = engine.scene.add(cube()).unwrap();
    begin.send(()).unwrap();
    let last = engine.loader.load("last", 0, cube_of("last"));
    let meshes = engine.scene.assets().iter::<Mesh>().count();
    assert_eq!(engine.receive(1).meshes, [last]);
    assert_eq!(engine.scene.assets().iter::<Mesh>().count(), meshes + 1);
    assert_eq!(engine.scene.assets().get(next).unwrap().name(), cube().name());
    assert!(matches!(engine.scene.unload(last), Ok(Some(_))));
}

#[test]
fn loads_begin_by_priority() {
    // Nothing runs in the background, so the order is that of the calls of `receive`.
    let mut engine = Engine::new(1);
    let handles: Vec<_> = [3, 9, -5, 9, 0]
        .into_iter()
        .enumerate()
        .map(|(index, priority)| engine.loader.load(format!("{index}"), priority, cube_of(&index.to_string())))
        .collect();
    assert_eq!(engine.loader.waiting(), 5);
    let order = engine.receive(5).meshes;
    assert_eq!(order, [1, 3, 0, 4, 2].map(|index: usize| handles[index]));
    let priorities = handles.iter().map(|handle| engine.scene.assets().priority(*handle).unwrap());
    assert_eq!(priorities.collect::<Vec<_>>(), [3, 9, -5, 9, 0]);
}

#[test]
fn handles_are_made_on_any_thread_while_frames_go_on() {
    let mut engine = Engine::new(4);
    let material = engine.material();
    let handles = std::thread::scope(|scope| {
        let loader = engine.loader.clone();
        let other = scope.spawn(move || {
            (0..200).map(|number| loader.load("cube", number % 7, cube_of(&number.to_string()))).collect::<Vec<_>>()
        });
        for _frame in 0..20 {
            engine.scene.receive(&engine.loader);
            engine.frame();
            engine.scene.add(cube()).unwrap();
        }
        other.join().unwrap()
    });
    for (number, handle) in handles.iter().enumerate() {
        let position = DVec3::new(number as f64 * 0.1, 0.0, 0.0);
        engine.scene.add_object(RenderObject::new(*handle, material, position)).unwrap();
    }
    while handles.iter().any(|handle| engine.scene.assets().is_pending(*handle)) {
        engine.scene.receive(&engine.loader);
        engine.frame();
    }
    for (number, handle) in handles.iter().enumerate() {
        assert_eq!(engine.scene.assets().get(*handle).unwrap().name(), number.to_string());
    }
    assert_eq!(reasons(&engine.frame()), []);
    drop(engine.scheduler);
}

#[test]
fn a_loader_whose_scheduler_is_gone_loads_at_once() {
    let mut scene = field(1);
    let scheduler = Arc::new(Scheduler::new(2).unwrap());
    let loader = scene.assets().loader(&scheduler);
    drop(scheduler);
    let mesh = loader.load("cube", 0, cube_of("cube"));
    assert_eq!(scene.receive(&loader).meshes, [mesh]);
}

#[test]
fn a_slow_load_does_not_hold_up_another_one_while_workers_idle() {
    let mut engine = Engine::new(3);
    engine.scheduler.set_background_workers(2);
    let (other_has_begun, begun) = mpsc::channel::<()>();
    engine.loader.load("slow", 0, move || {
        // It ends only when the other one has begun; if that never comes, this is an error.
        let waited = begun.recv_timeout(std::time::Duration::from_secs(20));
        waited.map(|()| cube()).map_err(|error| error.to_string())
    });
    while engine.loader.waiting() > 0 {
        std::thread::yield_now();
    }
    engine.loader.load("other", 0, move || {
        other_has_begun.send(()).map_err(|error| error.to_string())?;
        Ok::<_, String>(cube())
    });
    assert_eq!(engine.receive(2).errors.len(), 0);
}

#[test]
fn an_error_whose_conversion_panics_is_told_and_others_load() {
    struct Panics;
    impl From<Panics> for Box<dyn std::error::Error + Send + Sync> {
        fn from(_: Panics) -> Self {
            std::panic::resume_unwind(Box::new("as planned"))
        }
    }
    let mut engine = Engine::new(2);
    engine.loader.load("panics", 0, || Err::<Mesh, _>(Panics));
    engine.loader.load("loads", 0, cube_of("loads"));
    let arrivals = engine.receive(2);
    assert_eq!(arrivals.count, 1);
    assert!(arrivals.errors[0].to_string().contains("as planned"), "{}", arrivals.errors[0]);
}

#[test]
fn an_object_is_drawn_when_its_mesh_its_material_or_both_at_once_have_arrived() {
    for (loads_mesh, loads_material) in [(true, false), (false, true), (true, true)] {
        let mut engine = Engine::new(2);
        let mesh = match loads_mesh {
            true => engine.loader.load("cube", 0, cube_of("cube")),
            false => engine.scene.add(cube()).unwrap(),
        };
        let material = match loads_material {
            true => engine.loader.load("paint", 0, || Ok::<_, SceneError>(Material::default())),
            false => engine.material(),
        };
        engine.scene.add_object(RenderObject::new(mesh, material, DVec3::ZERO)).unwrap();
        assert_eq!(reasons(&engine.frame()), [(IssueReason::NotResident, 1)]);
        engine.receive(usize::from(loads_mesh) + usize::from(loads_material));
        // No object changed, and what they consist of did.
        let scene = SceneRef { changes: Changes::NONE, ..engine.scene.as_scene_ref() };
        let statistics = engine.renderer.record(scene).unwrap().statistics().clone();
        assert_eq!(reasons(&statistics), [], "mesh: {loads_mesh}, material: {loads_material}");
    }
}
