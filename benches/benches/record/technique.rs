//! Those who are compared.

use std::error::Error;

use drawloom::backend::Record;
use drawloom::scene::SceneRef;
use drawloom_benches::backends::BackendName;

use crate::CAMERAS;
use crate::draw_only::DrawOnly;
use crate::encoders::EncoderPerThread;
use crate::naive::Naive;
use crate::ours::Ours;
use crate::parallel::Parallel;
use crate::studio::Studio;

pub type Failure = Box<dyn Error>;

/// A way to record.
pub trait Technique {
    /// Draws a frame: from visibility to submit.
    fn frame(&mut self, scene: SceneRef<'_>) -> Result<(), Failure>;

    /// Waits until the device is idle.
    fn wait(&mut self) -> Result<(), Failure>;

    /// How many objects the last frame drew, over all cameras.
    fn drawn(&self) -> usize;

    /// What the last frame looks like: four bytes a pixel.
    fn picture(&mut self, camera: usize) -> Result<Vec<u8>, Failure>;
}

/// One that takes turns.
pub struct Contender {
    pub name: &'static str,
    /// Threads that it runs on.
    pub workers: usize,
    pub technique: Box<dyn Technique>,
}

impl Contender {
    /// All of them, in the order they are shown.
    pub fn all(backend: BackendName, scene: &SceneRef<'_>) -> Result<Vec<Self>, Failure> {
        let studio = || Studio::new(&backend.open()?, scene);
        let draw_only = || Ok::<_, Failure>(DrawOnly::new(studio()?, scene));
        let of = |name, workers, technique| Self { name, workers, technique };
        let mut all = vec![
            of("naive", 1, Box::new(Naive::new(studio()?, scene)) as Box<dyn Technique>),
            of("rayon", 1, Box::new(Parallel::new(draw_only()?, 1)?)),
            of("rayon", 2, Box::new(Parallel::new(draw_only()?, 2)?)),
            of("encoder-per-thread", CAMERAS, Box::new(EncoderPerThread::new(draw_only()?)?)),
        ];
        let ways = [
            ("drawloom", None),
            ("drawloom-direct", Some(Record::Direct)),
            ("drawloom-bundles", Some(Record::Bundles)),
            ("drawloom-kept", Some(Record::Kept)),
            ("drawloom-indirect", Some(Record::Indirect)),
        ];
        for workers in [1, 2] {
            for (name, way) in ways {
                let opened = backend.open()?;
                let opened = match way {
                    None => opened,
                    // Some adapters lack what it takes.
                    Some(way) => match opened.record(way) {
                        Ok(opened) => opened,
                        Err(error) => {
                            eprintln!("{name} is left out: {error}");
                            continue;
                        }
                    },
                };
                all.push(of(name, workers, Box::new(Ours::new(opened, workers)?)));
            }
        }
        Ok(all)
    }

    /// Whether it is this crate's.
    pub fn is_ours(&self) -> bool {
        self.name.starts_with("drawloom")
    }
}
