//! The time to test many objects against a frustum.

use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Instant;

use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::quality::CullingVolume;
use drawloom::scene::{Camera, Material, Mesh, RenderObject, Scene, SceneError};
use drawloom::view::BoundingSphere;
use drawloom::view::internal::{Frustum, ObjectTable, VisibleSet};
use drawloom_benches::harness::{Harness, Rounds};
use drawloom_benches::statistics::median;
use drawloom_testing::culling::lanes::SphereArrays;
use drawloom_testing::culling::naive::Naive;
use drawloom_testing::random::Random;
use indicatif::ProgressBar;
use multiversion::multiversion;
use multiversion::target::target_cfg_f;
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

/// Writes a mask of the visible objects for each word of [`VisibleSet::OBJECTS_PER_WORD`].
type Test<'a> = Box<dyn Fn(&mut [u64]) + 'a>;

/// Runs all tests on all objects of two scenes, interleaved.
///
/// # Errors
/// Returns an error if a scene rejects a mesh, a material or an object.
pub fn measure(objects: usize, rounds: usize, progress: &ProgressBar) -> Result<Vec<Speed>, SceneError> {
    let mut speeds = Vec::new();
    let mut words = vec![0; objects.div_ceil(VisibleSet::OBJECTS_PER_WORD)];
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
            test(black_box(&mut words));
            let nanoseconds = start.elapsed().as_nanos() as f64 / objects as f64;
            let visible: u32 = words.iter().map(|word| word.count_ones()).sum();
            Ok::<_, SceneError>((visible, nanoseconds))
        })?;
        speeds.extend(tests.iter().zip(samples).map(|(&(test, _), samples)| Speed {
            scene: name,
            test,
            objects,
            nanoseconds: median(samples.iter().map(|&(_, nanoseconds)| nanoseconds)),
            visible: samples.last().map_or(0.0, |&(visible, _)| f64::from(visible) / objects as f64),
        }));
    }
    Ok(speeds)
}

fn tests<'a>(tables: &'a [ObjectTable; 3], camera: &Camera) -> Vec<(&'static str, Test<'a>)> {
    let [spheres, boxes, oriented] = tables;
    let frustum = Frustum::new(camera);
    let each = |table: &'a ObjectTable, volume| -> Test<'a> {
        let frustum = frustum.clone();
        Box::new(move |words| by_blocks(table, &frustum, volume, words))
    };
    let mut all = vec![
        ("none", each(spheres, CullingVolume::None)),
        ("sphere", each(spheres, CullingVolume::Sphere)),
        ("box", each(boxes, CullingVolume::Box)),
        ("oriented box", each(oriented, CullingVolume::OrientedBox)),
    ];
    // The spheres in f32, 16 bytes each, as engines with this test store them.
    let plain: Vec<(Vec3, f32)> = (0..spheres.len())
        .map(|object| {
            let bounds = spheres.block(object / ObjectTable::BLOCK_SIZE).spheres.get(object % ObjectTable::BLOCK_SIZE);
            (bounds.center.as_vec3(), bounds.radius)
        })
        .collect();
    all.push(("sphere, one by one", Box::new(move |words| one_by_one(spheres, &frustum, words))));
    if let (Some(single), Some(several)) = (Naive::new(camera), Naive::new(camera)) {
        let arrays = SphereArrays::new(&plain);
        all.push(("naive sphere, one by one, f32", Box::new(move |words| naive_one_by_one(&plain, &single, words))));
        all.push(("naive sphere, SIMD, f32", Box::new(move |words| in_lanes(&arrays, &several, words))));
    }
    all
}

/// Culls like a frame: one block of objects at a time, with one lock.
fn by_blocks(table: &ObjectTable, frustum: &Frustum, volume: CullingVolume, words: &mut [u64]) {
    let in_block = ObjectTable::BLOCK_SIZE / VisibleSet::OBJECTS_PER_WORD;
    for (index, words) in words.chunks_mut(in_block).enumerate() {
        table.block(index).visible_words(frustum, volume, 0..words.len(), |word, bits| words[word] = bits);
    }
}

/// One call of the crate's test for each sphere.
fn one_by_one(table: &ObjectTable, frustum: &Frustum, words: &mut [u64]) {
    let in_block = ObjectTable::BLOCK_SIZE / VisibleSet::OBJECTS_PER_WORD;
    for (index, words) in words.chunks_mut(in_block).enumerate() {
        let block = table.block(index);
        for (word, bits) in words.iter_mut().enumerate() {
            *bits = mask(VisibleSet::OBJECTS_PER_WORD, |bit| {
                let BoundingSphere { center, radius } = block.spheres.get(word * VisibleSet::OBJECTS_PER_WORD + bit);
                frustum.intersects_sphere(center, radius)
            });
        }
    }
}

/// The usual loop.
fn naive_one_by_one(spheres: &[(Vec3, f32)], naive: &Naive, words: &mut [u64]) {
    for (bits, spheres) in words.iter_mut().zip(spheres.chunks(VisibleSet::OBJECTS_PER_WORD)) {
        *bits = mask(spheres.len(), |bit| naive.sees(spheres[bit].0, spheres[bit].1));
    }
}

/// The same planes, written for speed.
#[multiversion(targets("x86_64+avx2+fma"))]
fn in_lanes(spheres: &SphereArrays, naive: &Naive, words: &mut [u64]) {
    const HAS_FUSED: bool = target_cfg_f!(target_feature = "fma");
    spheres.visible(naive, words, |a, b, c| if HAS_FUSED { a.mul_add(b, c) } else { a * b + c });
}

fn mask(count: usize, sees: impl Fn(usize) -> bool) -> u64 {
    (0..count).fold(0, |mask, bit| mask | u64::from(sees(bit)) << bit)
}

/// Boxes up to `size` metres long, scattered in a cloud of 2 km around the camera.
fn cloud(objects: usize, size: f64) -> Result<Scene, SceneError> {
    let (mut random, mut scene) = (Random::new(), Scene::new());
    let mut meshes = Vec::new();
    for index in 0..16 {
        let half = random.vector(0.02, 0.5) * size as f32;
        meshes.push(scene.add(Mesh::cuboid(format!("box {index}"), 2.0 * half)?)?);
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
