//! A city of boxes.

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::scene::{Camera, Material, Mesh, RenderObject, Scene, SceneError};
use drawloom_testing::random::Random;

/// In metres: the side of a lot. A street follows after [`LOTS`] lots along each axis.
const LOT: f64 = 14.0;
const LOTS: [usize; 2] = [4, 6];
const STREET: f64 = 16.0;

/// The share of boxes that are houses. The others are objects in the streets, half a metre to five metres high.
const HOUSES: f64 = 0.7;

/// A city of `boxes` boxes, with cameras in streets, above roofs and high above.
///
/// # Errors
/// Returns an error if the scene rejects a mesh, a material or an object.
pub fn new(boxes: usize, picture: [u32; 2]) -> Result<Scene, SceneError> {
    with_street_mesh(boxes, picture, None)
}

/// The same city, whose objects in the streets have a mesh of their own, which fits into a cube from −1 to 1. They
/// remain boxes without it.
///
/// # Errors
/// Returns an error if the scene rejects a mesh, a material or an object.
pub fn with_street_mesh(boxes: usize, picture: [u32; 2], street_mesh: Option<Mesh>) -> Result<Scene, SceneError> {
    let mut random = Random::new();
    let mut scene = Scene::new();
    let house_mesh = scene.add(Mesh::cuboid("box".to_owned(), Vec3::splat(2.0))?)?;
    let street_mesh = street_mesh.map_or(Ok(house_mesh), |mesh| scene.add(mesh))?;
    let material = scene.add(Material::default())?;
    let houses = (boxes as f64 * HOUSES) as usize;
    let side = (houses as f64).sqrt().ceil() as usize;
    // The position of a lot along an axis, relative to the city's centre.
    let along = |lot: usize, axis: usize| {
        let streets = |lot: usize| (lot / LOTS[axis]) as f64 * STREET;
        (lot as f64 + 0.5 - (side / 2 / LOTS[axis] * LOTS[axis]) as f64) * LOT + streets(lot)
            - streets(side / 2 / LOTS[axis] * LOTS[axis])
    };
    let extent = side as f64 * LOT * 0.5;
    for index in 0..boxes {
        let is_house = index < houses;
        let (x, z, half, height) = if is_house {
            let half = [random.between(4.5, 6.9), random.between(4.5, 6.9)];
            // Only a few are high.
            let height = 6.0 + 22.0 * random.between(0.0, 1.0).powi(2) + 90.0 * random.between(0.0, 1.0).powi(40);
            (along(index % side, 0), along(index / side, 1), half, height)
        } else {
            let half = [random.between(0.25, 2.5), random.between(0.25, 2.5)];
            (random.between(-extent, extent), random.between(-extent, extent), half, random.between(0.5, 5.0))
        };
        let is_rotated = random.below(7) == 0;
        let angle = if is_rotated { random.between(0.0, 1.57) } else { 0.0 };
        // A rotated box must still fit into its lot.
        let half = half.map(|half| if is_rotated { half * 0.7 } else { half });
        let mesh = if is_house { house_mesh } else { street_mesh };
        let object = RenderObject::new(mesh, material, DVec3::new(x, height * 0.5, z));
        let scale = Vec3::new(half[0] as f32, height as f32 * 0.5, half[1] as f32);
        scene.add_object(RenderObject { scale, orientation: Quat::from_rotation_y(angle as f32), ..object })?;
    }
    let street = -STREET * 0.5;
    let eye = DVec3::new(street, 1.7, street);
    let up = |height: f64| DVec3::Y * height;
    scene.cameras = [
        ("along a street", eye + DVec3::Z * 60.0, DVec3::NEG_Z),
        ("across a street", eye + DVec3::Z * 55.0, DVec3::new(1.0, 0.05, -0.3)),
        ("from a crossing", eye, DVec3::new(1.0, 0.1, 1.0)),
        ("above the roofs", eye + up(32.0), DVec3::new(-0.6, -0.1, 1.0)),
        ("from above", eye + up(250.0), DVec3::new(0.5, -0.8, 0.5)),
    ]
    .map(|(name, position, towards)| Camera { size: picture, ..Camera::looking_at(name, position, position + towards) })
    .into();
    Ok(scene)
}
