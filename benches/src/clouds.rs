//! Scenes of boxes scattered in clouds. Each camera sees a whole cloud.

use std::f64::consts::TAU;

use drawloom::glam::{DVec3, Quat};
use drawloom::scene::{Blend, Camera, Material, Mesh, RenderObject, Scene, SceneError};
use drawloom_testing::random::Random;

pub const MESHES: u32 = 64;
/// A view of a large cloud has 64 × 16 = 1,024 batches, which are four bundles to record.
pub const MATERIALS: u32 = 16;

/// In metres. A cloud covers 20° to each side of its camera's axis. A camera sees 30° in each direction, as its picture
/// is square: all of its own cloud, and nothing of the clouds at right angles to it.
const DISTANCE: f64 = 150.0;
const CLOUD_RADIUS: f64 = 50.0;

/// Width and height in pixels. It is small, as the CPU part is measured and a software device would share the cores.
const PICTURE: u32 = 64;

/// Cameras around one cloud of objects. Each sees the whole cloud.
///
/// # Errors
/// Returns an error if the scene rejects a mesh, a material or an object.
pub fn around_one(cameras: usize, objects: usize) -> Result<Scene, SceneError> {
    let mut scene = scene_of_clouds([(DVec3::ZERO, objects)], Blend::None)?;
    let around = directions(cameras).enumerate();
    scene.cameras = around.map(|(index, direction)| camera(index, direction * DISTANCE, DVec3::ZERO)).collect();
    Ok(scene)
}

/// Four cameras back to back, each with a cloud of its own, all of this blending.
///
/// # Errors
/// Returns an error if the scene rejects a mesh, a material or an object.
pub fn back_to_back(objects: [usize; 4], blend: Blend) -> Result<Scene, SceneError> {
    let centers: Vec<_> = directions(4).map(|direction| direction * DISTANCE).collect();
    let mut scene = scene_of_clouds(centers.iter().copied().zip(objects), blend)?;
    scene.cameras = centers.iter().enumerate().map(|(index, &center)| camera(index, DVec3::ZERO, center)).collect();
    Ok(scene)
}

/// A row of clouds far from each other, `objects` boxes in each, one after the other in the scene. Each of the cameras
/// sees one of the first clouds.
///
/// # Errors
/// Returns an error if the scene rejects a mesh, a material or an object.
pub fn row(clouds: usize, objects: usize, cameras: usize) -> Result<Scene, SceneError> {
    let center = |cloud: usize| DVec3::X * (cloud as f64 * 50.0 * DISTANCE);
    let mut scene = scene_of_clouds((0..clouds).map(|cloud| (center(cloud), objects)), Blend::None)?;
    let before = |cloud| camera(cloud, center(cloud) + DVec3::Z * DISTANCE, center(cloud));
    scene.cameras = (0..cameras).map(before).collect();
    Ok(scene)
}

fn directions(count: usize) -> impl Iterator<Item = DVec3> {
    (0..count).map(move |index| {
        let (sine, cosine) = (TAU * index as f64 / count as f64).sin_cos();
        DVec3::new(cosine, 0.0, sine)
    })
}

fn camera(index: usize, position: DVec3, target: DVec3) -> Camera {
    Camera { size: [PICTURE; 2], ..Camera::looking_at(format!("camera {index}"), position, target) }
}

/// A scene of clouds, each given by its centre and number of boxes.
fn scene_of_clouds(clouds: impl IntoIterator<Item = (DVec3, usize)>, blend: Blend) -> Result<Scene, SceneError> {
    let opacity = if blend == Blend::None { 1.0 } else { 0.5 };
    let mut random = Random::new();
    let mut scene = Scene::new();
    let (mut meshes, mut materials) = (Vec::new(), Vec::new());
    for index in 0..MESHES {
        meshes.push(scene.add(Mesh::cuboid(format!("box {index}"), 2.0 * random.vector(0.1, 0.6))?)?);
    }
    for index in 0..MATERIALS {
        let (name, diffuse) = (format!("paint {index}"), random.vector(0.2, 0.9));
        materials.push(scene.add(Material { name, diffuse, blend, opacity, ..Material::default() })?);
    }
    for (center, objects) in clouds {
        for _ in 0..objects {
            let position = center + random.direction() * (CLOUD_RADIUS * random.between(0.0, 1.0).cbrt());
            let orientation = Quat::from_axis_angle(random.direction().as_vec3(), random.between(0.0, TAU) as f32);
            let mesh = meshes[random.below(meshes.len())];
            let material = materials[random.below(materials.len())];
            scene.add_object(RenderObject { orientation, ..RenderObject::new(mesh, material, position) })?;
        }
    }
    Ok(scene)
}
