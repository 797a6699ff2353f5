//! Cost with and without a depth pre-pass.

use std::error::Error;
use std::rc::Rc;

use drawloom::glam::{DVec3, Vec3};
use drawloom::process::Deferred;
use drawloom::scene::{Camera, Light, Material, Mesh, RenderObject, Scene, SceneError};
use drawloom_benches::backends::BackendName;
use drawloom_benches::table::Table;
use drawloom_output::print_line;
use drawloom_testing::demo;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::Extent;
use crate::block::{Block, Setting};
use crate::report::milliseconds;

/// A row of the table.
#[derive(Serialize)]
pub struct Row {
    backend: BackendName,
    scene: &'static str,
    workers: usize,
    depth_pre_pass: bool,
    draws: usize,
    #[serde(rename = "processor_ms")]
    cpu_ms: f64,
    device_ms: Option<f64>,
}

/// # Errors
/// Returns an error if a frame cannot be drawn.
pub fn measure(
    extent: &Extent,
    backend: BackendName,
    workers: &[usize],
    progress: &ProgressBar,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let mut colonnade = demo::colonnade()?;
    for camera in &mut colonnade.cameras {
        camera.size = extent.picture;
    }
    let scenes = [
        ("30 walls, front to back", walls(extent, Order::FrontToBack)?),
        ("30 walls, back to front", walls(extent, Order::BackToFront)?),
        ("colonnade", colonnade),
    ];
    let mut block = Block::new(backend, progress);
    let mut names = Vec::new();
    for (name, scene) in scenes {
        let scene = Rc::new(scene);
        for &workers in workers {
            for depth_pre_pass in [false, true] {
                let deferred = Deferred::to_picture().depth_pre_pass(depth_pre_pass);
                block.add(Rc::clone(&scene), workers, |builder| builder.pipeline(deferred))?;
                names.push((name, workers, depth_pre_pass));
            }
        }
    }
    let settings = block.measure(extent, "depth pre-pass")?;
    let row = |(setting, (scene, workers, depth_pre_pass)): (&Setting, (&'static str, usize, bool))| Row {
        backend,
        scene,
        workers,
        depth_pre_pass,
        draws: setting.counts().draws,
        cpu_ms: milliseconds(setting.cpu()),
        device_ms: (backend == BackendName::Adapter).then(|| milliseconds(setting.device())),
    };
    Ok(settings.iter().zip(names).map(row).collect())
}

/// The order in which walls are added to the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Order {
    FrontToBack,
    BackToFront,
}

/// Thirty walls one behind the other. Each fills the picture. `order` is that of the objects in the scene. Commands of
/// one mesh and state are sorted by depth, so both scenes are drawn front to back.
fn walls(extent: &Extent, order: Order) -> Result<Scene, SceneError> {
    const WALLS: usize = 30;
    let mut scene = Scene::new();
    let wall = scene.add(Mesh::cuboid(String::from("wall"), Vec3::new(120.0, 80.0, 0.1))?)?;
    for index in 0..WALLS {
        let behind = if order == Order::FrontToBack { index } else { WALLS - 1 - index };
        let diffuse = Vec3::new(0.2, 0.5, 0.9).lerp(Vec3::new(0.9, 0.5, 0.2), behind as f32 / WALLS as f32);
        let material = scene.add(Material { name: format!("wall {behind}"), diffuse, ..Material::default() })?;
        scene.add_object(RenderObject::new(wall, material, DVec3::NEG_Z * (5.0 + behind as f64)))?;
    }
    scene.lights.push(Light::Point {
        position: DVec3::NEG_Z * 3.0,
        intensity: Vec3::splat(10.0),
        range: 8.0,
        casts_shadow: false,
    });
    scene.cameras.push(Camera { size: extent.picture, ..Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z) });
    Ok(scene)
}

pub fn print(rows: &[Row]) {
    print_line!("The depth pre-pass.\n");
    let mut table = Table::new(&["backend", "scene", "workers", "pre-pass", "draws", "CPU ms", "device ms"]);
    for row in rows {
        table.row([
            row.backend.name().to_owned(),
            row.scene.to_owned(),
            row.workers.to_string(),
            if row.depth_pre_pass { "on" } else { "off" }.to_owned(),
            row.draws.to_string(),
            format!("{:.3}", row.cpu_ms),
            row.device_ms.map_or_else(String::new, |device| format!("{device:.2}")),
        ]);
    }
    table.print();
}
