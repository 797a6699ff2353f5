//! A small scene that requires every render process.

use std::f32::consts::{FRAC_PI_2, PI};

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::handle::Handle;
use drawloom::scene::{
    Blend, Camera, ClipPlane, LayerMask, Light, LightKind, Material, Mesh, RenderObject, Scene, Topology,
};
use drawloom::view::LightClass;

use super::{cube, sized, square};

/// The size of its picture.
pub const SIZE: [u32; 2] = [96, 64];

/// Boxes on a floor before a wall, some of them behind panes of each blend mode, and a light of every class that
/// reaches visible objects. Opaque objects have three draw states: a list, a mirrored list, and a double-sided strip.
pub fn everything() -> Scene {
    let mut scene = Scene::new();
    let list = scene.add(square(Topology::TriangleList)).unwrap();
    let strip = scene.add(square(Topology::TriangleStrip)).unwrap();
    let block = scene.add(cube()).unwrap();
    let stone = scene.add(Material { diffuse: Vec3::splat(0.7), ..Material::default() }).unwrap();
    let plaster = Material { diffuse: Vec3::new(0.5, 0.6, 0.7), double_sided: true, ..Material::default() };
    let plaster = scene.add(plaster).unwrap();

    add(&mut scene, list, stone, DVec3::ZERO, Vec3::splat(6.0), Quat::from_rotation_x(-FRAC_PI_2));
    add(&mut scene, strip, plaster, DVec3::new(0.0, 2.0, -4.0), Vec3::splat(6.0), Quat::IDENTITY);
    for (index, x) in [-2.4, -0.8, 0.8, 2.4].into_iter().enumerate() {
        let mirrored = if index == 2 { -1.0 } else { 1.0 };
        let position = DVec3::new(x, 0.5, -0.5 * index as f64);
        add(
            &mut scene,
            block,
            stone,
            position,
            Vec3::new(0.4 * mirrored, 0.5, 0.4),
            Quat::from_rotation_y(index as f32),
        );
    }
    for (x, blend) in [(-2.0, Blend::Alpha), (0.0, Blend::Additive), (2.0, Blend::Subtractive)] {
        let diffuse = Vec3::new(0.3, 0.5, 0.2);
        let glass = scene.add(Material { diffuse, blend, opacity: 0.6, ..Material::default() }).unwrap();
        add(&mut scene, list, glass, DVec3::new(x, 1.2, 2.5), Vec3::splat(0.8), Quat::IDENTITY);
    }
    scene.lights = LightClass::all().map(light_of).collect();
    scene.ambient = Vec3::splat(0.05);
    scene.background = Vec3::new(0.1, 0.15, 0.3);
    scene.cameras = vec![sized(Camera::looking_at("main", DVec3::new(0.0, 3.0, 8.0), DVec3::Y), SIZE)];
    scene
}

fn add(
    scene: &mut Scene,
    mesh: Handle<Mesh>,
    material: Handle<Material>,
    position: DVec3,
    scale: Vec3,
    orientation: Quat,
) {
    scene.add_object(RenderObject { scale, orientation, ..RenderObject::new(mesh, material, position) }).unwrap();
}

/// A light of a class.
fn light_of(class: LightClass) -> Light {
    let casts_shadow = class.shadowed;
    let side = if casts_shadow { 1.0 } else { -1.0 };
    let position = DVec3::new(f64::from(side) * 3.0, 5.0, 4.0);
    let direction = (Vec3::new(0.0, 0.0, -1.0) - position.as_vec3()).normalize();
    let color = Vec3::new(0.9, 0.7 + 0.2 * side, 0.7);
    match class.kind {
        LightKind::Directional => Light::Directional { direction, illuminance: color * 0.8, casts_shadow },
        LightKind::Point => Light::Point {
            position: DVec3::new(0.0, 2.0, 0.5 * f64::from(-side)),
            intensity: color * 2.0,
            range: 8.0,
            casts_shadow,
        },
        LightKind::Spot => Light::Spot {
            position,
            direction,
            intensity: color * 20.0,
            range: 20.0,
            inner_angle: 0.3,
            outer_angle: PI / 4.0,
            casts_shadow,
        },
        LightKind::Hemispherical => Light::Hemispherical {
            position: DVec3::new(f64::from(side), 4.0, 1.0),
            direction: Vec3::NEG_Y,
            intensity: color * 8.0,
            range: 20.0,
            casts_shadow,
        },
        other => unreachable!("no light of kind {other:?}"),
    }
}

/// The class of a light of the scene, if shadows are enabled.
pub fn class_of(light: &Light) -> LightClass {
    LightClass { kind: light.kind(), shadowed: light.casts_shadow() }
}

/// The same light without a shadow.
pub fn without_shadow(mut light: Light) -> Light {
    *light.casts_shadow_mut() = false;
    light
}

/// The same light, but black.
pub fn dark(mut light: Light) -> Light {
    *light.color_mut() = Vec3::ZERO;
    light
}

/// The blended materials, in slot order.
pub fn glasses(scene: &Scene) -> Vec<(Handle<Material>, Material)> {
    let materials = scene.assets().iter::<Material>();
    materials
        .filter(|(_, material)| material.blend != Blend::None)
        .map(|(handle, glass)| (handle, glass.clone()))
        .collect()
}

/// The objects of [`everything_with_mirror`] but the mirror.
pub const WORLD: LayerMask = LayerMask::layer(0);

/// The scene with a mirror above the boxes, an object of the layer `mirror`, and with the camera that draws what it
/// reflects: the view `mirror` of the camera. In the picture of that camera nothing transparent is in front of the
/// mirror.
pub fn everything_with_mirror(mirror: LayerMask) -> Scene {
    let mut scene = everything();
    for handle in scene.objects().collect::<Vec<_>>() {
        let object = scene.object(handle).unwrap();
        scene.replace_object(handle, RenderObject { layers: WORLD, ..object }).unwrap();
    }
    let (point, orientation) = (DVec3::new(0.0, 3.2, -3.0), Quat::from_rotation_x(0.4));
    let mesh = scene.add(square(Topology::TriangleList)).unwrap();
    let material = scene.add(Material { diffuse: Vec3::ZERO, ..Material::default() }).unwrap();
    let (scale, object) = (Vec3::splat(2.2), RenderObject::new(mesh, material, point));
    scene.add_object(RenderObject { layers: mirror, orientation, scale, ..object }).unwrap();
    // The panes have one visible side, which the camera sees. The mirror sees that of one more.
    let (glass, _) = glasses(&scene)[0];
    let (back, behind) = (Quat::from_rotation_y(PI), DVec3::new(0.6, 1.4, -0.8));
    let pane = RenderObject::new(mesh, glass, behind);
    scene.add_object(RenderObject { layers: WORLD, orientation: back, scale: Vec3::splat(0.8), ..pane }).unwrap();
    let camera = scene.cameras[0].reflected("mirror", ClipPlane { point, normal: orientation * Vec3::Z });
    scene.cameras.push(Camera { layers: WORLD, ..camera });
    scene
}
