//! The scene of L 6: a few objects under a light. Further objects have the same positions as these.

use std::f64::consts::TAU;

use drawloom::glam::{DVec3, Vec3};
use drawloom::scene::{Camera, Light, Material, Mesh, RenderObject, Scene, SceneError};
use drawloom_benches::moving::{Motion, Moving};
use drawloom_testing::random::Random;

/// Width and height of the picture and the shadow map. They are small, as the CPU part is measured and a software
/// device would share the cores.
pub const PICTURE: u32 = 64;

/// The number of objects with positions, meshes and materials of their own.
pub const ORIGINALS: usize = 7;
/// In metres. From there a box needs no subdivision in the light's map: its edges subtend at most 5°.
const LIGHT_HEIGHT: f64 = 20.0;
const LIGHT_DISTANCE: f64 = 1.0;

/// The scene with this many lights, each of which casts shadows.
///
/// # Errors
/// Returns an error if the scene rejects a mesh, a material or an object.
pub fn new(objects: usize, lights: usize) -> Result<Moving, SceneError> {
    let mut random = Random::new();
    let mut scene = Scene::new();
    let mut originals = Vec::new();
    for index in 0..ORIGINALS {
        let mesh = scene.add(Mesh::cuboid(format!("box {index}"), 2.0 * random.vector(0.3, 0.5))?)?;
        let (name, diffuse) = (format!("paint {index}"), random.vector(0.2, 0.9));
        let material = scene.add(Material { name, diffuse, ..Material::default() })?;
        let (sine, cosine) = (TAU * index as f64 / ORIGINALS as f64).sin_cos();
        originals.push(RenderObject::new(mesh, material, DVec3::new(cosine, 0.0, sine) * 3.0));
    }
    for &object in originals.iter().cycle().take(objects) {
        scene.add_object(object)?;
    }
    scene
        .cameras
        .push(Camera { size: [PICTURE; 2], ..Camera::looking_at("main", DVec3::new(0.0, 6.0, 10.0), DVec3::ZERO) });
    scene.lights.extend((0..lights).map(|index| Light::Hemispherical {
        position: DVec3::new(index as f64 * LIGHT_DISTANCE, LIGHT_HEIGHT, 0.0),
        direction: Vec3::NEG_Y,
        intensity: Vec3::splat(300.0 / lights as f32),
        range: 40.0,
        casts_shadow: true,
    }));
    Ok(Moving::new(scene, Motion::Everything))
}
