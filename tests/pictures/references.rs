//! Pictures are compared with stored references. Typical mistakes exceed the bound of the comparison.

use std::path::{Path, PathBuf};

use drawloom::backend::Picture;
use drawloom::glam::Vec3;
use drawloom::scene::{Light, Mesh, Scene, Vertex};
use drawloom_testing::demo;
use drawloom_testing::obj_files::{ObjFile, UNUSUAL, hall, interior};
use drawloom_testing::scenes::field;
use drawloom_testing::shared_scenes;
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::draw;
use crate::image_distance::{Distance, as_image, assert_different};

pub const CASES: &[Case] = &[
    ("reference_of_the_projects_own_scene", || compare("colonnade", &colonnade()?)),
    ("reference_of_a_field_of_boxes", || compare("field", &field(400))),
    ("reference_of_an_interior", || compare("interior", &small(generated(&interior())?))),
    ("reference_of_a_hall", || compare("hall", &small(generated(&hall())?))),
    ("every_unusual_file_that_loads_can_be_drawn", unusual_files),
    ("a_wrong_light_exceeds_the_bound", a_wrong_light_exceeds_the_bound),
    ("a_missing_object_exceeds_the_bound", a_missing_object_exceeds_the_bound),
    ("flipped_normals_exceed_the_bound", flipped_normals_exceed_the_bound),
];

pub const CASES_OF_SHARED_SCENES: &[Case] = &[
    ("reference_of_cornell", || compare("cornell", &cornell()?)),
    ("reference_of_sponza", || compare("sponza", &sponza()?)),
    ("every_malformed_file_that_loads_can_be_drawn", malformed_files),
];

pub fn colonnade() -> Result<Scene, Failed> {
    Ok(small(demo::colonnade()?))
}

/// The project's own scene in a smaller picture. Its lamp casts no shadow: the subdivision of all objects near it takes
/// half a second for each renderer, and `everything` has that lamp as well.
pub fn small_colonnade() -> Result<Scene, Failed> {
    let mut scene = colonnade()?;
    scene.cameras[0].size = [160, 90];
    for light in &mut scene.lights {
        if let Light::Hemispherical { casts_shadow, .. } = light {
            *casts_shadow = false;
        }
    }
    Ok(scene)
}

pub fn cornell() -> Result<Scene, Failed> {
    Ok(small(shared("cornell/CornellBox-Original.obj")?))
}

pub fn sponza() -> Result<Scene, Failed> {
    Ok(small(shared("sponza/sponza_part.obj")?))
}

/// A generated scene with a camera and lights.
pub fn generated(file: &ObjFile) -> Result<Scene, Failed> {
    let folder = tempfile::tempdir()?;
    load(&file.write_to(folder.path())?)
}

/// A shared scene with a camera and lights.
pub fn shared(path: &str) -> Result<Scene, Failed> {
    load(&shared_scenes::folder().join(path))
}

fn load(path: &Path) -> Result<Scene, Failed> {
    let mut scene = drawloom_obj::load(path)?.scene;
    demo::add_camera_and_lights(&mut scene);
    Ok(scene)
}

/// The scene with pictures of 320 × 180.
pub fn small(mut scene: Scene) -> Scene {
    for camera in &mut scene.cameras {
        camera.size = [320, 180];
    }
    scene
}

fn compare(name: &str, scene: &Scene) -> Result<(), Failed> {
    compare_picture(name, &draw(scene)?)
}

/// Fails unless a picture is that of the reference called `name`.
pub fn compare_picture(name: &str, picture: &Picture) -> Result<(), Failed> {
    let drawn = as_image(picture)?;
    let path = reference_path(name);
    if std::env::var_os("DRAWLOOM_RENEW_REFERENCES").is_some() {
        drawn.save(&path)?;
    }
    let reference = image::open(&path)?.to_rgb8();
    let distance = Distance::between(&drawn, &reference)?;
    if distance.is_within_bound() {
        return Ok(());
    }
    let found = std::env::temp_dir().join(format!("drawloom-{name}.png"));
    drawn.save(&found)?;
    Err(format!("{distance:?} between {} and {}", path.display(), found.display()).into())
}

fn reference_path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/pictures/references").join(format!("{name}.png"))
}

fn a_wrong_light_exceeds_the_bound() -> Result<(), Failed> {
    let wrong = |color: &mut Vec3| *color = Vec3::new(color.z, color.x, color.y);
    let right = draw(&field(400))?;
    for index in 0..field(0).lights.len() {
        let mut scene = field(400);
        match &mut scene.lights[index] {
            Light::Directional { illuminance, .. } => *illuminance *= 1.2,
            Light::Point { intensity, .. } => wrong(intensity),
            other => return Err(format!("no case for {other:?}").into()),
        }
        assert_different(&draw(&scene)?, &right).map_err(|_| format!("a wrong light {index} goes unnoticed"))?;
    }
    let right = draw(&small_colonnade()?)?;
    let mut scene = small_colonnade()?;
    for light in &mut scene.lights {
        if let Light::Directional { illuminance, .. } = light {
            wrong(illuminance);
        }
    }
    assert_different(&draw(&scene)?, &right)
}

fn a_missing_object_exceeds_the_bound() -> Result<(), Failed> {
    let right = draw(&field(60))?;
    let mut tested = 0;
    for index in 0..20 {
        let mut scene = field(60);
        let handle = scene.objects().nth(index).ok_or("the field has 60 objects")?;
        let object = scene.remove_object(handle)?;
        let large = object.scale.x.abs() > 0.6 && object.position.z > 0.0 && object.position.x.abs() < 12.0;
        let opaque = scene.assets().get(object.material)?.blend == drawloom::scene::Blend::None;
        if large && opaque {
            assert_different(&draw(&scene)?, &right).map_err(|_| format!("a missing object {index} goes unnoticed"))?;
            tested += 1;
        }
    }
    if tested == 0 { Err("no object was large enough".into()) } else { Ok(()) }
}

fn flipped_normals_exceed_the_bound() -> Result<(), Failed> {
    let right = draw(&small_colonnade()?)?;
    // Single-sided materials use the mesh's normals; double-sided ones turn them to the camera.
    let mut scene = small_colonnade()?;
    let meshes: Vec<_> = scene.assets().iter::<Mesh>().map(|(handle, mesh)| (handle, mesh.clone())).collect();
    for (handle, mesh) in meshes {
        let flip = |vertex: &Vertex| Vertex { normal: vertex.normal.map(|component| -component), ..*vertex };
        let vertices = mesh.vertices().iter().map(flip).collect();
        scene.replace(handle, Mesh::new(mesh.name(), mesh.topology(), vertices, mesh.indices().to_vec())?)?;
    }
    assert_different(&draw(&scene)?, &right)
}

fn unusual_files() -> Result<(), Failed> {
    let folder = tempfile::tempdir()?;
    let mut drawn = 0;
    for (name, text) in UNUSUAL {
        let path = folder.path().join(format!("{name}.obj"));
        std::fs::write(&path, text)?;
        drawn += u32::from(draws_if_it_loads(&path)?);
    }
    if drawn < 10 { Err(format!("only {drawn} files loaded").into()) } else { Ok(()) }
}

fn malformed_files() -> Result<(), Failed> {
    let mut drawn = 0;
    for folder in ["tobj", "trimesh"] {
        for entry in std::fs::read_dir(shared_scenes::folder().join("malformed").join(folder))? {
            let path = entry?.path();
            let is_obj = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("obj"));
            drawn += u32::from(is_obj && draws_if_it_loads(&path)?);
        }
    }
    if drawn < 10 { Err(format!("only {drawn} files loaded").into()) } else { Ok(()) }
}

/// Whether a file loads. If it does, something of it is seen.
fn draws_if_it_loads(path: &Path) -> Result<bool, Failed> {
    let Ok(mut imported) = drawloom_obj::load(path) else { return Ok(false) };
    demo::add_camera_and_lights(&mut imported.scene);
    let picture = draw(&small(imported.scene))?;
    let first = &picture.bytes[..4];
    let is_plain = picture.bytes.chunks_exact(4).all(|pixel| pixel == first);
    if is_plain { Err(format!("{} gives an empty picture", path.display()).into()) } else { Ok(true) }
}
