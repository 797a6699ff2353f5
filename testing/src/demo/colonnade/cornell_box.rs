//! The Cornell box, from its published measurements (<https://www.graphics.cornell.edu/online/box/data.html>).

use drawloom::glam::{DVec3, Vec2, Vec3};
use drawloom::scene::{Light, Material, RenderObject, Scene, SceneError};

use super::mesh_builder::MeshBuilder;

/// Metres per published millimetre: ten times the size of the original, so that one can walk in.
const SCALE: f32 = 0.01;

/// The middle of the opening on the published x axis.
const MIDDLE: f32 = 278.0;

const WHITE: Vec3 = Vec3::new(0.725, 0.71, 0.68);
const RED: Vec3 = Vec3::new(0.63, 0.065, 0.05);
const GREEN: Vec3 = Vec3::new(0.14, 0.45, 0.091);

/// The radiance of the lamp in the ceiling, per channel.
const RADIANCE: Vec3 = Vec3::new(24.0, 17.0, 8.5);

/// Adds the box with its two blocks and its lamp. The opening faces +Z, and the middle of its lower edge is at
/// `position`. The faces of the box point inward.
///
/// # Errors
/// As [`colonnade`](super::colonnade).
pub(super) fn add(scene: &mut Scene, position: DVec3) -> Result<(), SceneError> {
    let floor = quad([552.8, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 559.2], [549.6, 0.0, 559.2]);
    let back = quad([549.6, 0.0, 559.2], [0.0, 0.0, 559.2], [0.0, 548.8, 559.2], [556.0, 548.8, 559.2]);
    let right = quad([0.0, 0.0, 559.2], [0.0, 0.0, 0.0], [0.0, 548.8, 0.0], [0.0, 548.8, 559.2]);
    let left = quad([552.8, 0.0, 0.0], [549.6, 0.0, 559.2], [556.0, 548.8, 559.2], [556.0, 548.8, 0.0]);
    let lamp = ceiling_between([213.0, 343.0], [227.0, 332.0]);
    let short = prism([[130.0, 65.0], [82.0, 225.0], [240.0, 272.0], [290.0, 114.0]], 165.0);
    let tall = prism([[423.0, 247.0], [265.0, 296.0], [314.0, 456.0], [472.0, 406.0]], 330.0);
    // The ceiling surrounds the lamp.
    let ceiling_rectangles = [
        ([0.0, 556.0], [0.0, 227.0]),
        ([0.0, 556.0], [332.0, 559.2]),
        ([0.0, 213.0], [227.0, 332.0]),
        ([343.0, 556.0], [227.0, 332.0]),
    ];
    let ceiling =
        ceiling_rectangles.into_iter().fold(MeshBuilder::default(), |builder, ([low_x, high_x], [low_z, high_z])| {
            builder.quad(ceiling_corners([low_x, high_x], [low_z, high_z]))
        });
    for (name, builder, diffuse, emission) in [
        ("box floor", floor, WHITE, Vec3::ZERO),
        ("box ceiling", ceiling, WHITE, Vec3::ZERO),
        ("box back wall", back, WHITE, Vec3::ZERO),
        ("box right wall", right, GREEN, Vec3::ZERO),
        ("box left wall", left, RED, Vec3::ZERO),
        ("short block", short, WHITE, Vec3::ZERO),
        ("tall block", tall, WHITE, Vec3::ZERO),
        ("box lamp", lamp, Vec3::splat(0.78), RADIANCE),
    ] {
        let mesh = builder.add_to(scene, name)?;
        let material = scene.add(Material { name: name.into(), diffuse, emission, ..Material::default() })?;
        scene.add_object(RenderObject::new(mesh, material, position))?;
    }
    // On its axis, the intensity of a planar surface is radiance times area.
    let intensity = RADIANCE * (1.30 * 1.05);
    scene.lights.push(Light::Hemispherical {
        position: position + point([278.0, 547.8, 279.5]).as_dvec3(),
        direction: Vec3::NEG_Y,
        intensity,
        range: Light::range_for(intensity),
        casts_shadow: true,
    });
    Ok(())
}

/// Converts a published coordinate: rotated by 180°, since the published camera looks along +Z and ours along −Z.
fn point([x, y, z]: [f32; 3]) -> Vec3 {
    Vec3::new(MIDDLE - x, y, -z) * SCALE
}

fn quad(a: [f32; 3], b: [f32; 3], c: [f32; 3], d: [f32; 3]) -> MeshBuilder {
    MeshBuilder::default().quad([a, b, c, d].map(point))
}

fn ceiling_between(x: [f32; 2], z: [f32; 2]) -> MeshBuilder {
    MeshBuilder::default().quad(ceiling_corners(x, z))
}

/// The corners of a rectangle of the ceiling, which faces down.
fn ceiling_corners([low_x, high_x]: [f32; 2], [low_z, high_z]: [f32; 2]) -> [Vec3; 4] {
    [[high_x, low_z], [high_x, high_z], [low_x, high_z], [low_x, low_z]].map(|[x, z]| point([x, 548.8, z]))
}

fn prism(footprint: [[f32; 2]; 4], height: f32) -> MeshBuilder {
    let footprint = footprint.map(|[x, z]| point([x, 0.0, z])).map(|corner| Vec2::new(corner.x, corner.z));
    MeshBuilder::default().prism(&footprint, 0.0, height * SCALE)
}
