//! What it takes to ask for each of many objects whether a camera sees it.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Instant;

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::quality::CullingVolume;
use drawloom::scene::{Camera, Material, RenderObject, Scene, SceneError};
use drawloom::view::{BoundingSphere, Frustum, ObjectTable};
use drawloom_benches::boxes::new_box;
use drawloom_benches::stopwatch::middle;
use drawloom_testing::culling::naive::Naive;
use drawloom_testing::random::Random;
use indicatif::ProgressBar;
use serde::Serialize;

/// How one way to ask did.
#[derive(Serialize)]
pub struct Speed {
    scene: &'static str,
    pub way: &'static str,
    objects: usize,
    /// The median round's nanoseconds an object, on one thread.
    pub nanoseconds: f64,
    /// The share of the objects that may be seen.
    pub seen: f64,
}

impl Speed {
    pub fn cells(&self) -> [String; 5] {
        let Self { scene, way, objects, nanoseconds, seen } = self;
        [
            scene.to_string(),
            way.to_string(),
            objects.to_string(),
            format!("{nanoseconds:.2}"),
            format!("{:.2} %", seen * 100.0),
        ]
    }
}

type Way<'a> = (&'static str, Box<dyn Fn() -> u64 + 'a>);

/// Asks for all objects of two scenes, all ways in turn, so many rounds.
///
/// # Errors
/// If a scene cannot be.
pub fn measure(objects: usize, rounds: usize, progress: &ProgressBar) -> Result<Vec<Speed>, SceneError> {
    let mut speeds = Vec::new();
    // A few metres large in a cloud of 2 km: few of them touch a plane. And so large that most of them do.
    for (name, size) in [("small objects", 3.0), ("large objects", 400.0)] {
        let scene = cloud(objects, size)?;
        let tables = [CullingVolume::Sphere, CullingVolume::Box, CullingVolume::OrientedBox].map(|volume| {
            let mut table = ObjectTable::default();
            table.configure(volume);
            table.reset(objects);
            table.fill(&scene.as_scene_ref(), 0..objects);
            table
        });
        let camera = Camera { far: 900.0, ..Camera::looking_at("main", DVec3::new(3.0, 2.0, 1.0), DVec3::NEG_Z) };
        let mut ways = ways(&tables, &camera);
        let mut samples = vec![Vec::new(); ways.len()];
        let mut seen = vec![0; ways.len()];
        let mut random = Random::new();
        for _ in 0..rounds {
            for way in random.order(ways.len()) {
                let start = Instant::now();
                seen[way] = (ways[way].1)();
                samples[way].push(start.elapsed().as_nanos() as f64 / objects as f64);
            }
            progress.inc(1);
        }
        speeds.extend(ways.drain(..).zip(samples).zip(seen).map(|(((way, _), samples), seen)| Speed {
            scene: name,
            way,
            objects,
            nanoseconds: middle(samples),
            seen: seen as f64 / objects as f64,
        }));
    }
    Ok(speeds)
}

fn ways<'a>(tables: &'a [ObjectTable; 3], camera: &Camera) -> Vec<Way<'a>> {
    let [spheres, boxes, oriented] = tables;
    let frustum = Frustum::new(camera);
    let each = |table: &'a ObjectTable, volume| -> Box<dyn Fn() -> u64 + 'a> {
        let frustum = frustum.clone();
        Box::new(move || seen_by_words(table, &frustum, volume))
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
    // What stands in f32 already, as such engines have it: 16 bytes an object.
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

/// As a frame does it: a word of objects at a time, and their block's lock for each.
fn seen_by_words(table: &ObjectTable, frustum: &Frustum, volume: CullingVolume) -> u64 {
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

/// Boxes up to so many metres long, scattered in a cloud of 2 km around the camera.
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
