//! The maximum throughput of several threads on this machine: each draws frames of its own, and they share only the
//! hardware.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::Instant;

use drawloom_benches::backends::BackendName;
use drawloom_benches::clouds::around_one;
use drawloom_benches::moving::{Motion, Moving};

use crate::CAMERAS;
use crate::renderer::Drawloom;
use crate::technique::{Failure, Technique};

/// Threads that draw at the same time.
pub struct IndependentThreads {
    threads: Vec<Runner>,
}

/// A thread that draws some frames on each request, and returns the seconds per frame.
struct Runner {
    begin: Sender<()>,
    times: Receiver<Result<f64, String>>,
}

/// Frames per request: enough that slightly different start times of the threads do not matter.
const FRAMES: u32 = 8;

impl IndependentThreads {
    pub fn new(threads: usize, backend: BackendName, objects: usize) -> Self {
        Self { threads: (0..threads).map(|_| Runner::new(backend, objects)).collect() }
    }

    pub fn count(&self) -> usize {
        self.threads.len()
    }

    /// Has all draw; returns the seconds per frame of all together.
    ///
    /// # Errors
    /// Returns an error if one cannot draw.
    pub fn sample(&self) -> Result<f64, Failure> {
        for runner in &self.threads {
            runner.begin.send(())?;
        }
        let mut rate = 0.0;
        for runner in &self.threads {
            rate += 1.0 / runner.times.recv()??;
        }
        Ok(1.0 / rate)
    }
}

impl Runner {
    fn new(backend: BackendName, objects: usize) -> Self {
        let ((begin, requests), (send_time, times)) = (channel(), channel());
        thread::spawn(move || {
            let mut state = None;
            for () in requests {
                let time = draw(backend, objects, &mut state).map_err(|error| error.to_string());
                if send_time.send(time).is_err() {
                    return;
                }
            }
        });
        Self { begin, times }
    }
}

fn draw(backend: BackendName, objects: usize, state: &mut Option<(Moving, Drawloom)>) -> Result<f64, Failure> {
    let (world, drawloom) = match state {
        Some(state) => state,
        None => state.insert((
            Moving::new(around_one(CAMERAS, objects)?, Motion::Everything),
            Drawloom::new(backend.open()?, 1, true)?,
        )),
    };
    let mut elapsed = 0.0;
    for _ in 0..FRAMES {
        world.step();
        let start = Instant::now();
        drawloom.frame(world.as_scene_ref())?;
        elapsed += start.elapsed().as_secs_f64();
        drawloom.wait()?;
    }
    Ok(elapsed / f64::from(FRAMES))
}
