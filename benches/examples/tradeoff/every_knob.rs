//! A small scene in which every knob has an effect.

use std::f32::consts::{FRAC_PI_2, TAU};

use drawloom::glam::{DVec3, Quat, Vec2, Vec3};
use drawloom::scene::{ClipPlane, LayerMask, Material, RenderObject, Topology};
use drawloom_testing::scenes::everything::everything;
use drawloom_testing::scenes::leveled::globe;
use drawloom_testing::scenes::square;

use crate::Failure;
use crate::subject::{ImpostorSquare, MIRRORS, NO_CASTER, ORIGINAL, SQUARE, SQUARE_TYPE, Subject};

/// The layer of what is neither a mirror's surface nor the impostor or its original.
const WORLD: LayerMask = LayerMask::layer(0);

/// Where the globes with levels of detail stand, and their radii: some before the wall, one behind it, others beside it
/// up to 40 m away, and the last behind the camera, where the first mirror shows it.
const GLOBES: [[f64; 4]; 10] = [
    [-5.0, 1.0, -1.0, 1.0],
    [5.2, 1.0, -2.0, 1.0],
    [0.0, 1.0, -9.0, 1.0],
    [-9.0, 1.0, -4.0, 1.0],
    [9.5, 1.0, -6.0, 1.0],
    [-14.0, 1.0, -11.0, 1.0],
    [16.0, 1.0, -15.0, 1.0],
    [-24.0, 1.0, -22.0, 1.0],
    [30.0, 1.0, -30.0, 1.0],
    [4.0, 1.8, 13.0, 2.5],
];

/// The centre of the globes that the impostor stands for, and the radius around them.
const CLUSTER: (DVec3, f64) = (DVec3::new(3.9, 1.2, 2.0), 1.0);

/// The scene [`everything`], which has lights of all classes and objects of all blend modes, on wide ground, with
/// globes that have levels of detail, two mirrors, and an impostor of a cluster of globes.
///
/// # Errors
/// If the scene has no room for an object.
pub fn every_knob() -> Result<Subject, Failure> {
    let mut scene = everything();
    for handle in scene.objects().collect::<Vec<_>>() {
        let object = scene.object(handle)?;
        scene.replace_object(handle, RenderObject { layers: WORLD, ..object })?;
    }
    let (globe, plate) = (scene.add(globe())?, scene.add(square(Topology::TriangleList))?);
    let clay = scene.add(Material { diffuse: Vec3::new(0.6, 0.4, 0.3), ..Material::default() })?;
    let leaf = scene.add(Material { diffuse: Vec3::new(0.2, 0.5, 0.2), ..Material::default() })?;

    let mut ground = RenderObject::new(plate, clay, DVec3::Y * -0.02);
    (ground.orientation, ground.scale) = (Quat::from_rotation_x(-FRAC_PI_2), Vec3::splat(80.0));
    scene.add_object(RenderObject { layers: NO_CASTER, ..ground })?;
    for [x, y, z, radius] in GLOBES {
        let globe = RenderObject::new(globe, clay, DVec3::new(x, y, z));
        scene.add_object(RenderObject { layers: WORLD, scale: Vec3::splat(radius as f32), ..globe })?;
    }

    let (center, radius) = CLUSTER;
    for index in 0..5 {
        // Around the middle one.
        let turn = TAU * index as f32 / 4.0;
        let offset = if index == 0 { Vec3::ZERO } else { Vec3::new(turn.cos(), 0.3 * turn.sin(), turn.sin()) * 0.6 };
        let object = RenderObject::new(globe, leaf, center + offset.as_dvec3());
        scene.add_object(RenderObject { layers: ORIGINAL, scale: Vec3::splat(0.35), ..object })?;
    }
    let picture = scene.add(Material { values: Some(SQUARE_TYPE.values(0)), ..Material::default() })?;
    let square = scene.add_object(RenderObject { layers: SQUARE, ..RenderObject::new(plate, picture, center) })?;
    let impostor = Some(ImpostorSquare { center, radius, square });

    let surface = scene.add(Material { diffuse: Vec3::ZERO, ..Material::default() })?;
    let places = [
        (DVec3::new(-4.6, 1.6, 0.8), Quat::from_rotation_y(0.6), Vec2::new(1.0, 1.3)),
        (DVec3::new(0.0, 0.02, 4.2), Quat::from_rotation_x(-FRAC_PI_2), Vec2::new(2.6, 0.8)),
    ];
    let mut mirrors = Vec::new();
    for ((position, orientation, half_size), (_, layers)) in places.into_iter().zip(MIRRORS) {
        let object = RenderObject::new(plate, surface, position);
        scene.add_object(RenderObject { layers, orientation, scale: half_size.extend(1.0), ..object })?;
        mirrors.push(ClipPlane { point: position, normal: orientation * Vec3::Z });
    }
    Ok(Subject { scene, mirrors, impostor })
}
