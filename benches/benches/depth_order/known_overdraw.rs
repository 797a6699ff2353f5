//! Checks the counts on two walls, one behind the other, whose overdraw is known.

use std::error::Error;
use std::sync::Arc;
use std::thread::available_parallelism;

use drawloom::glam::{DVec3, Vec3};
use drawloom::quality::DepthPrecision;
use drawloom::scene::{Camera, Material, Mesh, RenderObject, Scene};
use drawloom::task::Scheduler;

use crate::across_meshes::AcrossMeshes;
use crate::fragment_counter::{Counts, FragmentCounter};
use crate::logarithmic;

const NEAR: f64 = 2.0;
const FAR: f64 = 4.0;

const PICTURE: [u32; 2] = [64, 36];

/// # Errors
/// Returns an error if a count is wrong.
pub fn check() -> Result<(), Box<dyn Error>> {
    let scheduler = Arc::new(Scheduler::new(available_parallelism()?.get())?);
    let camera = Camera { size: PICTURE, ..Camera::looking_at("before the walls", DVec3::ZERO, DVec3::NEG_Z) };
    // One counter, whose order changes from frame to frame, as in the measurement.
    let mut counter = FragmentCounter::new(&scheduler)?;
    for (name, distances, meshes, [unordered, ordered]) in [
        ("the far wall first", [FAR, NEAR], 1, [2, 1]),
        ("the near wall first", [NEAR, FAR], 1, [1, 1]),
        ("the far wall's mesh first", [FAR, NEAR], 2, [2, 2]),
    ] {
        let walls = walls(distances, meshes)?;
        for (order, expected) in
            [(DepthPrecision::UNORDERED, unordered), (logarithmic(16), ordered), (DepthPrecision::UNORDERED, unordered)]
        {
            expect(name, counter.count(&walls, &camera, order)?, expected, meshes)?;
        }
    }
    for (order, expected) in [(AcrossMeshes::FrontToBack, 1), (AcrossMeshes::BackToFront, 2)] {
        for distances in [[FAR, NEAR], [NEAR, FAR]] {
            for meshes in [1, 2] {
                let counts = order.count(&scheduler, &walls(distances, meshes)?, &camera)?;
                expect(order.name(), counts, expected, meshes)?;
            }
        }
    }
    Ok(())
}

/// Two walls of one mesh or of two, each of which fills the picture.
fn walls(distances: [f64; 2], meshes: usize) -> Result<Scene, Box<dyn Error>> {
    let mut scene = Scene::new();
    let material = scene.add(Material::default())?;
    let mut handles = Vec::new();
    for index in 0..meshes {
        handles.push(scene.add(Mesh::cuboid(format!("wall {index}"), Vec3::new(200.0, 200.0, 0.2))?)?);
    }
    for (index, distance) in distances.into_iter().enumerate() {
        scene.add_object(RenderObject::new(handles[index % meshes], material, DVec3::NEG_Z * distance))?;
    }
    Ok(scene)
}

fn expect(name: &str, counts: Counts, overdraw: u64, draws: usize) -> Result<(), Box<dyn Error>> {
    let pixels = PICTURE.iter().map(|&side| u64::from(side)).product::<u64>();
    let expected = (pixels * overdraw, pixels, draws);
    if (counts.fragments, counts.covered, counts.draws) == expected {
        return Ok(());
    }
    Err(format!("two walls, {name}: {counts:?}, not (fragments, covered, draws) = {expected:?}").into())
}
