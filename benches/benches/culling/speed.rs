//! The time to test many objects against a frustum.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Instant;

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::quality::CullingVolume;
use drawloom::scene::{Camera, Material, RenderObject, Scene, SceneError};
use drawloom::view::{BoundingSphere, Frustum, ObjectTable};
use drawloom_benches::boxes::new_box;
use drawloom_benches::harness::{Harness, Rounds};
use drawloom_benches::statistics::median;
use drawloom_testing::culling::naive::Naive;
use drawloom_testing::random::Random;
use indicatif::ProgressBar;
use serde::Serialize;

/// The result of one test.
#[derive(Serialize)]
pub struct Speed {
    scene: &'static str,
    #[serde(rename = "way")]
    pub test: &'static str,
    objects: usize,
    /// Median nanoseconds per object, on one thread.
    pub nanoseconds: f64,
    /// The share of visible objects.
    #[serde(rename = "seen")]
    pub visible: f64,
}

impl Speed {
    pub fn cells(&self) -> [String; 5] {
        let Self { scene, test, objects, nanoseconds, visible } = self;
        [
            scene.to_string(),
            test.to_string(),
            objects.to_string(),
            format!("{nanoseconds:.2}"),
            format!("{:.2} %", visible * 100.0),
        ]
    }
}

type Test<'a> = (&'static str, Box<dyn Fn() -> u64 + 'a>);

/// Runs all tests on all objects of two scenes, interleaved.
///
/// # Errors
/// Returns an error if a scene rejects a mesh, a material or an object.
pub fn measure(objects: usize, rounds: usize, progress: &ProgressBar) -> Result<Vec<Speed>, SceneError> {
    let mut speeds = Vec::new();
    // In a cloud of 2 km few objects of some metres intersect a plane, and most of the large ones do.
    for (name, size) in [("small objects", 3.0), ("large objects", 400.0)] {
        let scene = cloud(objects, size)?;
        let tables = [CullingVolume::Sphere, CullingVolume::Box, CullingVolume::OrientedBox].map(|volume| {
            let mut table = ObjectTable::default();
            table.configure(volume);
            table.update(&scene.as_scene_ref());
            table
        });
        let camera = Camera { far: 900.0, ..Camera::looking_at("main", DVec3::new(3.0, 2.0, 1.0), DVec3::NEG_Z) };
        let mut tests = tests(&tables, &camera);
        let rounds = Rounds { warm_up: 0, measured: rounds };
        let samples = Harness::new(rounds, progress).measure(&mut tests, |(_, test), _round| {
            let start = Instant::now();
            let visible = test();
            Ok::<_, SceneError>((visible, start.elapsed().as_nanos() as f64 / objects as f64))
        })?;
        speeds.extend(tests.iter().zip(samples).map(|(&(test, _), samples)| Speed {
            scene: name,
            test,
            objects,
            nanoseconds: median(samples.iter().map(|&(_, nanoseconds)| nanoseconds)),
            visible: samples.last().map_or(0.0, |&(visible, _)| visible as f64 / objects as f64),
        }));
    }
    Ok(speeds)
}

fn tests<'a>(tables: &'a [ObjectTable; 3], camera: &Camera) -> Vec<Test<'a>> {
    let [spheres, boxes, oriented] = tables;
    let frustum = Frustum::new(camera);
    let each = |table: &'a ObjectTable, volume| -> Box<dyn Fn() -> u64 + 'a> {
        let frustum = frustum.clone();
        Box::new(move || visible_by_words(table, &frustum, volume))
    };
    let mut all = vec![
        ("none", each(spheres, CullingVolume::None)),
        ("sphere", each(spheres, CullingVolume::Sphere)),
        ("box", each(boxes, CullingVolume::Box)),
        ("oriented box", each(oriented, CullingVolume::OrientedBox)),
    ];
    all.push((
        "sphere, one by one",
        Box::new(move || one_by_one(spheres, |bounds| frustum.intersects_sphere(bounds.center, bounds.radius))),
    ));
    // The spheres in f32, 16 bytes each, as engines with this test store them.
    let plain: Vec<(Vec3, f32)> = (0..spheres.len())
        .map(|object| {
            let bounds = spheres.block(object / ObjectTable::BLOCK_SIZE).spheres.get(object % ObjectTable::BLOCK_SIZE);
            (bounds.center.as_vec3(), bounds.radius)
        })
        .collect();
    if let Some(naive) = Naive::new(camera) {
        let count = move || plain.iter().filter(|(center, radius)| naive.sees(*center, *radius)).count() as u64;
        all.push(("naive sphere, one by one, f32", Box::new(count)));
    }
    all
}

/// Culls like a frame: one word of objects at a time, with one lock of its block.
fn visible_by_words(table: &ObjectTable, frustum: &Frustum, volume: CullingVolume) -> u64 {
    let word = |first: usize| {
        let count = (table.len() - first).min(Frustum::WORD);
        let entry = first % ObjectTable::BLOCK_SIZE;
        let bits =
            table.block(first / ObjectTable::BLOCK_SIZE).visible(black_box(frustum), volume, entry..entry + count);
        u64::from((bits & u64::MAX >> (Frustum::WORD - count)).count_ones())
    };
    (0..table.len()).step_by(Frustum::WORD).map(word).sum()
}

fn one_by_one(table: &ObjectTable, sees: impl Fn(BoundingSphere) -> bool) -> u64 {
    let block = |index: usize| {
        let block = table.block(index);
        let count = (table.len() - index * ObjectTable::BLOCK_SIZE).min(ObjectTable::BLOCK_SIZE);
        (0..count).filter(|&entry| sees(block.spheres.get(entry))).count() as u64
    };
    (0..table.block_count()).map(block).sum()
}

/// Boxes up to `size` metres long, scattered in a cloud of 2 km around the camera.
fn cloud(objects: usize, size: f64) -> Result<Scene, SceneError> {
    let (mut random, mut scene) = (Random::new(), Scene::new());
    let mut meshes = Vec::new();
    for index in 0..16 {
        let half = random.vector(0.02, 0.5) * size as f32;
        meshes.push(scene.add(new_box(format!("box {index}"), half)?)?);
    }
    let material = scene.add(Material::default())?;
    for _ in 0..objects {
        let position = random.direction() * (1_000.0 * random.between(0.0, 1.0).cbrt());
        let orientation = Quat::from_axis_angle(random.direction().as_vec3(), random.between(0.0, TAU) as f32);
        let mesh = meshes[random.below(meshes.len())];
        scene.add_object(RenderObject { orientation, ..RenderObject::new(mesh, material, position) })?;
    }
    Ok(scene)
}
