//! What two threads can do on this machine at the most: each draws frames of its own, and they share nothing but what the
//! machine's processors share.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread;
use std::time::Instant;

use drawloom_benches::backends::BackendName;
use drawloom_benches::clouds::around_one;
use drawloom_benches::moving::Moving;

use crate::CAMERAS;
use crate::ours::Ours;
use crate::technique::{Failure, Technique};

/// Two threads that draw at the same time.
pub struct Apart {
    threads: [Painter; 2],
}

/// A thread that draws some frames each time it is told to, and says how many seconds one took.
struct Painter {
    begin: Sender<()>,
    times: Receiver<Result<f64, String>>,
}

/// That each thread draws in a turn: so many that it does not matter when they begin.
const FRAMES: u32 = 8;

impl Apart {
    pub fn new(backend: BackendName, objects: usize) -> Self {
        Self { threads: [(); 2].map(|()| Painter::new(backend, objects)) }
    }

    /// Lets both draw; returns seconds a frame, of those of both together.
    ///
    /// # Errors
    /// If one cannot draw.
    pub fn take_turn(&self) -> Result<f64, Failure> {
        for painter in &self.threads {
            painter.begin.send(())?;
        }
        let mut rate = 0.0;
        for painter in &self.threads {
            rate += 1.0 / painter.times.recv()??;
        }
        Ok(1.0 / rate)
    }
}

impl Painter {
    fn new(backend: BackendName, objects: usize) -> Self {
        let ((begin, begins), (tell, times)) = (channel(), channel());
        thread::spawn(move || {
            let mut made = None;
            for () in begins {
                let time = draw(backend, objects, &mut made).map_err(|error| error.to_string());
                if tell.send(time).is_err() {
                    return;
                }
            }
        });
        Self { begin, times }
    }
}

fn draw(backend: BackendName, objects: usize, made: &mut Option<(Moving, Ours)>) -> Result<f64, Failure> {
    let (world, ours) = match made {
        Some(made) => made,
        None => made.insert((Moving::new(around_one(CAMERAS, objects)?), Ours::new(backend.open()?, 1)?)),
    };
    let mut elapsed = 0.0;
    for _ in 0..FRAMES {
        world.step();
        let start = Instant::now();
        ours.frame(world.as_scene_ref())?;
        elapsed += start.elapsed().as_secs_f64();
        ours.wait()?;
    }
    Ok(elapsed / f64::from(FRAMES))
}
