//! What holds of every glTF file, whatever is in it.

use std::cell::RefCell;
use std::path::Path;
use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::process::Deferred;
use drawloom::scene::Mesh;
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter};
use gltf_scene::{GltfLimits, LoadOptions, World, load_bytes};
use indicatif::ProgressBar;

/// The file, which errors have to name. There is no folder of that name, so that no URI leads to a file.
const NAME: &str = "no such folder/a.gltf";

/// What a file may take: little, so that a file of a few kilobytes reaches every limit.
const LIMITS: GltfLimits = GltfLimits {
    scene_bytes: 64 << 10,
    json_values: 2000,
    buffer_bytes: 16 << 10,
    geometry_bytes: 128 << 10,
    zero_bytes: 8 << 10,
    keyframe_bytes: 8 << 10,
    pose_bytes: 8 << 10,
    objects: 50,
    lights: 4,
    texture_file_bytes: 16 << 10,
    texture_bytes: 64 << 10,
    all_textures_bytes: 128 << 10,
    warnings: 3,
};

struct Engine {
    scheduler: Arc<Scheduler>,
    renderer: Renderer<NullBackend>,
    submitter: Submitter<NullBackend>,
}

thread_local! {
    static ENGINE: RefCell<Engine> = RefCell::new(engine());
}

fn engine() -> Engine {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    let (renderer, submitter) =
        Renderer::builder(NullBackend).deferred(Deferred::to_picture()).build(Arc::clone(&scheduler)).unwrap();
    Engine { scheduler, renderer, submitter }
}

/// Loads a file, and checks the world, or the error.
///
/// # Panics
/// If one is wrong.
pub fn check(file: &[u8], time: Option<f64>) {
    let options = LoadOptions { time, limits: LIMITS, ..LoadOptions::default() };
    ENGINE.with_borrow_mut(|engine| {
        match load_bytes(Path::new(NAME), file.to_vec(), &options, &engine.scheduler, &ProgressBar::hidden()) {
            Ok(world) => check_world(&world, engine),
            Err(error) => {
                let text = error.to_string();
                assert!(text.starts_with(NAME), "{text}");
                error.warnings.iter().chain([&text]).for_each(|text| assert_is_escaped(text));
            }
        }
    });
}

fn check_world(world: &World, engine: &mut Engine) {
    assert!(world.warnings.len() as u64 <= LIMITS.warnings);
    world.warnings.iter().chain(&world.animations).for_each(|text| assert_is_escaped(text));
    let columns = world.columns();
    let scene = world.as_scene_ref(&columns);
    assert!(scene.object_count() as u64 <= LIMITS.objects);
    let mut geometry = 0;
    for (_, mesh) in scene.assets.iter::<Mesh>() {
        geometry += (size_of_val(mesh.vertices()) + size_of_val(mesh.indices())) as u64;
        assert!(mesh.vertices().iter().all(|vertex| vertex.position.iter().all(|number| number.is_finite())));
        assert!(mesh.indices().iter().all(|&index| (index as usize) < mesh.vertices().len()));
        assert_is_escaped(mesh.name());
    }
    assert!(geometry <= LIMITS.geometry_bytes, "{geometry} bytes");
    // A matrix and a number are there without a file that has any.
    let resources = LIMITS.pose_bytes + LIMITS.geometry_bytes + LIMITS.all_textures_bytes + 68;
    assert!(world.resource_bytes() as u64 <= resources, "{} bytes", world.resource_bytes());
    assert!(scene.bounds.iter().all(|bounds| bounds.is_valid()));
    let recorded = engine.renderer.record(scene).unwrap();
    engine.submitter.submit(recorded).unwrap();
}

/// No control character of a file reaches a terminal.
fn assert_is_escaped(text: &str) {
    assert!(!text.chars().any(char::is_control), "{text:?}");
}
