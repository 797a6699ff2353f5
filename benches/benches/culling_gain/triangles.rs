//! Triangle culling on the CPU, and what else there is against triangles below a pixel.

use std::error::Error;
use std::rc::Rc;
use std::time::Duration;

use drawloom::glam::{DVec3, Vec3};
use drawloom::quality::Quality;
use drawloom::scene::{Camera, Material, RenderObject, Scene};
use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::{Harness, Rounds};
use drawloom_benches::sphere;
use drawloom_benches::statistics::median_duration;
use drawloom_benches::stopwatch::FrameTime;
use drawloom_benches::table::Table;
use drawloom_benches::targets::Targets;
use drawloom_output::print_line;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::Extent;
use crate::drawloom_renderer::DrawloomRenderer;
use crate::walk::Walk;

/// A square of spheres.
#[derive(Clone, Copy)]
struct Spheres {
    name: &'static str,
    /// What the number of rings of each is divided by.
    divisor: u32,
    count: usize,
    radius: f32,
    /// Of the middle of all, below the camera and in front of it.
    below: f64,
    distance: f64,
}

const SCENES: [Spheres; 3] = [
    Spheres { name: "far below a pixel", divisor: 1, count: 4, radius: 1.0, below: 0.0, distance: 40.0 },
    Spheres { name: OF_SOME_PIXELS, divisor: 12, count: 64, radius: 1.0, below: 0.0, distance: 18.0 },
    // A planet, seen from above its surface.
    Spheres { name: "mostly outside the picture", divisor: 1, count: 1, radius: 10.0, below: 10.5, distance: 0.0 },
];

const OF_SOME_PIXELS: &str = "of some pixels";

/// The levels of detail of a sphere that has them.
const LEVELS: u32 = 2;

/// What is done about triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
enum Method {
    None,
    Culling,
    LevelsOfDetail,
}

impl Method {
    const ALL: [Self; 3] = [Self::None, Self::Culling, Self::LevelsOfDetail];

    fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Culling => "triangle culling",
            Self::LevelsOfDetail => "levels of detail",
        }
    }
}

#[derive(Serialize)]
pub struct Row {
    backend: BackendName,
    scene: &'static str,
    method: Method,
    workers: usize,
    triangles: usize,
    /// Triangles that the device draws in the last frame.
    drawn: usize,
    cpu_us: f64,
    /// From submission.
    device_ms: Option<f64>,
    /// From the hand-over of the scene until the frame is drawn.
    until_drawn_ms: Option<f64>,
}

struct Contender {
    scene: &'static str,
    method: Method,
    workers: usize,
    triangles: usize,
    renderer: DrawloomRenderer,
}

impl Contender {
    /// The triangles that the last frame drew.
    fn drawn(&self) -> usize {
        let Some(view) = self.renderer.statistics.views.first() else { return 0 };
        match self.method {
            Method::None => self.triangles,
            Method::Culling => self.triangles - view.culled_triangles.culled(),
            Method::LevelsOfDetail => view.levels_of_detail.map_or(self.triangles, |levels| levels.triangles),
        }
    }
}

/// Measures all methods in all scenes.
///
/// # Errors
/// Returns an error if a frame cannot be drawn.
pub fn measure(
    extent: &Extent,
    backend: BackendName,
    workers: &[usize],
    progress: &ProgressBar,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let mut rows = Vec::new();
    for spheres in SCENES {
        progress.set_message(format!("{}, {}", spheres.name, backend.name()));
        let mut contenders = Vec::new();
        for method in Method::ALL {
            let (scene, triangles) = spheres.scene(extent, method)?;
            let (scene, start) = (Rc::new(scene), spheres.camera(extent));
            for &workers in workers {
                let world = Walk::new(Rc::clone(&scene), start.clone(), 1e-3);
                let renderer = DrawloomRenderer::new(backend, workers, Quality::default(), world)?;
                contenders.push(Contender { scene: spheres.name, method, workers, triangles, renderer });
            }
        }
        let rounds = Rounds { warm_up: extent.warm_up, measured: backend.of(extent.rounds) };
        let times = Harness::new(rounds, progress)
            .measure(&mut contenders, |contender, _round| contender.renderer.frame(true))?;
        rows.extend(contenders.iter().zip(times).map(|(contender, times)| Row::new(backend, contender, &times)));
    }
    Ok(rows)
}

impl Spheres {
    fn scene(&self, extent: &Extent, method: Method) -> Result<(Scene, usize), Box<dyn Error>> {
        let levels = if method == Method::LevelsOfDetail { LEVELS } else { 0 };
        let mesh = sphere::new("sphere", (extent.rings / self.divisor).max(8), levels)?;
        let mesh = mesh.with_triangle_culling(method == Method::Culling);
        let triangles = mesh.triangle_count() * self.count;
        let mut scene = Scene::new();
        let (mesh, material) = (scene.add(mesh)?, scene.add(Material::default())?);
        let columns = (self.count as f64).sqrt().ceil() as usize;
        for index in 0..self.count {
            let across = |index: usize| (index as f64 - (columns - 1) as f64 / 2.0) * 2.5 * f64::from(self.radius);
            let center = DVec3::new(across(index % columns), across(index / columns) - self.below, -self.distance);
            scene.add_object(RenderObject {
                scale: Vec3::splat(self.radius),
                ..RenderObject::new(mesh, material, center)
            })?;
        }
        Ok((scene, triangles))
    }

    fn camera(&self, extent: &Extent) -> Camera {
        Camera { size: extent.picture, ..Camera::looking_at("main", DVec3::ZERO, DVec3::NEG_Z) }
    }
}

impl Row {
    fn new(backend: BackendName, contender: &Contender, times: &[FrameTime]) -> Self {
        let milliseconds =
            |time: fn(&FrameTime) -> Duration| median_duration(times.iter().map(time)).as_secs_f64() * 1e3;
        let on_device = |time| (backend == BackendName::Adapter).then(|| milliseconds(time));
        Self {
            backend,
            scene: contender.scene,
            method: contender.method,
            workers: contender.workers,
            triangles: contender.triangles,
            drawn: contender.drawn(),
            cpu_us: milliseconds(|time| time.cpu) * 1e3,
            device_ms: on_device(|time| time.device),
            until_drawn_ms: on_device(|time| time.borrowed + time.device),
        }
    }
}

/// The targets: where triangles are far below a pixel or outside of the picture, frames with culling are drawn sooner.
pub fn add_targets(rows: &[Row], targets: &mut Targets) {
    for culled in rows.iter().filter(|row| row.method == Method::Culling) {
        let whole = rows.iter().find(|row| {
            (row.backend, row.scene, row.workers) == (culled.backend, culled.scene, culled.workers)
                && row.method == Method::None
        });
        if let (Some(Some(whole)), Some(drawn)) = (whole.map(|row| row.until_drawn_ms), culled.until_drawn_ms)
            && culled.scene != OF_SOME_PIXELS
        {
            let figure = format!("triangles {}, workers: {}, culling ÷ none", culled.scene, culled.workers);
            targets.at_most(figure, 1.0, drawn / whole);
        }
    }
}

pub fn print(rows: &[Row]) {
    print_line!("Triangle culling.\n");
    let headings =
        ["backend", "triangles", "method", "workers", "count", "drawn", "CPU µs", "device ms", "until drawn ms"];
    let mut table = Table::new(&headings);
    let milliseconds = |time: Option<f64>| time.map_or_else(String::new, |time| format!("{time:.2}"));
    for row in rows {
        table.row([
            row.backend.name().to_owned(),
            row.scene.to_owned(),
            row.method.name().to_owned(),
            row.workers.to_string(),
            row.triangles.to_string(),
            row.drawn.to_string(),
            format!("{:.0}", row.cpu_us),
            milliseconds(row.device_ms),
            milliseconds(row.until_drawn_ms),
        ]);
    }
    table.print();
}
