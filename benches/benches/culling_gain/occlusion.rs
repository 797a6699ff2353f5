//! Occlusion culling by a coarse depth buffer on the CPU, and by queries on the device.

use std::error::Error;
use std::rc::Rc;
use std::time::Duration;

use drawloom::quality::Quality;
use drawloom::scene::Scene;
use drawloom_benches::backends::BackendName;
use drawloom_benches::harness::{Harness, Rounds};
use drawloom_benches::statistics::median_duration;
use drawloom_benches::stopwatch::FrameTime;
use drawloom_benches::table::Table;
use drawloom_benches::targets::Targets;
use drawloom_benches::{city, sphere};
use drawloom_output::print_line;
use drawloom_testing::samples::Samples;
use indicatif::ProgressBar;
use serde::Serialize;

use crate::Extent;
use crate::by_hand::{ByHand, Found, Method};
use crate::drawloom_renderer::DrawloomRenderer;
use crate::queries::{FRAMES_LATE, RETEST_FRAMES};
use crate::walk::Walk;

/// That of [`Quality::fast`].
const TILE_SIZE: u32 = 16;

/// 10 m/s at 60 frames a second.
const METRES_PER_FRAME: f64 = 1.0 / 6.0;

const CAMERAS: [&str; 2] = ["along a street", "above the roofs"];

/// One counted frame in this many is compared with the reference.
const COUNTED_EVERY: u32 = 3;

/// The names of renderers.
const NONE: &str = "by hand, none";
const COARSE: &str = "by hand, coarse depth";
const QUERIES: &str = "by hand, queries";
const DRAWLOOM_NONE: &str = "drawloom, none";
const DRAWLOOM_COARSE: &str = "drawloom, coarse depth";

/// A renderer in a scene, seen from a camera. Numbers of objects are means of the counted frames.
#[derive(Serialize)]
pub struct Row {
    backend: BackendName,
    scene: &'static str,
    camera: &'static str,
    renderer: &'static str,
    workers: usize,
    in_frustum: f64,
    /// Objects in the frustum that cover no pixel.
    hidden: f64,
    /// Those of them that are drawn.
    left: f64,
    /// Objects that cover a pixel and are not drawn; `None` where the renderer does not tell which it draws.
    missing: Option<f64>,
    /// How old the results are that decide.
    frames_late: Option<u64>,
    /// The share of measured frames with a test.
    tested: Option<f64>,
    cpu_us: f64,
    /// From submission.
    device_ms: Option<f64>,
    /// From the hand-over of the scene until the frame is drawn.
    until_drawn_ms: Option<f64>,
}

struct Contender {
    name: &'static str,
    workers: usize,
    renderer: Kind,
    /// Measured frames with a test.
    tested: usize,
}

enum Kind {
    ByHand(Box<ByHand>),
    Drawloom(Box<DrawloomRenderer>),
}

impl Contender {
    fn frame(&mut self, moves: bool) -> Result<FrameTime, Box<dyn Error>> {
        match &mut self.renderer {
            Kind::ByHand(renderer) => renderer.frame(moves),
            Kind::Drawloom(renderer) => renderer.frame(moves),
        }
    }

    fn frames_late(&self) -> Option<u64> {
        match self.name {
            QUERIES => Some(FRAMES_LATE),
            COARSE | DRAWLOOM_COARSE => Some(0),
            _ => None,
        }
    }
}

/// Measures all renderers in all scenes.
///
/// # Errors
/// Returns an error if a frame cannot be drawn, or if a visible object is missing where the camera stands still.
pub fn measure(
    extent: &Extent,
    backend: BackendName,
    workers: &[usize],
    progress: &ProgressBar,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let ball = sphere::new("ball", extent.street_rings, 0)?;
    let scenes = [
        ("boxes", city::new(extent.boxes, extent.picture)?),
        ("boxes and balls", city::with_street_mesh(extent.boxes, extent.picture, Some(ball))?),
    ];
    let mut rows = Vec::new();
    for (name, scene) in scenes {
        let scene = Rc::new(scene);
        for camera in CAMERAS {
            progress.set_message(format!("{name}, {camera}, {}", backend.name()));
            let mut contenders = contenders(backend, workers, &scene, camera)?;
            rows.extend(measure_view(extent, backend, [name, camera], &mut contenders, progress)?);
        }
    }
    Ok(rows)
}

fn contenders(
    backend: BackendName,
    workers: &[usize],
    scene: &Rc<Scene>,
    camera: &str,
) -> Result<Vec<Contender>, Box<dyn Error>> {
    let start = scene.cameras.iter().find(|known| known.name == camera).ok_or("the city lacks a camera")?;
    let walk = || Walk::new(Rc::clone(scene), start.clone(), METRES_PER_FRAME);
    let mut contenders = Vec::new();
    for (name, method) in
        [(NONE, Method::None), (COARSE, Method::CoarseDepth { tile_size: TILE_SIZE }), (QUERIES, Method::Queries)]
    {
        let renderer = Kind::ByHand(Box::new(ByHand::new(backend, method, walk())?));
        contenders.push(Contender { name, workers: 1, renderer, tested: 0 });
    }
    for &workers in workers {
        for (name, occlusion) in [(DRAWLOOM_NONE, None), (DRAWLOOM_COARSE, Some(TILE_SIZE))] {
            let quality = Quality { occlusion, ..Quality::default() };
            let renderer = Kind::Drawloom(Box::new(DrawloomRenderer::new(backend, workers, quality, walk())?));
            contenders.push(Contender { name, workers, renderer, tested: 0 });
        }
    }
    Ok(contenders)
}

/// The objects of a contender, summed over counted frames.
#[derive(Clone, Copy, Default)]
struct Counts {
    left: usize,
    missing: usize,
}

fn measure_view(
    extent: &Extent,
    backend: BackendName,
    [scene, camera]: [&'static str; 2],
    contenders: &mut [Contender],
    progress: &ProgressBar,
) -> Result<Vec<Row>, Box<dyn Error>> {
    let rounds = Rounds { warm_up: extent.warm_up, measured: backend.of(extent.rounds) };
    let times = Harness::new(rounds, progress).measure(contenders, |contender, round| {
        let time = contender.frame(true)?;
        if let Kind::Drawloom(renderer) = &contender.renderer
            && !round.is_warm_up()
        {
            contender.tested += usize::from(renderer.has_tested());
        }
        Ok::<_, Box<dyn Error>>(time)
    })?;

    let mut counts = vec![Counts::default(); contenders.len()];
    let (mut in_frustum, mut hidden) = (0, 0);
    for frame in 1..=extent.counted {
        for contender in &mut *contenders {
            contender.frame(true)?;
        }
        if frame.is_multiple_of(COUNTED_EVERY) {
            let (seen, shown) = count(contenders, &mut counts)?;
            in_frustum += seen;
            hidden += seen - shown;
        }
    }
    // The results of all tests have arrived, and every drawn object was tested.
    for _ in 0..FRAMES_LATE + RETEST_FRAMES + 1 {
        for contender in &mut *contenders {
            contender.frame(false)?;
        }
    }
    let mut at_rest = vec![Counts::default(); contenders.len()];
    count(contenders, &mut at_rest)?;
    if let Some((contender, counts)) = contenders.iter().zip(at_rest).find(|(_, counts)| counts.missing > 0) {
        let missing = counts.missing;
        return Err(format!("{scene}, {camera}, {}: {missing} visible objects are missing", contender.name).into());
    }

    let mean = |sum: usize| sum as f64 / f64::from(extent.counted / COUNTED_EVERY);
    let row = |((contender, counts), times): ((&Contender, Counts), Vec<FrameTime>)| {
        let milliseconds =
            |time: fn(&FrameTime) -> Duration| median_duration(times.iter().map(time)).as_secs_f64() * 1e3;
        let on_device = |time| (backend == BackendName::Adapter).then(|| milliseconds(time));
        Row {
            backend,
            scene,
            camera,
            renderer: contender.name,
            workers: contender.workers,
            in_frustum: mean(in_frustum),
            hidden: mean(hidden),
            left: mean(counts.left),
            missing: matches!(contender.renderer, Kind::ByHand(_)).then(|| mean(counts.missing)),
            frames_late: contender.frames_late(),
            tested: matches!(contender.renderer, Kind::Drawloom(_))
                .then(|| contender.tested as f64 / times.len().max(1) as f64),
            cpu_us: milliseconds(|time| time.cpu) * 1e3,
            device_ms: on_device(|time| time.device),
            until_drawn_ms: on_device(|time| time.borrowed + time.device),
        }
    };
    Ok(contenders.iter().zip(counts).zip(times).map(row).collect())
}

/// Counts what the last frame drew. Returns the number of objects in the frustum, and of those that cover a pixel.
fn count(contenders: &[Contender], counts: &mut [Counts]) -> Result<(usize, usize), Box<dyn Error>> {
    let Some(Kind::ByHand(first)) = contenders.first().map(|contender| &contender.renderer) else {
        return Err("the first renderer is one by hand".into());
    };
    let Found { in_frustum, .. } = first.found();
    let scene = first.world().as_scene_ref();
    let mut sees = vec![false; scene.object_count()];
    in_frustum.iter().for_each(|&object| sees[object as usize] = true);
    let truth = Samples::new(&scene, first.world().camera(), 1.0, |object| sees[object]);
    let shown = truth.shown.iter().filter(|&&shown| shown).count();
    for (contender, counts) in contenders.iter().zip(counts) {
        match &contender.renderer {
            Kind::ByHand(renderer) => {
                let drawn = renderer.found().drawn;
                let drawn_in_vain = drawn.iter().filter(|&&object| !truth.shown[object as usize]).count();
                counts.left += drawn_in_vain;
                counts.missing += shown - (drawn.len() - drawn_in_vain);
            }
            Kind::Drawloom(renderer) => {
                let visible = renderer.statistics.views.first().map_or(0, |view| view.visible);
                counts.left += visible.checked_sub(shown).ok_or("drawloom draws too few objects")?;
            }
        }
    }
    Ok((in_frustum.len(), shown))
}

/// The targets: culling must not take longer than it saves, and queries no less than the coarse depth buffer.
pub fn add_targets(rows: &[Row], targets: &mut Targets) {
    let views =
        rows.chunk_by(|one, next| (one.backend, one.scene, one.camera) == (next.backend, next.scene, next.camera));
    for view in views {
        let time = |renderer: &str| {
            let row = view.iter().find(|row| row.renderer == renderer);
            row.map_or(f64::NAN, |row| row.until_drawn_ms.unwrap_or(row.cpu_us / 1e3))
        };
        let Row { backend, scene, camera, .. } = view[0];
        let mut ratio = |above: &str, below: &str| {
            let figure = format!("{scene}, {camera}, {}: {above} ÷ {below}", backend.name());
            targets.at_most(figure, 1.0, time(above) / time(below));
        };
        ratio(COARSE, QUERIES);
        // Without a device, hidden objects cost nothing but their place in a list; above the roofs few are hidden.
        if backend == BackendName::Adapter && camera == CAMERAS[0] {
            ratio(COARSE, NONE);
        }
    }
}

pub fn print(rows: &[Row]) {
    print_line!("Occlusion culling.\n");
    let headings = [
        "backend",
        "scene",
        "camera",
        "renderer",
        "workers",
        "in frustum",
        "hidden",
        "left",
        "missing",
        "frames late",
        "tested in",
        "CPU µs",
        "device ms",
        "until drawn ms",
    ];
    let mut table = Table::new(&headings);
    let milliseconds = |time: Option<f64>| time.map_or_else(String::new, |time| format!("{time:.2}"));
    for row in rows {
        table.row([
            row.backend.name().to_owned(),
            row.scene.to_owned(),
            row.camera.to_owned(),
            row.renderer.to_owned(),
            row.workers.to_string(),
            format!("{:.0}", row.in_frustum),
            format!("{:.0}", row.hidden),
            format!("{:.0}", row.left),
            row.missing.map_or_else(String::new, |missing| format!("{missing:.1}")),
            row.frames_late.map_or_else(String::new, |late| late.to_string()),
            row.tested.map_or_else(String::new, |share| format!("{:.0}%", share * 100.0)),
            format!("{:.0}", row.cpu_us),
            milliseconds(row.device_ms),
            milliseconds(row.until_drawn_ms),
        ]);
    }
    table.print();
}
