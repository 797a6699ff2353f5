//! Loops that draw frames, with and without a [`FrameLoop`].

use std::collections::VecDeque;
use std::error::Error;
use std::thread;
use std::time::{Duration, Instant};

use drawloom::backend::Backend;
use drawloom::fence::Fence;
use drawloom::{Buffering, FencePoint, FrameLoop, FrameTimes, Renderer, Submitter};
use drawloom_benches::moving::Moving;

/// Longer than any frame.
const LONG: Duration = Duration::from_secs(60);

/// A loop that draws frames.
pub struct Contender<B: Backend>
where
    B::Submission: Send,
{
    frames: Frames<B>,
    world: Moving,
}

enum Frames<B: Backend>
where
    B::Submission: Send,
{
    /// Everything on one thread, which waits until fewer than this number of frames are in flight.
    Plain {
        renderer: Renderer<B>,
        submitter: Submitter<B>,
        in_flight: usize,
    },
    Loop(FrameLoop<B>),
}

/// Which loop.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// All on one thread, with this number of frames in flight.
    Plain(usize),
    Loop(Buffering),
}

impl Kind {
    pub const ALL: [Self; 5] = [
        Self::Plain(1),
        Self::Plain(2),
        Self::Loop(Buffering::SameFrame),
        Self::Loop(Buffering::Double),
        Self::Loop(Buffering::Triple),
    ];

    pub fn name(self) -> &'static str {
        match self {
            Self::Plain(1) => "one thread, each frame waited for",
            Self::Plain(_) => "one thread, two in flight",
            Self::Loop(Buffering::SameFrame) => "same frame",
            Self::Loop(Buffering::Double) => "double",
            Self::Loop(Buffering::Triple) => "triple",
        }
    }
}

impl<B: Backend> Contender<B>
where
    B::Submission: Send,
{
    pub fn new(
        kind: Kind,
        (renderer, submitter): (Renderer<B>, Submitter<B>),
        world: Moving,
    ) -> Result<Self, Box<dyn Error>> {
        let frames = match kind {
            Kind::Plain(in_flight) => Frames::Plain { renderer, submitter, in_flight },
            Kind::Loop(buffering) => Frames::Loop(FrameLoop::new(renderer, submitter, buffering)?),
        };
        Ok(Self { frames, world })
    }

    pub fn backend(&mut self) -> &B {
        match &mut self.frames {
            Frames::Plain { renderer, .. } => renderer.backend(),
            Frames::Loop(frames) => frames.renderer().backend(),
        }
    }

    /// Draws frames, whose update takes so long, and waits for the last one.
    pub fn draw(&mut self, count: usize, update: Duration) -> Result<Vec<FrameTimes>, Box<dyn Error>> {
        let world = &mut self.world;
        let mut times = Vec::with_capacity(count);
        match &mut self.frames {
            Frames::Plain { renderer, submitter, in_flight } => {
                let mut unfinished: VecDeque<(FrameTimes, Fence)> = VecDeque::new();
                let finish = |(frame, drawn): (FrameTimes, Fence)| {
                    drawn.wait(LONG)?;
                    Ok::<_, Box<dyn Error>>(FrameTimes { finished: drawn.set_at().ok_or("it is set")?, ..frame })
                };
                for _ in 0..count {
                    let start = Instant::now();
                    while unfinished.len() >= *in_flight {
                        times.push(finish(unfinished.pop_front().ok_or("it is not empty")?)?);
                    }
                    let begun = Instant::now();
                    world.step_for(update);
                    let mut recorded = renderer.record(world.as_scene_ref())?;
                    let drawn = recorded.fence_at(FencePoint::End)?;
                    let recorded_at = Instant::now();
                    submitter.submit(recorded)?;
                    let submitted = Instant::now();
                    let frame = FrameTimes {
                        waited: begun - start,
                        begun,
                        recorded: recorded_at,
                        submission_began: recorded_at,
                        submitted,
                        finished: submitted,
                    };
                    unfinished.push_back((frame, drawn));
                }
                for frame in unfinished {
                    times.push(finish(frame)?);
                }
            }
            Frames::Loop(frames) => {
                let mut finished = Vec::with_capacity(count);
                for _ in 0..count {
                    let (slot, more) = frames.begin();
                    finished.extend(more);
                    world.step_for(update);
                    let recorded = frames.renderer().record(world.as_scene_ref())?;
                    slot.submit(recorded);
                }
                while finished.len() < count {
                    thread::sleep(Duration::from_micros(100));
                    let (slot, more) = frames.begin();
                    finished.extend(more);
                    drop(slot);
                }
                for frame in finished {
                    frame.outcome?;
                    times.push(frame.times);
                }
            }
        }
        Ok(times)
    }
}
