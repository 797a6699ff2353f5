//! The recording techniques that are compared.

use std::error::Error;

use drawloom::backend::RecordingStrategy;
use drawloom::scene::SceneRef;
use drawloom_benches::backends::BackendName;

use drawloom_benches::clouds::around_one;
use drawloom_benches::moving::{Motion, Moving};
use drawloom_output::print_diagnostic;

use crate::CAMERAS;
use crate::by_mesh::ByMesh;
use crate::draw_only::DrawOnly;
use crate::encoders::EncoderPerThread;
use crate::fixture::Fixture;
use crate::naive::Naive;
use crate::parallel::Parallel;
use crate::renderer::Drawloom;

pub type Failure = Box<dyn Error>;

/// A way to record.
pub trait Technique {
    /// Draws a frame, from visibility to submit.
    fn frame(&mut self, scene: SceneRef<'_>) -> Result<(), Failure>;

    /// Waits until the device is idle.
    fn wait(&mut self) -> Result<(), Failure>;

    /// Objects drawn by the last frame for all cameras.
    fn drawn(&self) -> usize;

    /// A camera's picture of the last frame: four bytes per pixel.
    fn picture(&mut self, camera: usize) -> Result<Vec<u8>, Failure>;
}

/// A technique on a number of threads, in a scene.
pub struct Contender {
    pub name: &'static str,
    pub workers: usize,
    pub motion: Motion,
    pub technique: Box<dyn Technique>,
    /// A world of its own, because the reported changes hold for one renderer.
    pub world: Moving,
}

impl Contender {
    /// All contenders with these numbers of workers, in the order of the table.
    pub fn all(backend: BackendName, objects: usize, workers: &[usize]) -> Result<Vec<Self>, Failure> {
        let scene = around_one(CAMERAS, objects)?;
        let scene = &scene.as_scene_ref();
        let fixture = || Fixture::new(&backend.open()?, scene);
        let draw_only = || Ok::<_, Failure>(DrawOnly::new(fixture()?, scene));
        let in_scene = |name, workers, motion, technique| {
            Ok::<_, Failure>(Self {
                name,
                workers,
                motion,
                technique,
                world: Moving::new(around_one(CAMERAS, objects)?, motion),
            })
        };
        let of = |name, workers, technique| in_scene(name, workers, Motion::Everything, technique);
        let mut all = vec![of("naive", 1, Box::new(Naive::new(fixture()?, scene)) as Box<dyn Technique>)?];
        for &threads in workers {
            all.push(of("rayon", threads, Box::new(Parallel::new(draw_only()?, threads)?))?);
        }
        all.push(of("encoder-per-thread", CAMERAS, Box::new(EncoderPerThread::new(draw_only()?)?))?);
        for motion in [Motion::Everything, Motion::EverythingInTurningViews] {
            for &threads in workers {
                let technique = Box::new(ByMesh::new(DrawOnly::with_instances(fixture()?, scene), threads)?);
                all.push(in_scene("by-mesh", threads, motion, technique)?);
            }
        }
        let strategies = [
            ("drawloom", None),
            ("drawloom-direct", Some(RecordingStrategy::Direct)),
            ("drawloom-bundles", Some(RecordingStrategy::Bundles)),
            ("drawloom-cached", Some(RecordingStrategy::CachedBundles)),
            ("drawloom-indirect", Some(RecordingStrategy::Indirect)),
        ];
        for &workers in workers {
            for (name, strategy) in strategies {
                let opened = backend.open()?;
                let opened = match strategy {
                    None => opened,
                    // Some adapters lack a feature that it requires.
                    Some(strategy) => match opened.recording_strategy(strategy) {
                        Ok(opened) => opened,
                        Err(error) => {
                            print_diagnostic!("{name} is left out: {error}");
                            continue;
                        }
                    },
                };
                all.push(of(name, workers, Box::new(Drawloom::new(opened, workers, true)?))?);
            }
            all.push(of("drawloom-not-instanced", workers, Box::new(Drawloom::new(backend.open()?, workers, false)?))?);
            for motion in Motion::ALL.into_iter().filter(|motion| *motion != Motion::Everything) {
                let technique = Box::new(Drawloom::new(backend.open()?, workers, true)?);
                all.push(in_scene("drawloom", workers, motion, technique)?);
            }
        }
        Ok(all)
    }

    /// Whether it is a technique of this crate.
    pub fn is_drawloom(&self) -> bool {
        self.name.starts_with("drawloom")
    }

    /// Whether equal objects are one draw.
    pub fn is_instanced(&self) -> bool {
        matches!(self.name, "by-mesh") || self.is_drawloom() && self.name != "drawloom-not-instanced"
    }
}
