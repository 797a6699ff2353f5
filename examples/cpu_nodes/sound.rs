//! The sound of a frame: a job beside the picture mixes it, and nothing of the frame waits for it.

use std::ops::Range;

use drawloom::graph::NodeError;
use drawloom::task::Worker;
use drawloom::{CpuNode, NodeAccesses, NodeContext};
use parking_lot::Mutex;

/// Samples in a second, and in a frame at 30 frames a second.
pub const RATE: usize = 48_000;
const SAMPLES: usize = RATE / 30;

/// How many voices are mixed.
const VOICES: usize = 48;

pub struct Sound {
    /// What is mixed for the frame, for an engine to hand to its device.
    samples: Mutex<Vec<f32>>,
    seconds: f32,
}

impl Sound {
    pub fn new() -> Self {
        Self { samples: Mutex::new(vec![0.0; SAMPLES]), seconds: 0.0 }
    }

    pub fn set_time(&mut self, seconds: f32) {
        self.seconds = seconds;
    }

    /// The loudest sample of the latest frame.
    pub fn peak(&self) -> f32 {
        self.samples.lock().iter().fold(0.0, |peak, sample| peak.max(sample.abs()))
    }
}

impl CpuNode for Sound {
    fn name(&self) -> &str {
        "sound"
    }

    fn declare(&self, accesses: &mut NodeAccesses) {
        accesses.writes("samples");
    }

    fn run(&self, _: &NodeContext<'_>, _: Range<usize>, _: &Worker) -> Result<(), NodeError> {
        for (index, sample) in self.samples.lock().iter_mut().enumerate() {
            let time = self.seconds + index as f32 / RATE as f32;
            let voice = |voice: usize| {
                let pitch = 90.0 + 13.0 * voice as f32;
                // Footsteps: a short tone twice a second, each walker at its own time.
                let since_step = (time * 2.0 + voice as f32 * 0.37).fract() / 2.0;
                (since_step * pitch * std::f32::consts::TAU).sin() * (-since_step * 40.0).exp()
            };
            *sample = (0..VOICES).map(voice).sum::<f32>() / VOICES as f32;
        }
        Ok(())
    }
}
