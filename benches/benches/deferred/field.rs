//! A field of boxes under many small lights.

use std::f64::consts::TAU;

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::scene::{Camera, Light, Material, Mesh, RenderObject, Scene, SceneError};
use drawloom_testing::random::Random;

use crate::Extent;

/// The distance from the centre of the field to its edges, in metres.
const HALF: f64 = 25.0;
const MATERIALS: usize = 16;

/// The contents of a field of boxes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Field {
    /// Small lights, half of them point lights and half spot lights, that reach about 3 m. A smaller number of lights
    /// is a prefix of a larger one.
    pub lights: usize,
    /// Spot lights that cast shadows, high above the field.
    pub shadow_maps: usize,
    pub sight: Sight,
}

/// Where the camera is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sight {
    /// High above the field. It sees all objects and lights, and little behind what a light reaches.
    #[default]
    Above,
    /// Low over one edge, so that there is much behind what a light reaches. It does not see all lights.
    Across,
}

impl Sight {
    pub const ALL: [Self; 2] = [Self::Above, Self::Across];

    pub fn name(self) -> &'static str {
        match self {
            Self::Above => "from above",
            Self::Across => "across",
        }
    }

    fn camera(self) -> Camera {
        let (position, at) = match self {
            Self::Above => (DVec3::new(0.0, 36.0, 38.0), DVec3::ZERO),
            Self::Across => (DVec3::new(0.0, 3.0, HALF), DVec3::Y),
        };
        Camera::looking_at("main", position, at)
    }
}

impl Field {
    /// The field. All objects have one mesh, so that one instanced draw suffices.
    ///
    /// # Errors
    /// Returns an error if the scene rejects a mesh, a material or an object.
    pub fn scene(self, extent: &Extent) -> Result<Scene, SceneError> {
        let mut random = Random::new();
        let mut scene = Scene::new();
        (scene.ambient, scene.background) = (Vec3::splat(0.02), Vec3::new(0.01, 0.01, 0.02));
        let cube = scene.add(Mesh::cuboid(String::from("cube"), Vec3::splat(2.0))?)?;
        let mut paints = Vec::new();
        for index in 0..MATERIALS {
            let paint =
                Material { name: format!("paint {index}"), diffuse: random.vector(0.3, 0.9), ..Material::default() };
            paints.push(scene.add(paint)?);
        }
        let mut objects = vec![RenderObject {
            scale: Vec3::new(HALF as f32, 0.1, HALF as f32),
            ..RenderObject::new(cube, paints[0], DVec3::Y * -0.1)
        }];
        for _ in 0..extent.boxes {
            let position =
                DVec3::new(random.between(-HALF, HALF), random.between(0.2, 0.8), random.between(-HALF, HALF));
            let scale = random.vector(0.15, 0.5);
            let orientation = Quat::from_axis_angle(random.direction().as_vec3(), random.between(0.0, TAU) as f32);
            let paint = paints[random.below(MATERIALS)];
            objects.push(RenderObject { orientation, scale, ..RenderObject::new(cube, paint, position) });
        }
        for object in objects {
            scene.add_object(object)?;
        }
        scene.lights = (0..self.lights).map(|index| small_light(index, &mut random)).collect();
        scene.lights.extend((0..self.shadow_maps).map(|index| high_light(index, self.shadow_maps)));
        scene.cameras.push(Camera { size: extent.picture, ..self.sight.camera() });
        Ok(scene)
    }

    /// Number of objects.
    pub fn objects(self, extent: &Extent) -> usize {
        extent.boxes + 1
    }
}

fn small_light(index: usize, random: &mut Random) -> Light {
    let inner = HALF * 0.95;
    let (x, z) = (random.between(-inner, inner), random.between(-inner, inner));
    let color = random.vector(0.2, 1.0);
    let range = random.between(2.7, 3.3) as f32;
    if index.is_multiple_of(2) {
        Light::Point { position: DVec3::new(x, 1.2, z), intensity: color * 2.0, range, casts_shadow: false }
    } else {
        Light::Spot {
            position: DVec3::new(x, 2.4, z),
            direction: Vec3::new(0.2, -1.0, 0.1).normalize(),
            intensity: color * 5.0,
            range,
            inner_angle: 0.4,
            outer_angle: 0.7,
            casts_shadow: false,
        }
    }
}

/// One of `of` lights on a ring above the field. Each lights at least the field's centre.
fn high_light(index: usize, of: usize) -> Light {
    let (sine, cosine) = (TAU * index as f64 / of as f64).sin_cos();
    Light::Spot {
        position: DVec3::new(15.0 * cosine, 20.0, 15.0 * sine),
        direction: Vec3::new(-0.3 * cosine as f32, -1.0, -0.3 * sine as f32).normalize(),
        intensity: Vec3::splat(800.0 / of as f32),
        range: 40.0,
        inner_angle: 0.5,
        outer_angle: 0.75,
        casts_shadow: true,
    }
}
