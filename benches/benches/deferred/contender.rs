//! A pipeline under test.

use std::error::Error;

use drawloom::backend::Picture;
use drawloom::scene::SceneRef;
use drawloom_benches::stopwatch::FrameTime;

/// A pipeline that draws scenes on a device of its own.
pub trait Contender {
    /// Draws a frame, and waits until the device has drawn it.
    ///
    /// # Errors
    /// Returns an error if the frame cannot be drawn.
    fn frame(&mut self, scene: SceneRef<'_>) -> Result<FrameTime, Box<dyn Error>>;

    /// What the last frame drew.
    fn counts(&self) -> Counts;

    /// The picture of the last frame.
    ///
    /// # Errors
    /// Returns an error if no frame was drawn, or if the picture cannot be read.
    fn picture(&self) -> Result<Picture, Box<dyn Error>>;
}

/// What a frame drew.
#[derive(Clone, Copy, Debug, Default)]
pub struct Counts {
    pub views: usize,
    /// Objects and lights that the first view sees.
    pub visible: usize,
    pub lights: usize,
    /// Objects drawn in all views, once for each time.
    pub commands: usize,
    /// Instanced draws.
    pub draws: usize,
    /// Passes over the picture or the scene.
    pub processes: usize,
}
