//! How long a frame takes, on the processor and on the device.

use std::error::Error;
use std::time::{Duration, Instant};

use drawloom::backend::{Backend, BackendError};
use drawloom::scene::SceneRef;
use drawloom::{Renderer, Submitted, Submitter};

/// Frames of each setting that are drawn first and not counted: tables grow and pipelines are made in them.
pub const WARM_UP: usize = 2;

/// What a frame took.
#[derive(Clone, Copy, Debug)]
pub struct FrameTime {
    /// From the scene's hand-over to the return of submit.
    pub processor: Duration,
    /// How much of that the scene was held: until recording ended (L 3).
    pub held: Duration,
    /// From the call of submit until the device has drawn the frame.
    pub device: Duration,
}

/// Draws a frame, and waits until the device is idle again.
///
/// # Errors
/// If the frame cannot be drawn.
pub fn timed_frame<B: Backend>(
    renderer: &mut Renderer<B>,
    submitter: &Submitter<B>,
    scene: SceneRef<'_>,
    wait: impl Fn(&B::Submission) -> Result<(), BackendError>,
) -> Result<(Submitted<B>, FrameTime), Box<dyn Error>> {
    let start = Instant::now();
    let recorded = renderer.record(scene)?;
    let hand_over = Instant::now();
    let submitted = submitter.submit(recorded)?;
    let processor = start.elapsed();
    wait(&submitted.submission)?;
    Ok((submitted, FrameTime { processor, held: hand_over - start, device: hand_over.elapsed() }))
}

/// The one in the middle; of an even number, the later of the two. Zero of none.
pub fn median(times: impl IntoIterator<Item = Duration>) -> Duration {
    let mut times: Vec<_> = times.into_iter().collect();
    times.sort();
    times.get(times.len() / 2).copied().unwrap_or_default()
}

/// The same of figures.
pub fn middle(figures: impl IntoIterator<Item = f64>) -> f64 {
    let mut figures: Vec<_> = figures.into_iter().collect();
    figures.sort_by(f64::total_cmp);
    figures.get(figures.len() / 2).copied().unwrap_or_default()
}
