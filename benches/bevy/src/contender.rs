//! What is compared.

use std::error::Error;
use std::time::{Duration, Instant};

pub type Failure = Box<dyn Error>;

/// Mean times of a frame over a burst of frames, in seconds.
#[derive(Clone, Copy, Debug)]
pub struct FrameTime {
    /// From the motion of the objects until submit returns.
    pub submitted: f64,
    /// From the motion of the objects until the device is idle.
    pub drawn: f64,
}

impl FrameTime {
    /// The means of `frames` frames that took these times together.
    pub fn mean(submitted: Duration, drawn: Duration, frames: u32) -> Self {
        let mean = |sum: Duration| sum.as_secs_f64() / f64::from(frames);
        Self { submitted: mean(submitted), drawn: mean(drawn) }
    }
}

/// A renderer with a world of its own, on a device of its own.
pub trait Contender {
    /// The name in tables and charts.
    fn name(&self) -> &'static str;

    /// Moves the objects, and draws a frame.
    ///
    /// # Errors
    /// Returns an error if the frame cannot be drawn.
    fn frame(&mut self) -> Result<(), Failure>;

    /// Waits until all frames are submitted and the device is idle.
    ///
    /// # Errors
    /// Returns an error if the device is lost.
    fn wait(&mut self) -> Result<(), Failure>;

    /// The number of objects that the last frame drew, over all cameras.
    ///
    /// # Errors
    /// Returns an error if the frame lacks a draw.
    fn drawn_objects(&mut self) -> Result<usize, Failure>;

    /// A camera's picture of the last frame: four bytes per pixel, the rows from top to bottom.
    ///
    /// # Errors
    /// Returns an error if the picture cannot be read.
    fn picture(&mut self, camera: usize) -> Result<Vec<u8>, Failure>;

    /// Draws a burst of `frames` frames, and waits for the device after each.
    ///
    /// # Errors
    /// Returns an error if a frame cannot be drawn.
    fn burst(&mut self, frames: u32) -> Result<FrameTime, Failure> {
        separate_frames(self, frames)
    }
}

/// Draws frames one by one, and waits for the device after each.
///
/// # Errors
/// Returns an error if a frame cannot be drawn.
pub fn separate_frames<C: Contender + ?Sized>(contender: &mut C, frames: u32) -> Result<FrameTime, Failure> {
    let (mut submitted, mut drawn) = (Duration::ZERO, Duration::ZERO);
    for _ in 0..frames {
        let start = Instant::now();
        contender.frame()?;
        submitted += start.elapsed();
        contender.wait()?;
        drawn += start.elapsed();
    }
    Ok(FrameTime::mean(submitted, drawn, frames))
}
