//! Frame times, on the CPU and on the device.

use std::error::Error;
use std::time::{Duration, Instant};

use drawloom::backend::{Backend, BackendError};
use drawloom::scene::SceneRef;
use drawloom::{Renderer, SubmittedFrame, Submitter};

/// The times of one frame.
#[derive(Clone, Copy, Debug)]
pub struct FrameTime {
    /// From the hand-over of the scene to the return of submit.
    pub cpu: Duration,
    /// The part of that in which the scene is borrowed: until recording ends (L 3).
    pub borrowed: Duration,
    /// From the call of submit until the device has drawn the frame.
    pub device: Duration,
}

/// Draws a frame, and waits until the device is idle again.
///
/// # Errors
/// Returns an error if the frame cannot be drawn.
pub fn timed_frame<B: Backend>(
    renderer: &mut Renderer<B>,
    submitter: &Submitter<B>,
    scene: SceneRef<'_>,
    wait: impl Fn(&B::Submission) -> Result<(), BackendError>,
) -> Result<(SubmittedFrame<B>, FrameTime), Box<dyn Error>> {
    let start = Instant::now();
    let recorded = renderer.record(scene)?;
    let submit = Instant::now();
    let submitted = submitter.submit(recorded)?;
    let cpu = start.elapsed();
    wait(&submitted.submission)?;
    Ok((submitted, FrameTime { cpu, borrowed: submit - start, device: submit.elapsed() }))
}

/// Calls `frame` once, and again until the times that it returns add up to `at_least`. Returns the mean, in seconds.
///
/// # Errors
/// Returns the first error of `frame`.
pub fn mean_frame<E>(at_least: Duration, mut frame: impl FnMut() -> Result<Duration, E>) -> Result<f64, E> {
    let (mut elapsed, mut frames) = (Duration::ZERO, 0);
    while frames == 0 || elapsed < at_least {
        elapsed += frame()?;
        frames += 1;
    }
    Ok(elapsed.as_secs_f64() / f64::from(frames))
}
