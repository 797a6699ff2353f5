//! The scenes and the unusual files that the project generates.

use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Light, Material};
use drawloom_obj::{Imported, ObjWarning};
use drawloom_testing::demo;
use drawloom_testing::obj_files::{ObjFile, UNUSUAL, hall, interior};
use libtest_mimic::Trial;

use crate::folder::Folder;
use crate::trial;

/// Of each unusual file the objects, triangles and warnings, or none where it has no triangle.
const OUTCOMES: [Option<[usize; 3]>; UNUSUAL.len()] = [
    Some([1, 1, 0]),
    // A vertex that is not there, and a model without a face.
    Some([1, 1, 2]),
    Some([4, 6, 0]),
    Some([1, 1, 1]),
    Some([1, 1, 1]),
    Some([1, 1, 1]),
    Some([1, 1, 0]),
    // The library, and the material.
    Some([1, 1, 2]),
    // A face of two corners, which is a line, and one of a smoothing group without normals.
    Some([1, 1, 2]),
    Some([1, 1, 1]),
    // A material without a name.
    Some([1, 4, 1]),
    None,
    None,
    None,
    None,
    None,
];

pub fn trials() -> Vec<Trial> {
    let unusual = UNUSUAL
        .into_iter()
        .zip(OUTCOMES)
        .map(|((name, text), outcome)| trial(format!("generated::{name}"), move || check(text, outcome)));
    let scenes = [trial("generated::interior", an_interior), trial("generated::hall", a_hall)];
    unusual.chain(scenes).collect()
}

fn check(text: &str, outcome: Option<[usize; 3]>) {
    match (Folder::new().with("a.obj", text).load(), outcome) {
        (Ok(imported), Some(expected)) => {
            let found = [imported.scene.object_count(), imported.triangles, imported.warnings.len()];
            assert_eq!((found, imported.degenerate_triangles), (expected, 0), "{:?}", imported.warnings);
        }
        (Err(error), None) => {
            let message = error.to_string();
            assert!(message.contains("a.obj") && message.contains("no triangle to draw"), "{message}");
        }
        (Ok(imported), None) => panic!("{} triangles instead of an error", imported.triangles),
        (Err(error), Some(_)) => panic!("{error}"),
    }
}

/// Loads a generated scene, and checks that each of its objects and triangles is there.
fn load(file: &ObjFile) -> Imported {
    let folder = Folder::new();
    let imported = drawloom_obj::load(file.write_to(&folder.0).unwrap()).unwrap();
    let found = (imported.scene.object_count(), imported.triangles, imported.degenerate_triangles);
    assert_eq!(found, (file.objects, file.triangles, 0));
    imported
}

fn an_interior() {
    let Imported { mut scene, warnings, .. } = load(&interior());
    assert_eq!(warnings, []);
    let diffuse = |name: &str| {
        let mut materials = scene.assets().iter::<Material>().map(|(_, material)| material);
        materials.find(|material| material.name == name).unwrap().diffuse
    };
    assert_eq!(diffuse("red"), Vec3::new(0.6, 0.08, 0.06));
    assert_eq!(diffuse("green"), Vec3::new(0.1, 0.5, 0.12));
    let [Light::Hemispherical { position, direction, intensity, casts_shadow: true, .. }] = scene.lights[..] else {
        panic!("{:?}", scene.lights);
    };
    assert_eq!(direction, Vec3::NEG_Y);
    assert!(position.distance(DVec3::new(0.0, 2.99, 0.0)) < 0.01, "{position}");
    // 12, 9 and 5 times 1 m by 0.8 m.
    assert!(intensity.abs_diff_eq(Vec3::new(9.6, 7.2, 4.0), 1e-3), "{intensity}");
    demo::add_camera_and_lights(&mut scene);
    let camera = &scene.cameras[0];
    assert!((camera.orientation * Vec3::NEG_Z).abs_diff_eq(Vec3::NEG_Z, 1e-4), "it looks in at the open side");
    let DVec3 { x, y, z } = camera.position;
    assert!(x.abs() < 0.1 && (y - 1.5).abs() < 0.1 && z > 2.0, "{}", camera.position);
}

fn a_hall() {
    let Imported { mut scene, warnings, .. } = load(&hall());
    let [ObjWarning::UnusableTexture { .. }] = &warnings[..] else { panic!("{warnings:?}") };
    assert!(warnings[0].to_string().contains("`stone.png`"), "{}", warnings[0]);
    demo::add_camera_and_lights(&mut scene);
    let camera = &scene.cameras[0];
    let forward = camera.orientation * Vec3::NEG_Z;
    assert!(forward.x.abs() > 0.9, "it looks along the nave: {forward}");
    let DVec3 { x, y, z } = camera.position;
    assert!(x.abs() < 30.0 && y > 0.0 && y < 10.0 && z.abs() < 6.0, "it is inside: {}", camera.position);
    assert_eq!(scene.lights.len(), 3);
}
