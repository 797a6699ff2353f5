//! Scenes in which many small contributions of light add up, with their sums in f64.

use std::f64::consts::PI;

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::quality::{Quality, RadianceSum, ShadowQuality};
use drawloom::scene::{Blend, Camera, Light, Material, Projection, RenderObject, Scene, Topology};

use crate::scenes::{sized, square};

/// A scene of a white square at the world's origin that faces +Z, and of what adds light to it.
pub struct SumScene {
    pub name: String,
    pub scene: Scene,
    /// The number of lights.
    pub lights: u32,
    /// The number of blended objects that cover each pixel.
    pub objects: u32,
    /// What each pixel's radiance is.
    expected: Vec<[f64; 3]>,
    /// What it would be if everything were added.
    magnitude: Vec<[f64; 3]>,
}

/// What f32 adds to the error of a light by itself, as a fraction of it: half a unit in the last place for each of less
/// than 256 roundings. The position of a pixel has some 20, the way from there to the light and its factors some 80,
/// each of which may count twice.
const SHADING_ERROR: f64 = 256.0 / 16_777_216.0;

impl SumScene {
    /// The greatest error that this value of the knob may make, as a fraction of all that is added.
    pub fn bound(&self, sum: RadianceSum) -> f64 {
        sum.max_light_error(self.lights) + sum.max_blended_error(self.objects) + SHADING_ERROR
    }

    /// The greatest error of a pixel, as a fraction of all that is added, of `radiance`.
    ///
    /// # Panics
    /// If the number of pixels is another one.
    pub fn error(&self, radiance: &[[f64; 3]]) -> f64 {
        assert_eq!(radiance.len(), self.expected.len(), "{}", self.name);
        let pixels = radiance.iter().zip(&self.expected).zip(&self.magnitude);
        let errors = pixels.flat_map(|((found, expected), magnitude)| {
            [0, 1, 2].map(|channel| (found[channel] - expected[channel]).abs() / magnitude[channel])
        });
        // NaN counts as the greatest.
        errors.fold(0.0, |worst, error| if error.is_nan() || error > worst { error } else { worst })
    }
}

/// The exact quality with this value of the knob, and with small shadow maps, because some scenes have a hundred of
/// them.
pub fn quality(radiance_sum: RadianceSum) -> Quality {
    let exact = Quality::exact();
    Quality { radiance_sum, shadows: ShadowQuality { side: 64, ..exact.shadows }, ..exact }
}

/// The values of the knob.
pub const SUMS: [RadianceSum; 3] = [RadianceSum::HalfFloat, RadianceSum::Float, RadianceSum::Shader];

/// The numbers of lights and of objects.
const COUNTS: [u32; 3] = [1, 100, 10_000];

/// All scenes with lights.
pub fn light_scenes() -> Vec<SumScene> {
    let mut scenes = vec![every_class()];
    for count in COUNTS {
        for is_mixed in [false, true] {
            scenes.push(lit(count, is_mixed));
            scenes.push(shadowed(count, is_mixed));
        }
        scenes.push(lit_glass(count));
    }
    scenes
}

/// All scenes with blended objects.
pub fn blended_scenes() -> Vec<SumScene> {
    let mut scenes = Vec::new();
    for count in COUNTS {
        for blend in [Blend::Additive, Blend::Subtractive, Blend::Alpha] {
            scenes.extend([false, true].map(|is_mixed| panes(blend, count, is_mixed)));
        }
    }
    scenes
}

/// What all lights together have as intensity.
const TOTAL: DVec3 = DVec3::new(6.0, 4.0, 0.5);

const RANGE: f32 = 50.0;

/// The share of each of `count` terms. Mixed ones are 1 to 10,000 times as large as others, and the largest come first.
fn shares(count: u32, is_mixed: bool) -> Vec<f64> {
    let weight = |index: u32| if is_mixed { 10_f64.powi(-(index as i32 % 5)) } else { 1.0 };
    let sum: f64 = (0..count).map(weight).sum();
    (0..count).map(|index| weight(index) / sum).collect()
}

/// The position of a light around the square's axis.
fn around(index: u32) -> DVec3 {
    let (sine, cosine) = (f64::from(index) * 2.4).sin_cos();
    let radius = 0.5 + 0.1 * f64::from(index % 5);
    DVec3::new(radius * cosine, radius * sine, 1.0 + 0.25 * f64::from(index % 3))
}

fn point(position: DVec3, intensity: DVec3) -> Light {
    Light::Point { position, intensity: intensity.as_vec3(), range: RANGE, casts_shadow: false }
}

/// A light whose whole brightness reaches all of the picture.
fn spot(position: DVec3, intensity: DVec3, casts_shadow: bool) -> Light {
    let direction = (-position).normalize().as_vec3();
    let (inner_angle, outer_angle) = (0.8, 1.0);
    Light::Spot {
        position,
        direction,
        intensity: intensity.as_vec3(),
        range: RANGE,
        inner_angle,
        outer_angle,
        casts_shadow,
    }
}

/// Point lights without shadows.
fn lit(count: u32, is_mixed: bool) -> SumScene {
    let lights = (0..).zip(shares(count, is_mixed)).map(|(index, share)| point(around(index), TOTAL * share)).collect();
    sum_of_lights(described("lights", count, is_mixed), base(Vec3::ONE, Vec3::ZERO, 0.0), lights, |_| true)
}

/// The same on a pane in front of the square, which is lit as it is blended.
fn lit_glass(count: u32) -> SumScene {
    let mut scene = base(Vec3::ZERO, Vec3::ZERO, -1.0);
    let pane = Material { diffuse: Vec3::ONE, blend: Blend::Alpha, ..Material::default() };
    add_pane(&mut scene, pane, 0.0);
    let lights = (0..).zip(shares(count, true)).map(|(index, share)| point(around(index), TOTAL * share)).collect();
    SumScene { objects: 1, ..sum_of_lights(format!("{count} lights on glass"), scene, lights, |_| true) }
}

/// Spot lights, up to 100 of which have a shadow map. A wall hides every second of those.
fn shadowed(count: u32, is_mixed: bool) -> SumScene {
    let is_hidden = |index: u32| index < 100 && index % 2 == 1;
    let light = |(index, share): (u32, f64)| {
        let y = 0.2 * f64::from(index % 7) - 0.6;
        let position = if is_hidden(index) { DVec3::new(2.5, y, 1.0) } else { DVec3::new(-1.5, y, 1.2) };
        spot(position, TOTAL * share, index < 100)
    };
    let lights: Vec<_> = (0..).zip(shares(count, is_mixed)).map(light).collect();
    let mut scene = base(Vec3::ONE, Vec3::ZERO, 0.0);
    let mesh = scene.add(square(Topology::TriangleList)).expect("it is valid");
    let material = scene.add(Material { double_sided: true, ..Material::default() }).expect("it is valid");
    let orientation = Quat::from_rotation_y(std::f32::consts::FRAC_PI_2);
    let wall =
        RenderObject { orientation, scale: Vec3::splat(4.0), ..RenderObject::new(mesh, material, DVec3::X * 1.5) };
    scene.add_object(wall).expect("it is valid");
    sum_of_lights(described("shadowed lights", count, is_mixed), scene, lights, |index| !is_hidden(index))
}

/// Eight lights of each class.
fn every_class() -> SumScene {
    let light = |(index, share): (u32, f64)| {
        let (position, casts_shadow, intensity) = (around(index), index / 4 % 2 == 1, TOTAL * share);
        match index % 4 {
            0 => {
                let direction = (-position).normalize().as_vec3();
                Light::Directional { direction, illuminance: intensity.as_vec3(), casts_shadow }
            }
            1 => Light::Point { position, intensity: intensity.as_vec3(), range: RANGE, casts_shadow },
            2 => spot(position, intensity, casts_shadow),
            _ => {
                let intensity = intensity.as_vec3();
                Light::Hemispherical { position, direction: Vec3::NEG_Z, intensity, range: RANGE, casts_shadow }
            }
        }
    };
    let lights = (0..).zip(shares(64, true)).map(light).collect();
    sum_of_lights("lights of every class".to_owned(), base(Vec3::ONE, Vec3::ZERO, 0.0), lights, |_| true)
}

/// Panes of one blend mode before a square that shines.
fn panes(blend: Blend, count: u32, is_mixed: bool) -> SumScene {
    // A half float has it exactly, so that only sums are rounded.
    let background = DVec3::new(4.0, 2.0, 0.5);
    let mut scene = base(Vec3::ZERO, background.as_vec3(), 0.0);
    let shares = shares(count, is_mixed);
    let (mut radiance, mut magnitude) = (background, background);
    // As few materials as there are different panes, and all of them in front of the square.
    let mut materials = Vec::new();
    let mesh = scene.add(square(Topology::TriangleList)).expect("it is valid");
    for (index, share) in shares.into_iter().enumerate() {
        let (emission, opacity) = match blend {
            // Half of what is behind remains, whatever the number.
            Blend::Alpha => (Vec3::new(0.5, 3.0, 1.0), -(-std::f64::consts::LN_2 * share).exp_m1() as f32),
            _ => ((background * 1.37 * share).as_vec3(), 0.5),
        };
        if materials.len() <= index.min(4) {
            let pane = Material { diffuse: Vec3::ZERO, emission, opacity, blend, ..Material::default() };
            materials.push(scene.add(pane).expect("it is valid"));
        }
        let z = 0.1 + 0.9 * index as f64 / f64::from(count);
        scene.add_object(RenderObject::new(mesh, materials[index % 5], DVec3::Z * z)).expect("it is valid");
        let (added, opacity) = (emission.as_dvec3() * f64::from(opacity), f64::from(opacity));
        radiance = match blend {
            Blend::Alpha => radiance * (1.0 - opacity) + added,
            Blend::Subtractive => radiance - added,
            _ => radiance + added,
        };
        magnitude += added;
    }
    let of_pixels = |value: DVec3| vec![value.to_array(); (SIDE * SIDE) as usize];
    SumScene {
        name: described(&format!("{blend:?} panes"), count, is_mixed),
        scene,
        lights: 0,
        objects: count,
        expected: of_pixels(radiance),
        magnitude: of_pixels(magnitude),
    }
}

fn described(what: &str, count: u32, is_mixed: bool) -> String {
    format!("{count} {what} of {} brightness", if is_mixed { "mixed" } else { "one" })
}

/// Width and height of the picture.
const SIDE: u32 = 4;

/// Half of the camera's field of view.
const HALF_ANGLE: f32 = 0.2;

/// The distance of the camera from the square.
const DISTANCE: f64 = 2.0;

/// A square that fills the picture.
fn base(diffuse: Vec3, emission: Vec3, z: f64) -> Scene {
    let mut scene = Scene::new();
    let projection = Projection::Perspective { field_of_view: 2.0 * HALF_ANGLE };
    let camera = Camera { projection, ..Camera::looking_at("main", DVec3::Z * DISTANCE, DVec3::ZERO) };
    scene.cameras = vec![sized(camera, [SIDE; 2])];
    scene.ambient = Vec3::ZERO;
    add_pane(&mut scene, Material { diffuse, emission, ..Material::default() }, z);
    scene
}

fn add_pane(scene: &mut Scene, material: Material, z: f64) {
    let mesh = scene.add(square(Topology::TriangleList)).expect("it is valid");
    let material = scene.add(material).expect("it is valid");
    scene.add_object(RenderObject::new(mesh, material, DVec3::Z * z)).expect("it is valid");
}

/// A scene with these lights, of which those reach the square for whose indices `reaches` is true.
fn sum_of_lights(name: String, mut scene: Scene, lights: Vec<Light>, reaches: impl Fn(u32) -> bool) -> SumScene {
    let visible: Vec<_> = (0..).zip(&lights).filter(|(index, _)| reaches(*index)).map(|(_, light)| light).collect();
    let radiance_at = |point: DVec3| {
        let illuminance: DVec3 = visible.iter().map(|light| illuminance(light, point)).sum();
        (illuminance / PI).to_array()
    };
    let coordinate = |pixel: u32| {
        let clip = (f64::from(pixel) + 0.5) / f64::from(SIDE) * 2.0 - 1.0;
        clip * DISTANCE * f64::from(HALF_ANGLE).tan()
    };
    let pixels = (0..SIDE * SIDE).map(|pixel| DVec3::new(coordinate(pixel % SIDE), -coordinate(pixel / SIDE), 0.0));
    let expected: Vec<_> = pixels.map(radiance_at).collect();
    let count = lights.len() as u32;
    scene.lights = lights;
    SumScene { name, scene, lights: count, objects: 0, magnitude: expected.clone(), expected }
}

/// The illuminance of a light on a surface that faces +Z, as the documentation of [`Light`] defines it.
fn illuminance(light: &Light, point: DVec3) -> DVec3 {
    let (position, intensity, axis) = match *light {
        Light::Directional { direction, illuminance, .. } => {
            return illuminance.as_dvec3() * f64::from(-direction.normalize().z).max(0.0);
        }
        Light::Point { position, intensity, .. } | Light::Spot { position, intensity, .. } => {
            (position, intensity, None)
        }
        Light::Hemispherical { position, intensity, direction, .. } => (position, intensity, Some(direction)),
        ref other => unreachable!("{other:?}"),
    };
    let way = point - position;
    let distance = way.length();
    // The picture is within the inner cone of spot lights.
    let shape = axis.map_or(1.0, |axis| way.dot(axis.as_dvec3()) / distance);
    let window = (1.0 - (distance / f64::from(RANGE)).powi(4)).powi(2);
    intensity.as_dvec3() * (shape * (-way.z / distance) * window / distance.powi(2))
}
