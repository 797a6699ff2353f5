//! What a late layer does to the picture when the camera moves.

use std::error::Error;
use std::f32::consts::TAU;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use drawloom::backend::{Picture, PipelineLibrary, WgpuBackend};
use drawloom::glam::{DVec3, Quat, Vec3};
use drawloom::process::{Deferred, ToneMapping, targets};
use drawloom::scene::{Camera, Changes, Light, Scene, SceneRef};
use drawloom::task::Scheduler;
use drawloom::{Renderer, Submitter};
use drawloom_async_post::{AsyncPost, Bloom, LayerBlend, LayerReprojection, LayerSettings, StepSource};
use drawloom_benches::results;
use drawloom_output::PictureFile;
use drawloom_testing::adapter;
use drawloom_testing::demo;
use drawloom_testing::scenes::everything::everything;
use serde::Serialize;

use crate::steps::AmbientOcclusion;

/// Longer than any step.
const LONG: Duration = Duration::from_secs(60);

/// The time of a frame.
const FRAME: f32 = 1.0 / 60.0;

const LOOKUPS: [(&str, LayerReprojection); 4] = [
    ("same place", LayerReprojection::None),
    ("reprojected, edge", LayerReprojection::ByDepth),
    ("reprojected, same place", LayerReprojection::ByDepthOrSamePlace),
    ("reprojected, or none", LayerReprojection::ByDepthOrNone),
];

/// Motions: their names, metres a second to the right, and degrees a second to the left.
const MOTIONS: [(&str, f64, f32); 5] =
    [("stands", 0.0, 0.0), ("1 m/s", 1.0, 0.0), ("5 m/s", 5.0, 0.0), ("30°/s", 0.0, 30.0), ("180°/s", 0.0, 180.0)];

#[derive(Serialize)]
pub struct Row {
    pub layer: &'static str,
    pub motion: &'static str,
    pub lookup: &'static str,
    /// Of the differences of channels, in units of 255.
    pub mean: f64,
    pub percentile_99: u8,
    pub largest: u8,
    pub psnr: f64,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Layer {
    Bloom,
    Occlusion,
}

impl Layer {
    fn name(self) -> &'static str {
        match self {
            Self::Bloom => "bloom",
            Self::Occlusion => "occlusion",
        }
    }
}

/// A renderer whose layer is late, and the viewpoints that it draws.
struct Engine {
    renderer: Renderer<WgpuBackend>,
    submitter: Submitter<WgpuBackend>,
    post: AsyncPost,
}

pub fn measure(quick: bool) -> Result<Vec<Row>, Box<dyn Error>> {
    let size = if quick { [48, 27] } else { [640, 360] };
    let directions = if quick { 1 } else { 4 };
    let motions = if quick { &MOTIONS[..1] } else { &MOTIONS[..] };
    let scene = at_dusk(if quick { everything() } else { demo::colonnade()? });
    let (device, queue) = adapter::device()?;
    let library = PipelineLibrary::new(device, queue);
    let mut rows = Vec::new();
    for layer in [Layer::Bloom, Layer::Occlusion] {
        for (lookup, reprojection) in LOOKUPS {
            let mut engine = Engine::new(&library, layer, reprojection)?;
            for &(motion, metres, degrees) in motions {
                // The number of channels with each difference.
                let mut counts = [0_u64; 256];
                for direction in 0..directions {
                    let turn = Quat::from_rotation_y(direction as f32 / directions as f32 * TAU);
                    let orientation = (turn * scene.cameras[0].orientation).normalize();
                    let now = Camera { size, orientation, ..scene.cameras[0].clone() };
                    let before = Camera {
                        position: now.position - (orientation * Vec3::X).as_dvec3() * metres * f64::from(FRAME),
                        orientation: (Quat::from_rotation_y(-degrees.to_radians() * FRAME) * orientation).normalize(),
                        ..now.clone()
                    };
                    engine.draw_and_wait(&scene, &before)?;
                    let late = engine.draw_and_wait(&scene, &now)?;
                    let exact = engine.draw_and_wait(&scene, &now)?;
                    for (one, other) in late.bytes.chunks_exact(4).zip(exact.bytes.chunks_exact(4)) {
                        (0..3).for_each(|channel| counts[usize::from(one[channel].abs_diff(other[channel]))] += 1);
                    }
                    let is_shown =
                        motion == "180°/s" && direction == 0 && reprojection != LayerReprojection::ByDepthOrNone;
                    if is_shown && !quick {
                        let name = format!("async_post-{}-{}", layer.name(), lookup.replace([' ', ','], "-"));
                        save(&format!("{name}.png"), &late, None)?;
                        save(&format!("{name}-difference.png"), &late, Some(&exact))?;
                        save(&format!("async_post-{}-exact.png", layer.name()), &exact, None)?;
                    }
                }
                rows.push(row(layer, motion, lookup, &counts));
            }
        }
    }
    Ok(rows)
}

fn row(layer: Layer, motion: &'static str, lookup: &'static str, counts: &[u64; 256]) -> Row {
    let all: u64 = counts.iter().sum();
    let mean_of = |value: fn(f64) -> f64| {
        counts.iter().enumerate().map(|(difference, count)| value(difference as f64) * *count as f64).sum::<f64>()
            / all as f64
    };
    let mut seen = 0;
    let percentile_99 = counts.iter().position(|count| {
        seen += count;
        seen * 100 >= all * 99
    });
    let largest = counts.iter().rposition(|count| *count > 0);
    Row {
        layer: layer.name(),
        motion,
        lookup,
        mean: mean_of(|difference| difference),
        percentile_99: percentile_99.unwrap_or(255) as u8,
        largest: largest.unwrap_or(0) as u8,
        psnr: 10.0 * (255.0 * 255.0 / mean_of(|difference| difference * difference)).log10(),
    }
}

/// The scene at dusk, with lamps around its camera that are brighter than white, and a bright sky.
fn at_dusk(mut scene: Scene) -> Scene {
    scene.background = Vec3::new(1.6, 1.9, 2.6);
    let camera = scene.cameras[0].clone();
    for index in 0..6 {
        let around = Quat::from_rotation_y(index as f32 / 6.0 * TAU) * Vec3::new(0.0, 0.5, -4.0);
        let position: DVec3 = camera.position + around.as_dvec3();
        let intensity = Vec3::new(16.0, 9.0, 3.0);
        scene.lights.push(Light::Point { position, intensity, range: 12.0, casts_shadow: false });
    }
    scene
}

impl Engine {
    fn new(library: &PipelineLibrary, layer: Layer, reprojection: LayerReprojection) -> Result<Self, Box<dyn Error>> {
        let scheduler = Arc::new(Scheduler::new(2)?);
        let bloom = Bloom::default();
        let (post, layer) = match layer {
            Layer::Bloom => {
                let post = AsyncPost::new(Arc::clone(&scheduler), bloom.on_cpu(), bloom.source());
                (post, LayerSettings { strength: 0.5, reprojection, ..LayerSettings::default() })
            }
            Layer::Occlusion => {
                let post = AsyncPost::new(Arc::clone(&scheduler), AmbientOcclusion, StepSource::whole(targets::DEPTH));
                (post, LayerSettings { blend: LayerBlend::Multiply, reprojection, ..LayerSettings::default() })
            }
        };
        let mut builder = Renderer::builder(library.backend()?)
            .pipeline(Deferred::new().post(post.layer(layer)).post(ToneMapping::default()))
            .output(post.source_target());
        if let Some(downsample) = post.downsample() {
            builder = builder.process(downsample);
        }
        let (renderer, submitter) = builder.build(scheduler)?;
        Ok(Self { renderer, submitter, post })
    }

    /// Draws a frame, waits until the step has been computed of it, and returns its picture.
    fn draw_and_wait(&mut self, scene: &Scene, camera: &Camera) -> Result<Picture, Box<dyn Error>> {
        let cameras = [camera.clone()];
        self.post.begin_frame(&self.renderer, &cameras);
        let world = SceneRef { cameras: &cameras, changes: Changes::Unknown, ..scene.as_scene_ref() };
        let mut recorded = self.renderer.record(world)?;
        self.post.read_back(&mut recorded);
        let number = self.post.statistics()[0].frame;
        let picture = self.submitter.submit(recorded)?.submission.read(0, targets::PICTURE)?;
        let start = Instant::now();
        while self.post.latest(&camera.name).is_none_or(|(latest, _)| latest < number) {
            if start.elapsed() > LONG {
                return Err("the step has no result".into());
            }
            thread::sleep(Duration::from_micros(100));
        }
        Ok(picture)
    }
}

/// Writes a picture, or eight times its difference from another one.
fn save(name: &str, picture: &Picture, other: Option<&Picture>) -> Result<(), Box<dyn Error>> {
    let pixels = picture.bytes.chunks_exact(4).enumerate();
    let bytes = pixels.flat_map(|(index, pixel)| {
        [0, 1, 2, 3].map(|channel| match other {
            Some(other) => pixel[channel].abs_diff(other.bytes[index * 4 + channel]).saturating_mul(8),
            None => pixel[channel],
        })
    });
    let bytes: Vec<u8> = bytes.collect();
    Ok(PictureFile::new(results::file(name)?)?.write_opaque([picture.width, picture.height], &bytes)?)
}
