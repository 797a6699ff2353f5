//! The occlusion test of a view in one frame.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::time::Duration;

use crate::view::{OcclusionCuller, RenderView};

/// The occlusion test of a view in one frame. It keeps its memory from frame to frame.
#[derive(Debug, Default)]
pub(in crate::frame) struct ViewOcclusion {
    pub(in crate::frame) occlusion: OcclusionCuller,
    is_on: bool,
    hidden: AtomicUsize,
    /// The thread time of the test, and of drawing what is left.
    nanoseconds: AtomicU64,
}

impl ViewOcclusion {
    /// Starts a frame. `tile` is the side of a tile of the coarse depth buffer in pixels; `None` turns the test off.
    pub(in crate::frame) fn reset(&mut self, view: &RenderView, tile: Option<u32>) {
        let tile = tile.filter(|side| has_room(view, *side));
        self.is_on = tile.is_some();
        *self.hidden.get_mut() = 0;
        *self.nanoseconds.get_mut() = 0;
        if let Some(side) = tile {
            self.occlusion.reset(view, side);
        }
    }

    /// Whether the view tests for occlusion in this frame.
    pub(in crate::frame) fn is_on(&self) -> bool {
        self.is_on
    }

    /// Counts hidden objects.
    pub(in crate::frame) fn add_hidden(&self, objects: usize) {
        // Relaxed, here and below: sums, read after the run.
        self.hidden.fetch_add(objects, Ordering::Relaxed);
    }

    /// The number of hidden objects.
    pub(in crate::frame) fn hidden(&self) -> usize {
        self.hidden.load(Ordering::Relaxed)
    }

    /// Adds the thread time of a job.
    pub(in crate::frame) fn add_time(&self, took: Duration) {
        self.nanoseconds.fetch_add(took.as_nanos() as u64, Ordering::Relaxed);
    }

    /// Takes away a time that a job spends on other views. It wraps below 0 until the job's own time is added.
    pub(in crate::frame) fn subtract_time(&self, took: Duration) {
        self.nanoseconds.fetch_sub(took.as_nanos() as u64, Ordering::Relaxed);
    }

    /// The thread time in nanoseconds.
    pub(in crate::frame) fn nanoseconds(&self) -> u64 {
        self.nanoseconds.load(Ordering::Relaxed)
    }
}

/// Whether the coarse depth buffer is of a reasonable size: no backend draws a picture of more than 2²⁴ tiles of 16
/// pixels, and finer tiles would take more memory than the picture.
fn has_room(view: &RenderView, side: u32) -> bool {
    let [columns, rows] = view.camera.size.map(|pixels| u64::from(pixels.div_ceil(side.max(1))));
    columns * rows <= 1 << 24
}
