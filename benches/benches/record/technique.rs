//! The recording techniques that are compared.

use std::error::Error;

use drawloom::backend::RecordingStrategy;
use drawloom::scene::SceneRef;
use drawloom_benches::backends::BackendName;

use drawloom_benches::clouds::around_one;
use drawloom_benches::moving::{Motion, Moving};

use crate::CAMERAS;
use crate::bundles::Bundles;
use crate::by_mesh::ByMesh;
use crate::draw_only::DrawOnly;
use crate::encoders::Encoders;
use crate::fixture::Fixture;
use crate::naive::Naive;
use crate::renderer::Drawloom;
use crate::threads::Threads;

pub type Failure = Box<dyn Error>;

/// The scenes in which instancing by hand is measured.
pub const BY_MESH_SCENES: [Motion; 2] = [Motion::Everything, Motion::EverythingInTurningViews];

/// A way to record.
pub trait Technique {
    /// Draws a frame, from visibility to submit. Called within [`Contender::run`].
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
    pub runner: Runner,
    /// A world of its own, because the reported changes hold for one renderer.
    pub world: Moving,
}

/// A technique, and what runs its frames.
pub enum Runner {
    /// This crate, whose scheduler has threads of its own.
    Drawloom(Box<Drawloom>),
    ByHand(Box<dyn Technique + Send>, Threads),
}

impl Contender {
    /// All contenders, in the order of the table. Peers run on one thread too.
    pub fn all(backend: BackendName, objects: usize, workers: &[usize]) -> Result<Vec<Self>, Failure> {
        let scene = around_one(CAMERAS, objects)?;
        let scene = &scene.as_scene_ref();
        let fixture = || Fixture::new(&backend.open()?, scene);
        let draw_only = || Ok::<_, Failure>(DrawOnly::new(fixture()?, scene));
        let world = |motion| Ok::<_, Failure>(Moving::new(around_one(CAMERAS, objects)?, motion));
        let by_hand = |name, threads: &Threads, motion, technique| {
            let runner = Runner::ByHand(technique, threads.clone());
            Ok::<_, Failure>(Self { name, workers: threads.count(), motion, runner, world: world(motion)? })
        };
        let drawloom = |name, workers, motion, technique| {
            let runner = Runner::Drawloom(Box::new(technique));
            Ok::<_, Failure>(Self { name, workers, motion, runner, world: world(motion)? })
        };
        let naive = Box::new(Naive::new(fixture()?, scene));
        let mut all = vec![by_hand("naive", &Threads::One, Motion::Everything, naive)?];
        let threads = Threads::all(workers)?;
        for threads in &threads {
            let technique = Box::new(Bundles::new(draw_only()?, threads));
            all.push(by_hand("bundles", threads, Motion::Everything, technique)?);
        }
        for threads in &threads {
            let technique = Box::new(Encoders::new(draw_only()?, threads));
            all.push(by_hand("encoders", threads, Motion::Everything, technique)?);
        }
        for motion in BY_MESH_SCENES {
            for threads in &threads {
                let technique = Box::new(ByMesh::new(DrawOnly::with_instances(fixture()?, scene), threads));
                all.push(by_hand("by-mesh", threads, motion, technique)?);
            }
        }
        let strategies = [
            ("drawloom", None),
            ("drawloom-direct", Some(RecordingStrategy::Direct)),
            ("drawloom-bundles", Some(RecordingStrategy::Bundles)),
            ("drawloom-cached", Some(RecordingStrategy::CachedBundles)),
        ];
        for &workers in workers {
            for (name, strategy) in strategies {
                let mut opened = backend.open()?;
                if let Some(strategy) = strategy {
                    opened = opened.recording_strategy(strategy);
                }
                all.push(drawloom(name, workers, Motion::Everything, Drawloom::new(opened, workers, true)?)?);
            }
            let single_draws = Drawloom::new(backend.open()?, workers, false)?;
            all.push(drawloom("drawloom-not-instanced", workers, Motion::Everything, single_draws)?);
            for motion in Motion::ALL.into_iter().filter(|motion| *motion != Motion::Everything) {
                all.push(drawloom("drawloom", workers, motion, Drawloom::new(backend.open()?, workers, true)?)?);
            }
        }
        Ok(all)
    }

    /// Runs `frames` on a thread of the technique's.
    ///
    /// # Errors
    /// Returns the error of `frames`.
    pub fn run<R: Send>(
        &mut self,
        frames: impl FnOnce(&mut dyn Technique, &mut Moving) -> Result<R, Failure> + Send,
    ) -> Result<R, Failure> {
        match &mut self.runner {
            Runner::Drawloom(technique) => frames(&mut **technique, &mut self.world),
            Runner::ByHand(technique, threads) => {
                let world = &mut self.world;
                // Errors of wgpu cannot be sent from thread to thread.
                Ok(threads.run(|| frames(&mut **technique, world).map_err(|failure| failure.to_string()))?)
            }
        }
    }

    pub fn technique(&mut self) -> &mut dyn Technique {
        match &mut self.runner {
            Runner::Drawloom(technique) => &mut **technique,
            Runner::ByHand(technique, _) => &mut **technique,
        }
    }

    /// How a hand-written technique divides its work among threads; empty for one thread.
    pub fn threads(&self) -> &'static str {
        match &self.runner {
            Runner::Drawloom(_) => "",
            Runner::ByHand(_, threads) => threads.name(),
        }
    }

    /// Whether it is a technique of this crate.
    pub fn is_drawloom(&self) -> bool {
        matches!(self.runner, Runner::Drawloom(_))
    }

    /// Whether equal objects are one draw.
    pub fn is_instanced(&self) -> bool {
        matches!(self.name, "by-mesh") || self.is_drawloom() && self.name != "drawloom-not-instanced"
    }
}
