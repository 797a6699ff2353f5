//! wgpu's pictures of random scenes against those of the software backend.
//!
//! `cargo test` draws a few. `DRAWLOOM_STRESS_SECONDS=600 cargo test --release --test pictures random_scenes` draws
//! more for that many seconds.

use std::f64::consts::TAU;
use std::sync::Arc;
use std::time::{Duration, Instant};

use drawloom::Renderer;
use drawloom::backend::{Picture, SoftwareBackend};
use drawloom::glam::{Quat, Vec3};
use drawloom::process::Deferred;
use drawloom::quality::{Quality, ShadowQuality};
use drawloom::scene::{
    Blend, Camera, Light, Material, Mesh, Projection, RenderObject, Scene, SceneError, Texture, Topology, VERTEX_COLOR,
};
use drawloom::task::Scheduler;
use drawloom_testing::random::Random;
use drawloom_testing::scenes::leveled::halved;
use drawloom_testing::scenes::{as_list, cube, culled, square};
use libtest_mimic::Failed;

use crate::Case;
use crate::fixture::Fixture;

pub const CASES: &[Case] = &[("software_draws_random_scenes_as_wgpu_does", random_scenes)];

/// How many are drawn at least.
const SCENES: u64 = 16;

fn random_scenes() -> Result<(), Failed> {
    let seconds = std::env::var("DRAWLOOM_STRESS_SECONDS").map_or(Ok(0), |seconds| seconds.parse())?;
    let end = Instant::now() + Duration::from_secs(seconds);
    let scheduler = Arc::new(Scheduler::new(2)?);
    let mut fixtures = Vec::new();
    for (preset, occlusion) in [(Quality::balanced(), None), (Quality::exact(), None), (Quality::fast(), Some(16))] {
        let shadows = ShadowQuality { side: 128, interval: 1, ..preset.shadows };
        let quality = Quality { shadows, occlusion, ..preset };
        // One of the presets ignores colours.
        let deferred = Deferred::to_picture().vertex_colors(preset != Quality::fast());
        let by_wgpu = Fixture::with(2, |builder| builder.pipeline(deferred.clone()).quality(quality))?;
        let backend = SoftwareBackend::new(Arc::clone(&scheduler));
        let builder = Renderer::builder(backend).pipeline(deferred).quality(quality);
        fixtures.push((by_wgpu, builder.build(Arc::clone(&scheduler))?));
    }
    let mut worst = Spread::default();
    for number in 0.. {
        if number >= SCENES && Instant::now() >= end {
            println!("{number} scenes; the worst: {worst:?}");
            break;
        }
        let scene = random_scene(number)?;
        let preset = number as usize % fixtures.len();
        let (fixture, (renderer, submitter)) = &mut fixtures[preset];
        let by_wgpu = fixture.draw(&scene)?;
        let by_software = submitter.submit(renderer.record(scene.as_scene_ref())?)?.submission.read(0, "picture")?;
        let spread = Spread::new(&by_wgpu, &by_software);
        if !spread.is_within_bound() {
            return Err(format!("the pictures of scene {number} differ: {spread:?}").into());
        }
        if spread.at_edges > worst.at_edges {
            worst = spread;
        }
    }
    Ok(())
}

/// The mesh with other colours at each of its vertices.
fn colored(mesh: Mesh) -> Result<Mesh, SceneError> {
    let colors: Vec<_> = mesh.vertices().iter().map(|vertex| vertex.position.map(|x| 0.5 + 0.4 * x)).collect();
    mesh.with_attribute(VERTEX_COLOR, &colors)
}

/// Boxes and squares of any size and material that intersect each other, in any lights, wherever in the world.
fn random_scene(number: u64) -> Result<Scene, SceneError> {
    let mut random = Random::stream(number);
    // Where positions have few bits left behind the point, or all of them.
    let center = random.direction() * [0.0, 1e3, 1e6, 4e9][random.below(4)];
    let mut scene = Scene::new();
    let meshes = [
        scene.add(cube())?,
        scene.add(square(Topology::TriangleList))?,
        scene.add(square(Topology::TriangleStrip))?,
        scene.add(culled(&as_list(&cube())))?,
        scene.add(halved(&cube()))?,
        scene.add(colored(cube())?)?,
    ];
    let blends = [Blend::None, Blend::None, Blend::None, Blend::Alpha, Blend::Additive, Blend::Subtractive];
    let mut materials = Vec::new();
    for blend in blends {
        let pixels = (0..16).map(|_| random.below(256) as u8).collect();
        let texture = scene.add(Texture::new("texture", 2, 2, pixels)?)?;
        materials.push(scene.add(Material {
            diffuse: random.vector(0.0, 1.0),
            emission: if random.below(4) == 0 { random.vector(0.0, 1.0) } else { Vec3::ZERO },
            texture: (random.below(3) == 0).then_some(texture),
            opacity: random.between(0.1, 1.0) as f32,
            double_sided: random.below(2) == 0,
            blend,
            ..Material::default()
        })?);
    }
    for _ in 0..1 + random.below(30) {
        let (mesh, material) = (meshes[random.below(meshes.len())], materials[random.below(materials.len())]);
        let position = center + random.vector(-4.0, 4.0).as_dvec3();
        let mut object = RenderObject::new(mesh, material, position);
        object.orientation = Quat::from_axis_angle(random.direction().as_vec3(), random.between(0.0, TAU) as f32);
        object.scale = random.vector(-1.5, 1.5);
        scene.add_object(object)?;
    }
    for _ in 0..random.below(5) {
        let (direction, intensity) = (random.direction().as_vec3(), random.vector(0.0, 20.0));
        let (position, range) = (center + random.vector(-6.0, 6.0).as_dvec3(), random.between(1.0, 20.0) as f32);
        let casts_shadow = random.below(2) == 0;
        scene.lights.push(match random.below(4) {
            0 => Light::Directional { direction, illuminance: intensity * 0.1, casts_shadow },
            1 => Light::Point { position, intensity, range, casts_shadow },
            2 => {
                let outer_angle = random.between(0.1, 1.5) as f32;
                let inner_angle = random.between(0.0, outer_angle.into()) as f32;
                Light::Spot { position, direction, intensity, range, inner_angle, outer_angle, casts_shadow }
            }
            _ => Light::Hemispherical { position, direction, intensity, range, casts_shadow },
        });
    }
    (scene.ambient, scene.background) = (random.vector(0.0, 0.3), random.vector(0.0, 0.5));
    // Sometimes among the objects, some of which its near plane cuts.
    let position = center + random.direction() * random.between(0.5, 12.0);
    let mut camera = Camera::looking_at("main", position, center);
    (camera.projection, camera.far) = match random.below(4) {
        0 => (Projection::Orthographic { height: 8.0 }, 100.0),
        _ => (Projection::Perspective { field_of_view: random.between(0.2, 2.5) as f32 }, f32::INFINITY),
    };
    camera.size = [113, 71];
    scene.cameras = vec![camera];
    Ok(scene)
}

/// The pixels of two pictures that differ by more than rounding.
#[derive(Debug, Default)]
struct Spread {
    /// Those of which no pixel around differs from its neighbours: there, only rounding may make a difference.
    inside: usize,
    /// The others, where an edge may pass on the other side of the pixel's centre.
    at_edges: usize,
    /// The pixels at edges.
    edges: usize,
}

impl Spread {
    fn new(one: &Picture, other: &Picture) -> Self {
        let [one_pixels, other_pixels] = [one, other].map(|picture| picture.bytes.as_chunks::<4>().0);
        let (width, height) = (one.width as usize, one.height as usize);
        let are_far =
            |one: &[u8; 4], other: &[u8; 4]| one.iter().zip(other).any(|(one, other)| one.abs_diff(*other) > 2);
        let around = |index: usize| {
            let near = |center: usize, end: usize| center.saturating_sub(1)..(center + 2).min(end);
            near(index / width, height).flat_map(move |y| near(index % width, width).map(move |x| y * width + x))
        };
        let is_edge =
            |pixels: &[[u8; 4]], index: usize| around(index).any(|other| are_far(&pixels[other], &pixels[index]));
        let mut spread = Self { inside: 0, at_edges: 0, edges: 0 };
        for index in 0..width * height {
            let is_at_edge = is_edge(one_pixels, index) || is_edge(other_pixels, index);
            let is_far = are_far(&one_pixels[index], &other_pixels[index]);
            spread.edges += usize::from(is_at_edge);
            spread.inside += usize::from(is_far && !is_at_edge);
            spread.at_edges += usize::from(is_far && is_at_edge);
        }
        spread
    }

    /// Devices round vertices to 1/256 of a pixel. An edge that moves by half of that to either side passes the centre
    /// of at most one in 256 of the pixels that it runs through, which are fewer than those at edges. How many these
    /// are in a scene is random: four standard deviations of their number come on top. Shadow maps have edges of their
    /// own, whose few pixels are several of the picture.
    fn is_within_bound(&self) -> bool {
        let expected = self.edges as f64 / 256.0;
        self.inside == 0 && self.at_edges as f64 <= expected + 4.0 * expected.sqrt() + 4.0
    }
}
