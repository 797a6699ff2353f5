//! The shared scenes, which are not part of this package.

use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Blend, Light, Material, Scene};
use drawloom_obj::{Imported, ObjWarning};
use drawloom_testing::demo;
use drawloom_testing::shared_scenes;
use libtest_mimic::Trial;

use crate::trial;

/// The expected outcome of a file: objects, triangles and warnings without degenerate triangles, or an error that
/// contains a text.
enum Outcome {
    Scene { objects: usize, triangles: usize, warnings: usize },
    Error(&'static str),
}

use Outcome::{Error, Scene as Gives};

const fn gives(objects: usize, triangles: usize) -> Outcome {
    Gives { objects, triangles, warnings: 0 }
}

const fn warns(objects: usize, triangles: usize, warnings: usize) -> Outcome {
    Gives { objects, triangles, warnings }
}

const MALFORMED: [(&str, Outcome); 31] = [
    // Two libraries with unsupported statements; three missing textures.
    ("tobj/cornell_box.obj", warns(8, 36, 5)),
    ("tobj/empty_name_triangle.obj", gives(1, 1)),
    // The only face of a model refers to vertex 7 of 6.
    ("tobj/invalid_index.obj", warns(1, 1, 2)),
    ("tobj/lines.obj", Error("no triangle to draw (0 degenerate triangles, 0 points, 3 lines, 0 curves or surfaces)")),
    ("tobj/quad.obj", gives(3, 5)),
    ("tobj/quad_colored_merge.obj", gives(1, 2)),
    ("tobj/triangle.obj", gives(1, 1)),
    ("tobj/triangle_colored.obj", gives(1, 1)),
    // `Ks` and `Ka`.
    ("trimesh/box.obj", warns(2, 12, 1)),
    ("trimesh/cube.OBJ", gives(1, 12)),
    ("trimesh/cube_compressed.obj", gives(1, 12)),
    // Its faces refer to texture coordinates that it does not have.
    ("trimesh/cubevt.obj", warns(1, 12, 1)),
    ("trimesh/empty.obj", Error("no triangle to draw")),
    ("trimesh/face_in_group_name.obj", Error("no triangle to draw")),
    // Its first face refers to normals that it does not have.
    ("trimesh/face_in_group_name_mid_file.obj", warns(2, 2, 1)),
    ("trimesh/jacked.obj", warns(1, 12, 2)),
    ("trimesh/joined_tetrahedra.obj", gives(2, 8)),
    // A colour that is not a number.
    ("trimesh/nancolor.obj", warns(1, 12, 1)),
    ("trimesh/negative_indices.obj", gives(1, 12)),
    ("trimesh/not_convex.obj", gives(1, 96)),
    // A face of two corners, which is a line; one of a smoothing group without normals; a missing library; an undefined
    // material.
    ("trimesh/notenoughindices.obj", warns(1, 1, 4)),
    ("trimesh/obj_empty.obj", Error("no triangle to draw")),
    ("trimesh/obj_points.obj", Error("no triangle to draw")),
    (
        "trimesh/obj_wireframe.obj",
        Error("no triangle to draw (0 degenerate triangles, 0 points, 12 lines, 0 curves or surfaces)"),
    ),
    ("trimesh/obj_with_no_face_in_chunk.obj", warns(1, 1, 1)),
    ("trimesh/polygonfaces.obj", warns(1, 3, 3)),
    ("trimesh/singlevn.obj", warns(1, 2, 2)),
    ("trimesh/textured_tetrahedron.obj", gives(1, 4)),
    ("trimesh/tube.obj", warns(1, 120, 2)),
    ("trimesh/two_objects.obj", gives(2, 16)),
    // Large polygons on continued lines, some with corners in a row, and a `usemtl` without a name.
    ("trimesh/wallhole.obj", warns(1, 66, 2)),
];

pub fn trials() -> Vec<Trial> {
    let missing = shared_scenes::are_optional_and_missing();
    let malformed = MALFORMED.into_iter().map(|(name, outcome)| {
        trial(format!("shared::malformed/{name}"), move || check(&format!("malformed/{name}"), &outcome))
    });
    let more = [
        trial("shared::every_malformed_file_has_an_outcome", every_malformed_file_has_an_outcome),
        trial("shared::cornell", cornell),
        trial("shared::sponza", sponza),
    ];
    malformed.chain(more).map(|trial| trial.with_ignored_flag(missing)).collect()
}

fn check(name: &str, outcome: &Outcome) {
    match (drawloom_obj::load(shared_scenes::folder().join(name)), outcome) {
        (Ok(imported), &Gives { objects, triangles, warnings }) => {
            assert_eq!((imported.triangles, imported.degenerate_triangles), (triangles, 0));
            assert_eq!(imported.scene.object_count(), objects, "objects");
            assert_eq!(imported.warnings.len(), warnings, "{:?}", imported.warnings);
        }
        (Err(error), Error(part)) => {
            let message = error.to_string();
            assert!(message.contains(part), "{message}");
            assert!(message.contains(name), "the file is not named: {message}");
        }
        (Ok(imported), Error(part)) => panic!("{} triangles instead of the error `{part}`", imported.triangles),
        (Err(error), Gives { .. }) => panic!("{error}"),
    }
}

fn every_malformed_file_has_an_outcome() {
    let listed = MALFORMED.map(|(name, _)| name);
    for folder in ["tobj", "trimesh"] {
        for entry in std::fs::read_dir(shared_scenes::folder().join("malformed").join(folder)).unwrap() {
            let name = format!("{folder}/{}", entry.unwrap().file_name().to_string_lossy());
            let is_obj = name.to_lowercase().ends_with(".obj");
            assert!(!is_obj || listed.contains(&name.as_str()), "{name}");
        }
    }
}

fn cornell() {
    let Imported { mut scene, warnings, triangles, degenerate_triangles, .. } =
        drawloom_obj::load(shared_scenes::folder().join("cornell/CornellBox-Original.obj")).unwrap();
    assert_eq!((scene.object_count(), triangles, degenerate_triangles), (8, 36, 0));
    assert_eq!(warnings, []);
    assert_eq!(material(&scene, "leftWall").diffuse, Vec3::new(0.63, 0.065, 0.05));
    assert_eq!(material(&scene, "rightWall").diffuse, Vec3::new(0.14, 0.45, 0.091));
    assert_eq!(material(&scene, "light").emission, Vec3::new(17.0, 12.0, 4.0));
    let [Light::Hemispherical { position, direction, intensity, range, casts_shadow: true }] = scene.lights[..] else {
        panic!("{:?}", scene.lights);
    };
    assert_eq!(direction, Vec3::NEG_Y);
    assert!(position.distance(DVec3::new(-0.005, 1.98, -0.03)) < 0.01, "{position}");
    // 17, 12 and 4 times 0.47 m by 0.38 m.
    assert!(intensity.abs_diff_eq(Vec3::new(3.0362, 2.1432, 0.7144), 1e-3), "{intensity}");
    assert!(range > 2.0, "{range}");
    // The box is open towards +Z, and the camera is there at mid height.
    demo::add_camera_and_lights(&mut scene);
    let camera = &scene.cameras[0];
    assert!((camera.orientation * Vec3::NEG_Z).abs_diff_eq(Vec3::NEG_Z, 1e-4));
    assert!(camera.position.distance(DVec3::new(-0.01, 0.995, 3.5)) < 0.1, "{}", camera.position);
}

fn sponza() {
    let Imported { mut scene, warnings, triangles, degenerate_triangles, .. } =
        drawloom_obj::load(shared_scenes::folder().join("sponza/sponza_part.obj")).unwrap();
    assert_eq!(triangles + degenerate_triangles, 33_662);
    assert_eq!(scene.object_count(), 126);
    for (_, material) in scene.assets().iter::<Material>() {
        assert_eq!((material.blend, material.opacity, material.texture), (Blend::None, 1.0, None), "{}", material.name);
        assert!(material.double_sided);
    }
    assert!(warnings.contains(&ObjWarning::InvertedOpacity { invisible: 22, materials: 25 }));
    assert!(warnings.contains(&ObjWarning::UndefinedMaterial { material: String::from("VasePlant") }));
    let missing = warnings.iter().filter(|warning| matches!(warning, ObjWarning::UnusableTexture { .. })).count();
    // Leaves and a lion's head have quads so bent that every projection of them intersects itself.
    let crossed = |warning: &&ObjWarning| matches!(warning, ObjWarning::FannedPolygons { .. });
    assert_eq!((missing, warnings.iter().filter(crossed).count(), warnings.len()), (11, 2, 16), "{warnings:?}");
    assert!(warnings.iter().any(|warning| warning.to_string().contains("`textures/sponza_arch_diff.tga`")));
    // Inside, at eye height over the ground floor, looking down the nave.
    demo::add_camera_and_lights(&mut scene);
    let camera = &scene.cameras[0];
    let forward = camera.orientation * Vec3::NEG_Z;
    assert!(forward.x.abs() > 0.9, "{forward}");
    let [low, high] = [DVec3::new(-1921.0, -127.0, -1183.0), DVec3::new(1800.0, 500.0, 1105.0)];
    assert!(camera.position.cmpgt(low).all() && camera.position.cmplt(high).all(), "{}", camera.position);
    assert_eq!(scene.lights.len(), 3);
}

fn material<'a>(scene: &'a Scene, name: &str) -> &'a Material {
    scene.assets().iter::<Material>().map(|(_, material)| material).find(|material| material.name == name).unwrap()
}
