//! What holds of every OBJ import, whatever is in its files.

use std::cell::RefCell;
use std::io;
use std::sync::Arc;

use drawloom::backend::NullBackend;
use drawloom::glam::DVec3;
use drawloom::process::Deferred;
use drawloom::scene::{Camera, Light, Material, Mesh, SceneRef};
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter};
use drawloom_obj::{Imported, ObjError, ObjLimits};

use crate::gltf_worlds::invariants::is_forbidden;

/// The name of the OBJ file, which errors have to contain.
const NAME: &str = "a.obj";

/// What an import may take: little, so that a file of a few kilobytes reaches every limit.
pub const LIMITS: ObjLimits = ObjLimits {
    scene_bytes: 64 << 10,
    line_bytes: 512,
    library_bytes: 64 << 10,
    texture_file_bytes: 64 << 10,
    texture_bytes: 1 << 20,
    all_textures_bytes: 1 << 20,
    decoded_bytes: 4 << 20,
    warnings: 3,
};

/// Imports a file, and checks the scene, or the error. `check` gets the import.
pub fn import(file: &[u8], fetch: impl Fn(&str) -> io::Result<Vec<u8>>, check: impl FnOnce(&Imported)) {
    match drawloom_obj::read_within(NAME, file, fetch, &LIMITS) {
        Ok(imported) => {
            check_meshes(&imported);
            check_materials(imported.scene.as_scene_ref());
            check_warnings(&imported);
            check_frame(&imported, Camera::looking_at("main", DVec3::splat(3.0), DVec3::ZERO), &[]);
            check(&imported);
        }
        Err(ObjError::Refused { reason, .. }) => panic!("tobj refuses what preprocessing wrote: {reason}"),
        Err(error) => {
            assert!(error.to_string().contains(NAME), "{error}");
            assert_is_escaped(&error);
        }
    }
}

fn check_meshes(imported: &Imported) {
    let scene = imported.scene.as_scene_ref();
    let mut triangles = 0;
    for (&mesh, position) in scene.meshes.iter().zip(scene.positions) {
        let mesh: &Mesh = scene.assets.get(mesh).unwrap();
        assert!(position.is_finite());
        for vertex in mesh.vertices() {
            let numbers = vertex.position.iter().chain(&vertex.normal).chain(&vertex.uv);
            assert!(numbers.into_iter().all(|number| number.is_finite()), "{vertex:?}");
            let length = vertex.normal.iter().map(|number| number * number).sum::<f32>().sqrt();
            assert!((length - 1.0).abs() < 1e-5, "{vertex:?}");
        }
        assert!(mesh.indices().iter().all(|&index| (index as usize) < mesh.vertices().len()));
        assert!(mesh.bounds().is_valid());
        triangles += mesh.triangle_count();
    }
    assert_eq!(triangles, imported.triangles);
    assert!(triangles > 0);
}

fn check_materials(scene: SceneRef<'_>) {
    for &material in scene.materials {
        let material: &Material = scene.assets.get(material).unwrap();
        for color in [material.diffuse, material.emission] {
            assert!(color.is_finite() && color.min_element() >= 0.0, "{material:?}");
        }
        assert!((0.0..=1.0).contains(&material.opacity), "{material:?}");
        if let Some(texture) = material.texture {
            let texture = scene.assets.get(texture).unwrap();
            let bytes = u64::from(texture.width()) * u64::from(texture.height()) * 4;
            assert!(bytes == texture.pixels().len() as u64 && bytes <= LIMITS.all_textures_bytes);
        }
    }
}

/// All warnings are counted, and the first of each kind are listed.
fn check_warnings(imported: &Imported) {
    for warning in &imported.warnings {
        assert!(imported.warning_counts.contains_key(warning.kind()), "{warning}");
        assert_is_escaped(warning);
    }
    for (kind, &count) in &imported.warning_counts {
        let listed = imported.warnings.iter().filter(|warning| warning.kind() == *kind).count();
        assert_eq!(listed, count.min(LIMITS.warnings), "{kind}");
    }
}

/// No character of a file reaches a terminal that does more than show.
fn assert_is_escaped(message: &impl ToString) {
    let message = message.to_string();
    assert!(!message.contains(is_forbidden), "{message:?}");
}

/// A renderer draws the scene with this camera and further lights, or says that the camera is too far away for that.
///
/// # Panics
/// If it does neither.
pub fn check_frame(imported: &Imported, camera: Camera, lights: &[Light]) {
    thread_local! {
        static NULL: RefCell<(Renderer<NullBackend>, Submitter<NullBackend>)> = RefCell::new(null_renderer());
    }
    let scene = imported.scene.as_scene_ref();
    let lights = [scene.lights, lights].concat();
    let scene = SceneRef { cameras: &[camera], lights: &lights, ..scene };
    NULL.with_borrow_mut(|(renderer, submitter)| match renderer.record(scene) {
        Ok(recorded) => _ = submitter.submit(recorded).unwrap(),
        Err(error) => assert!(error.to_string().contains("\"main\""), "{error}"),
    });
}

fn null_renderer() -> (Renderer<NullBackend>, Submitter<NullBackend>) {
    let scheduler = Arc::new(Scheduler::new(1).unwrap());
    Renderer::builder(NullBackend).pipeline(Deferred::to_picture()).build(scheduler).unwrap()
}
