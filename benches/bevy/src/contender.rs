//! What is compared.

use std::error::Error;
use std::time::Instant;

use drawloom::wgpu;

pub type Failure = Box<dyn Error>;

/// The times of a frame, in seconds; of a pipelined contender, the means of a burst.
#[derive(Clone, Copy, Debug)]
pub struct FrameTime {
    /// From the motion of the objects until submit returns. If frames overlap, from the submit of one frame to that of
    /// the next.
    pub submitted: f64,
    /// The three parts of `submitted`, see [`PARTS`]. `None` if they overlap.
    pub parts: Option<[f64; 3]>,
    /// From the motion of the objects until the device is idle.
    pub drawn: f64,
}

/// The parts of a frame: Drawloom's name, and Bevy's.
pub const PARTS: [&str; 3] = ["update / main", "record / extract", "submit / render"];

/// A renderer with a world of its own, on a device of its own.
pub trait Contender {
    /// The name in tables and charts, and in names of files.
    fn name(&self) -> &'static str;

    /// The index of the colour in charts. It is also the order of the lines.
    fn color(&self) -> usize;

    /// The adapter of the device.
    fn adapter(&self) -> wgpu::AdapterInfo;

    /// Moves what the scene moves, and draws a frame. Returns the parts of [`FrameTime::submitted`].
    ///
    /// # Errors
    /// Returns an error if the frame cannot be drawn.
    fn frame(&mut self) -> Result<[f64; 3], Failure>;

    /// Waits until all frames are submitted and the device is idle.
    ///
    /// # Errors
    /// Returns an error if the device is lost.
    fn wait(&mut self) -> Result<(), Failure>;

    /// Draws a frame, waits for it, and returns how many objects it hands to the device for each camera.
    ///
    /// # Errors
    /// Returns an error if the frame cannot be drawn.
    fn counted_frame(&mut self) -> Result<Vec<usize>, Failure>;

    /// A camera's picture of the last frame: four bytes per pixel, the rows from top to bottom.
    ///
    /// # Errors
    /// Returns an error if the picture cannot be read.
    fn picture(&mut self, camera: usize) -> Result<Vec<u8>, Failure>;

    /// Draws frames for a measurement. The device is idle before and after.
    ///
    /// # Errors
    /// Returns an error if a frame cannot be drawn.
    fn burst(&mut self, frames: u32) -> Result<Vec<FrameTime>, Failure> {
        (0..frames).map(|_| timed_frame(self)).collect()
    }
}

/// Draws a frame, and waits for the device.
///
/// # Errors
/// Returns an error if the frame cannot be drawn.
pub fn timed_frame<C: Contender + ?Sized>(contender: &mut C) -> Result<FrameTime, Failure> {
    let start = Instant::now();
    let parts = contender.frame()?;
    let submitted = start.elapsed().as_secs_f64();
    contender.wait()?;
    Ok(FrameTime { submitted, parts: Some(parts), drawn: start.elapsed().as_secs_f64() })
}
